//! What may be seen on an arc.

use wide::f64x2;

use super::{Footprint, Frame, SidePair, Triangle};
use crate::math::{larger, smaller};

/// Keeps what a border's tolerance lets in, metres.
const SLACK_M: f64 = 1e-6;

/// The ground that may be seen on an arc: all triangles along it, and perhaps a little more.
#[derive(Debug, Clone, Copy)]
pub struct Sight {
    /// The corners of the triangles at both ends, of each the apex, the inner one on the turn and the outer one.
    x_m: [f64; 6],
    y_m: [f64; 6],
    /// How far a corner may leave the line between its places at both ends, metres.
    bulge_m: f64,
    /// 1 on a left turn or straight on, -1 on a right turn: the sign that turns the right-hand normal of a side outwards.
    outwards: f64,
}

impl Sight {
    /// What is seen from `at`.
    #[must_use]
    pub fn from(triangle: &Triangle, at: &Frame) -> Self {
        Self::along(triangle, at, at, 0.0, 0.0)
    }

    /// What may be seen on an arc of signed curvature `curvature_per_m` from `start` to `end`, which turns by less than half
    /// a circle.
    #[must_use]
    #[inline]
    pub fn along(
        triangle: &Triangle,
        start: &Frame,
        end: &Frame,
        curvature_per_m: f64,
        length_m: f64,
    ) -> Self {
        // A corner runs on a circle of radius 1/k + reach at most, and leaves its chord by as much as in `BarSweep`.
        let (k, reach_m) = (curvature_per_m.abs(), triangle.reach_m());
        // The far corner on the inner side of the turn comes first, then the outer one.
        let outwards = 1.0_f64.copysign(curvature_per_m + 0.0);
        let (from, to) =
            (triangle.corners_from(start, outwards), triangle.corners_from(end, outwards));
        let corners = [from[0], from[1], from[2], to[0], to[1], to[2]];
        Self {
            x_m: corners.map(|corner| corner.x),
            y_m: corners.map(|corner| corner.y),
            bulge_m: (k + reach_m * k * k) * length_m * length_m / 8.0 + SLACK_M,
            outwards,
        }
    }

    /// Two sides, each along the line from one corner to another, as far out as any corner comes.
    #[inline]
    fn two_sides(&self, from: [usize; 2], to: [usize; 2]) -> SidePair {
        /// Where the mower stands still a corner has no path: then any direction will do.
        const ANY: f64 = 1e-100;
        let Self { x_m, y_m, bulge_m, outwards } = self;
        let of = |numbers: &[f64; 6], corners: [usize; 2]| f64x2::new(corners.map(|i| numbers[i]));
        let x = (of(y_m, to) - of(y_m, from)) * *outwards + ANY;
        let y = (of(x_m, from) - of(x_m, to)) * *outwards;
        let along = |i: usize| x * x_m[i] + y * y_m[i];
        let highest = (1..6).fold(along(0), |highest, i| highest.fast_max(along(i)));
        let level = highest + (x * x + y * y).sqrt() * *bulge_m;
        SidePair { x, y, level }
    }
}

fn lowest(of: [f64; 6]) -> f64 {
    of.into_iter().reduce(smaller).unwrap_or_default()
}

fn highest(of: [f64; 6]) -> f64 {
    of.into_iter().reduce(larger).unwrap_or_default()
}

impl Footprint<2> for Sight {
    #[inline]
    fn x_range(&self) -> (f64, f64) {
        (lowest(self.x_m) - self.bulge_m, highest(self.x_m) + self.bulge_m)
    }

    #[inline]
    fn y_range(&self) -> (f64, f64) {
        (lowest(self.y_m) - self.bulge_m, highest(self.y_m) + self.bulge_m)
    }

    /// Lines from corner to corner: from the first apex to the outer far corner, along that one's path, to the inner far corner
    /// at the end, and back. The path comes first: most of what is visited in vain is beyond it. Gradients not of length 1.
    #[inline]
    fn sides(&self) -> [SidePair; 2] {
        [self.two_sides([2, 5], [5, 4]), self.two_sides([0, 4], [2, 0])]
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::super::{Point, Pose};
    use super::*;

    #[test]
    fn its_ranges_and_sides_enclose_every_point_that_is_seen_on_the_way() {
        let triangles = [Triangle::new(7.0, 5.0), Triangle::new(6.0, 0.2), Triangle::new(0.5, 9.0)];
        for turn in 0..40 {
            let curvature_per_m = [0.0, 0.5, -0.5, 1.2, -1.2][turn % 5];
            let length_m = if turn < 30 { 0.8 } else { 0.0 };
            let start = Frame::from(Pose::new(3.0, -2.0, turn as f64 * PI / 20.0));
            let end = start.advanced(curvature_per_m, length_m);
            for triangle in &triangles {
                let sight = Sight::along(triangle, &start, &end, curvature_per_m, length_m);
                let (none, mut sides) = (f64x2::ZERO, sight.sides().into_iter());
                let is_a_line =
                    |pair: SidePair| !(pair.x.simd_eq(none) & pair.y.simd_eq(none)).any();
                assert!(sides.all(is_a_line), "{turn}");
                let ((left, right), (bottom, top)) = (sight.x_range(), sight.y_range());
                for step in 0..=8 {
                    let look = start.advanced(curvature_per_m, length_m * f64::from(step) / 8.0);
                    for point in grid_of_points().filter(|&point| triangle.contains(&look, point)) {
                        assert!(left <= point.x && point.x <= right, "{point}");
                        assert!(bottom <= point.y && point.y <= top, "{point}");
                        assert!(sight.sides().iter().all(|sides| sides.hold(point)), "{point}");
                    }
                }
            }
        }
    }

    #[test]
    fn its_sides_leave_out_points_a_little_beyond_the_corners() {
        // Half a metre beyond each side: the apex has come from (0, 0), and the triangle is 6 m deep and 4 m wide.
        let triangle = Triangle::new(6.0, 4.0);
        for sign in [1.0, -1.0] {
            for curvature_per_m in [0.0, 0.25, 0.5] {
                let start = Frame::from(Pose::new(0.0, 0.0, 0.0));
                let end = start.advanced(sign * curvature_per_m, 1.0);
                let sight = Sight::along(&triangle, &start, &end, sign * curvature_per_m, 1.0);
                let [_, inner, outer] = triangle.corners_from(&end, sign);
                let (cos, sin) = (end.cos, end.sin);
                let far = Point::new(0.5 * (inner.x + outer.x), 0.5 * (inner.y + outer.y));
                let [_, _, first_outer] = triangle.corners_from(&start, sign);
                let path = Point::new(
                    0.5 * (first_outer.x + outer.x) + 0.5 * sign * (outer.y - first_outer.y),
                    0.5 * (first_outer.y + outer.y) - 0.5 * sign * (outer.x - first_outer.x),
                );
                for beyond in [
                    Point::new(far.x + 0.5 * cos, far.y + 0.5 * sin),
                    Point::new(2.0, sign * -(2.0 / 3.0 + 0.8)),
                    Point::new(0.5 * inner.x, 0.5 * inner.y + sign * 0.8),
                    path,
                ] {
                    assert!(!sight.sides().iter().all(|sides| sides.hold(beyond)), "{beyond}");
                }
            }
        }
    }

    fn grid_of_points() -> impl Iterator<Item = Point> {
        let across = |i: i32| (-45..45).map(move |j| (i, j));
        (-45..45)
            .flat_map(across)
            .map(|(i, j)| Point::new(3.0 + f64::from(i) * 0.2, -2.0 + f64::from(j) * 0.2))
    }
}
