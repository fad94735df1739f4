//! A piece of a path with constant curvature.

use std::f64::consts::{FRAC_PI_2, PI};

use super::{Point, Pose};
use crate::math::wrap_to_tau;

/// Headings in which a turn passes its outermost points, rad.
const ALONG_AXES: [f64; 4] = [0.0, FRAC_PI_2, PI, -FRAC_PI_2];

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

    /// Corners of the smallest rectangle along the axes that holds the piece: least and greatest x and y, metres.
    #[must_use]
    pub fn bounds(&self) -> (Point, Point) {
        let (start, end) = (self.start.position(), self.end().position());
        let (mut least, mut most) = (start.inf(&end), start.sup(&end));
        if self.curvature_per_m != 0.0 {
            let turned_rad = self.length_m * self.curvature_per_m.abs();
            for along_rad in ALONG_AXES {
                let to_rad = (along_rad - self.start.heading_rad) * self.curvature_per_m.signum();
                let to_rad = wrap_to_tau(to_rad);
                if to_rad < turned_rad {
                    let outermost = self.at(to_rad / self.curvature_per_m.abs()).position();
                    (least, most) = (least.inf(&outermost), most.sup(&outermost));
                }
            }
        }
        (least, most)
    }
}
