//! Positions in a few bits, so that many are compared at once.

use std::ops::Range;

use wide::{i16x8, i32x4};

use crate::geometry::Point;
use crate::math::{larger, smaller};

/// The pasture's longer side in units: squared distances fit 32 bits.
const UNITS: f64 = 30_000.0;
/// Rounding two positions to whole units brings them closer by less than this, in units.
const SLACK_UNITS: f64 = 1.5;
/// Positions that are compared at once, and positions of a vector.
const BLOCK: usize = 16;
const VECTOR: usize = 4;

/// Positions on a pasture in whole units; those off it are moved onto its border, which takes no two of them apart.
#[derive(Debug, Clone)]
pub(super) struct RoughPositions {
    units_per_m: f64,
    blocks: Vec<[[i16; 2 * VECTOR]; BLOCK / VECTOR]>,
}

impl RoughPositions {
    /// Room for so many.
    pub(super) fn with_room(positions: usize) -> Self {
        let blocks = vec![[[0; 2 * VECTOR]; BLOCK / VECTOR]; positions.div_ceil(BLOCK)];
        Self { units_per_m: 0.0, blocks }
    }

    /// Chooses the unit for a pasture of that size; the positions so far lose their meaning.
    pub(super) fn scale(&mut self, (length_m, width_m): (f64, f64)) {
        self.units_per_m = UNITS / larger(length_m, width_m);
    }

    /// Writes a position.
    #[inline]
    pub(super) fn put(&mut self, place: usize, position: Point) {
        let [x, y] = self.in_units(position);
        let at = 2 * (place % VECTOR);
        let vector = &mut self.blocks[place / BLOCK][place % BLOCK / VECTOR];
        vector[at] = x;
        vector[at + 1] = y;
    }

    /// The blocks of the first `positions`.
    #[inline]
    pub(super) fn blocks(positions: usize) -> Range<usize> {
        0..positions.div_ceil(BLOCK)
    }

    /// The place that the lowest of a block's bits stands for.
    #[inline]
    pub(super) fn place(block: usize, bits: u32) -> usize {
        block * BLOCK + bits.trailing_zeros() as usize
    }

    /// All within a distance of a point.
    #[inline]
    pub(super) fn near(&self, point: Point, within_m2: f64) -> Near {
        let [x, y] = self.in_units(point);
        let is_x = i16x8::new([-1, 0, -1, 0, -1, 0, -1, 0]);
        let at = (i16x8::splat(x) & is_x) | (i16x8::splat(y) & !is_x);
        Near { at, end: self.end(within_m2) }
    }

    /// The squared distance in units from which on a position is certainly farther than that.
    #[inline]
    pub(super) fn end(&self, within_m2: f64) -> i32x4 {
        let units = within_m2.sqrt() * self.units_per_m + SLACK_UNITS;
        i32x4::splat(whole(smaller(units * units, f64::from(i32::MAX))))
    }

    /// Which places of a block are perhaps near, as bits.
    #[inline]
    pub(super) fn near_in(&self, block: usize, near: &Near) -> u32 {
        let beyond = self.blocks[block].map(|vector| {
            let offset = i16x8::new(vector) - near.at;
            offset.dot(offset) - near.end
        });
        // What is below 0 has its highest bit set.
        let [a, b, c, d] = beyond;
        if (a | b | c | d).to_bitmask() == 0 {
            return 0;
        }
        let bits = beyond.map(i32x4::to_bitmask);
        bits[0] | bits[1] << VECTOR | bits[2] << (2 * VECTOR) | bits[3] << (3 * VECTOR)
    }

    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "16 bits hold the units")]
    fn in_units(&self, position: Point) -> [i16; 2] {
        [position.x, position.y].map(|at_m| {
            whole(smaller(larger(at_m * self.units_per_m, 0.0), UNITS)) as i16
        })
    }
}

/// The ground within a distance of a point.
pub(super) struct Near {
    at: i16x8,
    pub(super) end: i32x4,
}

/// A number that 32 bits hold, rounded to a whole one.
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "the lowest 32 bits are wanted")]
fn whole(number: f64) -> i32 {
    // A number so large has no bits left for a fraction; its lowest ones are those of the whole number.
    const NO_FRACTION: f64 = 1.5 * (1_u64 << 52) as f64;
    (number + NO_FRACTION).to_bits() as i32
}
