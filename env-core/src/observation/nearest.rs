//! The nearest known weeds, remembered from one observation to the next.

use super::rough::RoughPositions;
use crate::geometry::Point;
use crate::known::{KnownWeed, KnownWeeds, Window, is_before};

/// How many weeds are remembered at most for each one that is listed.
const REMEMBERED: usize = 16;
/// A window is made this much larger than it has to be, metres.
const SPARE_M: f64 = 0.03;

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
        self.catch_up(known);
        loop {
            self.rank(from);
            if self.is_certain(from) || !self.widen(from, known) {
                return &self.weeds[..self.listed.min(self.count)];
            }
        }
    }

    /// Whether no other weed can be closer than those at the front.
    #[inline]
    fn is_certain(&self, from: Point) -> bool {
        let margin_m = self.window.margin_m(from);
        margin_m == f64::INFINITY || (margin_m > 0.0 && margin_m * margin_m > self.limit_m2())
    }

    /// Squared distance of the last weed listed; infinite if there is room for more.
    fn limit_m2(&self) -> f64 {
        if self.count < self.listed { f64::INFINITY } else { self.weeds[self.listed - 1].0 }
    }

    /// Leaves out weeds that were mowed and takes in those that were detected.
    fn catch_up(&mut self, known: &KnownWeeds) {
        let removed = &known.removed()[self.removals..];
        if !removed.is_empty() {
            self.removals = known.removed().len();
            removed.iter().for_each(|&number| self.forget(number));
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
    fn forget(&mut self, number: u32) {
        let mut weeds = self.weeds[..self.count].iter();
        let Some(place) = weeds.position(|(_, weed)| weed.number == number) else { return };
        self.count -= 1;
        self.weeds[place] = self.weeds[self.count];
        if place >= self.listed {
            self.others.put(place - self.listed, self.weeds[place].1.position);
        }
    }

    /// Adds a weed; returns whether there was room.
    fn remember(&mut self, weed: KnownWeed) -> bool {
        let has_room = self.count < self.weeds.len();
        if has_room {
            self.weeds[self.count] = (0.0, weed);
            if self.count >= self.listed {
                self.others.put(self.count - self.listed, weed.position);
            }
            self.count += 1;
        }
        has_room
    }

    /// Moves the nearest of the weeds remembered to the front, in order.
    #[inline]
    fn rank(&mut self, from: Point) {
        let (listed, others) = self.weeds[..self.count].split_at_mut(self.listed.min(self.count));
        // Their order has often hardly changed since the last time.
        for place in 0..listed.len() {
            listed[place].0 = (listed[place].1.position - from).norm_squared();
            move_forward(&mut listed[..=place]);
        }
        let Some(last) = listed.len().checked_sub(1) else { return };
        let mut near = self.others.near(from, listed[last].0);
        for block in RoughPositions::blocks(others.len()) {
            let mut bits = self.others.near_in(block, &near);
            if bits == 0 {
                continue;
            }
            while bits != 0 {
                let place = RoughPositions::place(block, bits);
                bits &= bits - 1;
                let Some(other) = others.get_mut(place) else { break };
                other.0 = (other.1.position - from).norm_squared();
                if is_before(other, &listed[last]) {
                    std::mem::swap(other, &mut listed[last]);
                    self.others.put(place, other.1.position);
                    move_forward(listed);
                }
            }
            near.end = self.others.end(listed[last].0);
        }
    }

    /// Makes the window large enough to be certain of the nearest weeds, which are to be ranked then; returns false if
    /// there is not room for it, and lists them at once.
    #[cold]
    fn widen(&mut self, from: Point, known: &KnownWeeds) -> bool {
        if known.len() <= self.weeds.len() {
            return self.extend(Window::EVERYWHERE, known);
        }
        if self.count < self.listed {
            self.look_up(from, known);
        }
        // So many weeds are within this reach at least.
        let reach_m = self.limit_m2().sqrt() + SPARE_M;
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
            self.count = 0;
        }
        let mut has_room = true;
        let before = self.window;
        known.for_each_between(&before, &window, |weed| {
            has_room = has_room && self.remember(weed);
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

/// Moves the last weed of a list that is sorted up to it to where it belongs.
#[inline]
fn move_forward(weeds: &mut [(f64, KnownWeed)]) {
    let mut place = weeds.len() - 1;
    if place == 0 || !is_before(&weeds[place], &weeds[place - 1]) {
        return;
    }
    let weed = weeds[place];
    while place > 0 && is_before(&weed, &weeds[place - 1]) {
        weeds[place] = weeds[place - 1];
        place -= 1;
    }
    weeds[place] = weed;
}
