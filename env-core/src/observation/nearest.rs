//! The nearest known weeds, remembered from one observation to the next.

use smallvec::SmallVec;

use super::ranked::{self, FEW, Ranked};
use super::rough::RoughPositions;
use crate::geometry::Point;
use crate::known::{KnownWeed, KnownWeeds, Window, is_before};

/// How many weeds are remembered at most for each one that is listed.
const REMEMBERED: usize = 16;
/// A window reaches this much further than it has to, metres; and as a share, for rounding far from the pasture.
const SPARE_M: f64 = 0.03;
const SPARE: f64 = 1e-9;

/// The known weeds nearest to a mower that moves little between questions.
///
/// It remembers all weeds in a window. As long as the nearest ones stand closer than the window's sides, no other weed
/// has to be looked at; else the window grows, until it holds too many weeds and begins anew. While few weeds are known, it
/// holds all of them.
#[derive(Debug, Clone)]
pub(super) struct NearestWeeds {
    most: usize,
    /// Those listed last time, in any order.
    listed: SmallVec<[KnownWeed; FEW]>,
    /// The same by distance, nearest first.
    ranks: SmallVec<[Ranked; FEW]>,
    /// The others that are remembered, and roughly where they stand.
    others: Vec<KnownWeed>,
    places: RoughPositions,
    window: Window,
    next_number: u32,
    removals: usize,
    /// Room for those found among all known weeds.
    found: Vec<(f64, KnownWeed)>,
}

impl NearestWeeds {
    /// Lists the `most` nearest.
    pub(super) fn new(most: usize) -> Self {
        let nobody = (0.0, KnownWeed { number: 0, position: Point::origin() });
        let mut nearest = Self {
            most,
            listed: SmallVec::new(),
            ranks: SmallVec::new(),
            others: Vec::new(),
            places: RoughPositions::with_room(REMEMBERED * most),
            window: Window::EVERYWHERE,
            next_number: 0,
            removals: 0,
            found: vec![nobody; most],
        };
        nearest.clear();
        nearest
    }

    /// How many may be remembered.
    fn room(&self) -> usize {
        REMEMBERED * self.most
    }

    /// Forgets all weeds: the known ones are others now.
    pub(super) fn clear(&mut self) {
        self.forget_all();
        // A clone has no more room than it holds weeds.
        self.listed.reserve_exact(self.most);
        self.ranks.reserve_exact(self.most);
        self.others.reserve_exact(self.room());
        self.window = Window::EVERYWHERE;
        self.next_number = 0;
        self.removals = 0;
    }

    /// The nearest weeds to `from`, nearest first, ties by order of detection.
    #[inline]
    pub(super) fn find(
        &mut self,
        from: Point,
        known: &KnownWeeds,
    ) -> impl ExactSizeIterator<Item = &KnownWeed> {
        self.catch_up(known);
        let mut limit_m2 = self.rank(from);
        while !self.is_certain(from, limit_m2) {
            let is_wider = self.widen(from, limit_m2, known);
            limit_m2 = self.rank(from);
            if !is_wider {
                break;
            }
        }
        self.ranks.iter().map(|ranked| &self.listed[ranked.place()])
    }

    /// Whether the window holds all weeds that are not farther than that.
    #[inline]
    fn is_certain(&self, from: Point, limit_m2: f64) -> bool {
        let margin_m = self.window.margin_m(from);
        margin_m == f64::INFINITY || (margin_m > 0.0 && margin_m * margin_m > limit_m2)
    }

    /// Leaves out weeds that were mowed and takes in those that were detected.
    #[inline]
    fn catch_up(&mut self, known: &KnownWeeds) {
        let removed = &known.removed()[self.removals..];
        if !removed.is_empty() {
            self.removals = known.removed().len();
            for &number in removed {
                self.forget(number);
            }
        }
        let detected = known.since(self.next_number);
        if let Some(last) = detected.last() {
            self.next_number = last.number + 1;
            self.places.scale(known.size_m());
            for &weed in detected {
                if self.window.contains(weed.position) && !self.remember(weed) {
                    self.window = Window::NOWHERE;
                }
            }
        }
    }

    /// Leaves out a weed, if it is remembered.
    #[inline(never)]
    fn forget(&mut self, number: u32) {
        let is_it = |weed: &KnownWeed| weed.number == number;
        if let Some(place) = self.listed.iter().position(is_it) {
            self.listed.swap_remove(place);
            self.listed.extend(self.others.pop());
        } else if let Some(place) = self.others.iter().position(is_it) {
            self.others.swap_remove(place);
            // The last one has moved there.
            if let Some(moved) = self.others.get(place) {
                self.places.write(place, moved.position);
            }
        }
    }

    /// Forgets all weeds remembered.
    fn forget_all(&mut self) {
        self.listed.clear();
        self.ranks.clear();
        self.others.clear();
    }

