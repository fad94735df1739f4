//! The detection triangle.

use super::{Footprint, Frame, Point, Side, XLimits};

/// How far outside a border a point still counts as inside, metres: it settles ties that rounding would decide.
const BORDER_M: f64 = 1e-9;

/// What a sensor sees at one look: a triangle with its apex at the mower's pose, opening forward. Borders count.
#[derive(Debug, Clone, Copy)]
pub struct Triangle {
    frame: Frame,
    range_m: f64,
    half_width_per_m: f64,
    y_range: (f64, f64),
    limits: XLimits,
}

impl Triangle {
    /// The triangle of depth `range_m` and far side `width_m` in front of a pose.
    #[must_use]
    pub fn new(from: impl Into<Frame>, range_m: f64, width_m: f64) -> Self {
        let frame = from.into();
        let Frame { pose, cos, sin } = frame;
        let m = width_m / (2.0 * range_m);
        let apex = pose.position();
        // Half-planes gx x + gy y <= h from the apex: the far side, the left one and the right one.
        let half_planes = [
            (cos, sin, range_m + BORDER_M),
            (-sin - m * cos, cos - m * sin, BORDER_M),
            (sin - m * cos, -cos - m * sin, BORDER_M),
        ];
        // Of three sides at most two face the same way; one that runs along x limits y only, which the range of y does already.
        let mut limits = XLimits {
            lower: [Side::upright(f64::NEG_INFINITY); 2],
            upper: [Side::upright(f64::INFINITY); 2],
        };
        let (mut lower, mut upper) = (limits.lower.iter_mut(), limits.upper.iter_mut());
        for (gx, gy, h) in half_planes {
            if gx.abs() > 1e-9 {
                let facing = if gx > 0.0 { upper.next() } else { lower.next() };
                let slope = -gy / gx;
                *facing.expect("the sides of a triangle do not all face one way") =
                    Side { x_at_0_m: h / gx + apex.x - slope * apex.y, slope };
            }
        }
        let (far, half) = (range_m * sin, range_m * m * cos);
        let (a, b) = (far + half, far - half);
        let y_range = (apex.y + a.min(b).min(0.0), apex.y + a.max(b).max(0.0));
        Self { frame, range_m, half_width_per_m: m, y_range, limits }
    }
}

impl Footprint for Triangle {
    #[inline]
    fn contains(&self, point: Point) -> bool {
        let (ahead, left) = self.frame.offsets_to(point);
        ahead <= self.range_m + BORDER_M && left.abs() <= ahead * self.half_width_per_m + BORDER_M
    }

    #[inline]
    fn y_range(&self) -> (f64, f64) {
        self.y_range
    }

    #[inline]
    fn limits(&self) -> &XLimits {
        &self.limits
    }
}

#[cfg(test)]
mod tests {
    use super::super::Pose;
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
                        let at = |side: &Side| side.x_at_0_m + side.slope * point.y;
                        assert!(
                            triangle.limits().lower.iter().all(|side| at(side) - 1e-6 <= point.x),
                            "{point}"
                        );
                        assert!(
                            triangle.limits().upper.iter().all(|side| point.x <= at(side) + 1e-6),
                            "{point}"
                        );
                    }
                }
            }
        }
    }
}
