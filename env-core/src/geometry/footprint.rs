//! What a shape on the ground has to answer to be found in a grid.

use super::Point;

/// A shape on the ground that can be looked up in a grid.
///
/// The ranges may be too wide, never too narrow; [`Footprint::contains`] decides.
pub trait Footprint {
    /// Whether a point of the world lies in the shape, borders included.
    fn contains(&self, point: Point) -> bool;
    /// Lowest and highest y of the shape, metres.
    fn y_range(&self) -> (f64, f64);
    /// Lowest and highest x of the shape within the strip `y_from..=y_to`, metres; low above high if it is empty there.
    fn x_range(&self, y_from: f64, y_to: f64) -> (f64, f64);
}
