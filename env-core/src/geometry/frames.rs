//! A few frames, number by number.

use wide::f64x2;

use super::{Frame, Point, Pose};
use crate::math;

/// How many frames there are.
pub const FRAMES: usize = 6;

/// A few frames, which are worked out and tested two at a time.
#[derive(Debug, Clone, Copy)]
pub struct Frames([Pair; FRAMES / 2]);

/// The numbers of two frames.
#[derive(Debug, Clone, Copy)]
struct Pair {
    x_m: f64x2,
    y_m: f64x2,
    heading_rad: f64x2,
    cos: f64x2,
    sin: f64x2,
}

impl Frames {
    /// Where a mower stands after each of some ways on a circle of signed curvature `curvature_per_m`, which turn it by a
    /// radian at most: what [`Frame::advanced`] finds, to the last bit.
    #[must_use]
    pub fn along(start: &Frame, curvature_per_m: f64, ways_m: [f64; FRAMES]) -> Self {
        Self(std::array::from_fn(|pair| {
            let way_m = f64x2::new([ways_m[2 * pair], ways_m[2 * pair + 1]]);
            Pair::after(start, curvature_per_m, way_m)
        }))
    }

    /// One of them.
    ///
    /// # Panics
    ///
    /// If there is no such one.
    #[must_use]
    #[inline]
    pub fn at(&self, index: usize) -> Frame {
        let Pair { x_m, y_m, heading_rad, cos, sin } = &self.0[index / 2];
        let of = |numbers: &f64x2| numbers.as_array()[index % 2];
        Frame { pose: Pose::new(of(x_m), of(y_m), of(heading_rad)), cos: of(cos), sin: of(sin) }
    }

    /// From which of them a point of the world is at most `ahead_m` ahead, and not further to either side than so many
    /// times its offset ahead and `border_m`; lowest bit first.
    #[must_use]
    #[inline]
    pub fn in_cone(&self, point: Point, ahead_m: f64, side_per_m: f64, border_m: f64) -> u32 {
        let (x_m, y_m) = (f64x2::splat(point.x), f64x2::splat(point.y));
        self.0.iter().rev().fold(0, |bits, pair| {
            let (dx, dy) = (x_m - pair.x_m, y_m - pair.y_m);
            let ahead = pair.cos * dx + pair.sin * dy;
            let left = pair.cos * dy - pair.sin * dx;
            let is_near = ahead.simd_le(f64x2::splat(ahead_m));
            let is_beside = left.abs().simd_le(ahead * side_per_m + border_m);
            bits << 2 | (is_near & is_beside).to_bitmask()
        })
    }
}

impl Pair {
    #[inline]
    fn after(start: &Frame, curvature_per_m: f64, way_m: f64x2) -> Self {
        let Frame { pose, cos, sin } = *start;
        let (cos, sin) = (f64x2::splat(cos), f64x2::splat(sin));
        let half_turn = f64x2::splat(0.5 * curvature_per_m) * way_m;
        let (sinc, half_cos) = math::small_sinc_cos(half_turn);
        let (half_sin, chord_m) = (sinc * half_turn, way_m * sinc);
        let twice_half_sin = half_sin + half_sin;
        let (turn_cos, turn_sin) = (1.0 - twice_half_sin * half_sin, twice_half_sin * half_cos);
        Self {
            x_m: pose.x_m + chord_m * (cos * half_cos - sin * half_sin),
            y_m: pose.y_m + chord_m * (sin * half_cos + cos * half_sin),
            heading_rad: pose.heading_rad + (half_turn + half_turn),
            cos: cos * turn_cos - sin * turn_sin,
            sin: sin * turn_cos + cos * turn_sin,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bits(Frame { pose, cos, sin }: &Frame) -> [u64; 5] {
        [pose.x_m, pose.y_m, pose.heading_rad, *cos, *sin].map(f64::to_bits)
    }

    #[test]
    fn they_are_where_one_alone_would_be_to_the_last_bit() {
        for k in -50..=50 {
            let curvature_per_m = f64::from(k) * 0.01;
            let start = Frame::from(Pose::new(3.0, -2.0, f64::from(k)));
            let ways_m = [0.0, 0.1, 0.3, 0.7, 1.0, 2.0];
            let frames = Frames::along(&start, curvature_per_m, ways_m);
            for (i, way_m) in ways_m.into_iter().enumerate() {
                assert_eq!(bits(&frames.at(i)), bits(&start.advanced(curvature_per_m, way_m)));
            }
        }
    }
}
