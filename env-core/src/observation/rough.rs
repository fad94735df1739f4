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
        [position.x, position.y]
            .map(|at_m| whole(smaller(larger(at_m * self.units_per_m, 0.0), UNITS)) as i16)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Stream, stream, uniform};

    #[test]
    fn no_position_within_the_distance_is_missed() {
        let mut rng = stream(5, Stream::Weeds);
        for size_m in [(100.0, 40.0), (3.0, 70.0), (2000.0, 2000.0)] {
            let mut rough = RoughPositions::with_room(40);
            rough.scale(size_m);
            let mut anywhere = |beyond: f64| {
                let mut at =
                    |size_m: f64| size_m * ((1.0 + 2.0 * beyond) * uniform(&mut rng) - beyond);
                Point::new(at(size_m.0), at(size_m.1))
            };
            let positions: Vec<Point> = (0..40).map(|_| anywhere(0.0)).collect();
            for (place, &position) in positions.iter().enumerate() {
                rough.put(place, position);
            }
            for _ in 0..200 {
                let from = anywhere(0.5);
                let distances_m2 = positions.iter().map(|at| (at - from).norm_squared());
                let mut sorted: Vec<f64> = distances_m2.clone().collect();
                sorted.sort_by(f64::total_cmp);
                // Just as far as one of them, so that a rounding either way would lose it.
                let near = rough.near(from, sorted[12]);
                let mut found = 0;
                for (place, distance_m2) in distances_m2.enumerate() {
                    let is_near = rough.near_in(place / BLOCK, &near) >> (place % BLOCK) & 1 == 1;
                    assert!(is_near || distance_m2 > sorted[12], "{place} from {from}");
                    found += usize::from(is_near);
                }
                let is_inside =
                    from.x > 0.0 && from.x < size_m.0 && from.y > 0.0 && from.y < size_m.1;
                assert!(!is_inside || found < 20, "{found} of 40 are near {from}");
            }
        }
    }
}
