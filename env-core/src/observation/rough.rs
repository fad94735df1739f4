//! Positions in a few bits, so that many are compared at once.

use wide::i16x8;

use crate::geometry::Point;

/// The pasture's longer side in units: the squared distance of two positions fits 32 bits.
const UNITS: f64 = 30_000.0;
/// Positions in a block, which are compared at once, and in one of its vectors.
const BLOCK: usize = 16;
const VECTOR: usize = 4;

/// Positions on a pasture in whole units, rounded down; those off it are moved onto it.
///
/// Rounding brings two positions closer by less than the square root of two units, and moving them onto the pasture
/// never takes them apart: what is far in units is far.
#[derive(Debug, Clone)]
pub(super) struct RoughPositions {
    blocks: Vec<[[i16; 2 * VECTOR]; BLOCK / VECTOR]>,
}

impl RoughPositions {
    /// Room for so many.
    pub(super) fn with_room(positions: usize) -> Self {
        Self { blocks: vec![[[0; 2 * VECTOR]; BLOCK / VECTOR]; positions.div_ceil(BLOCK)] }
    }

    /// Writes a position on a pasture whose longer side is `longest_m`.
    #[inline]
    pub(super) fn put(&mut self, place: usize, position: Point, longest_m: f64) {
        let first = 2 * (place % VECTOR);
        let vector = &mut self.blocks[place / BLOCK][place % BLOCK / VECTOR];
        vector[first..first + 2].copy_from_slice(&in_units(position, longest_m));
    }

    /// Copies the position of one place to another.
    pub(super) fn copy(&mut self, from: usize, to: usize) {
        let first = 2 * (from % VECTOR);
        let vector = self.blocks[from / BLOCK][from % BLOCK / VECTOR];
        let first_to = 2 * (to % VECTOR);
        self.blocks[to / BLOCK][to % BLOCK / VECTOR][first_to..first_to + 2]
            .copy_from_slice(&vector[first..first + 2]);
    }

    /// Which positions of a block are perhaps within `near`, as bits.
    #[inline]
    pub(super) fn within(&self, block: usize, near: &Near) -> u32 {
        let beyond = self.blocks[block].map(|vector| {
            let offset = i16x8::new(vector) - near.at;
            offset.dot(offset) - near.end
        });
        let any = beyond.iter().fold(wide::i32x4::ZERO, |any, &vector| any | vector);
        if any.to_bitmask() == 0 {
            return 0;
        }
        (0..).zip(beyond).fold(0, |bits, (i, vector): (u32, _)| bits | vector.to_bitmask() << (4 * i))
    }

    /// The blocks that hold the first `positions`.
    pub(super) fn blocks(positions: usize) -> std::ops::Range<usize> {
        0..positions.div_ceil(BLOCK)
    }

    /// The first place of a block.
    pub(super) fn first(block: usize) -> usize {
        block * BLOCK
    }
}

/// The ground near a point.
pub(super) struct Near {
    at: i16x8,
    /// The squared distance in units from which on a position is not near.
    end: wide::i32x4,
}

impl Near {
    /// All within a squared distance of `limit_m2` from `from`, on a pasture whose longer side is `longest_m`.
    #[inline]
    pub(super) fn new(from: Point, limit_m2: f64, longest_m: f64) -> Self {
        let [x, y] = in_units(from, longest_m);
        let mut near = Self { at: i16x8::new([x, y, x, y, x, y, x, y]), end: wide::i32x4::ZERO };
        near.limit(limit_m2, longest_m);
        near
    }

    /// Replaces the limit.
    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "the cast saturates, which is what is wanted")]
    pub(super) fn limit(&mut self, limit_m2: f64, longest_m: f64) {
        let limit = limit_m2.sqrt() * (UNITS / longest_m) + 1.5;
        self.end = wide::i32x4::splat((limit * limit) as i32);
    }
}

#[inline]
#[expect(clippy::cast_possible_truncation, reason = "the numbers are clamped")]
fn in_units(position: Point, longest_m: f64) -> [i16; 2] {
    let units = |at_m: f64| (at_m * (UNITS / longest_m)).clamp(0.0, UNITS) as i32 as i16;
    [units(position.x), units(position.y)]
}
