//! A way to drive, and the fence that it has to stay within.

use crate::geometry::{Arc, DubinsPath, Frame, Point, Pose, Segment};
use crate::math::wrap_to_tau;
use crate::site::Site;

/// Rounding in comparisons with the fence, metres; half of what the fence itself allows.
const ROUNDING_M: f64 = 0.5e-9;

/// A Dubins path and a straight piece behind it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Way {
    start: Pose,
    goal: Frame,
    segments: [Segment; 4],
}

impl Way {
    /// Along `path`, which leads to `goal`, then straight on for `straight_m`.
    pub(super) fn along(path: &DubinsPath, goal: Frame, straight_m: f64) -> Self {
        let [first, second, third] = path.segments();
        let last = Segment { curvature_per_m: 0.0, length_m: straight_m };
        Self { start: path.start(), goal, segments: [first, second, third, last] }
    }

    /// One arc, then straight on for `straight_m`.
    pub(super) fn arc(start: &Frame, curvature_per_m: f64, length_m: f64, straight_m: f64) -> Self {
        let straight = |length_m: f64| Segment { curvature_per_m: 0.0, length_m };
        let first = Segment { curvature_per_m, length_m };
        let goal = start.advanced(curvature_per_m, length_m);
        let segments = [first, straight(0.0), straight(0.0), straight(straight_m)];
        Self { start: start.pose, goal, segments }
    }

    /// Its pieces in driving order; any of them may have length 0.
    #[must_use]
    pub fn segments(&self) -> [Segment; 4] {
        self.segments
    }

    /// Length of all pieces, metres.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.segments.iter().map(|segment| segment.length_m).sum()
    }

    /// Where the Dubins path ends and the last straight piece begins.
    #[must_use]
    pub fn goal(&self) -> Pose {
        self.goal.pose
    }

    /// Where it ends.
    #[must_use]
    pub fn end(&self) -> Frame {
        let [.., last] = self.segments;
        self.goal.advanced(0.0, last.length_m)
    }

    /// The pieces as arcs, each beginning where the one before ends.
    fn arcs(&self) -> impl Iterator<Item = Arc> {
        let mut start = self.start;
        self.segments.iter().map(move |&Segment { curvature_per_m, length_m }| {
            let arc = Arc { start, curvature_per_m, length_m };
            start = arc.end();
            arc
        })
    }
}

/// The border of the ground on which a mower may drive: the pasture and its headland.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fence {
    /// Lowest x and y, and the highest of each, metres.
    low: f64,
    high_x: f64,
    high_y: f64,
    radius_m: f64,
}

impl Fence {
    pub(super) fn new(site: &Site) -> Self {
        let reach_m = site.headland_m + ROUNDING_M;
        Self {
            low: -reach_m,
            high_x: site.length_m + reach_m,
            high_y: site.width_m + reach_m,
            radius_m: site.turning_radius_m,
        }
    }

    /// Whether a point lies within, and at least `margin_m` away from the border.
    fn holds_point(&self, point: Point, margin_m: f64) -> bool {
        let low_m = self.low + margin_m;
        (low_m..=self.high_x - margin_m).contains(&point.x)
            && (low_m..=self.high_y - margin_m).contains(&point.y)
    }

    /// Whether a mower that follows `way` stays within.
    pub(super) fn holds(&self, way: &Way) -> bool {
        // Three arcs that touch reach at most four radii beyond the ends, whatever their word.
        let far_m = 4.0 * self.radius_m;
        let is_far = |pose: Pose| self.holds_point(pose.position(), far_m);
        (is_far(way.start) && is_far(way.end().pose)) || way.arcs().all(|arc| self.holds_arc(&arc))
    }

    fn holds_arc(&self, arc: &Arc) -> bool {
        if !self.holds_point(arc.start.position(), 0.0)
            || !self.holds_point(arc.end().position(), 0.0)
        {
            return false;
        }
        if arc.curvature_per_m == 0.0 {
            return true;
        }
        // The points of the circle furthest along each axis, as far as the arc comes to them.
        let (radius_m, turned_rad) =
            (1.0 / arc.curvature_per_m, arc.curvature_per_m * arc.length_m);
        let (sin, cos) = crate::math::sin_cos(arc.start.heading_rad);
        let centre = Point::new(arc.start.x_m - radius_m * sin, arc.start.y_m + radius_m * cos);
        (0..4_u8).all(|quarter| {
            let heading_rad = f64::from(quarter) * std::f64::consts::FRAC_PI_2;
            let ahead_rad =
                wrap_to_tau((heading_rad - arc.start.heading_rad) * turned_rad.signum());
            let [x, y] = [[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]][usize::from(quarter)];
            let furthest = Point::new(centre.x + radius_m * x, centre.y + radius_m * y);
            ahead_rad > turned_rad.abs() || self.holds_point(furthest, 0.0)
        })
    }
}
