//! The nearest known weeds, remembered from one observation to the next.

use super::rough::{Near, RoughPositions};
use crate::geometry::Point;
use crate::known::{KnownWeed, KnownWeeds, Window, is_before};

/// How many weeds are remembered at most for each one that is listed.
const REMEMBERED: usize = 16;
/// A window is made larger by this much more than is needed now.
const SPARE: f64 = 0.03;

/// The known weeds nearest to a mower that moves little between questions.
///
/// It remembers all weeds in a window. As long as the nearest ones stand closer than the window's sides, no other weed
/// has to be looked at; else the window grows, until it holds too many weeds and begins anew. While few weeds are known, it
/// holds all of them.
#[derive(Debug, Clone)]
pub(super) struct NearestWeeds {
    listed: usize,
    /// First those listed last time with their squared distances, nearest first, then the others.
    weeds: Vec<(f64, KnownWeed)>,
    count: usize,
    /// Where the others stand.
    others: RoughPositions,
    window: Window,
    next_number: u32,
    removals: usize,
}

impl NearestWeeds {
    /// Lists the `listed` nearest.
    pub(super) fn new(listed: usize) -> Self {
        let nobody = (0.0, KnownWeed { number: 0, position: Point::origin() });
        let others = (REMEMBERED - 1) * listed;
        Self {
            listed,
            weeds: vec![nobody; listed + others],
            count: 0,
            others: RoughPositions::with_room(others),
            window: Window::EVERYWHERE,
            next_number: 0,
            removals: 0,
        }
    }

    /// How many are listed.
    pub(super) fn listed(&self) -> usize {
        self.listed
    }

    /// Forgets all weeds: the known ones are others now.
    pub(super) fn clear(&mut self) {
        self.count = 0;
        self.window = Window::EVERYWHERE;
        self.next_number = 0;
        self.removals = 0;
    }

    /// The nearest weeds to `from`, nearest first, ties by order of detection.
    #[inline(never)]
    pub(super) fn find(&mut self, from: Point, known: &KnownWeeds) -> &[(f64, KnownWeed)] {
        let (length_m, width_m) = known.size_m();
        let longest_m = length_m.max(width_m);
        self.catch_up(known, longest_m);
        self.rank(from, longest_m);
        let margin_m = self.window.margin_m(from);
        let is_certain = margin_m == f64::INFINITY
            || (margin_m > 0.0 && margin_m * margin_m > self.limit_m2());
        if !is_certain {
            self.widen(from, known, longest_m);
        }
        &self.weeds[..self.listed.min(self.count)]
    }

    /// Squared distance of the last weed listed; infinite if there is room for more.
    fn limit_m2(&self) -> f64 {
        if self.count < self.listed { f64::INFINITY } else { self.weeds[self.listed - 1].0 }
    }

    /// Leaves out weeds that were mowed and takes in those that were detected.
    fn catch_up(&mut self, known: &KnownWeeds, longest_m: f64) {
        for &number in &known.removed()[self.removals..] {
            let mut weeds = self.weeds[..self.count].iter();
            if let Some(place) = weeds.position(|(_, weed)| weed.number == number) {
                self.count -= 1;
                self.weeds[place] = self.weeds[self.count];
                if place >= self.listed {
                    self.others.copy(self.count - self.listed, place - self.listed);
                }
            }
        }
        self.removals = known.removed().len();
        for &weed in known.since(self.next_number) {
            self.next_number = weed.number + 1;
            if self.window.contains(weed.position) && !self.remember(weed, longest_m) {
                self.window = Window::NOWHERE;
            }
        }
    }

    /// Adds a weed; returns whether there was room.
    fn remember(&mut self, weed: KnownWeed, longest_m: f64) -> bool {
        let has_room = self.count < self.weeds.len();
        if has_room {
            self.weeds[self.count] = (0.0, weed);
            if self.count >= self.listed {
                self.others.put(self.count - self.listed, weed.position, longest_m);
            }
            self.count += 1;
        }
        has_room
    }

    /// Moves the nearest of the weeds remembered to the front, in order.
    fn rank(&mut self, from: Point, longest_m: f64) {
        let (listed, others) = self.weeds[..self.count].split_at_mut(self.listed.min(self.count));
        // Often their order has hardly changed since the last time.
        for end in 0..listed.len() {
            let weed = listed[end].1;
            let offered = ((weed.position - from).norm_squared(), weed);
            insert(listed, end, offered);
        }
        let Some(last) = listed.len().checked_sub(1) else { return };
        if others.is_empty() {
            return;
        }
        let mut near = Near::new(from, listed[last].0, longest_m);
        for block in RoughPositions::blocks(others.len()) {
            let mut bits = self.others.within(block, &near);
            if bits == 0 {
                continue;
            }
            while bits != 0 {
                let place = RoughPositions::first(block) + bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let Some(other) = others.get_mut(place) else { break };
                let offered = ((other.1.position - from).norm_squared(), other.1);
                if is_before(&offered, &listed[last]) {
                    *other = listed[last];
                    self.others.put(place, other.1.position, longest_m);
                    insert(listed, last, offered);
                }
            }
            near.limit(listed[last].0, longest_m);
        }
    }

    /// Makes the window large enough to be certain of the nearest weeds.
    fn widen(&mut self, from: Point, known: &KnownWeeds, longest_m: f64) {
        let around = if known.len() <= self.weeds.len() {
            Window::EVERYWHERE
        } else {
            if self.count < self.listed {
                self.look_up(from, known);
            }
            // There are so many weeds within this reach at least.
            let reach_m = self.limit_m2().sqrt() * (1.0 + SPARE);
            Window::around(from, reach_m, known.size_m())
        };
        if self.extend(self.window.with(&around), known, longest_m) {
            self.rank(from, longest_m);
            return;
        }
        self.window = Window::NOWHERE;
        if self.extend(around, known, longest_m) {
            self.rank(from, longest_m);
        } else {
            self.look_up(from, known);
        }
    }

    /// Takes in the weeds of a window that holds the present one; returns whether there was room.
    fn extend(&mut self, window: Window, known: &KnownWeeds, longest_m: f64) -> bool {
        if self.window == Window::NOWHERE {
            self.count = 0;
        }
        let mut has_room = true;
        let before = self.window;
        known.for_each_between(&before, &window, |weed| {
            has_room = has_room && self.remember(weed, longest_m);
        });
        self.window = window;
        has_room
    }

    /// Finds the nearest among all known weeds, and remembers no others.
    fn look_up(&mut self, from: Point, known: &KnownWeeds) {
        self.window = Window::NOWHERE;
        self.count = known.nearest(from, &mut self.weeds[..self.listed]);
    }
}

/// Puts a weed into a list that is sorted up to the place `end`, which is free.
#[inline]
fn insert(weeds: &mut [(f64, KnownWeed)], end: usize, weed: (f64, KnownWeed)) {
    let mut place = end;
    while place > 0 && is_before(&weed, &weeds[place - 1]) {
        weeds[place] = weeds[place - 1];
        place -= 1;
    }
    weeds[place] = weed;
}
