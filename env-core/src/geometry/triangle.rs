//! The detection triangle.

use super::{Frame, Frames, Point};

/// How far outside a border a point still counts as inside, metres: it settles ties that rounding would decide.
const BORDER_M: f64 = 1e-9;

/// The form of the triangle that a sensor sees, its apex at the mower's pose, opening forward. Borders count.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::struct_field_names, reason = "units are in names")]
pub struct Triangle {
    range_m: f64,
    half_width_per_m: f64,
    /// How far the corners of the far side are from the apex.
    corner_m: f64,
}

impl Triangle {
    /// The triangle of depth `range_m` and far side `width_m`.
    #[must_use]
    pub fn new(range_m: f64, width_m: f64) -> Self {
        let half_width_per_m = width_m / (2.0 * range_m);
        let corner_m = range_m * (1.0 + half_width_per_m * half_width_per_m).sqrt();
        Self { range_m, half_width_per_m, corner_m }
    }

    /// How far the corners of the far side are from the apex, metres.
    #[must_use]
    pub fn reach_m(&self) -> f64 {
        self.corner_m
    }

    /// Whether a point of the world lies in the triangle in front of a pose.
    #[must_use]
    #[inline]
    pub fn contains(&self, from: &Frame, point: Point) -> bool {
        let (ahead, left) = from.offsets_to(point);
        ahead <= self.range_m + BORDER_M && left.abs() <= ahead * self.half_width_per_m + BORDER_M
    }

    /// From which frames a point of the world lies in the triangle in front of them, lowest bit first.
    #[must_use]
    #[inline]
    pub fn seen_from(&self, frames: &Frames, point: Point) -> u32 {
        frames.in_cone(point, self.range_m + BORDER_M, self.half_width_per_m, BORDER_M)
    }

    /// The apex, and the left and the right end of the far side, in front of a pose.
    #[must_use]
    #[inline]
    pub fn corners(&self, from: &Frame) -> [Point; 3] {
        self.corners_from(from, 1.0)
    }

    /// The same for `side` 1; for -1 the right end comes before the left one.
    #[must_use]
    #[inline]
    pub(super) fn corners_from(&self, from: &Frame, side: f64) -> [Point; 3] {
        let Frame { pose, cos, sin } = *from;
        let half_m = side * self.range_m * self.half_width_per_m;
        let (far_x, far_y) = (pose.x_m + self.range_m * cos, pose.y_m + self.range_m * sin);
        let (left_x, left_y) = (half_m * sin, half_m * cos);
        [
            pose.position(),
            Point::new(far_x - left_x, far_y + left_y),
            Point::new(far_x + left_x, far_y - left_y),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::super::Pose;
    use super::*;

    #[test]
    fn from_a_few_frames_the_same_is_seen_as_from_each() {
        let start = Frame::from(Pose::new(1.0, 2.0, 0.7));
        let frames = Frames::along(&start, 0.4, [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]);
        let triangle = Triangle::new(3.0, 2.0);
        for i in -40..40 {
            for j in -40..40 {
                let point = Point::new(1.0 + f64::from(i) * 0.1, 2.0 + f64::from(j) * 0.1);
                let bits = triangle.seen_from(&frames, point);
                for k in 0..6 {
                    let is_seen = triangle.contains(&frames.at(k), point);
                    assert_eq!(bits >> k & 1 == 1, is_seen, "{point} from {k}");
                }
            }
        }
    }

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
