//! Where a plan passes, and how long the shortest way from one such place to the next is.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use swath_core::geometry::Pose;
use wide::f32x4;

/// A pose in single precision, with what legs are computed from: metres and radians.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Spot {
    pub(super) x_m: f32,
    pub(super) y_m: f32,
    /// From -pi to pi.
    pub(super) heading_rad: f32,
    pub(super) cos: f32,
    pub(super) sin: f32,
}

impl Spot {
    pub(super) fn new(x_m: f64, y_m: f64, heading_rad: f64) -> Self {
        let heading_rad = swath_core::math::wrap_to_pi(heading_rad);
        let (sin, cos) = swath_core::math::sin_cos(heading_rad);
        Self {
            x_m: single(x_m),
            y_m: single(y_m),
            heading_rad: single(heading_rad),
            cos: single(cos),
            sin: single(sin),
        }
    }

    /// The same place with another direction, given by its cosine and sine.
    pub(super) fn facing(x_m: f32, y_m: f32, (cos, sin): (f32, f32)) -> Self {
        Self { x_m, y_m, heading_rad: atan2(sin, cos), cos, sin }
    }

    pub(super) fn pose(&self) -> Pose {
        Pose::new(self.x_m.into(), self.y_m.into(), self.heading_rad.into())
    }

    /// How far ahead of here and to the left another spot lies, metres.
    pub(super) fn offsets_to(&self, other: &Self) -> (f32, f32) {
        let (x_m, y_m) = (other.x_m - self.x_m, other.y_m - self.y_m);
        (self.cos * x_m + self.sin * y_m, self.cos * y_m - self.sin * x_m)
    }

    pub(super) fn distance_to(&self, other: &Self) -> f32 {
        let (x_m, y_m) = (other.x_m - self.x_m, other.y_m - self.y_m);
        (x_m * x_m + y_m * y_m).sqrt()
    }
}

impl From<Pose> for Spot {
    fn from(pose: Pose) -> Self {
        Self::new(pose.x_m, pose.y_m, pose.heading_rad)
    }
}

/// Cosine and sine of a heading.
pub(super) fn cos_sin(heading_rad: f32) -> (f32, f32) {
    let (sin, cos) = swath_core::math::sin_cos(heading_rad.into());
    (single(cos), single(sin))
}

/// A number in single precision: plans are compared by their lengths, to which that is a tenth of a millimetre.
#[expect(clippy::cast_possible_truncation, reason = "single precision is what is wanted")]
pub(super) fn single(number: f64) -> f32 {
    number as f32
}

/// Turns this close below a full circle are rounding, not a circle.
const PHANTOM_RAD: f32 = 1e-3;

/// Lengths of the shortest of the words with a straight, and of those of three turns, metres.
#[derive(Debug, Clone, Copy)]
pub(super) struct Legs {
    pub(super) with_straight: f32,
    /// Infinite where that is certainly not the shorter one.
    pub(super) of_three_turns: f32,
}

impl Legs {
    #[inline]
    pub(super) fn shortest(self) -> f32 {
        self.with_straight.min(self.of_three_turns)
    }
}

/// Lengths of shortest Dubins paths, to about a millimetre.
///
/// The four words with a straight are worked out at once: a straight is a tangent of two circles, and its direction tells both
/// turns. Then the two words of three turns, where the circles are close enough.
#[inline]
pub(super) fn legs_m(from: &Spot, to: &Spot, radius_m: f32) -> Legs {
    // LSL, RSR, LSR, RSL: on which side the first and the last turning centre lie, left positive.
    let first = f32x4::new([1.0, -1.0, 1.0, -1.0]);
    let last = f32x4::new([1.0, -1.0, -1.0, 1.0]);
    let gap = 2.0 * radius_m;
    let crossing = f32x4::new([0.0, 0.0, gap, -gap]);
    let x = (to.x_m - from.x_m) + (first * from.sin - last * to.sin) * radius_m;
    let y = (to.y_m - from.y_m) + (last * to.cos - first * from.cos) * radius_m;
    let apart = x * x + y * y;
    let squared = apart - crossing * crossing;
    let straight = squared.fast_max(f32x4::ZERO).sqrt();
    let along = atan2_of_four(x * crossing + y * straight, x * straight - y * crossing);
    let turns = turn_of_four(first * (along - from.heading_rad))
        + turn_of_four(last * (to.heading_rad - along));
    let is_missing = squared.simd_lt(f32x4::splat(-1e-4));
    let lengths = straight + turns * radius_m + (is_missing & f32x4::splat(1e9));
    let [lsl, rsr, lsr, rsl] = lengths.to_array();
    let shortest = lsl.min(rsr).min(lsr.min(rsl));
    let [left, right, ..] = apart.to_array();
    // A middle turn is more than half a circle.
    if shortest <= PI * radius_m || left.min(right) >= 4.0 * gap * gap {
        return Legs { with_straight: shortest, of_three_turns: f32::INFINITY };
    }
    let ([x_left, x_right, ..], [y_left, y_right, ..]) = (x.to_array(), y.to_array());
    let lrl = three_turns_m([x_left, -y_left], -from.heading_rad, -to.heading_rad, radius_m);
    let rlr = three_turns_m([x_right, y_right], from.heading_rad, to.heading_rad, radius_m);
    Legs { with_straight: shortest, of_three_turns: lrl.min(rlr) }
}

