//! How the mower may get from one place to the next.

use swath_core::geometry::{DubinsPath, Pose, shortest, words};
use swath_core::site::Site;

use super::spot::{Spot, legs_m, single};

/// What a leg costs more that leaves the headland, metres.
const FORBIDDEN_M: f32 = 1_000.0;
/// How much nearer the border is for plans, metres: more than single precision errs by.
const BORDER_M: f64 = 0.01;
/// How far from where it begins or ends a shortest way leads at most that has a straight, in turning radii: to the other side of
/// a turning circle. And any shortest way: to the other side of the circle in the middle, which touches that one.
const REACH: f64 = 2.0;
const REACH_OF_THREE_TURNS: f64 = 4.0;

/// Shortest ways for a turning radius that stay on the pasture and its headland.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ways {
    radius_m: f64,
    /// `None` where the mower may drive anywhere.
    fence: Option<Fence>,
    /// How far outside the pasture the mower may stand in any direction, metres.
    outside_m: f32,
}

/// Where the mower may drive.
#[derive(Debug, Clone, Copy)]
#[expect(clippy::struct_field_names, reason = "units are in names")]
struct Fence {
    length_m: f64,
    width_m: f64,
    headland_m: f64,
}

impl Ways {
    pub(super) fn new(site: &Site) -> Self {
        let fence = site.headland_m.is_finite().then_some(Fence {
            length_m: site.length_m,
            width_m: site.width_m,
            headland_m: site.headland_m - BORDER_M,
        });
        let outside_m = single((site.headland_m - REACH * site.turning_radius_m).max(0.0));
        Self { radius_m: site.turning_radius_m, fence, outside_m }
    }

    /// How far outside the pasture the mower may stand in any direction, metres.
    pub(super) fn outside_m(&self) -> f32 {
        self.outside_m
    }

    /// Length of the shortest way, metres; much more if it leaves the headland.
    #[inline]
    pub(super) fn leg_m(&self, from: &Spot, to: &Spot) -> f32 {
        let legs_m = || legs_m(from, to, single(self.radius_m));
        let Some(fence) = &self.fence else { return legs_m().shortest() };
        let far_m = single(fence.headland_m - REACH_OF_THREE_TURNS * self.radius_m);
        if fence.is_within(from, far_m) && fence.is_within(to, far_m) {
            return legs_m().shortest();
        }
        let near_m = single(fence.headland_m - REACH * self.radius_m);
        if fence.is_within(from, near_m) && fence.is_within(to, near_m) {
            let legs_m = legs_m();
            if legs_m.with_straight <= legs_m.of_three_turns {
                return legs_m.with_straight;
            }
        }
        let (way, beyond_m) = self.least_beyond(fence, from.pose(), to.pose());
        single(way.length_m()) + if beyond_m > 0.0 { FORBIDDEN_M } else { 0.0 }
    }

    /// The shortest way that stays on the headland; where there is none, the one that leaves it least.
    pub(super) fn way(&self, from: Pose, to: Pose) -> DubinsPath {
        match &self.fence {
            Some(fence) => self.least_beyond(fence, from, to).0,
            None => {
                shortest(from, to, self.radius_m).expect("a checked scenario has a turning radius")
            }
        }
    }

    /// The way that leaves the headland least, the shortest of several, and how far it does, metres.
    fn least_beyond(&self, fence: &Fence, from: Pose, to: Pose) -> (DubinsPath, f64) {
        let ways = words(from, to, self.radius_m).map(|way| (way, fence.beyond_m(&way)));
        let order = |(one, one_m): &(DubinsPath, f64), (other, other_m): &(DubinsPath, f64)| {
            one_m.total_cmp(other_m).then(one.length_m().total_cmp(&other.length_m()))
        };
        ways.min_by(order).expect("two of the words join any poses")
    }
}

impl Fence {
    /// Whether a spot lies at most so far outside the pasture, metres.
    fn is_within(&self, spot: &Spot, outside_m: f32) -> bool {
        let (length_m, width_m) = (single(self.length_m), single(self.width_m));
        (-outside_m..=length_m + outside_m).contains(&spot.x_m)
            && (-outside_m..=width_m + outside_m).contains(&spot.y_m)
    }

    /// How far a way leads over the fence, metres; 0 if it does not.
    fn beyond_m(&self, way: &DubinsPath) -> f64 {
        way.arcs().fold(0.0, |beyond_m: f64, arc| {
            let (least, most) = arc.bounds();
            let outside_m =
                (-least.x).max(-least.y).max(most.x - self.length_m).max(most.y - self.width_m);
            beyond_m.max(outside_m - self.headland_m)
        })
    }
}
