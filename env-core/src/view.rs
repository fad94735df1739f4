//! The fairness line: all that an agent may know.

use crate::belief::{Belief, KnownWeed, SeenGround};
use crate::geometry::Pose;
use crate::mower::Mower;
use crate::site::Site;

/// What a mower knows when it decides.
///
/// It never holds undetected weeds, their number, the seed or the configuration; every planner and every observation is
/// made from this and nothing else.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    /// The scenario's public numbers.
    pub site: &'a Site,
    /// Where the mower stands.
    pub pose: Pose,
    /// Way driven since reset, metres.
    pub path_m: f64,
    /// Weeds detected and not yet mowed, in the order of detection.
    pub known_weeds: &'a [KnownWeed],
    /// Number of weeds ever detected.
    pub weeds_detected: u32,
    /// The ground seen so far.
    pub ground: &'a SeenGround,
}

impl<'a> View<'a> {
    /// The view of a mower with this belief.
    #[must_use]
    pub fn new(site: &'a Site, mower: &Mower, belief: &'a Belief) -> Self {
        Self {
            site,
            pose: mower.pose(),
            path_m: mower.path_m(),
            known_weeds: belief.known(),
            weeds_detected: belief.detected(),
            ground: belief.ground(),
        }
    }

    /// Writes the known weeds nearest to the mower to `nearest` with their squared distances, nearest first, ties by order of
    /// detection; returns how many.
    pub fn nearest_known(&self, nearest: &mut [(f64, KnownWeed)]) -> usize {
        let mut count = 0;
        for &weed in self.known_weeds {
            let distance_m2 = (weed.position - self.pose.position()).norm_squared();
            let mut place = count;
            while place > 0 && distance_m2 < nearest[place - 1].0 {
                place -= 1;
            }
            if place == nearest.len() {
                continue;
            }
            count = (count + 1).min(nearest.len());
            nearest[place..count].rotate_right(1);
            nearest[place] = (distance_m2, weed);
        }
        count
    }
}
