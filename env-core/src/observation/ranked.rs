//! A place and how far away it is, as one number.

use wide::f64x2;

use crate::geometry::Point;

/// The lowest bits of a [`Ranked`], which hold its place.
const PLACES: u64 = (1 << 10) - 1;

/// A place, one of the first 1024, with the squared distance of what is there: places are sorted by one comparison of
/// whole numbers each.
///
/// The place takes the lowest bits of the distance, so it is known to 13 digits only.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
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
pub(super) fn sort(places: &mut [Ranked], is_before: impl Fn(Ranked, Ranked) -> bool) {
    if places.len() > FEW {
        places.sort_unstable_by_key(|place| place.0);
    }
    for rank in 1..places.len() {
        move_forward(&mut places[..=rank], &is_before);
    }
}

/// A few places by their distance to a point, the nearest first; those too close to tell come in any order.
#[inline]
pub(super) fn sorted(from: Point, positions: [Point; FEW]) -> [Ranked; FEW] {
    let from = f64x2::new([from.x, from.y]);
    let pairs = std::array::from_fn(|pair| {
        let squares = |place: usize| {
            let offset = f64x2::new([positions[place].x, positions[place].y]) - from;
            (offset * offset).to_array()
        };
        let (one, other) = (squares(2 * pair), squares(2 * pair + 1));
        let distance_m2 = f64x2::new([one[0], other[0]]) + f64x2::new([one[1], other[1]]);
        let place = [2 * pair as u64, 2 * pair as u64 + 1].map(f64::from_bits);
        distance_m2 & f64x2::splat(f64::from_bits(!PLACES)) | f64x2::new(place)
    });
    // As positive numbers they are sorted as they are as whole ones.
    in_sequence(pairs).map(|number| Ranked(number.to_bits()))
}

/// Whether no two neighbours among a few are too close to tell.
#[inline]
pub(super) fn are_few_certain(places: &[Ranked; FEW]) -> bool {
    let numbers = |first: usize| {
        f64x2::new([places[first], places[first + 1]].map(|place| f64::from_bits(place.0)))
    };
    let distances = f64x2::splat(f64::from_bits(!PLACES));
    let is_before = |first: usize, second: usize| {
        (numbers(first) & distances).simd_lt(numbers(second) & distances)
    };
    let all = is_before(0, 1) & is_before(2, 3) & is_before(4, 5) & is_before(5, 6);
    all.all()
}

/// Puts a place, which is nearer than the last one, into a sorted list of a few, whose last one is left out; returns which is
/// the last one now.
#[inline]
pub(super) fn replace_last_of_few(places: &mut [Ranked; FEW], place: Ranked) -> Ranked {
    // Where it belongs nothing is less than the one before, and the farther ones move on: no branch is needed.
    let numbers = places.map(|place| f64::from_bits(place.0));
    let number = f64x2::splat(f64::from_bits(place.0));
    for first in (0..FEW).step_by(2) {
        let before = if first == 0 { 0.0 } else { numbers[first - 1] };
        let [one, other] = f64x2::new([before, numbers[first]])
            .fast_max(f64x2::new([numbers[first], numbers[first + 1]]).fast_min(number))
            .to_array();
        places[first] = Ranked(one.to_bits());
        places[first + 1] = Ranked(other.to_bits());
    }
    places[FEW - 1]
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
fn in_sequence(mut column: [f64x2; FEW / 2]) -> [f64; FEW] {
    // Two columns of four, each sorted.
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

    /// Some of them as far away as each other.
    fn around(from: Point, rng: &mut StreamRng) -> [Point; FEW] {
        std::array::from_fn(|_| {
            let mut at = || (8.0 * uniform(rng)).round() - 4.0;
            Point::new(from.x + at(), from.y + at())
        })
    }

    #[test]
    fn a_few_are_sorted_by_the_distance_that_each_of_them_has() {
        let (mut rng, mut ties) = (stream(4, Stream::Weeds), 0);
        for _ in 0..2000 {
            let from = Point::new(9.0 * uniform(&mut rng), 9.0 * uniform(&mut rng));
            let positions = around(from, &mut rng);
            let distance_m2 = |place: usize| (positions[place] - from).norm_squared();
            let places = sorted(from, positions);
            let mut expected: Vec<Ranked> =
                (0..FEW).map(|place| Ranked::new(distance_m2(place), place)).collect();
            expected.sort_unstable();
            assert_eq!(places[..], expected[..]);
            let is_certain = places.windows(2).all(|pair| pair[0].is_before(pair[1]).is_some());
            assert_eq!(are_few_certain(&places), is_certain);
            ties += usize::from(!is_certain);
        }
        assert!((100..1900).contains(&ties), "{ties} of 2000 have some too close to tell");
    }

    #[test]
    fn a_nearer_place_takes_the_last_ones_and_stands_where_it_belongs() {
        let mut rng = stream(5, Stream::Weeds);
        for _ in 0..2000 {
            let from = Point::origin();
            let mut few = sorted(
                from,
                std::array::from_fn(|_| {
                    Point::new(9.0 * uniform(&mut rng), 9.0 * uniform(&mut rng))
                }),
            );
            let last = few[FEW - 1];
            let nearer = Ranked::new(last.at_most_m2() * uniform(&mut rng), last.place());
            let mut expected = few.to_vec();
            expected[FEW - 1] = nearer;
            expected.sort_unstable();
            assert_eq!(replace_last_of_few(&mut few, nearer), expected[FEW - 1]);
            assert_eq!(few[..], expected[..]);
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