    /// Adds a weed; returns whether there was room.
    fn remember(&mut self, weed: KnownWeed) -> bool {
        if self.listed.len() < self.most {
            self.listed.push(weed);
            return true;
        }
        let place = self.others.len();
        let has_room = self.listed.len() + place < self.room();
        if has_room {
            self.places.write(place, weed.position);
            self.others.push(weed);
        }
        has_room
    }

    /// Lists the nearest of the weeds remembered; returns a squared distance beyond which no weed belongs on the list.
    #[inline]
    fn rank(&mut self, from: Point) -> f64 {
        let Self { most, listed, ranks, others, places, .. } = self;
        let distance_m2 = |weed: &KnownWeed| (weed.position - from).norm_squared();
        let is_weed_before = |one: KnownWeed, other: KnownWeed| {
            is_before(&(distance_m2(&one), one), &(distance_m2(&other), other))
        };
        let by_weeds = |listed: &[KnownWeed], one: Ranked, other: Ranked| {
            is_weed_before(listed[one.place()], listed[other.place()])
        };
        if ranks.len() != listed.len() {
            ranks.resize(listed.len(), Ranked::default());
        }
        for (place, (rank, weed)) in ranks.iter_mut().zip(listed.iter()).enumerate() {
            *rank = Ranked::new(distance_m2(weed), place);
        }
        // As slices: who asks them for a place need not find out each time where they lie.
        let (listed, ranks, others) = (&mut listed[..], &mut ranks[..], &mut others[..]);
        ranked::sort(ranks, |one, other| by_weeds(listed, one, other));
        let Some(&(mut last)) = ranks.last() else { return f64::INFINITY };
        if others.is_empty() {
            return if listed.len() < *most { f64::INFINITY } else { last.at_most_m2() };
        }
        let mut near = places.near(from, last.at_most_m2());
        let blocks = RoughPositions::blocks(others.len());
        for block in 0..blocks {
            let mut bits = places.near_in(block, others.len(), &near);
            if bits == 0 {
                continue;
            }
            while bits != 0 {
                let place = RoughPositions::place(block, bits);
                bits &= bits - 1;
                // It takes the place of the farthest one, which is kept among the others.
                let farthest = last.place();
                let other = Ranked::new(distance_m2(&others[place]), farthest);
                let is_nearer = other
                    .is_before(last)
                    .unwrap_or_else(|| is_weed_before(others[place], listed[farthest]));
                if is_nearer {
                    std::mem::swap(&mut listed[farthest], &mut others[place]);
                    places.write(place, others[place].position);
                    last = ranked::replace_last(ranks, other, |one, other| {
                        by_weeds(listed, one, other)
                    });
                }
            }
            if block + 1 < blocks {
                near.end = places.end(last.at_most_m2());
            }
        }
        last.at_most_m2()
    }

    /// Makes the window large enough to be certain of the nearest weeds, which are to be ranked then; returns false if
    /// there is not room for it, and remembers just them.
    #[cold]
    fn widen(&mut self, from: Point, mut limit_m2: f64, known: &KnownWeeds) -> bool {
        if known.len() <= self.room() {
            return self.extend(Window::EVERYWHERE, known);
        }
        if self.listed.len() < self.most {
            limit_m2 = self.look_up(from, known);
        }
        // So many weeds are within this reach at least.
        let reach_m = limit_m2.sqrt() * (1.0 + SPARE) + SPARE_M;
        let around = Window::around(from, reach_m, known.size_m());
        if self.extend(self.window.with(&around), known) {
            return true;
        }
        self.window = Window::NOWHERE;
        if self.extend(around, known) {
            return true;
        }
        self.look_up(from, known);
        false
    }

    /// Takes in the weeds of a window that holds the present one; returns whether there was room.
    fn extend(&mut self, window: Window, known: &KnownWeeds) -> bool {
        if self.window == Window::NOWHERE {
            self.forget_all();
        }
        let mut has_room = true;
        let before = self.window;
        known.for_each_between(&before, &window, |weed| {
            has_room = has_room && self.remember(weed);
        });
        self.window = window;
        has_room
    }

