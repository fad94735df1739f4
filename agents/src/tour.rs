//! The order in which to visit points: an open tour from a fixed start, by straight distances.

use swath_core::geometry::Point;

/// Up to this many points the order is exact.
const EXACT_POINTS: usize = 12;

/// The order in which to visit `points` from `start`, as indexes.
///
/// Exact up to 12 points (Held & Karp, 1962); beyond, nearest neighbour improved by 2-opt and Or-opt (moves of up to three
/// points, either way round) until neither finds a shorter tour. Ties go to the lower index, so the order repeats.
#[must_use]
pub fn open_tour(start: Point, points: &[Point]) -> Vec<usize> {
    let distances = Distances::new(start, points);
    if points.len() <= EXACT_POINTS {
        exact(&distances)
    } else {
        improved(&distances, nearest_neighbour(&distances))
    }
}

/// Length of the tour from `start` through `points` in `order`, metres.
#[must_use]
pub fn tour_length(start: Point, points: &[Point], order: &[usize]) -> f64 {
    order
        .iter()
        .map(|&index| points[index])
        .fold((0.0, start), |(sum, from), to| (sum + (to - from).norm(), to))
        .0
}

/// Up to this many points a table of distances is kept, 32 MB at most; beyond, they are computed when asked for.
const TABLE_POINTS: usize = 2_000;

/// Distances between all points; the start is the last one.
struct Distances {
    count: usize,
    points: Vec<Point>,
    table: Vec<f64>,
}

impl Distances {
    fn new(start: Point, points: &[Point]) -> Self {
        let count = points.len();
        let points: Vec<Point> = points.iter().copied().chain([start]).collect();
        let pairs = points.iter().flat_map(|from| points.iter().map(move |to| (to - from).norm()));
        let table = if count <= TABLE_POINTS { pairs.collect() } else { Vec::new() };
        Self { count, points, table }
    }

    fn start(&self) -> usize {
        self.count
    }

    fn between(&self, from: usize, to: usize) -> f64 {
        let kept = self.table.get(from * (self.count + 1) + to);
        kept.copied().unwrap_or_else(|| (self.points[to] - self.points[from]).norm())
    }
}

fn exact(distances: &Distances) -> Vec<usize> {
    let count = distances.count;
    if count == 0 {
        return Vec::new();
    }
    // best[set][last]: shortest way from the start through `set`, ending at `last`, and the point before it.
    let mut best = vec![(f64::INFINITY, usize::MAX); (1 << count) * count];
    for last in 0..count {
        best[(1 << last) * count + last] = (distances.between(distances.start(), last), usize::MAX);
    }
    for set in 1_usize..1 << count {
        for last in (0..count).filter(|last| set >> last & 1 == 1) {
            let length = best[set * count + last].0;
            for next in (0..count).filter(|next| set >> next & 1 == 0) {
                let longer = length + distances.between(last, next);
                let entry = &mut best[(set | 1 << next) * count + next];
                if longer < entry.0 {
                    *entry = (longer, last);
                }
            }
        }
    }
    let mut set = (1 << count) - 1;
    let mut last = (0..count)
        .min_by(|&a, &b| best[set * count + a].0.total_cmp(&best[set * count + b].0))
        .expect("there are points");
    let mut order = Vec::with_capacity(count);
    while last != usize::MAX {
        order.push(last);
        let before = best[set * count + last].1;
        set &= !(1 << last);
        last = before;
    }
    order.reverse();
    order
}

fn nearest_neighbour(distances: &Distances) -> Vec<usize> {
    let mut open: Vec<usize> = (0..distances.count).collect();
    let mut order = Vec::with_capacity(distances.count);
    let mut at = distances.start();
    while !open.is_empty() {
        let nearest = (0..open.len())
            .min_by(|&a, &b| {
                distances.between(at, open[a]).total_cmp(&distances.between(at, open[b]))
            })
            .expect("a point is open");
        at = open.remove(nearest);
        order.push(at);
    }
    order
}

fn improved(distances: &Distances, mut order: Vec<usize>) -> Vec<usize> {
    while two_opt(distances, &mut order) || or_opt(distances, &mut order) {}
    order
}

/// Gains below this are rounding, metres.
const GAIN_M: f64 = 1e-9;

/// Reverses runs that get shorter that way; returns whether any did.
fn two_opt(distances: &Distances, order: &mut [usize]) -> bool {
    let mut has_gained = false;
    for first in 0..order.len() {
        let before = if first == 0 { distances.start() } else { order[first - 1] };
        for last in first + 1..order.len() {
            let mut gain_m =
                distances.between(before, order[first]) - distances.between(before, order[last]);
            if let Some(&after) = order.get(last + 1) {
                gain_m +=
                    distances.between(order[last], after) - distances.between(order[first], after);
            }
            if gain_m > GAIN_M {
                order[first..=last].reverse();
                has_gained = true;
            }
        }
    }
    has_gained
}

/// Moves runs of up to three points to where they cost less; returns whether any moved.
fn or_opt(distances: &Distances, order: &mut Vec<usize>) -> bool {
    let mut has_gained = false;
    for length in 1..=3 {
        let mut first = 0;
        while first + length <= order.len() {
            if let Some((place, is_reversed)) = better_place(distances, order, first, length) {
                let mut run: Vec<usize> = order.drain(first..first + length).collect();
                if is_reversed {
                    run.reverse();
                }
                order.splice(place..place, run);
                has_gained = true;
            }
            first += 1;
        }
    }
    has_gained
}

