//! What a shape on the ground has to answer to be found in a grid.

use super::Point;

/// A convex shape on the ground.
///
/// Its ranges may be too wide, never too narrow; [`Footprint::contains`] decides.
pub trait Footprint {
    /// Whether a point of the world lies in the shape, borders included.
    fn contains(&self, point: Point) -> bool;
    /// Lowest and highest x of the shape, metres.
    fn x_range(&self) -> (f64, f64);
    /// Lowest and highest y of the shape, metres.
    fn y_range(&self) -> (f64, f64);
    /// The limits on x.
    fn limits(&self) -> XLimits;
    /// Whether the shape certainly has no point in the box between two corners.
    fn misses(&self, low: Point, high: Point) -> bool;
}

/// The x between which a shape lies, at any y of its range: not left of any lower limit, not right of any upper one.
#[derive(Debug, Clone, Copy)]
pub struct XLimits {
    /// Limits from below.
    pub lower: [Side; 2],
    /// Limits from above.
    pub upper: [Side; 2],
}

/// A limit on x that depends on y.
#[derive(Debug, Clone, Copy)]
pub struct Side {
    /// The limit at y = 0, metres.
    pub x_at_0_m: f64,
    /// Metres of x for a metre of y.
    pub slope: f64,
}

impl Side {
    /// A limit that does not depend on y.
    #[must_use]
    pub fn upright(x_m: f64) -> Self {
        Self { x_at_0_m: x_m, slope: 0.0 }
    }
}
