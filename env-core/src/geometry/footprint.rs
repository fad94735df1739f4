//! What a shape on the ground has to answer to be found in a grid.

use wide::f64x2;

/// A convex shape on the ground with so many pairs of sides.
///
/// Its ranges and sides may be too wide, never too narrow.
pub trait Footprint<const PAIRS: usize> {
    /// Lowest and highest x of the shape, metres.
    fn x_range(&self) -> (f64, f64);
    /// Lowest and highest y of the shape, metres.
    fn y_range(&self) -> (f64, f64);
    /// Straight lines with the whole shape on one side.
    fn sides(&self) -> [SidePair; PAIRS];
}

/// Two sides of a shape: all its points have a product with each gradient that is not above the level.
#[derive(Debug, Clone, Copy)]
pub struct SidePair {
    /// Across the sides, outwards; of any length but 0.
    pub x: f64x2,
    /// The same along y.
    pub y: f64x2,
    /// The products for points on the sides.
    pub level: f64x2,
}

impl SidePair {
    /// Whether a point lies on the shape's side of both.
    #[cfg(test)]
    pub(super) fn hold(&self, point: super::Point) -> bool {
        (self.x * point.x + self.y * point.y).simd_le(self.level).to_bitmask() == 0b11
    }
}
