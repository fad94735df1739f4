//! What is seen on a piece of a motion.

use super::{Footprint, Frame, Point, Side, Triangle};
use crate::math::{larger, smaller};

/// Keeps what a border's tolerance lets in.
const SLACK: f64 = 1e-6;

/// What is seen from one or a few poses that follow each other closely: the union of their triangles.
#[derive(Debug, Clone, Copy)]
pub struct Sight<'a> {
    triangle: Triangle,
    looks: &'a [Frame],
    x_range: (f64, f64),
    y_range: (f64, f64),
    /// The far, the left and the right side of all triangles.
    sides: [Side; 3],
}

impl<'a> Sight<'a> {
    /// What is seen from `looks`, which turn by less than half a circle.
    ///
    /// # Panics
    ///
    /// If there is none.
    #[must_use]
    pub fn new(triangle: Triangle, looks: &'a [Frame]) -> Self {
        let (first, last) = (&looks[0], &looks[looks.len() - 1]);
        // The far, the left and the right side for the mean heading; gradients not of length 1.
        let m = triangle.half_width_per_m();
        let (cos, sin) = (first.cos + last.cos, first.sin + last.sin);
        let gradients =
            [(cos, sin), (-sin - m * cos, cos - m * sin), (sin - m * cos, -cos - m * sin)];
        let [mut far_level, mut left_level, mut right_level] = [f64::NEG_INFINITY; 3];
        let (mut low, mut high) =
            ((f64::INFINITY, f64::INFINITY), (f64::NEG_INFINITY, f64::NEG_INFINITY));
        let dot =
            |side: usize, point: Point| gradients[side].0 * point.x + gradients[side].1 * point.y;
        for look in looks {
            let (apex, [left, right]) = (look.pose.position(), triangle.far_corners(look));
            low.0 = smaller(low.0, smaller(apex.x, smaller(left.x, right.x)));
            low.1 = smaller(low.1, smaller(apex.y, smaller(left.y, right.y)));
            high.0 = larger(high.0, larger(apex.x, larger(left.x, right.x)));
            high.1 = larger(high.1, larger(apex.y, larger(left.y, right.y)));
            far_level = larger(far_level, larger(dot(0, left), dot(0, right)));
            left_level = larger(left_level, larger(dot(1, apex), dot(1, left)));
            right_level = larger(right_level, larger(dot(2, apex), dot(2, right)));
        }
        let levels = [far_level, left_level, right_level];
        let sides =
            std::array::from_fn(|i| Side { gradient: gradients[i], level: levels[i] + SLACK });
        Self { triangle, looks, x_range: (low.0, high.0), y_range: (low.1, high.1), sides }
    }
}

impl Footprint<3> for Sight<'_> {
    #[inline]
    fn contains(&self, point: Point) -> bool {
        self.looks.iter().any(|look| self.triangle.contains(look, point))
    }

    #[inline]
    fn x_range(&self) -> (f64, f64) {
        self.x_range
    }

    #[inline]
    fn y_range(&self) -> (f64, f64) {
        self.y_range
    }

    #[inline]
    fn sides(&self) -> [Side; 3] {
        self.sides
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::super::Pose;
    use super::*;

    #[test]
    fn its_ranges_enclose_every_point_inside() {
        for turn in 0..40 {
            let first = Frame::from(Pose::new(3.0, -2.0, f64::from(turn) * PI / 20.0));
            let frames = [0.0, 0.2, 0.4].map(|way_m| first.advanced(0.5, way_m));
            let sight = Sight::new(Triangle::new(7.0, 5.0), &frames);
            let ((left, right), (bottom, top)) = (sight.x_range(), sight.y_range());
            for i in -100..100 {
                for j in -100..100 {
                    let point = Point::new(3.0 + f64::from(i) * 0.1, -2.0 + f64::from(j) * 0.1);
                    if sight.contains(point) {
                        assert!(left - 1e-6 <= point.x && point.x <= right + 1e-6, "{point}");
                        assert!(bottom - 1e-6 <= point.y && point.y <= top + 1e-6, "{point}");
                        assert!(sight.sides.iter().all(|side| side.holds(point)), "{point}");
                    }
                }
            }
        }
    }
}
