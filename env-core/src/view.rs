//! The fairness line: all that an agent may know.

use crate::belief::Belief;
use crate::geometry::{Frame, Pose};
use crate::ground::SeenGround;
use crate::known::KnownWeeds;
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
    /// Cosine and sine of its heading.
    pub direction: (f64, f64),
    /// Way driven since reset, metres.
    pub path_m: f64,
    /// Weeds detected and not yet mowed, in the order of detection.
    pub known_weeds: &'a KnownWeeds,
    /// Number of weeds ever detected.
    pub weeds_detected: u32,
    /// The ground seen so far.
    pub ground: &'a SeenGround,
}

impl<'a> View<'a> {
    /// The view of a mower with this belief.
    #[must_use]
    pub fn new(site: &'a Site, mower: &Mower, belief: &'a Belief) -> Self {
        let Frame { pose, cos, sin } = mower.frame();
        Self {
            site,
            pose,
            direction: (cos, sin),
            path_m: mower.path_m(),
            known_weeds: belief.known(),
            weeds_detected: belief.detected(),
            ground: belief.ground(),
        }
    }
}