    /// Finds the nearest among all known weeds, and remembers no others; returns the squared distance of the last one.
    fn look_up(&mut self, from: Point, known: &KnownWeeds) -> f64 {
        self.window = Window::NOWHERE;
        self.forget_all();
        let count = known.nearest(from, &mut self.found);
        for place in 0..count {
            self.remember(self.found[place].1);
        }
        self.found[..count].last().map_or(f64::INFINITY, |last| last.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Stream, StreamRng, below, stream, uniform};

    const SIZE_M: (f64, f64) = (53.0, 31.0);

    /// A mower among weeds that it detects and mows as it comes by.
    struct Walk {
        rng: StreamRng,
        at: Point,
        heading_rad: f64,
        hidden: Vec<Point>,
        known: KnownWeeds,
        next_number: u32,
    }

    impl Walk {
        fn among(hidden: Vec<Point>, rng: StreamRng) -> Self {
            let known = KnownWeeds::none(SIZE_M.0, SIZE_M.1);
            let at = Point::new(20.0, 15.0);
            Self { rng, at, heading_rad: 0.0, hidden, known, next_number: 0 }
        }

        fn detect_within(&mut self, reach_m: f64) {
            for index in (0..self.hidden.len()).rev() {
                if (self.hidden[index] - self.at).norm() < reach_m {
                    let position = self.hidden.swap_remove(index);
                    self.known.add(KnownWeed { number: self.next_number, position });
                    self.next_number += 1;
                }
            }
        }

        fn mow_within(&mut self, reach_m: f64) {
            let is_mowed = |weed: &&KnownWeed| (weed.position - self.at).norm() < reach_m;
            let mowed: Vec<u32> =
                self.known.iter().filter(is_mowed).map(|weed| weed.number).collect();
            for number in mowed {
                self.known.remove(number);
            }
        }

        /// Drives a step, seldom beyond the pasture's border, and now and then jumps.
        fn step(&mut self, length_m: f64) {
            self.heading_rad += 0.5 * (uniform(&mut self.rng) - 0.4);
            let (sin, cos) = self.heading_rad.sin_cos();
            self.at += Point::new(length_m * cos, length_m * sin).coords;
            let is_far = (self.at - Point::new(20.0, 15.0)).norm() > 45.0;
            if is_far || below(100, &mut self.rng) == 0 {
                let (x, y) = (uniform(&mut self.rng), uniform(&mut self.rng));
                self.at = Point::new(SIZE_M.0 * x, SIZE_M.1 * y);
            }
        }

        fn nearest_of_all(&self, listed: usize) -> Vec<KnownWeed> {
            let distance_m2 = |weed: &KnownWeed| (weed.position - self.at).norm_squared();
            let mut all: Vec<_> =
                self.known.iter().map(|weed| (distance_m2(weed), *weed)).collect();
            all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.number.cmp(&b.1.number)));
            all.truncate(listed);
            all.into_iter().map(|(_, weed)| weed).collect()
        }
    }

    fn scattered(count: usize, rng: &mut StreamRng) -> Vec<Point> {
        (0..count).map(|_| Point::new(SIZE_M.0 * uniform(rng), SIZE_M.1 * uniform(rng))).collect()
    }

    /// Compares each list on the way with all known weeds sorted.
    fn assert_nearest(nearest: &mut NearestWeeds, walk: &mut Walk, steps: usize, length_m: f64) {
        for step in 0..steps {
            walk.detect_within(9.0);
            // For long stretches nothing is mowed.
            if step / 40 % 2 == 0 {
                walk.mow_within(1.2);
            }
            let listed = nearest.most;
            let expected = walk.nearest_of_all(listed);
            let found: Vec<KnownWeed> = nearest.find(walk.at, &walk.known).copied().collect();
            assert_eq!(found, expected, "step {step}");
            walk.step(length_m);
        }
    }

    #[test]
    fn the_list_on_the_way_is_that_of_all_known_weeds_sorted() {
        for (count, listed) in
            [(0, 8), (5, 8), (60, 8), (400, 8), (1500, 8), (6000, 8), (3000, 1), (3000, 30)]
        {
            for length_m in [0.07, 1.0, 6.0] {
                let mut rng = stream(count as u64, Stream::Weeds);
                let weeds = scattered(count, &mut rng);
                let mut walk = Walk::among(weeds, rng);
                assert_nearest(&mut NearestWeeds::new(listed), &mut walk, 240, length_m);
            }
        }
    }

    #[test]
    fn weeds_as_near_as_each_other_are_listed_in_the_order_of_detection() {
        let rng = stream(1, Stream::Weeds);
        let lattice = |at: usize| Point::new(0.5 * (at % 100) as f64, 0.5 * (at / 100) as f64);
        let mut walk = Walk::among((0..6000).map(lattice).collect(), rng);
        let mut nearest = NearestWeeds::new(8);
        for step in 0..300 {
            walk.at = lattice(step * 13 % 6000);
            walk.detect_within(4.0);
            let found: Vec<KnownWeed> = nearest.find(walk.at, &walk.known).copied().collect();
            assert_eq!(found, walk.nearest_of_all(8));
        }
    }

    #[test]
    fn weeds_all_in_one_place_are_listed_in_the_order_of_detection() {
        let at = Point::new(21.0, 15.0);
        let mut walk = Walk::among(vec![at; 500], stream(1, Stream::Weeds));
        let mut nearest = NearestWeeds::new(8);
        for _ in 0..5 {
            walk.detect_within(9.0);
            let found: Vec<KnownWeed> = nearest.find(walk.at, &walk.known).copied().collect();
            assert_eq!(found, walk.nearest_of_all(8));
            walk.at = at;
        }
    }

    #[test]
    fn another_episode_begins_with_nothing_remembered() {
        let mut nearest = NearestWeeds::new(8);
        for (count, seed) in [(3000, 1), (40, 2), (3000, 3)] {
            let mut rng = stream(seed, Stream::Weeds);
            let weeds = scattered(count, &mut rng);
            nearest.clear();
            assert_nearest(&mut nearest, &mut Walk::among(weeds, rng), 100, 1.0);
        }
    }
}