/// Where the run would cost least, as a place in the order without the run, and whether to turn it round.
fn better_place(
    distances: &Distances,
    order: &[usize],
    first: usize,
    length: usize,
) -> Option<(usize, bool)> {
    let (head, tail) = (order[first], order[first + length - 1]);
    let before = if first == 0 { distances.start() } else { order[first - 1] };
    let after = order.get(first + length).copied();
    let saved_m = distances.between(before, head)
        + after
            .map_or(0.0, |after| distances.between(tail, after) - distances.between(before, after));
    let mut best: Option<(f64, usize, bool)> = None;
    // A gap is named by the point behind which it lies, in the order without the run.
    let rest = order.len() - length;
    let without = |place: usize| if place < first { order[place] } else { order[place + length] };
    for place in (0..=rest).filter(|&place| place != first) {
        let left = if place == 0 { distances.start() } else { without(place - 1) };
        let right = (place < rest).then(|| without(place));
        for (is_reversed, near, far) in [(false, head, tail), (true, tail, head)] {
            let cost_m = distances.between(left, near)
                + right.map_or(0.0, |right| {
                    distances.between(far, right) - distances.between(left, right)
                });
            let gain_m = saved_m - cost_m;
            if gain_m > best.map_or(GAIN_M, |(gain_m, ..)| gain_m) {
                best = Some((gain_m, place, is_reversed));
            }
        }
    }
    best.map(|(_, place, is_reversed)| (place, is_reversed))
}

#[cfg(test)]
mod tests {
    use swath_core::rng::{agent_rng, uniform};

    use super::*;

    #[test]
    fn points_on_a_line_are_visited_in_their_order() {
        for count in [0, 1, 5, 12, 13, 60] {
            let points: Vec<Point> =
                (0..count).map(|i| Point::new(f64::from((i * 7) % count), 0.0)).collect();
            let order = open_tour(Point::new(-1.0, 0.0), &points);
            assert!(
                (tour_length(Point::new(-1.0, 0.0), &points, &order) - f64::from(count)).abs()
                    < 1e-9,
                "{count} points"
            );
        }
    }

    #[test]
    fn every_point_is_visited_once() {
        let points: Vec<Point> = (0..100_u32)
            .map(|i| Point::new(f64::from(i * 37 % 101), f64::from(i * 53 % 97)))
            .collect();
        let mut order = open_tour(Point::origin(), &points);
        order.sort_unstable();
        assert_eq!(order, (0..100).collect::<Vec<_>>());
    }

    /// Points on a square of 100 m by 100 m.
    fn drawn(count: usize, seed: u64) -> Vec<Point> {
        let mut rng = agent_rng(seed);
        let mut at = || 100.0 * uniform(&mut rng);
        (0..count).map(|_| Point::new(at(), at())).collect()
    }

    /// Calls `visit` with every order of the points from `fixed` on.
    fn for_each_order(order: &mut Vec<usize>, fixed: usize, visit: &mut impl FnMut(&[usize])) {
        if fixed == order.len() {
            visit(order);
        }
        for other in fixed..order.len() {
            order.swap(fixed, other);
            for_each_order(order, fixed + 1, visit);
            order.swap(fixed, other);
        }
    }

    #[test]
    fn a_tour_of_few_points_is_the_shortest_of_all_orders() {
        for (count, seed) in (1..=7).flat_map(|count| (0..5).map(move |seed| (count, seed))) {
            let (start, points) = (Point::new(50.0, 0.0), drawn(count, seed));
            let mut shortest_m = f64::INFINITY;
            for_each_order(&mut (0..count).collect(), 0, &mut |order| {
                shortest_m = shortest_m.min(tour_length(start, &points, order));
            });
            let found_m = tour_length(start, &points, &open_tour(start, &points));
            assert!((found_m - shortest_m).abs() < 1e-9, "{count} points: {found_m} {shortest_m}");
        }
    }

    #[test]
    fn no_run_of_a_tour_of_many_points_is_better_turned_round_or_a_short_one_elsewhere() {
        for seed in 0..20 {
            let (start, points) = (Point::origin(), drawn(40, seed));
            let order = open_tour(start, &points);
            let found_m = tour_length(start, &points, &order);
            let check = |other: &[usize], what: &str| {
                let other_m = tour_length(start, &points, other);
                assert!(other_m > found_m - 1e-6, "{what}: {other_m} m instead of {found_m}");
            };
            for first in 0..order.len() {
                for end in first + 1..=order.len() {
                    let mut other = order.clone();
                    other[first..end].reverse();
                    check(&other, "turned round");
                }
                for length in 1..=3.min(order.len() - first) {
                    let mut rest = order.clone();
                    let mut run: Vec<usize> = rest.drain(first..first + length).collect();
                    for _ in 0..2 {
                        for place in 0..=rest.len() {
                            let mut other = rest.clone();
                            other.splice(place..place, run.iter().copied());
                            check(&other, "moved");
                        }
                        run.reverse();
                    }
                }
            }
        }
    }
}
