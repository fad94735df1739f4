//! The detection triangle.

use super::{Frame, Point};

/// How far outside a border a point still counts as inside, metres: it settles ties that rounding would decide.
const BORDER_M: f64 = 1e-9;

/// The form of the triangle that a sensor sees, its apex at the mower's pose, opening forward. Borders count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triangle {
    range_m: f64,
    half_width_per_m: f64,
}

impl Triangle {
    /// The triangle of depth `range_m` and far side `width_m`.
    #[must_use]
    pub fn new(range_m: f64, width_m: f64) -> Self {
        Self { range_m, half_width_per_m: width_m / (2.0 * range_m) }
    }

    /// Half the far side over the depth.
    #[must_use]
    pub fn half_width_per_m(&self) -> f64 {
        self.half_width_per_m
    }

    /// How far the corners of the far side are from the apex, metres.
    #[must_use]
    pub fn reach_m(&self) -> f64 {
        self.range_m * (1.0 + self.half_width_per_m * self.half_width_per_m).sqrt()
    }

    /// Whether a point of the world lies in the triangle in front of a pose.
    #[must_use]
    #[inline]
    pub fn contains(&self, from: &Frame, point: Point) -> bool {
        let (ahead, left) = from.offsets_to(point);
        ahead <= self.range_m + BORDER_M && left.abs() <= ahead * self.half_width_per_m + BORDER_M
    }

    /// The left and the right end of the far side in front of a pose.
    #[must_use]
    #[inline]
    pub fn far_corners(&self, from: &Frame) -> [Point; 2] {
        let Frame { pose, cos, sin } = *from;
        let half_m = self.range_m * self.half_width_per_m;
        let (far_x, far_y) = (pose.x_m + self.range_m * cos, pose.y_m + self.range_m * sin);
        let (left_x, left_y) = (half_m * sin, half_m * cos);
        [Point::new(far_x - left_x, far_y + left_y), Point::new(far_x + left_x, far_y - left_y)]
    }
}

#[cfg(test)]
mod tests {
    use super::super::Pose;
    use super::*;

    #[test]
    fn borders_count_and_the_far_side_is_straight() {
        let from = Frame::from(Pose::new(0.0, 0.0, 0.0));
        let triangle = Triangle::new(12.0, 12.0);
        assert!(triangle.contains(&from, Point::new(12.0, 6.0)));
        assert!(triangle.contains(&from, Point::new(12.0, -6.0)));
        assert!(triangle.contains(&from, Point::new(0.0, 0.0)));
        assert!(!triangle.contains(&from, Point::new(12.001, 0.0)));
        assert!(!triangle.contains(&from, Point::new(6.0, 3.001)));
        assert!(!triangle.contains(&from, Point::new(-0.1, 0.0)));
    }
}
