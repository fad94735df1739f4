//! How the mower may get from one place to the next.

use swath_core::geometry::{DubinsPath, Pose, Word, shortest};
use swath_core::site::Site;

use super::spot::{Spot, leg_m, single};

/// What a leg costs more that leaves the headland, metres.
const FORBIDDEN_M: f32 = 1_000.0;
/// Spacing of the poses by which it is told whether a way leaves the headland, metres, and how much nearer the border is for that.
const SPACING_M: f64 = 0.25;
const BORDER_M: f64 = 0.01;

/// Shortest ways for a turning radius that stay on the pasture and its headland.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ways {
    radius_m: f32,
    /// `None` where the headland is so wide that no way between places on the pasture leaves it.
    fence: Option<Site>,
    /// How far outside the pasture the mower may stand in any direction, metres.
    outside_m: f32,
}

impl Ways {
    pub(super) fn new(site: &Site) -> Self {
        let turn_m = 2.0 * site.turning_radius_m;
        let fence = (site.headland_m < turn_m)
            .then_some(Site { headland_m: site.headland_m - BORDER_M, ..*site });
        let outside_m = single((site.headland_m - turn_m).max(0.0));
        Self { radius_m: single(site.turning_radius_m), fence, outside_m }
    }

    /// How far outside the pasture the mower may stand in any direction, metres.
    pub(super) fn outside_m(&self) -> f32 {
        self.outside_m
    }

    /// Length of the shortest way, metres; much more if it leaves the headland.
    #[inline]
    pub(super) fn leg_m(&self, from: &Spot, to: &Spot) -> f32 {
        match &self.fence {
            Some(fence) if self.may_leave(fence, from) || self.may_leave(fence, to) => {
                let way = self.within(fence, from.pose(), to.pose());
                way.map_or(FORBIDDEN_M + leg_m(from, to, self.radius_m), |way| {
                    single(way.length_m())
                })
            }
            _ => leg_m(from, to, self.radius_m),
        }
    }

    /// The shortest way; one that leaves the headland only if there is no other.
    pub(super) fn way(&self, from: Pose, to: Pose) -> DubinsPath {
        let within = self.fence.as_ref().and_then(|fence| self.within(fence, from, to));
        within.unwrap_or_else(|| {
            shortest(from, to, self.radius_m.into())
                .expect("a checked scenario has a turning radius")
        })
    }

    /// Whether a way from there may leave the headland.
    fn may_leave(&self, fence: &Site, spot: &Spot) -> bool {
        let reach_m = single(fence.headland_m) - 2.0 * self.radius_m;
        let (length_m, width_m) = (single(fence.length_m), single(fence.width_m));
        !((-reach_m..=length_m + reach_m).contains(&spot.x_m)
            && (-reach_m..=width_m + reach_m).contains(&spot.y_m))
    }

    /// The shortest of the words that stay on the headland.
    fn within(&self, fence: &Site, from: Pose, to: Pose) -> Option<DubinsPath> {
        let stays = |way: &DubinsPath| {
            let looks = swath_core::math::floor_index(way.length_m() / SPACING_M) + 1;
            let apart_m = way.length_m() / looks as f64;
            (0..=looks).all(|look| fence.allows(way.at(apart_m * look as f64)))
        };
        let ways = Word::ALL.iter().filter_map(|word| word.path(from, to, self.radius_m.into()));
        ways.filter(stays).min_by(|one, other| one.length_m().total_cmp(&other.length_m()))
    }
}
