//! Elementary functions whose bytes are the same on every machine.
//!
//! The system's `sin`, `cos`, `atan2`, `acos` and `ln` may round differently elsewhere, so all of them go through `libm` here.
//! A square root is exact by IEEE 754 and needs no care.

use std::f64::consts::{PI, TAU};
use std::ops::{Add, Mul};

use wide::f64x2;

/// Sine and cosine of `angle_rad`.
#[must_use]
pub fn sin_cos(angle_rad: f64) -> (f64, f64) {
    libm::sincos(angle_rad)
}

/// Angles up to this one are small, radians: half a radian, and what rounding may add to it.
pub const SMALL_RAD: f64 = 0.51;

/// Quotient of the sine by the angle, and the cosine, of a small angle, or of a few at once.
///
/// Taylor's series, whose next terms are below 1e-18 there: a third of the work of [`sin_cos`].
#[must_use]
#[inline]
pub fn small_sinc_cos<T>(angle_rad: T) -> (T, T)
where
    T: Copy + From<f64> + Add<Output = T> + Mul<Output = T>,
{
    // The factorial of an odd number, and that of the even number before it.
    const fn factorials(n: u64) -> (f64, f64) {
        let (mut even, mut i) = (1.0, 1);
        while i < n {
            even *= i as f64;
            i += 1;
        }
        (even * n as f64, even)
    }
    const TERMS: [(f64, f64); 8] = {
        let mut terms = [(1.0, 1.0); 8];
        let mut n = 1;
        while n < 8 {
            let (odd, even) = factorials(2 * n as u64 + 1);
            let sign = if n % 2 == 0 { 1.0 } else { -1.0 };
            terms[n] = (sign / odd, sign / even);
            n += 1;
        }
        terms
    };
    let square = angle_rad * angle_rad;
    let (of_sinc, of_cos) = TERMS[TERMS.len() - 1];
    TERMS.iter().rev().skip(1).fold(
        (of_sinc.into(), of_cos.into()),
        |(sinc, cos), &(of_sinc, of_cos)| {
            (sinc * square + of_sinc.into(), cos * square + of_cos.into())
        },
    )
}

/// Angle of the vector (`x`, `y`) in [-pi, pi].
#[must_use]
pub fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

/// Arc cosine in [0, pi]; the argument is clamped to [-1, 1], since it comes from a quotient that rounding may push over.
#[must_use]
pub fn acos(cosine: f64) -> f64 {
    libm::acos(cosine.clamp(-1.0, 1.0))
}

/// Natural logarithm.
#[must_use]
pub fn ln(value: f64) -> f64 {
    libm::log(value)
}

/// The same angle in [0, 2 pi).
#[must_use]
pub fn wrap_to_tau(angle_rad: f64) -> f64 {
    let wrapped = angle_rad.rem_euclid(TAU);
    if wrapped >= TAU { 0.0 } else { wrapped }
}

/// The same angle in [-pi, pi).
#[must_use]
pub fn wrap_to_pi(angle_rad: f64) -> f64 {
    if (-PI..PI).contains(&angle_rad) {
        return angle_rad;
    }
    wrap_to_tau(angle_rad + PI) - PI
}

/// Rounds a count or index below two thousand million towards zero; negative values and NaN give 0.
#[must_use]
#[inline]
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the cast saturates, which is what is wanted"
)]
pub fn floor_index(value: f64) -> usize {
    // By way of i32, which is one instruction on most machines; u64 takes a dozen.
    (value as i32).max(0) as usize
}

/// Rounds two numbers towards zero, as [`floor_index`] does, in less than half its instructions; but of a whole number it
/// may be the one before.
#[must_use]
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "the lowest 32 bits are wanted")]
pub fn floor_indices(values: [f64; 2]) -> [usize; 2] {
    // A number so large has no bits left for a fraction; its lowest ones are those of the whole number.
    const NO_FRACTION: f64 = 1.5 * (1_u64 << 52) as f64;
    let nearest = f64x2::new(values) - f64x2::splat(0.5);
    let nearest = nearest.fast_max(f64x2::ZERO).fast_min(f64x2::splat(2e9));
    (nearest + f64x2::splat(NO_FRACTION)).to_array().map(|value| value.to_bits() as u32 as usize)
}

/// The number of a cell, or a count, below four thousand million. Two instructions, where a cast takes half a dozen.
#[must_use]
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "grids have far fewer cells")]
pub fn number(index: usize) -> f64 {
    f64::from(index as u32)
}

/// The larger of two numbers; the second if either is NaN. One instruction, where `f64::max` takes several.
#[must_use]
#[inline]
pub fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The smaller of two numbers; the second if either is NaN.
#[must_use]
#[inline]
pub fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_angles_have_the_sine_and_cosine_that_all_angles_have() {
        for k in -510..=510 {
            let angle = f64::from(k) * 1e-3;
            let ((sinc, cos), (sine, cosine)) = (small_sinc_cos(angle), sin_cos(angle));
            assert!((sinc * angle - sine).abs() < 1.2e-16, "{angle}");
            assert!((cos - cosine).abs() < 1.2e-16, "{angle}");
        }
    }

    #[test]
    fn two_indices_at_once_are_those_of_each_or_that_before_a_whole_number() {
        for value in [-1e300, -3.7, -0.2, 0.0, 0.4, 0.5, 0.9, 1.1, 1.5, 2.999, 3e5 + 0.5, 1.9e9] {
            assert_eq!(floor_indices([value, 7.5]), [floor_index(value), 7], "{value}");
            assert_eq!(floor_indices([6.3, value]), [6, floor_index(value)], "{value}");
        }
        for value in 1..9_u32 {
            let [index, _] = floor_indices([f64::from(value), f64::INFINITY]);
            assert!(index == value as usize || index + 1 == value as usize, "{value}");
        }
    }

    #[test]
    fn wrapped_angles_stay_in_their_half_open_ranges() {
        for k in -9..=9 {
            for offset in [-1e-17, 0.0, 1e-17, 1.0] {
                let angle = f64::from(k) * PI + offset;
                assert!((0.0..TAU).contains(&wrap_to_tau(angle)), "{angle}");
                assert!((-PI..PI).contains(&wrap_to_pi(angle)), "{angle}");
            }
        }
    }
}
