//! The nearest known weeds, remembered from one observation to the next.

use smallvec::SmallVec;

use super::ranked::{self, FEW, Ranked};
use super::rough::{GROUP, RoughPositions};
use crate::fetch::fetch;
use crate::geometry::Point;
use crate::known::{KnownWeed, KnownWeeds, Window, is_before};

/// How many weeds are remembered at most for each one that is listed.
const REMEMBERED: usize = 16;
/// A window reaches this much further than it has to, metres; and as a share, for rounding far from the pasture.
const SPARE_M: f64 = 0.03;
const SPARE: f64 = 1e-9;
/// More than rounding may do to a squared distance, as a share; less than that spare.
const ROUNDING: f64 = 1e-12;

/// A window that has to grow reaches to where the mower is after so many questions more, if it goes on as it does.
const AHEAD: f64 = 2.0;

/// The known weeds nearest to a mower that moves little between questions.
///
/// It remembers all weeds in a window. As long as the nearest ones stand closer than the window's sides, no other weed
/// has to be looked at; else the window grows, until it holds too many weeds and begins anew. While few weeds are known, it
/// holds all of them. Where the buckets next to the mower alone hold too many, the weeds are looked up at every question.
#[derive(Debug, Clone)]
pub(super) struct NearestWeeds {
    most: usize,
    /// Those remembered, and roughly where they stand: mostly those first that were listed last time, in any order.
    weeds: Vec<KnownWeed>,
    places: RoughPositions,
    /// Those listed by distance, nearest first.
    ranks: SmallVec<[Ranked; FEW]>,
    window: Window,
    /// Where the list was asked for last.
    last_from: Point,
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
            weeds: Vec::new(),
            places: RoughPositions::with_room(REMEMBERED * most),
            ranks: SmallVec::new(),
            window: Window::EVERYWHERE,
            last_from: Point::origin(),
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
        self.weeds.clear();
        // A clone has no more room than it holds weeds.
        self.weeds.reserve_exact(self.room());
        self.ranks.clear();
        self.ranks.reserve_exact(self.most);
        self.window = Window::EVERYWHERE;
        self.next_number = 0;
        self.removals = 0;
    }

    /// Asks for those that were listed last time.
    #[inline]
    pub(super) fn fetch(&self) {
        fetch(&self.weeds[..self.most.min(self.weeds.len())]);
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
        while !self.is_certain(from, limit_m2)
            && !self.is_certain_from_outside(from, limit_m2, known)
        {
            let is_wider = self.widen(from, limit_m2, known);
            limit_m2 = self.rank(from);
            if !is_wider {
                break;
            }
        }
        self.last_from = from;
        self.ranks.iter().map(|ranked| &self.weeds[ranked.place()])
    }

    /// Whether the window holds all weeds that are not farther than that.
    #[inline]
    fn is_certain(&self, from: Point, limit_m2: f64) -> bool {
        let margin_m = self.window.margin_m(from);
        margin_m == f64::INFINITY || (margin_m > 0.0 && margin_m * margin_m > limit_m2)
    }

    /// The same for a mower off the pasture, from where a window that is long along the border would have to be wide as well.
    #[cold]
    fn is_certain_from_outside(&self, from: Point, limit_m2: f64, known: &KnownWeeds) -> bool {
        let off_m = known.off_m(from);
        off_m != (0.0, 0.0) && self.window.margin_m2(from, off_m) > limit_m2 * (1.0 + ROUNDING)
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
        // Mostly there is none, which is told without a look at any of them.
        if known.next_number() > self.next_number {
            self.take_in(known);
        }
    }

    /// Takes in the weeds that were detected since the last question.
    #[inline(never)]
    fn take_in(&mut self, known: &KnownWeeds) {
        self.places.scale(known.size_m());
        for weed in known.since(self.next_number) {
            if known.is_in(&self.window, weed.position) && !self.remember(weed) {
                self.window = Window::NOWHERE;
            }
        }
        self.next_number = known.next_number();
    }

    /// Leaves out a weed, if it is remembered; the last one takes its place.
    #[inline(never)]
    fn forget(&mut self, number: u32) {
        if let Some(place) = self.weeds.iter().position(|weed| weed.number == number) {
            self.places.swap(place, self.weeds.len() - 1);
            self.weeds.swap_remove(place);
        }
    }

    /// Adds a weed; returns whether there was room.
    fn remember(&mut self, weed: KnownWeed) -> bool {
        let has_room = self.weeds.len() < self.room();
        if has_room {
            self.places.write(self.weeds.len(), weed.position);
            self.weeds.push(weed);
        }
        has_room
    }

    /// Lists the nearest of the weeds remembered; returns a squared distance beyond which no weed belongs on the list.
    #[inline]
    fn rank(&mut self, from: Point) -> f64 {
        let listed = self.most.min(self.weeds.len());
        if self.ranks.len() != listed {
            self.ranks.resize(listed, Ranked::default());
        }
        self.rank_by_numbers(from).unwrap_or_else(|| self.rank_by_weeds(from))
    }

    /// The same for a few of them, no two of which are too close to tell; else `None`.
    #[inline]
    fn rank_by_numbers(&mut self, from: Point) -> Option<f64> {
        let Self { most, weeds, places, ranks, .. } = self;
        if *most != FEW {
            return None;
        }
        let weeds = &mut weeds[..];
        let ranks = <&mut [Ranked; FEW]>::try_from(&mut ranks[..]).ok()?;
        *ranks = ranked::sorted(from, weeds.first_chunk()?.each_ref().map(|weed| weed.position));
        let mut last = ranks[FEW - 1];
        if weeds.len() > FEW {
            let near = places.near(from, last.at_most_m2());
            let groups = &mut places.groups()[..weeds.len().div_ceil(GROUP)];
            let mut group = 0;
            let mut bits = near.find_in(&groups[0]) & (!0 << FEW);
            loop {
                while bits != 0 {
                    let bit = bits.trailing_zeros() as usize % GROUP;
                    bits &= bits - 1;
                    let place = group * GROUP + bit;
                    // The last group has room left.
                    let Some(&weed) = weeds.get(place) else { break };
                    // It takes the place of the farthest one, which is kept among the others; if it is as far away, that
                    // is noticed by what was dropped.
                    let farthest = last.place() % FEW;
                    let other = Ranked::new((weed.position - from).norm_squared(), farthest);
                    if other <= last {
                        (weeds[place], weeds[farthest]) = (weeds[farthest], weed);
                        (groups[group][bit], groups[0][farthest]) =
                            (groups[0][farthest], groups[group][bit]);
                        let dropped = last;
                        last = ranked::replace_last_of_few(ranks, other);
                        last.is_before(dropped)?;
                    }
                }
                group += 1;
                let Some(next) = groups.get(group) else { break };
                bits = near.find_in(next);
            }
        }
        ranked::are_few_certain(ranks).then(|| last.at_most_m2())
    }

    /// The same for any number of them, by asking the weeds themselves where they are too close to tell.
    #[inline(never)]
    fn rank_by_weeds(&mut self, from: Point) -> f64 {
        let Self { most, weeds, places, ranks, .. } = self;
        let listed = ranks.len();
        let distance_m2 = |weed: &KnownWeed| (weed.position - from).norm_squared();
        let is_weed_before = |one: KnownWeed, other: KnownWeed| {
            is_before(&(distance_m2(&one), one), &(distance_m2(&other), other))
        };
        let by_weeds = |weeds: &[KnownWeed], one: Ranked, other: Ranked| {
            is_weed_before(weeds[one.place()], weeds[other.place()])
        };
        for (place, (rank, weed)) in ranks.iter_mut().zip(weeds.iter()).enumerate() {
            *rank = Ranked::new(distance_m2(weed), place);
        }
        ranked::sort(ranks, |one, other| by_weeds(weeds, one, other));
        let Some(&(mut last)) = ranks.last() else { return f64::INFINITY };
        if weeds.len() == listed {
            return if listed < *most { f64::INFINITY } else { last.at_most_m2() };
        }
        let near = places.near(from, last.at_most_m2());
        let mut others = u32::MAX << (listed % GROUP);
        for group in listed / GROUP..weeds.len().div_ceil(GROUP) {
            let mut bits = near.find_in(&places.groups()[group]) & others;
            others = u32::MAX;
            while bits != 0 {
                let place = group * GROUP + bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let Some(&weed) = weeds.get(place) else { break };
                let farthest = last.place();
                let other = Ranked::new(distance_m2(&weed), farthest);
                let is_nearer =
                    other.is_before(last).unwrap_or_else(|| is_weed_before(weed, weeds[farthest]));
                if is_nearer {
                    weeds.swap(farthest, place);
                    places.swap(farthest, place);
                    last = ranked::replace_last(ranks, other, |one, other| {
                        by_weeds(weeds, one, other)
                    });
                }
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
        if self.weeds.len() < self.most {
            limit_m2 = self.look_up(from, known);
        }
        // So many weeds are within this reach at least.
        let reach_m = limit_m2.sqrt() * (1.0 + SPARE) + SPARE_M;
        let around = known.window(from, reach_m);
        let to = from + AHEAD * (from - self.last_from);
        let ahead = around.with(&known.window(to, reach_m));
        if self.extend(self.window.with(&ahead), known) {
            return true;
        }
        for window in [ahead, around] {
            self.window = Window::NOWHERE;
            if self.extend(window, known) {
                return true;
            }
        }
        self.look_up(from, known);
        false
    }

    /// Takes in the weeds of a window that holds the present one; returns whether there was room.
    fn extend(&mut self, window: Window, known: &KnownWeeds) -> bool {
        if self.window == Window::NOWHERE {
            self.weeds.clear();
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
        self.weeds.clear();
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
            let is_mowed = |weed: &KnownWeed| (weed.position - self.at).norm() < reach_m;
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
                self.known.iter().map(|weed| (distance_m2(&weed), weed)).collect();
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
        for (count, listed) in [
            (0, 8),
            (5, 8),
            (60, 8),
            (400, 8),
            (1500, 8),
            (6000, 8),
            (3000, 1),
            (3000, 9),
            (3000, 30),
        ] {
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
    fn the_list_is_that_of_all_known_weeds_on_pastures_of_any_size_and_from_anywhere() {
        // One bucket, buckets of a metre, larger ones, and very many along one side.
        for (length_m, width_m) in [(0.8, 0.7), (53.0, 31.0), (2000.3, 900.7), (40_000.1, 1.3)] {
            let mut rng = stream(11, Stream::Weeds);
            let mut walk = Walk::among(Vec::new(), stream(12, Stream::Weeds));
            walk.known = KnownWeeds::none(length_m, width_m);
            let bucket_m = (length_m * width_m / 16_384.0_f64).sqrt().max(1.0);
            for number in 0..1200 {
                let mut at = |size_m: f64| size_m * uniform(&mut rng);
                let position = match number % 3 {
                    0 => Point::new(at(length_m), at(width_m)),
                    // Far more than are remembered in one bucket, and some about the borders of buckets.
                    1 => Point::new(at(0.5), at(0.5)),
                    _ => Point::new((at(40.0).floor() * bucket_m).min(length_m), at(width_m)),
                };
                walk.known.add(KnownWeed { number, position });
            }
            let mut nearest = NearestWeeds::new(8);
            for question in 0..600 {
                let found: Vec<KnownWeed> = nearest.find(walk.at, &walk.known).copied().collect();
                assert_eq!(found, walk.nearest_of_all(8), "{length_m} x {width_m}: {question}");
                walk.at += Point::new(0.3, 0.01).coords;
                if question % 40 == 0 {
                    let away_m = [0.0, 1e3, 1e6, 1e9][question / 40 % 4];
                    let mut at = |size_m: f64| (size_m + away_m) * uniform(&mut rng) - away_m / 2.0;
                    walk.at = Point::new(at(length_m.min(60.0)), at(width_m));
                }
            }
        }
    }

    #[test]
    fn round_the_outside_of_a_pasture_the_list_is_that_of_all_known_weeds_sorted() {
        for count in [300, 4000] {
            let mut rng = stream(count as u64, Stream::Weeds);
            let hidden = scattered(count, &mut rng);
            let mut walk = Walk::among(hidden, rng);
            walk.detect_within(100.0);
            for off_m in [1.0, 15.0, 60.0, 400.0, 5e3, 1e7] {
                let mut nearest = NearestWeeds::new(8);
                for question in 0..400 {
                    // Twice round, past all sides and corners.
                    let (sin, cos) = (0.0314 * f64::from(question)).sin_cos();
                    let at = |middle_m: f64, share: f64| middle_m + (middle_m + off_m) * share;
                    walk.at = Point::new(at(0.5 * SIZE_M.0, cos), at(0.5 * SIZE_M.1, sin));
                    let found: Vec<KnownWeed> =
                        nearest.find(walk.at, &walk.known).copied().collect();
                    assert_eq!(found, walk.nearest_of_all(8), "{off_m} m off: {question}");
                }
            }
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

    #[test]
    fn the_list_is_whole_where_only_a_few_of_those_remembered_are_left() {
        for listed in [8, 9, 10, 16] {
            let mut rng = stream(listed as u64, Stream::Weeds);
            let hidden = scattered(2000, &mut rng);
            let mut walk = Walk::among(hidden, rng);
            walk.detect_within(100.0);
            let mut nearest = NearestWeeds::new(listed);
            for step in 0..1500 {
                let found: Vec<KnownWeed> = nearest.find(walk.at, &walk.known).copied().collect();
                assert_eq!(found, walk.nearest_of_all(listed), "step {step} of {listed}");
                // Of those listed some are mowed, so that the window holds fewer and fewer.
                for weed in found.iter().take(below(3, &mut walk.rng)) {
                    walk.known.remove(weed.number);
                }
                if step % 50 == 0 {
                    walk.at =
                        Point::new(53.0 * uniform(&mut walk.rng), 31.0 * uniform(&mut walk.rng));
                }
            }
        }
    }

    #[test]
    fn of_weeds_as_near_as_each_other_at_the_end_of_the_list_those_detected_first_are_on_it() {
        let mut rng = stream(9, Stream::Weeds);
        let at = Point::new(26.0, 15.0);
        for round in 0..3000 {
            let mut around = |distance_m: f64| {
                let (sin, cos) = (std::f64::consts::TAU * uniform(&mut rng)).sin_cos();
                Point::new(at.x + distance_m * cos, at.y + distance_m * sin)
            };
            // Seven at distances of their own, and some beyond them all.
            let mut spots: Vec<Point> = (0..7).map(|i| around(0.5 + 0.7 * f64::from(i))).collect();
            spots.extend((0..30).map(|i| around(8.5 + 0.1 * f64::from(i))));
            // The eighth is one of four, which differ by nothing or by a few of the last bits.
            for (x, y) in [(8.0, 0.0), (0.0, 8.0), (-8.0, 0.0), (0.0, -8.0)] {
                let hair_m = (below(5, &mut rng) as f64 - 2.0) * [0.0, 4e-15][round % 2];
                spots.push(Point::new(at.x + x + hair_m, at.y + y + hair_m));
            }
            let mut walk = Walk::among(Vec::new(), stream(1, Stream::Weeds));
            for number in 0..41 {
                let position = spots.swap_remove(below(spots.len(), &mut rng));
                walk.known.add(KnownWeed { number, position });
            }
            let mut nearest = NearestWeeds::new(8);
            // Questions from elsewhere leave another list to begin with.
            for question in 0..round % 4 {
                walk.at = Point::new(13.0 * question as f64, 31.0 * uniform(&mut rng));
                let found: Vec<KnownWeed> = nearest.find(walk.at, &walk.known).copied().collect();
                assert_eq!(found, walk.nearest_of_all(8));
            }
            walk.at = at;
            let found: Vec<KnownWeed> = nearest.find(walk.at, &walk.known).copied().collect();
            assert_eq!(found, walk.nearest_of_all(8), "round {round}");
        }
    }
}
