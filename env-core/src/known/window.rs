//! A part of the ground whose sides lie along the axes.

use crate::geometry::Point;
use crate::math::{larger, smaller};

/// A rectangle, its sides included; a side beyond which there is nothing is infinitely far away.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Window {
    low: Point,
    high: Point,
}

impl Window {
    /// All ground.
    pub(crate) const EVERYWHERE: Self = Self::between(f64::NEG_INFINITY, f64::INFINITY);
    /// No ground.
    pub(crate) const NOWHERE: Self = Self::between(f64::INFINITY, f64::NEG_INFINITY);

    const fn between(low_m: f64, high_m: f64) -> Self {
        Self { low: Point::new(low_m, low_m), high: Point::new(high_m, high_m) }
    }

    /// The square around a point whose sides are `reach_m` away, without those that leave a pasture of `length_m` by `width_m`.
    pub(crate) fn around(at: Point, reach_m: f64, (length_m, width_m): (f64, f64)) -> Self {
        let below = |at_m: f64| if at_m > 0.0 { at_m } else { f64::NEG_INFINITY };
        let above = |at_m: f64, size_m: f64| if at_m < size_m { at_m } else { f64::INFINITY };
        Self {
            low: Point::new(below(at.x - reach_m), below(at.y - reach_m)),
            high: Point::new(above(at.x + reach_m, length_m), above(at.y + reach_m, width_m)),
        }
    }

    /// The smallest window that holds both.
    pub(crate) fn with(&self, other: &Self) -> Self {
        let (low, high) = (&self.low, &self.high);
        Self {
            low: Point::new(smaller(low.x, other.low.x), smaller(low.y, other.low.y)),
            high: Point::new(larger(high.x, other.high.x), larger(high.y, other.high.y)),
        }
    }

    /// Lowest corner, metres.
    pub(crate) fn low(&self) -> Point {
        self.low
    }

    /// Highest corner, metres.
    pub(crate) fn high(&self) -> Point {
        self.high
    }

    /// Whether a point lies in it.
    #[inline]
    pub(crate) fn contains(&self, point: Point) -> bool {
        let Self { low, high } = self;
        (low.x <= point.x && point.x <= high.x) && (low.y <= point.y && point.y <= high.y)
    }

    /// How far a point is from the nearest side, metres; below 0 outside.
    #[inline]
    pub(crate) fn margin_m(&self, point: Point) -> f64 {
        let x_m = smaller(point.x - self.low.x, self.high.x - point.x);
        smaller(x_m, smaller(point.y - self.low.y, self.high.y - point.y))
    }
}
