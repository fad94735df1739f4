//! The nearest known weeds, remembered from one observation to the next.

use crate::geometry::Point;
use crate::known::{KnownWeed, KnownWeeds, is_before};

/// How many weeds are remembered for each one that is listed.
const REMEMBERED: usize = 2;
/// The mower must drive further than this before a list of weeds remembered can become wrong, metres; where weeds stand so
/// close that it would, none beyond those listed are remembered.
const WORTH_REMEMBERING_M: f64 = 1.5;

/// In even ground twice the number of weeds stand in a circle larger by the square root of two; how much further that reaches,
/// and how far is looked for them.
const GAIN: f64 = std::f64::consts::SQRT_2 - 1.0;
const REACH: f64 = 1.6;

/// The known weeds nearest to a mower that moves little between questions.
///
/// It remembers the weeds nearest to an anchor, and how far from there all others are: as long as the mower stays close to
/// the anchor, the nearest ones are among them.
#[derive(Debug, Clone)]
pub(super) struct NearestWeeds {
    listed: usize,
    /// Squared distances from the last question's point, nearest first.
    weeds: Vec<(f64, KnownWeed)>,
    count: usize,
    anchor: Point,
    /// No other weed is closer to the anchor than this, metres.
    others_m: f64,
    next_number: u32,
    removals: u64,
}

impl NearestWeeds {
    /// Lists the `listed` nearest.
    pub(super) fn new(listed: usize) -> Self {
        let nobody = (0.0, KnownWeed { number: 0, position: Point::origin() });
        Self {
            listed,
            weeds: vec![nobody; REMEMBERED * listed],
            count: 0,
            anchor: Point::origin(),
            others_m: f64::INFINITY,
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
        self.others_m = f64::INFINITY;
        self.next_number = 0;
        self.removals = 0;
    }

    /// The nearest weeds to `from`, nearest first, ties by order of detection.
    pub(super) fn find(&mut self, from: Point, known: &KnownWeeds) -> &[(f64, KnownWeed)] {
        self.catch_up(known);
        let moved_m = (from - self.anchor).norm();
        self.sort_from(from);
        let shown = self.listed.min(self.count);
        let is_certain = self.others_m == f64::INFINITY
            || (self.count >= self.listed
                && self.weeds[self.listed - 1].0.sqrt() + moved_m < self.others_m);
        if is_certain {
            return &self.weeds[..shown];
        }
        self.search(from, known);
        &self.weeds[..self.listed.min(self.count)]
    }

    /// Leaves out weeds that were mowed and takes in those that were detected.
    fn catch_up(&mut self, known: &KnownWeeds) {
        if known.removals() != self.removals {
            self.removals = known.removals();
            let mut kept = 0;
            for index in 0..self.count {
                self.weeds[kept] = self.weeds[index];
                kept += usize::from(known.holds(self.weeds[index].1.number));
            }
            self.count = kept;
        }
        for &weed in known.since(self.next_number) {
            self.next_number = weed.number + 1;
            let distance_m = (weed.position - self.anchor).norm();
            if distance_m >= self.others_m {
                continue;
            }
            if self.count == self.weeds.len() {
                self.others_m = distance_m;
            } else {
                self.weeds[self.count] = (0.0, weed);
                self.count += 1;
            }
        }
    }

    /// Sorts the weeds remembered by their distance from `from`.
    fn sort_from(&mut self, from: Point) {
        let weeds = &mut self.weeds[..self.count];
        for (distance_m2, weed) in weeds.iter_mut() {
            *distance_m2 = (weed.position - from).norm_squared();
        }
        // Their order has hardly changed since the last time.
        for end in 1..weeds.len() {
            if !is_before(&weeds[end], &weeds[end - 1]) {
                continue;
            }
            let weed = weeds[end];
            let mut place = end;
            while place > 0 && is_before(&weed, &weeds[place - 1]) {
                weeds[place] = weeds[place - 1];
                place -= 1;
            }
            weeds[place] = weed;
        }
    }

    /// Finds the weeds to remember anew.
    fn search(&mut self, from: Point, known: &KnownWeeds) {
        // Those listed before have hardly become more distant.
        let is_bounded = self.count >= self.listed;
        let within_m =
            if is_bounded { self.weeds[self.listed - 1].0.sqrt() } else { f64::INFINITY };
        self.anchor = from;
        if within_m * GAIN <= WORTH_REMEMBERING_M {
            self.count = self.listed;
            known.improve(from, &mut self.weeds[..self.listed]);
        } else {
            self.count = known.nearest(from, REACH * within_m, &mut self.weeds);
            if self.count < self.weeds.len() {
                self.others_m = REACH * within_m;
                return;
            }
        }
        self.others_m = self.weeds[self.count - 1].0.sqrt();
    }
}
