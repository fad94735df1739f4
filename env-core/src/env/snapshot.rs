//! An environment as bytes, and back.
//!
//! A snapshot holds the state, not the scenario: it can be restored into any environment of the same scenario, which then
//! goes on byte for byte as the first one would have. Indexes and buffers are rebuilt, not stored.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::Env;
use crate::episode::Episode;
use crate::geometry::{Frame, Point, Pose};
use crate::grid::CellSet;
use crate::mower::Mower;

/// Raised with every change of the layout.
const VERSION: u32 = 3;

/// Bytes that cannot be restored; the environment is as it was.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SnapshotError {
    /// Not a snapshot, or a damaged one.
    #[error("`snapshot` must be the bytes that `snapshot` returned, got {got}")]
    Damaged {
        /// What is wrong with them.
        got: String,
    },
    /// A snapshot of another version of swath.
    #[error("`snapshot` must have version {VERSION}, got {got}")]
    Version {
        /// The version found.
        got: u32,
    },
    /// A snapshot of another scenario.
    #[error(
        "`snapshot` must come from an environment of the same scenario, got another scenario's"
    )]
    Scenario,
    /// A snapshot taken with limits, restored without, or the other way round.
    #[error(
        "`snapshot` must come from an environment with the same limits, got one where they are lifted or not lifted"
    )]
    Limits,
}

// `weeds_in` reads the fields as far as the weeds.
#[derive(Serialize, Deserialize)]
struct State {
    version: u32,
    scenario: [u8; 32],
    seed: u64,
    episodes: u64,
    weeds_m: Vec<(f64, f64)>,
    is_mowed: Vec<bool>,
    pose: Pose,
    /// Cosine and sine of the heading, which the mower turns on its own.
    direction: (f64, f64),
    path_m: f64,
    looks: u64,
    unseen: Vec<u64>,
    /// The weeds in the order of their detection.
    weed_of: Vec<u32>,
    episode: Episode,
    are_limits_lifted: bool,
}

/// Number of weeds in a snapshot that is not restored; it may be damaged all the same.
///
/// # Errors
///
/// [`SnapshotError`] if it does not begin as one of this version does.
pub fn weeds_in(snapshot: &[u8]) -> Result<u64, SnapshotError> {
    type Head = (u32, [u8; 32], u64, u64, u64);
    let (version, _) = postcard::take_from_bytes::<u32>(snapshot).map_err(damaged)?;
    if version != VERSION {
        return Err(SnapshotError::Version { got: version });
    }
    let ((.., weeds), _) = postcard::take_from_bytes::<Head>(snapshot).map_err(damaged)?;
    Ok(weeds)
}

impl Env {
    /// The whole state as bytes.
    #[must_use]
    pub fn snapshot(&self) -> Vec<u8> {
        let Frame { pose, cos, sin } = self.mower.frame();
        let state = State {
            version: VERSION,
            scenario: self.setup.scenario_hash,
            seed: self.seed,
            episodes: self.episodes,
            weeds_m: self.weeds.positions().iter().map(|weed| (weed.x, weed.y)).collect(),
            is_mowed: self.weeds.is_mowed().to_vec(),
            pose,
            direction: (cos, sin),
            path_m: self.mower.path_m(),
            looks: self.mower.looks(),
            unseen: self.belief.ground().unseen().words().to_vec(),
            weed_of: self.belief.weed_of().to_vec(),
            episode: self.episode,
            are_limits_lifted: self.limits.are_lifted(),
        };
        let mut bytes =
            postcard::to_allocvec(&state).expect("a state in memory can be written to memory");
        bytes.extend(checksum(&bytes));
        bytes
    }

    /// Puts back the state that [`Env::snapshot`] returned, here or in another process.
    ///
    /// # Errors
    ///
    /// [`SnapshotError`]; the environment is then as it was.
    pub fn restore(&mut self, snapshot: &[u8]) -> Result<(), SnapshotError> {
        let (version, _) = postcard::take_from_bytes::<u32>(snapshot).map_err(damaged)?;
        if version != VERSION {
            return Err(SnapshotError::Version { got: version });
        }
        let content = match snapshot.split_last_chunk() {
            Some((content, sum)) if *sum == checksum(content) => content,
            _ => {
                return Err(SnapshotError::Damaged {
                    got: "a checksum that does not match".to_owned(),
                });
            }
        };
        let (state, rest) = postcard::take_from_bytes::<State>(content).map_err(damaged)?;
        if !rest.is_empty() {
            return Err(SnapshotError::Damaged { got: format!("{} bytes too many", rest.len()) });
        }
        if state.scenario != self.setup.scenario_hash {
            return Err(SnapshotError::Scenario);
        }
        if state.are_limits_lifted != self.limits.are_lifted() {
            return Err(SnapshotError::Limits);
        }
        self.check(&state)?;
        let unseen =
            CellSet::from_words(self.belief.ground().grid(), state.unseen).ok_or_else(|| {
                SnapshotError::Damaged { got: "ground of another pasture".to_owned() }
            })?;
        let at = Frame { pose: state.pose, cos: state.direction.0, sin: state.direction.1 };
        self.seed = state.seed;
        self.episodes = state.episodes;
        let positions = state.weeds_m.iter().map(|&(x_m, y_m)| Point::new(x_m, y_m)).collect();
        self.weeds.restore(positions, &state.weed_of, state.is_mowed);
        self.mower = Mower::restore(at, state.path_m, state.looks);
        self.belief.restore(unseen, state.weed_of, &self.weeds);
        self.reserve();
        self.memory.clear();
        self.episode = state.episode;
        self.forget();
        Ok(())
    }

    /// Whether every part of a state fits the others, so that no later step can trip over it.
    fn check(&self, state: &State) -> Result<(), SnapshotError> {
        let Pose { x_m, y_m, heading_rad } = state.pose;
        let mut is_detected = vec![false; state.weeds_m.len()];
        let mut is_new = |weed: u32| match is_detected.get_mut(weed as usize) {
            Some(flag) => !std::mem::replace(flag, true),
            None => false,
        };
        let Frame { cos, sin, .. } = state.pose.into();
        let is_near = |a: f64, b: f64| (a - b).abs() < 1e-6;
        let rules = [
            ("flags for other weeds", state.is_mowed.len() == state.weeds_m.len()),
            (
                "weeds off the pasture",
                state.weeds_m.iter().all(|&(x, y)| self.setup.site.holds(x, y)),
            ),
            ("a pose that is no pose", [x_m, y_m, heading_rad].iter().all(|v| v.is_finite())),
            (
                "a direction that is not the pose's",
                is_near(cos, state.direction.0) && is_near(sin, state.direction.1),
            ),
            ("looks that do not fit the path", Mower::looks_fit(state.path_m, state.looks)),
            ("detections of no weed", state.weed_of.iter().all(|&weed| is_new(weed))),
        ];
        match rules.iter().find(|(_, holds)| !holds) {
            Some((got, _)) => Err(SnapshotError::Damaged { got: (*got).to_owned() }),
            None => Ok(()),
        }
    }
}

/// The first eight bytes of the SHA-256 of a snapshot's content, which stand behind it.
fn checksum(content: &[u8]) -> [u8; 8] {
    let hash: [u8; 32] = Sha256::digest(content).into();
    std::array::from_fn(|i| hash[i])
}

pub(crate) fn damaged(error: postcard::Error) -> SnapshotError {
    let got = match error {
        postcard::Error::DeserializeUnexpectedEnd => "bytes that end too soon".to_owned(),
        other => other.to_string(),
    };
    SnapshotError::Damaged { got }
}
