//! A pose whose direction is at hand.

use super::{Point, Pose};
use crate::math;

/// A pose with the cosine and sine of its heading: what the step passes on, so that they are computed once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// The pose.
    pub pose: Pose,
    /// Cosine of its heading.
    pub cos: f64,
    /// Sine of its heading.
    pub sin: f64,
}

impl From<Pose> for Frame {
    fn from(pose: Pose) -> Self {
        let (sin, cos) = math::sin_cos(pose.heading_rad);
        Self { pose, cos, sin }
    }
}

impl Frame {
    /// Where the mower stands after `distance_m` on a circle of signed curvature `curvature_per_m` (left positive).
    ///
    /// Exact for any distance, straight lines included: the chord has length `s sinc(k s / 2)` and direction `heading + k s / 2`.
    #[must_use]
    pub fn advanced(&self, curvature_per_m: f64, distance_m: f64) -> Self {
        let half_turn_rad = 0.5 * curvature_per_m * distance_m;
        let (half_sin, half_cos, chord_m) = if half_turn_rad.abs() <= math::SMALL_RAD {
            let (sinc, cos) = math::small_sinc_cos(half_turn_rad);
            (sinc * half_turn_rad, cos, distance_m * sinc)
        } else {
            let (sin, cos) = math::sin_cos(half_turn_rad);
            (sin, cos, distance_m * (sin / half_turn_rad))
        };
        let along =
            (self.cos * half_cos - self.sin * half_sin, self.sin * half_cos + self.cos * half_sin);
        let (turn_cos, turn_sin) = (1.0 - 2.0 * half_sin * half_sin, 2.0 * half_sin * half_cos);
        let Self { pose, .. } = self.moved(chord_m, along.0, along.1);
        Self {
            pose: Pose { heading_rad: pose.heading_rad + 2.0 * half_turn_rad, ..pose },
            cos: self.cos * turn_cos - self.sin * turn_sin,
            sin: self.sin * turn_cos + self.cos * turn_sin,
        }
    }

    /// The same heading, `distance_m` further in the direction given.
    fn moved(&self, distance_m: f64, cos: f64, sin: f64) -> Self {
        let Pose { x_m, y_m, heading_rad } = self.pose;
        Self {
            pose: Pose::new(x_m + distance_m * cos, y_m + distance_m * sin, heading_rad),
            ..*self
        }
    }

    /// Forward and left offset of a point of the world, metres.
    #[must_use]
    #[inline]
    pub fn offsets_to(&self, point: Point) -> (f64, f64) {
        let (dx, dy) = (point.x - self.pose.x_m, point.y - self.pose.y_m);
        (self.cos * dx + self.sin * dy, self.cos * dy - self.sin * dx)
    }
}
