//! How an episode begins.

use super::Env;
use crate::config::{NamedStart, Start, ValidScenario};
use crate::episode::Episode;
use crate::geometry::{Point, Pose};
use crate::mower::Mower;
use crate::rng::{self, Stream};
use crate::weeds;

/// Where and among which weeds an episode begins, where that is not left to the scenario.
///
/// Fronts check what comes from outside: weeds off the pasture and a start off the headland are refused by a panic.
#[derive(Debug, Clone, Copy, Default)]
pub struct Beginning<'a> {
    /// The weeds, instead of drawing them; world frame, metres.
    pub weeds: Option<&'a [Point]>,
    /// The mower's pose, instead of the scenario's start.
    pub start: Option<Pose>,
}

impl Env {
    /// Begins episode 0 of `seed`.
    pub fn reset(&mut self, seed: u64) {
        self.reset_from(seed, Beginning::default());
    }

    /// Begins episode 0 of `seed` with weeds or a start pose of the caller's.
    ///
    /// # Panics
    ///
    /// If a weed of `beginning` is not on the pasture, or its start not on the pasture or its headland.
    pub fn reset_from(&mut self, seed: u64, beginning: Beginning) {
        self.seed = seed;
        self.episodes = 0;
        self.begin(beginning);
    }

    /// Begins the next episode of the present seed.
    ///
    /// # Panics
    ///
    /// As [`Env::reset_from`].
    pub fn reset_next(&mut self, beginning: Beginning) {
        self.begin(beginning);
    }

    fn begin(&mut self, beginning: Beginning) {
        let Beginning { weeds: given, start } = beginning;
        let site = &self.setup.site;
        assert!(
            given.into_iter().flatten().all(|weed| site.holds(weed.x, weed.y)),
            "weeds stand on the pasture"
        );
        assert!(
            start.is_none_or(|start| site.allows(start)),
            "the mower starts on the pasture or its headland"
        );
        let seed = rng::episode_seed(self.seed, self.episodes);
        self.episodes += 1;
        let Self { setup, weeds, .. } = self;
        let scenario = &setup.scenario;
        weeds.plant(|planted| match given {
            Some(given) => planted.extend_from_slice(given),
            None => weeds::draw(
                &scenario.weeds,
                &scenario.pasture,
                planted,
                &mut rng::stream(seed, Stream::Weeds),
            ),
        });
        self.belief.clear();
        self.reserve();
        self.memory.clear();
        self.episode = Episode::started();
        self.mower = Mower::at(start.unwrap_or_else(|| start_pose(&self.setup.scenario)));
        let Self { rig, mower, weeds, belief, .. } = self;
        let percept = rig.sensor.look_around(&mower.frame(), weeds, belief.ground());
        self.belief.absorb_percept(&percept, &self.weeds);
        self.forget();
    }

    /// Throws away what was worked out, or kept, of another state.
    pub(super) fn forget(&mut self) {
        if let Some(candidates) = &mut self.candidates {
            candidates.reset();
        }
        if let Some(trace) = &mut self.trace {
            trace.begin(self.mower.pose());
        }
    }

    /// Makes room for whatever an episode may bring, so that its steps allocate nothing.
    pub(super) fn reserve(&mut self) {
        self.belief.reserve(self.weeds.positions().len());
        self.rig.reserve(&self.weeds);
    }
}

pub(super) fn start_pose(scenario: &ValidScenario) -> Pose {
    match scenario.mower.start {
        Start::Named(NamedStart::Corner) => Pose::new(0.0, 0.5 * scenario.mower.deck_width_m, 0.0),
        Start::Named(NamedStart::Centre) => {
            Pose::new(0.5 * scenario.pasture.length_m, 0.5 * scenario.pasture.width_m, 0.0)
        }
        Start::Pose([x_m, y_m, heading_rad]) => Pose::new(x_m, y_m, heading_rad),
    }
}
