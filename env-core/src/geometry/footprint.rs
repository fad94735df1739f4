//! What a shape on the ground has to answer to be found in a grid.

use super::Point;

/// A convex shape on the ground with so many sides.
///
/// Its ranges and sides may be too wide, never too narrow.
pub trait Footprint<const SIDES: usize> {
    /// Lowest and highest x of the shape, metres.
    fn x_range(&self) -> (f64, f64);
    /// Lowest and highest y of the shape, metres.
    fn y_range(&self) -> (f64, f64);
    /// Straight lines with the whole shape on one side.
    fn sides(&self) -> [Side; SIDES];
}

/// A side of a shape: all its points have a product with the gradient that is not above the level.
#[derive(Debug, Clone, Copy)]
pub struct Side {
    /// Across the side, outwards; of any length but 0.
    pub gradient: (f64, f64),
    /// The product for points on the side.
    pub level: f64,
}

impl Side {
    /// Whether a point lies on the shape's side of it.
    #[must_use]
    pub fn holds(&self, point: Point) -> bool {
        self.gradient.0 * point.x + self.gradient.1 * point.y <= self.level
    }
}
