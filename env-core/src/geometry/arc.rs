//! A piece of a path with constant curvature.

use super::Pose;

/// A circular arc, or a straight line when the curvature is 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// Where the piece begins.
    pub start: Pose,
    /// Signed curvature, 1/m, left positive.
    pub curvature_per_m: f64,
    /// Length along the piece, metres.
    pub length_m: f64,
}

impl Arc {
    /// The pose after `distance_m` along the piece.
    #[must_use]
    pub fn at(&self, distance_m: f64) -> Pose {
        self.start.advanced(self.curvature_per_m, distance_m)
    }

    /// The pose at the end of the piece.
    #[must_use]
    pub fn end(&self) -> Pose {
        self.at(self.length_m)
    }
}
