//! Where something is and which way it faces.

use nalgebra::{Isometry2, Translation2, UnitComplex};
use serde::{Deserialize, Serialize};

use super::Point;
use crate::math;

/// A position and a heading in the world frame: x along the pasture's length, y along its width.
///
/// The mower's pose is the middle of its implement, which is also the apex of the detection triangle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Along the pasture's length, metres.
    pub x_m: f64,
    /// Along the pasture's width, metres.
    pub y_m: f64,
    /// Counter-clockwise from +x, radians, any real number.
    pub heading_rad: f64,
}

impl Pose {
    /// A pose from its three numbers: metres, metres, radians.
    #[must_use]
    pub fn new(x_m: f64, y_m: f64, heading_rad: f64) -> Self {
        Self { x_m, y_m, heading_rad }
    }

    /// The position without the heading.
    #[must_use]
    pub fn position(&self) -> Point {
        Point::new(self.x_m, self.y_m)
    }

    /// The transform that takes points of the mower's frame (forward, left) to the world.
    #[must_use]
    pub fn world_from_mower(&self) -> Isometry2<f64> {
        let super::Frame { cos, sin, .. } = (*self).into();
        let rotation = UnitComplex::new_unchecked(nalgebra::Complex::new(cos, sin));
        Isometry2::from_parts(Translation2::new(self.x_m, self.y_m), rotation)
    }

    /// Where the mower stands after `distance_m` on a circle of signed curvature `curvature_per_m` (left positive).
    #[must_use]
    pub fn advanced(&self, curvature_per_m: f64, distance_m: f64) -> Self {
        super::Frame::from(*self).advanced(curvature_per_m, distance_m).pose
    }

    /// Straight distance to another pose, metres, headings ignored.
    #[must_use]
    pub fn distance_to(&self, other: &Self) -> f64 {
        (self.position() - other.position()).norm()
    }

    /// Direction from here to `point`, radians in [-pi, pi].
    #[must_use]
    pub fn bearing_to(&self, point: Point) -> f64 {
        math::atan2(point.y - self.y_m, point.x - self.x_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn a_quarter_circle_to_the_left_ends_one_radius_ahead_and_one_to_the_left() {
        let end = Pose::new(0.0, 0.0, 0.0).advanced(0.5, PI);
        assert!((end.x_m - 2.0).abs() < 1e-12 && (end.y_m - 2.0).abs() < 1e-12, "{end:?}");
        assert!((end.heading_rad - FRAC_PI_2).abs() < 1e-12);
    }

    #[test]
    fn a_straight_line_keeps_its_height_to_the_bit() {
        let end = Pose::new(3.0, 7.3, 0.0).advanced(0.0, 20.0);
        assert_eq!(end, Pose::new(23.0, 7.3, 0.0));
    }

    #[test]
    fn a_point_ahead_in_the_mowers_frame_lies_along_the_heading() {
        let world = Pose::new(1.0, 2.0, FRAC_PI_2).world_from_mower() * Point::new(3.0, 1.0);
        assert!((world - Point::new(0.0, 5.0)).norm() < 1e-12, "{world}");
    }
}
