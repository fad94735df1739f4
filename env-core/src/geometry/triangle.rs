//! The detection triangle.

use super::{Footprint, Point, Pose};

/// How far outside a border a point still counts as inside, metres: it settles ties that rounding would decide.
const BORDER_M: f64 = 1e-9;

/// What a sensor sees at one look: a triangle with its apex at the mower's pose, opening forward. Borders count.
#[derive(Debug, Clone, Copy)]
pub struct Triangle {
    apex: Point,
    /// Unit vector forward; left is (-sin, cos).
    cos: f64,
    sin: f64,
    range_m: f64,
    half_width_per_m: f64,
}

impl Triangle {
    /// The triangle of depth `range_m` and far side `width_m` in front of `pose`.
    #[must_use]
    pub fn new(pose: Pose, range_m: f64, width_m: f64) -> Self {
        let (sin, cos) = crate::math::sin_cos(pose.heading_rad);
        Self {
            apex: pose.position(),
            cos,
            sin,
            range_m,
            half_width_per_m: width_m / (2.0 * range_m),
        }
    }

    /// Forward and left offset of a point, metres.
    fn in_mower(&self, point: Point) -> (f64, f64) {
        let (dx, dy) = (point.x - self.apex.x, point.y - self.apex.y);
        (self.cos * dx + self.sin * dy, self.cos * dy - self.sin * dx)
    }

    /// The three sides as half-planes `gx x + gy y <= h` in a frame that starts at the apex.
    fn sides(&self) -> [(f64, f64, f64); 3] {
        let m = self.half_width_per_m;
        [
            (self.cos, self.sin, self.range_m + BORDER_M),
            (-self.sin - m * self.cos, self.cos - m * self.sin, BORDER_M),
            (self.sin - m * self.cos, -self.cos - m * self.sin, BORDER_M),
        ]
    }
}

impl Footprint for Triangle {
    fn contains(&self, point: Point) -> bool {
        let (ahead, left) = self.in_mower(point);
        ahead <= self.range_m + BORDER_M && left.abs() <= ahead * self.half_width_per_m + BORDER_M
    }

    fn y_range(&self) -> (f64, f64) {
        let far = self.range_m * self.sin;
        let half = self.range_m * self.half_width_per_m * self.cos;
        let (a, b) = (far + half, far - half);
        (self.apex.y + a.min(b).min(0.0), self.apex.y + a.max(b).max(0.0))
    }

    #[inline]
    fn x_range(&self, y_from: f64, y_to: f64) -> (f64, f64) {
        let (y_from, y_to) = (y_from - self.apex.y, y_to - self.apex.y);
        let (mut low, mut high) = (
            -self.range_m - self.half_width_per_m * self.range_m,
            self.range_m + self.half_width_per_m * self.range_m,
        );
        for (gx, gy, h) in self.sides() {
            // The weaker of the side's two limits over the strip, so that the range never loses a point.
            let rest = (h - gy * y_from).max(h - gy * y_to);
            if gx > 1e-9 {
                high = high.min(rest / gx);
            } else if gx < -1e-9 {
                low = low.max(rest / gx);
            }
        }
        (self.apex.x + low, self.apex.x + high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn borders_count_and_the_far_side_is_straight() {
        let triangle = Triangle::new(Pose::new(0.0, 0.0, 0.0), 12.0, 12.0);
        assert!(triangle.contains(Point::new(12.0, 6.0)));
        assert!(triangle.contains(Point::new(12.0, -6.0)));
        assert!(triangle.contains(Point::new(0.0, 0.0)));
        assert!(!triangle.contains(Point::new(12.001, 0.0)));
        assert!(!triangle.contains(Point::new(6.0, 3.001)));
        assert!(!triangle.contains(Point::new(-0.1, 0.0)));
    }

    #[test]
    fn its_ranges_enclose_every_point_inside() {
        for turn in 0..40 {
            let triangle =
                Triangle::new(Pose::new(3.0, -2.0, f64::from(turn) * PI / 20.0), 7.0, 5.0);
            let (bottom, top) = triangle.y_range();
            for i in -100..100 {
                for j in -100..100 {
                    let point = Point::new(3.0 + f64::from(i) * 0.1, -2.0 + f64::from(j) * 0.1);
                    if triangle.contains(point) {
                        assert!(bottom - 1e-6 <= point.y && point.y <= top + 1e-6, "{point}");
                        let (low, high) = triangle.x_range(point.y, point.y);
                        assert!(low - 1e-6 <= point.x && point.x <= high + 1e-6, "{point}");
                    }
                }
            }
        }
    }
}
