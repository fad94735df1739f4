//! A view told piece by piece, and put together again where its environment is not.
//!
//! [`Told`] stands beside an environment and finds what is new in its [`View`]; [`Mirror`] stands beside an agent and takes
//! that in. All of it comes from the view, so what a mirror is told is what an agent may know.

use std::sync::Arc;

use crate::geometry::{Point, Pose};
use crate::grid::{CellSet, Grid};
use crate::ground::SeenGround;
use crate::known::{KnownWeed, KnownWeeds};
use crate::site::Site;
use crate::view::View;

/// What a view holds that an earlier one did not.
#[derive(Debug, Clone, PartialEq)]
pub struct News {
    /// Whether this is all that the view holds, and nothing before it counts.
    pub is_whole: bool,
    /// Where the mower stands.
    pub pose: Pose,
    /// Cosine and sine of its heading.
    pub direction: (f64, f64),
    /// Way driven since reset, metres.
    pub path_m: f64,
    /// Number of weeds ever detected.
    pub weeds_detected: u32,
    /// Weeds that have become known and still are, ascending by number.
    pub known: Vec<KnownWeed>,
    /// Numbers of the detected weeds that were mowed since, ascending: which of two was mowed first by one stretch depends on
    /// the order in which they were drawn.
    pub mowed: Vec<u32>,
    /// Tiles of the grid, ascending, each with the bits of its cells that have come into sight since.
    pub seen: Vec<(u32, u64)>,
}

impl Default for News {
    fn default() -> Self {
        Self {
            is_whole: true,
            pose: Pose::new(0.0, 0.0, 0.0),
            direction: (1.0, 0.0),
            path_m: 0.0,
            weeds_detected: 0,
            known: Vec::new(),
            mowed: Vec::new(),
            seen: Vec::new(),
        }
    }
}

/// What a mirror was told so far.
#[derive(Debug, Clone)]
pub struct Told {
    weeds_detected: u32,
    mowed: usize,
    unseen: CellSet,
}

impl Told {
    /// Nothing yet.
    #[must_use]
    pub fn nothing(grid: &Grid) -> Self {
        Self { weeds_detected: 0, mowed: 0, unseen: CellSet::full(grid) }
    }

    /// Writes what is new in a view since the last one to `news`; all that it holds if `is_whole`, as it has to be where
    /// another episode has begun or a state was put back.
    pub fn news(&mut self, view: &View, is_whole: bool, news: &mut News) {
        let View { pose, direction, path_m, known_weeds, weeds_detected, ground, .. } = *view;
        if is_whole {
            *self = Self::nothing(ground.grid());
        }
        (news.is_whole, news.pose, news.direction, news.path_m) =
            (is_whole, pose, direction, path_m);
        news.weeds_detected = weeds_detected;
        news.known.clear();
        news.known.reserve(if is_whole { known_weeds.len() } else { 0 });
        news.known.extend(known_weeds.since(self.weeds_detected));
        self.weeds_detected = weeds_detected;
        news.mowed.clear();
        news.mowed.extend_from_slice(&known_weeds.removed()[self.mowed..]);
        news.mowed.sort_unstable();
        self.mowed = known_weeds.removed().len();
        news.seen.clear();
        for ((tile, before), &now) in (0..).zip(self.unseen.words()).zip(ground.unseen().words()) {
            if *before != now {
                news.seen.push((tile, before & !now));
            }
        }
        if !news.seen.is_empty() {
            self.unseen.clone_from(ground.unseen());
        }
    }
}

/// News that fit no view which this one could have become.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("news of a view must follow from what was told before, got {got}")]
pub struct MirrorError {
    got: &'static str,
}

/// A view put together from its news.
#[derive(Debug, Clone)]
pub struct Mirror {
    site: Site,
    pose: Pose,
    direction: (f64, f64),
    path_m: f64,
    weeds_detected: u32,
    known: KnownWeeds,
    ground: SeenGround,
}

impl Mirror {
    /// A mirror that shows a mower which knows nothing yet.
    #[must_use]
    pub fn new(site: &Site) -> Self {
        let News { pose, direction, path_m, weeds_detected, .. } = News::default();
        Self {
            site: *site,
            pose,
            direction,
            path_m,
            weeds_detected,
            known: KnownWeeds::none(site.length_m, site.width_m),
            ground: SeenGround::none(Arc::new(Grid::new(site.length_m, site.width_m))),
        }
    }

    /// Takes in what is new.
    ///
    /// # Errors
    ///
    /// [`MirrorError`]; the mirror shows nothing of use then until it is told the whole anew.
    pub fn apply(&mut self, news: &News) -> Result<(), MirrorError> {
        if news.is_whole {
            self.weeds_detected = 0;
            self.known.clear();
            self.ground.clear();
        }
        self.check(news).map_err(|got| MirrorError { got })?;
        (self.pose, self.direction, self.path_m) = (news.pose, news.direction, news.path_m);
        self.weeds_detected = news.weeds_detected;
        news.known.iter().for_each(|&weed| self.known.add(weed));
        news.mowed.iter().for_each(|&number| self.known.strike_out(number));
        let are_unseen = news.seen.iter().all(|&(tile, bits)| self.ground.absorb_tile(tile, bits));
        if are_unseen { Ok(()) } else { Err(MirrorError { got: "ground that was seen already" }) }
    }

    /// Whether the weeds of some news follow from those before. News may come from anywhere.
    fn check(&self, news: &News) -> Result<(), &'static str> {
        let Pose { x_m, y_m, heading_rad } = news.pose;
        let numbers = [x_m, y_m, heading_rad, news.direction.0, news.direction.1, news.path_m];
        let is_new = |number: u32| (self.weeds_detected..news.weeds_detected).contains(&number);
        let is_on_pasture = |Point { coords, .. }: Point| self.site.holds(coords.x, coords.y);
        // Of the weeds detected since, those that are not known any more were mowed.
        let mowed_since = news.mowed.iter().filter(|&&number| is_new(number)).count();
        let detected = news.weeds_detected.checked_sub(self.weeds_detected);
        let rules = [
            ("a pose that is no pose", numbers.iter().all(|number| number.is_finite())),
            (
                "weeds out of their order",
                news.known.is_sorted_by(|a, b| a.number < b.number)
                    && news.known.iter().all(|weed| is_new(weed.number)),
            ),
            ("weeds off the pasture", news.known.iter().all(|weed| is_on_pasture(weed.position))),
            (
                "another number of weeds",
                detected.is_some_and(|count| count as usize == news.known.len() + mowed_since),
            ),
            (
                "mowed weeds that were not known",
                news.mowed.is_sorted_by(|a, b| a < b)
                    && news.mowed.iter().all(|&number| is_new(number) || self.known.holds(number)),
            ),
        ];
        rules.iter().find(|(_, holds)| !holds).map_or(Ok(()), |(got, _)| Err(got))
    }

    /// What the mower knows, as the environment's own view has it.
    #[must_use]
    pub fn view(&self) -> View<'_> {
        View {
            site: &self.site,
            pose: self.pose,
            direction: self.direction,
            path_m: self.path_m,
            known_weeds: &self.known,
            weeds_detected: self.weeds_detected,
            ground: &self.ground,
        }
    }
}
