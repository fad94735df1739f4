//! A place and how far away it is, as one number.

use wide::f64x2;

/// The lowest bits of a [`Ranked`], which hold its place.
const PLACES: u64 = (1 << 10) - 1;

/// A place, one of the first 1024, with the squared distance of what is there: places are sorted by one comparison of
/// whole numbers each.
///
/// The place takes the lowest bits of the distance, so it is known to 13 digits only.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Ranked(u64);

impl Ranked {
    /// A place and a squared distance, metres.
    #[inline]
    pub(super) fn new(distance_m2: f64, place: usize) -> Self {
        // Positive numbers are sorted as their bits are.
        Self(distance_m2.to_bits() & !PLACES | place as u64)
    }

    /// The place.
    #[inline]
    pub(super) fn place(self) -> usize {
        (self.0 & PLACES) as usize
    }

    /// Not less than the squared distance.
    #[inline]
    pub(super) fn at_most_m2(self) -> f64 {
        f64::from_bits(self.0 | PLACES)
    }

    /// Whether it is nearer than another; `None` if they are too close to tell.
    #[inline]
    pub(super) fn is_before(self, other: Self) -> Option<bool> {
        (self.0 ^ other.0 > PLACES).then_some(self.0 < other.0)
    }
}

/// So many places are sorted without a branch.
pub(super) const FEW: usize = 8;

/// Sorts places, the nearest first. `is_before` is asked of those that are too close to tell.
#[inline]
pub(super) fn sort(places: &mut [Ranked], is_before: impl Fn(Ranked, Ranked) -> bool) {
    if let Ok(eight) = <&mut [Ranked; FEW]>::try_from(&mut *places) {
        // As positive numbers they are sorted as they are as whole ones.
        let numbers = eight.map(|place| f64::from_bits(place.0));
        *eight = sorted(numbers).map(|number| Ranked(number.to_bits()));
    } else {
        places.sort_unstable_by_key(|place| place.0);
    }
    if places.windows(2).any(|pair| pair[0].is_before(pair[1]).is_none()) {
        for rank in 1..places.len() {
            move_forward(&mut places[..=rank], &is_before);
        }
    }
}

/// Puts a place into a sorted list, whose last one is left out; returns which is the last one now.
#[inline]
pub(super) fn replace_last(
    places: &mut [Ranked],
    place: Ranked,
    is_before: impl Fn(Ranked, Ranked) -> bool,
) -> Ranked {
    let last = places.len() - 1;
    places[last] = place;
    move_forward(places, &is_before);
    places[last]
}

/// Moves the last place of a list that is sorted up to it to where it belongs.
#[inline]
fn move_forward(places: &mut [Ranked], is_before: &impl Fn(Ranked, Ranked) -> bool) {
    let mut rank = places.len() - 1;
    let place = places[rank];
    while rank > 0
        && place.is_before(places[rank - 1]).unwrap_or_else(|| is_before(place, places[rank - 1]))
    {
        places[rank] = places[rank - 1];
        rank -= 1;
    }
    places[rank] = place;
}

/// Numbers sorted by comparing fixed pairs of them, two pairs at once: no processor could foresee which way they turn out.
#[inline]
fn sorted(numbers: [f64; FEW]) -> [f64; FEW] {
    // Two columns of four, each sorted.
    let mut column: [f64x2; 4] =
        std::array::from_fn(|i| f64x2::new([numbers[2 * i], numbers[2 * i + 1]]));
    for (one, other) in [(0, 2), (1, 3), (0, 1), (2, 3), (1, 2)] {
        (column[one], column[other]) = in_order(column[one], column[other]);
    }
    // The first one against the second one backwards: the lower half and the upper half (Batcher, 1968, "Sorting Networks
    // and Their Applications").
    let rows = column.map(f64x2::to_array);
    let pair =
        |first: usize, second: usize, of: usize| f64x2::new([rows[first][of], rows[second][of]]);
    let (low, high) = in_order(pair(0, 1, 0), pair(3, 2, 1));
    let (low_too, high_too) = in_order(pair(2, 3, 0), pair(1, 0, 1));
    // Each half goes up and down again.
    let half = |one: f64x2, other: f64x2| {
        let (low, high) = in_order(one, other);
        let ([first, second], [third, fourth]) = (low.to_array(), high.to_array());
        let (even, odd) = in_order(f64x2::new([first, third]), f64x2::new([second, fourth]));
        let ([first, third], [second, fourth]) = (even.to_array(), odd.to_array());
        [first, second, third, fourth]
    };
    let (lower, upper) = (half(low, low_too), half(high, high_too));
    std::array::from_fn(|i| if i < 4 { lower[i] } else { upper[i - 4] })
}

/// The smaller numbers of two pairs, and the larger ones.
#[inline]
fn in_order(one: f64x2, other: f64x2) -> (f64x2, f64x2) {
    (one.fast_min(other), one.fast_max(other))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Stream, StreamRng, stream, uniform};

    #[test]
    fn places_are_sorted_by_distance_unless_it_is_the_same_to_thirteen_digits() {
        let distances_m2 = [0.0, 1e-300, 0.3, 1.0, 1.0 + 1e-12, 2.0, 1e6, 1e300];
        for (one, &near_m2) in distances_m2.iter().enumerate() {
            for (other, &far_m2) in distances_m2.iter().enumerate().skip(one + 1) {
                let (near, far) = (Ranked::new(near_m2, 1023 - one), Ranked::new(far_m2, other));
                assert_eq!(near.is_before(far), Some(true), "{near_m2} {far_m2}");
                assert_eq!(far.is_before(near), Some(false), "{near_m2} {far_m2}");
            }
            let same = Ranked::new(near_m2 * (1.0 + 1e-15), 7);
            assert_eq!(Ranked::new(near_m2, one).is_before(same), None, "{near_m2}");
        }
    }

    #[test]
    fn few_places_and_many_are_sorted_by_distance() {
        let mut rng = stream(3, Stream::Weeds);
        for count in (0..=9).chain([40]) {
            for _ in 0..200 {
                // Some are as far away as each other: then the place decides.
                let distance_m2 = |rng: &mut StreamRng| (6.0 * uniform(rng)).round().max(1.0);
                let mut places: Vec<Ranked> =
                    (0..count).map(|i| Ranked::new(distance_m2(&mut rng), i ^ 1)).collect();
                let mut expected: Vec<u64> = places.iter().map(|place| place.0).collect();
                expected.sort_unstable();
                sort(&mut places, |one, other| one.place() < other.place());
                assert_eq!(places.iter().map(|place| place.0).collect::<Vec<_>>(), expected);
            }
        }
    }

    #[test]
    fn a_place_is_kept_and_its_distance_not_understated() {
        for (distance_m2, place) in [(0.0, 0), (0.1, 1023), (12.34, 511), (1e9, 1)] {
            let ranked = Ranked::new(distance_m2, place);
            assert_eq!(ranked.place(), place);
            let most_m2 = ranked.at_most_m2();
            assert!((distance_m2..=distance_m2 * (1.0 + 1e-12) + 1e-300).contains(&most_m2));
        }
    }
}