/// Length of a right, a left and a right turn, from the first right turning centre to the last.
fn three_turns_m([x, y]: [f32; 2], from_rad: f32, to_rad: f32, radius_m: f32) -> f32 {
    let cosine = (x * x + y * y).sqrt() / (4.0 * radius_m);
    if cosine > 1.0 {
        return f32::INFINITY;
    }
    let between = atan2((1.0 - cosine * cosine).sqrt(), cosine);
    let along = atan2(y, x);
    let first = turn(from_rad - along + between + FRAC_PI_2);
    let last = turn(along + between + FRAC_PI_2 - to_rad);
    radius_m * (first + PI + 2.0 * between + last)
}

/// An angle from -4 pi to 4 pi as a turn from 0 on.
fn turn(angle_rad: f32) -> f32 {
    let mut turn = angle_rad;
    while turn < 0.0 {
        turn += TAU;
    }
    while turn >= TAU - PHANTOM_RAD {
        turn -= TAU;
    }
    turn.max(0.0)
}

/// Angles from -2 pi to 2 pi as turns from 0 on.
#[inline]
fn turn_of_four(angles_rad: f32x4) -> f32x4 {
    let turns = angles_rad + (angles_rad.simd_lt(f32x4::ZERO) & f32x4::splat(TAU));
    turns & turns.simd_lt(f32x4::splat(TAU - PHANTOM_RAD))
}

/// The arc tangent of a quotient from 0 to 1, to 2e-6: Abramowitz & Stegun (1964), equation 4.4.49 with its eight terms.
macro_rules! arc_tangent {
    ($quotient:expr) => {{
        let quotient = $quotient;
        let square = quotient * quotient;
        let terms = square * 0.002_866_226 + -0.016_165_737;
        let terms = terms * square + 0.042_909_614;
        let terms = terms * square + -0.075_289_64;
        let terms = terms * square + 0.106_562_64;
        let terms = terms * square + -0.142_089;
        let terms = terms * square + 0.199_935_51;
        let terms = terms * square + -0.333_331_45;
        quotient + quotient * square * terms
    }};
}

#[inline]
pub(super) fn atan2(y: f32, x: f32) -> f32 {
    let (wide, high) = (x.abs(), y.abs());
    let (less, more) = if high > wide { (wide, high) } else { (high, wide) };
    let angle: f32 = arc_tangent!(less / more.max(1e-20));
    let angle = if high > wide { FRAC_PI_2 - angle } else { angle };
    let angle = if x < 0.0 { PI - angle } else { angle };
    if y < 0.0 { -angle } else { angle }
}

#[inline]
fn atan2_of_four(y: f32x4, x: f32x4) -> f32x4 {
    let (wide, high) = (x.abs(), y.abs());
    let (less, more) = (wide.fast_min(high), wide.fast_max(high));
    let angle = arc_tangent!(less / more.fast_max(f32x4::splat(1e-20)));
    let angle = high.simd_gt(wide).select(FRAC_PI_2 - angle, angle);
    let angle = x.simd_lt(f32x4::ZERO).select(PI - angle, angle);
    y.simd_lt(f32x4::ZERO).select(-angle, angle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use swath_core::geometry::shortest;
    use swath_core::rng::{agent_rng, uniform};

    #[test]
    fn a_leg_is_as_long_as_the_shortest_of_the_six_words() {
        let mut rng = agent_rng(1);
        let mut others = 0;
        for case in 0..200_000 {
            let reach_m = [2.0, 8.0, 100.0][case % 3];
            let mut at = || uniform(&mut rng);
            let radius_m = 0.5 + 4.0 * at();
            let from = Pose::new(reach_m * at(), reach_m * at(), 6.3 * at() - 3.15);
            let to = Pose::new(reach_m * at(), reach_m * at(), 6.3 * at() - 3.15);
            let exact_m = shortest(from, to, radius_m).unwrap().length_m();
            let got_m = f64::from(legs_m(&from.into(), &to.into(), single(radius_m)).shortest());
            others += u32::from((got_m - exact_m).abs() > 5e-3);
        }
        // Where two circles nearly touch, or a turn is nearly none, the shortest word changes from one pose to the next.
        assert!(others < 40, "{others} of 200000 legs have another length");
    }
}
