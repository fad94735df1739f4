//! The nearest known weeds, remembered from one observation to the next.

use super::rough::RoughPositions;
use crate::geometry::Point;
use crate::known::{KnownWeed, KnownWeeds, Window};

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
    listed: usize,
    /// The weeds remembered, each in a place that it keeps.
    weeds: Vec<KnownWeed>,
    /// The squared distances and places of those listed last time, nearest first.
    nearest: Vec<(f64, usize)>,
    /// Where the others stand.
    others: RoughPositions,
    window: Window,
    next_number: u32,
    removals: usize,
    /// Room for those found among all known weeds.
    found: Vec<(f64, KnownWeed)>,
}

impl NearestWeeds {
    /// Lists the `listed` nearest.
    pub(super) fn new(listed: usize) -> Self {
        let nobody = (0.0, KnownWeed { number: 0, position: Point::origin() });
        let remembered = REMEMBERED * listed;
        Self {
            listed,
            weeds: Vec::with_capacity(remembered),
            nearest: Vec::with_capacity(listed),
            others: RoughPositions::with_room(remembered),
            window: Window::EVERYWHERE,
            next_number: 0,
            removals: 0,
            found: vec![nobody; listed],
        }
    }

    /// How many may be remembered.
    fn room(&self) -> usize {
        REMEMBERED * self.listed
    }

    /// Forgets all weeds: the known ones are others now.
    pub(super) fn clear(&mut self) {
        self.forget_all();
        // A clone has no more room than it holds weeds.
        self.weeds.reserve_exact(self.room());
        self.nearest.reserve_exact(self.listed);
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
        loop {
            let limit_m2 = self.rank(from);
            if self.is_certain(from, limit_m2) || !self.widen(from, limit_m2, known) {
                return self.nearest.iter().map(|&(_, place)| &self.weeds[place]);
            }
        }
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
            self.others.scale(known.size_m());
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
        let Some(place) = self.weeds.iter().position(|weed| weed.number == number) else { return };
        self.others.remove(place);
        self.nearest.retain(|&(_, listed)| listed != place);
        self.weeds.swap_remove(place);
        // The last one has moved there.
        let last = self.weeds.len();
        if let Some(moved) = self.weeds.get(place) {
            self.others.write(place, moved.position);
            if let Some(listed) = self.nearest.iter_mut().find(|listed| listed.1 == last) {
                listed.1 = place;
            } else {
                self.others.remove(last);
                self.others.insert(place);
            }
        }
        if self.nearest.len() < self.listed
            && let Some(place) = self.others.first()
        {
            self.others.remove(place);
            self.nearest.push((0.0, place));
        }
    }

    /// Forgets all weeds remembered.
    fn forget_all(&mut self) {
        self.weeds.clear();
        self.nearest.clear();
        self.others.clear();
    }

    /// Adds a weed; returns whether there was room.
    fn remember(&mut self, weed: KnownWeed) -> bool {
        let place = self.weeds.len();
        let has_room = place < self.room();
        if has_room {
            self.weeds.push(weed);
            self.others.write(place, weed.position);
            if self.nearest.len() < self.listed {
                self.nearest.push((0.0, place));
            } else {
                self.others.insert(place);
            }
        }
        has_room
    }

    /// Lists the nearest of the weeds remembered, in order; returns the squared distance of the last one, which is infinite
    /// if there is room for more.
    #[inline]
    fn rank(&mut self, from: Point) -> f64 {
        let Self { weeds, nearest, others, .. } = self;
        let distance_m2 = |place: usize| (weeds[place].position - from).norm_squared();
        // Their order has often hardly changed since the last time.
        let mut farthest_m2 = -1.0;
        for rank in 0..nearest.len() {
            let place = nearest[rank].1;
            let distance_m2 = distance_m2(place);
            nearest[rank].0 = distance_m2;
            if distance_m2 > farthest_m2 {
                farthest_m2 = distance_m2;
            } else {
                move_forward(&mut nearest[..=rank], weeds);
            }
        }
        if weeds.len() <= nearest.len() {
            return if nearest.len() < self.listed { f64::INFINITY } else { farthest_m2 };
        }
        let mut near = others.near(from, farthest_m2);
        let blocks = RoughPositions::blocks(weeds.len());
        for block in 0..blocks {
            let mut bits = others.near_in(block, weeds.len(), &near);
            if bits == 0 {
                continue;
            }
            while bits != 0 {
                let place = RoughPositions::place(block, bits);
                bits &= bits - 1;
                let other = (distance_m2(place), place);
                let Some(last) = nearest.last_mut() else { break };
                if is_before(other, *last, weeds) {
                    others.exchange(place, last.1);
                    *last = other;
                    move_forward(nearest, weeds);
                }
            }
            farthest_m2 = nearest.last().map_or(farthest_m2, |last| last.0);
            if block + 1 < blocks {
                near.end = others.end(farthest_m2);
            }
        }
        farthest_m2
    }

    /// Makes the window large enough to be certain of the nearest weeds, which are to be ranked then; returns false if
    /// there is not room for it, and lists them at once.
    #[cold]
    fn widen(&mut self, from: Point, mut limit_m2: f64, known: &KnownWeeds) -> bool {
        if known.len() <= self.room() {
            return self.extend(Window::EVERYWHERE, known);
        }
        if self.weeds.len() < self.listed {
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

/// Whether a weed is listed before another, both with their squared distances: the nearer one, and of two as near that
/// detected first.
#[inline]
fn is_before(weed: (f64, usize), other: (f64, usize), weeds: &[KnownWeed]) -> bool {
    weed.0 < other.0 || (weed.0 <= other.0 && weeds[weed.1].number < weeds[other.1].number)
}

/// Moves the last weed of a list that is sorted up to it to where it belongs.
#[inline(always)]
#[expect(clippy::inline_always, reason = "the call would take longer than most moves")]
fn move_forward(nearest: &mut [(f64, usize)], weeds: &[KnownWeed]) {
    let mut rank = nearest.len() - 1;
    let weed = nearest[rank];
    while rank > 0 && is_before(weed, nearest[rank - 1], weeds) {
        nearest[rank] = nearest[rank - 1];
        rank -= 1;
    }
    nearest[rank] = weed;
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
            let listed = nearest.listed;
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
