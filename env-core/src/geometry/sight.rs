//! What may be seen on an arc.

use super::{Footprint, Frame, Side, Triangle};
use crate::math::{larger, smaller};

/// Keeps what a border's tolerance lets in, metres.
const SLACK_M: f64 = 1e-6;

/// The ground that may be seen on an arc: all triangles along it, and perhaps a little more.
#[derive(Debug, Clone, Copy)]
pub struct Sight {
    /// The corners of the triangles at both ends.
    x_m: [f64; 6],
    y_m: [f64; 6],
    /// How far a corner may leave the line between its places at both ends, metres.
    bulge_m: f64,
    /// The sum of the directions at both ends.
    towards: (f64, f64),
    half_width_per_m: f64,
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
        let (from, to) = (triangle.corners(start), triangle.corners(end));
        let corners = [from[0], from[1], from[2], to[0], to[1], to[2]];
        Self {
            x_m: corners.map(|corner| corner.x),
            y_m: corners.map(|corner| corner.y),
            bulge_m: (k + reach_m * k * k) * length_m * length_m / 8.0 + SLACK_M,
            towards: (start.cos + end.cos, start.sin + end.sin),
            half_width_per_m: triangle.half_width_per_m(),
        }
    }
}

fn lowest(of: [f64; 6]) -> f64 {
    of.into_iter().reduce(smaller).unwrap_or_default()
}

fn highest(of: [f64; 6]) -> f64 {
    of.into_iter().reduce(larger).unwrap_or_default()
}

impl Footprint<3> for Sight {
    #[inline]
    fn x_range(&self) -> (f64, f64) {
        (lowest(self.x_m) - self.bulge_m, highest(self.x_m) + self.bulge_m)
    }

    #[inline]
    fn y_range(&self) -> (f64, f64) {
        (lowest(self.y_m) - self.bulge_m, highest(self.y_m) + self.bulge_m)
    }

    /// The far, the left and the right side for the mean heading; gradients not of length 1.
    #[inline]
    fn sides(&self) -> [Side; 3] {
        let Self { x_m, y_m, towards: (cos, sin), half_width_per_m: m, bulge_m } = *self;
        let margin = 2.0 * (1.0 + m) * bulge_m;
        let side = |gradient: (f64, f64)| {
            let along = std::array::from_fn(|i| gradient.0 * x_m[i] + gradient.1 * y_m[i]);
            Side { gradient, level: highest(along) + margin }
        };
        [(cos, sin), (-sin - m * cos, cos - m * sin), (sin - m * cos, -cos - m * sin)].map(side)
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
            let curvature_per_m = [0.0, 0.5, -0.5, 1.2][turn % 4];
            let start = Frame::from(Pose::new(3.0, -2.0, turn as f64 * PI / 20.0));
            let end = start.advanced(curvature_per_m, 0.8);
            for triangle in &triangles {
                let sight = Sight::along(triangle, &start, &end, curvature_per_m, 0.8);
                let ((left, right), (bottom, top)) = (sight.x_range(), sight.y_range());
                for step in 0..=8 {
                    let look = start.advanced(curvature_per_m, 0.1 * f64::from(step));
                    for point in grid_of_points().filter(|&point| triangle.contains(&look, point)) {
                        assert!(left <= point.x && point.x <= right, "{point}");
                        assert!(bottom <= point.y && point.y <= top, "{point}");
                        assert!(sight.sides().iter().all(|side| side.holds(point)), "{point}");
                    }
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
