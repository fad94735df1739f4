//! A part of the ground, made of whole buckets.

use std::ops::Range;

use crate::geometry::Point;
use crate::grid::Grid;
use crate::math::{larger, smaller};

/// By so much the sides count as nearer than they are, metres: more than rounding may do to a weed at a side.
const SLACK_M: f64 = 1e-6;

/// A rectangle of buckets; a side beyond which there is nothing is infinitely far away.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Window {
    /// The first column and row, and those behind the last ones.
    first: [usize; 2],
    end: [usize; 2],
    /// The sides, a slack further in; infinitely far away at the pasture's border.
    low_m: Point,
    high_m: Point,
}

impl Window {
    /// All ground.
    pub(crate) const EVERYWHERE: Self =
        Self::between((0, f64::NEG_INFINITY), (usize::MAX, f64::INFINITY));
    /// No ground.
    pub(crate) const NOWHERE: Self =
        Self::between((usize::MAX, f64::INFINITY), (0, f64::NEG_INFINITY));

    const fn between((first, low_m): (usize, f64), (end, high_m): (usize, f64)) -> Self {
        let (low_m, high_m) = (Point::new(low_m, low_m), Point::new(high_m, high_m));
        Self { first: [first; 2], end: [end; 2], low_m, high_m }
    }

    /// The buckets that a rectangle around a point touches whose sides are so far away along x and y, metres.
    pub(super) fn around(at: Point, (reach_x_m, reach_y_m): (f64, f64), buckets: &Grid) -> Self {
        let reach = Point::new(reach_x_m, reach_y_m).coords;
        let (low, high) = (buckets.cell_of(at - reach), buckets.cell_of(at + reach));
        let (side_x_m, side_y_m) = buckets.cell_m();
        let below = |first: usize, side_m: f64| {
            if first == 0 { f64::NEG_INFINITY } else { first as f64 * side_m + SLACK_M }
        };
        let above = |end: usize, count: usize, side_m: f64| {
            if end == count { f64::INFINITY } else { end as f64 * side_m - SLACK_M }
        };
        let end = [high.0 + 1, high.1 + 1];
        Self {
            first: [low.0, low.1],
            end,
            low_m: Point::new(below(low.0, side_x_m), below(low.1, side_y_m)),
            high_m: Point::new(
                above(end[0], buckets.columns(), side_x_m),
                above(end[1], buckets.rows(), side_y_m),
            ),
        }
    }

    /// The smallest window that holds both.
    pub(crate) fn with(&self, other: &Self) -> Self {
        let [first, end] = [
            std::array::from_fn(|i| self.first[i].min(other.first[i])),
            std::array::from_fn(|i| self.end[i].max(other.end[i])),
        ];
        let (low, high) = (&self.low_m, &self.high_m);
        let (low2, high2) = (&other.low_m, &other.high_m);
        Self {
            first,
            end,
            low_m: Point::new(smaller(low.x, low2.x), smaller(low.y, low2.y)),
            high_m: Point::new(larger(high.x, high2.x), larger(high.y, high2.y)),
        }
    }

    /// Its columns and rows, of so many.
    pub(super) fn buckets(&self, counts: [usize; 2]) -> [Range<usize>; 2] {
        std::array::from_fn(|i| self.first[i].min(counts[i])..self.end[i].min(counts[i]))
    }

    /// Whether it holds a bucket.
    #[inline]
    pub(super) fn holds(&self, (column, row): (usize, usize)) -> bool {
        let Self { first, end, .. } = self;
        (first[0] <= column && column < end[0]) && (first[1] <= row && row < end[1])
    }

    /// How far a point is from the nearest side, metres; below 0 outside.
    #[inline]
    pub(crate) fn margin_m(&self, point: Point) -> f64 {
        let x_m = smaller(point.x - self.low_m.x, self.high_m.x - point.x);
        smaller(x_m, smaller(point.y - self.low_m.y, self.high_m.y - point.y))
    }

    /// The square of a distance from a point within which there is no weed but in the window, where the point is so far off the
    /// pasture along x and y, metres: what is beyond a side along one axis is off along the other, too.
    pub(crate) fn margin_m2(&self, point: Point, (off_x_m, off_y_m): (f64, f64)) -> f64 {
        let x_m = smaller(point.x - self.low_m.x, self.high_m.x - point.x);
        let y_m = smaller(point.y - self.low_m.y, self.high_m.y - point.y);
        if x_m <= 0.0 || y_m <= 0.0 {
            return 0.0;
        }
        smaller(x_m * x_m + off_y_m * off_y_m, y_m * y_m + off_x_m * off_x_m)
    }
}
