//! Positions in a few bits, so that many are compared at once.

use smallvec::SmallVec;
use wide::{f64x2, i16x8, i16x16, i32x8};

use crate::geometry::Point;
use crate::math::{larger, smaller};

/// The pasture's longer side in units: squared distances fit 32 bits.
const UNITS: f64 = 30_000.0;
/// Rounding two positions to whole units moves them apart by up to the root of 2, in units; the rest makes up for a squared
/// distance that is rounded to a whole number as well.
const SLACK_UNITS: f64 = 1.7;
/// A number so large has no bits left for a fraction; its lowest ones are those of the whole number.
const NO_FRACTION: f64 = 1.5 * (1_u64 << 52) as f64;
/// Positions of a group, which are compared at once, and those of a vector.
pub(super) const GROUP: usize = 16;
const VECTOR: usize = 8;

/// Positions on a pasture in whole units, each in a place of its own; those off the pasture are moved onto its border, which
/// takes no two of them apart.
#[derive(Debug, Clone)]
pub(super) struct RoughPositions {
    units_per_m: f64,
    /// Whole groups.
    places: SmallVec<[[i16; 2]; NEAR_PLACES]>,
}

/// So many places lie within, and no further memory has to be fetched: those of eight weeds that are listed.
const NEAR_PLACES: usize = 128;

impl RoughPositions {
    /// Room for so many.
    pub(super) fn with_room(positions: usize) -> Self {
        let places = positions.next_multiple_of(GROUP);
        Self { units_per_m: 0.0, places: SmallVec::from_elem([0; 2], places) }
    }

    /// Chooses the unit for a pasture of that size; the positions so far lose their meaning.
    pub(super) fn scale(&mut self, (length_m, width_m): (f64, f64)) {
        self.units_per_m = UNITS / larger(length_m, width_m);
    }

    /// Writes a position.
    pub(super) fn write(&mut self, place: usize, position: Point) {
        self.places[place] = self.in_units(position);
    }

    /// Exchanges the positions of two places.
    pub(super) fn swap(&mut self, one: usize, other: usize) {
        self.places.swap(one, other);
    }

    /// The positions, group by group.
    #[inline]
    pub(super) fn groups(&mut self) -> &mut [[[i16; 2]; GROUP]] {
        self.places.as_chunks_mut().0
    }

    /// All within a distance of a point.
    #[inline]
    pub(super) fn near(&self, point: Point, within_m2: f64) -> Near {
        let [x, y] = self.in_units(point);
        let units = within_m2.sqrt() * self.units_per_m + SLACK_UNITS;
        Near {
            at: i16x16::new([x, y, x, y, x, y, x, y, x, y, x, y, x, y, x, y]),
            end: i32x8::splat(whole(smaller(units * units, f64::from(i32::MAX)))),
        }
    }

    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "16 bits hold the units")]
    fn in_units(&self, position: Point) -> [i16; 2] {
        let units = f64x2::new([position.x, position.y]) * f64x2::splat(self.units_per_m);
        let units = units.fast_max(f64x2::ZERO).fast_min(f64x2::splat(UNITS));
        (units + f64x2::splat(NO_FRACTION)).to_array().map(|units| units.to_bits() as i16)
    }
}

/// The ground within a distance of a point.
pub(super) struct Near {
    at: i16x16,
    /// From this squared distance in units on a position is certainly farther.
    end: i32x8,
}

impl Near {
    /// Which positions of a group are perhaps near, as bits.
    #[inline]
    pub(super) fn find_in(&self, group: &[[i16; 2]; GROUP]) -> u32 {
        // What is below 0 has its highest bit set, which narrowing leaves.
        let below = |places: &[[i16; 2]]| {
            let vector = places.as_flattened().try_into().expect("16 numbers");
            let offset = i16x16::new(vector) - self.at;
            i16x8::from_i32x8_saturate(offset.dot(offset) - self.end).to_array()
        };
        let (one, other) = (below(&group[..VECTOR]), below(&group[VECTOR..]));
        let both: [i16; GROUP] =
            std::array::from_fn(|i| if i < VECTOR { one[i] } else { other[i - VECTOR] });
        i16x16::new(both).to_bitmask()
    }
}

/// A number that 32 bits hold, rounded to a whole one.
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "the lowest 32 bits are wanted")]
fn whole(number: f64) -> i32 {
    (number + NO_FRACTION).to_bits() as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Stream, stream, uniform};

    /// Whether a position is perhaps near.
    fn is_near(rough: &mut RoughPositions, place: usize, near: &Near) -> bool {
        near.find_in(&rough.groups()[place / GROUP]) >> (place % GROUP) & 1 == 1
    }

    #[test]
    fn positions_less_than_a_few_units_apart_are_near_each_other() {
        let mut rough = RoughPositions::with_room(1);
        rough.scale((UNITS, 10.0));
        let mut rng = stream(6, Stream::Weeds);
        let mut somewhere = |around: f64| {
            Point::new(around + 4.0 * uniform(&mut rng), 1.0 + 4.0 * uniform(&mut rng))
        };
        for place in 0..20_000 {
            let (from, position) = (somewhere(f64::from(place)), somewhere(f64::from(place)));
            rough.write(0, position);
            let near = rough.near(from, (position - from).norm_squared());
            assert!(is_near(&mut rough, 0, &near), "{position} from {from}");
        }
        // On either side of where rounding goes up.
        let (from, position) = (Point::new(0.499, 0.499), Point::new(0.501, 0.501));
        rough.write(0, position);
        let near = rough.near(from, (position - from).norm_squared());
        assert!(is_near(&mut rough, 0, &near));
    }

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
                rough.write(place, position);
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
                    let is_near = is_near(&mut rough, place, &near);
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
