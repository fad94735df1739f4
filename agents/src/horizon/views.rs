//! Places to look from, until a plan shows all ground that is still open.

use std::f32::consts::TAU;

use swath_core::rng::{StreamRng, below, uniform};

use super::anneal::bell;
use super::open::OpenGround;
use super::plan::{Node, Plan};
use super::spot::{Spot, cos_sin};

/// The way between two looks in a band, in depths of the triangle.
const STRIDE: f32 = 0.67;
/// Open cells that are looked at in search of a better place to look from, and most places that are added at once.
const CELLS: usize = 6;
const MOST: usize = 12;
/// From how many sides, and from how far away, in depths of the triangle.
const SIDES: usize = 12;
const DISTANCES: [f32; 3] = [0.45, 0.7, 0.95];
/// How far outside the pasture the mower may look from, metres.
const OUTSIDE_M: f32 = 6.0;
/// A look is worth moving if the plan gets shorter by that much, metres.
const WORTH_M: f32 = 0.05;
/// Changes that are tried for each of the first plans, and how much longer it may become at the beginning, metres; the same for the
/// best of them; and at the end.
const FIRST: (usize, f32) = (16_000, 4.0);
const SECOND: (usize, f32) = (16_000, 0.4);
const COLD_M: f32 = 0.02;
/// While the mower drives: how often it is tried to show what is missed by a change, how many changes are tried besides, and what a
/// cell costs then that is not shown, metres.
const MENDING: usize = 150;
const CHANGES: usize = 60;
const DEAR_M: f32 = 10.0;
/// What an open cell costs at first that is not shown, metres.
const PRICE_M: f32 = 0.4;

/// Plans over open ground.
pub(super) struct Views<'a> {
    pub(super) plan: &'a mut Plan,
    pub(super) ground: &'a mut OpenGround,
    pub(super) size_m: (f32, f32),
}

impl Views<'_> {
    /// The shortest way found to look at the whole pasture: sweeps in bands, as many as there is hardly room for and one more,
    /// annealed.
    pub(super) fn sweep(&mut self, sensor_width_m: f32, rng: &mut StreamRng) {
        let fitting = (self.size_m.1 / sensor_width_m).floor().max(1.0) as usize;
        let mut best: Option<Plan> = None;
        for bands in [fitting, fitting, fitting, fitting + 1] {
            self.plan.nodes.clear();
            self.plan.measure_all();
            self.begin_sweep(bands);
            self.look_along();
            self.complete(usize::MAX, rng);
            self.cool(FIRST, rng);
            if best.as_ref().is_none_or(|best| self.plan.length_m() < best.length_m()) {
                best = Some(self.plan.clone());
            }
        }
        *self.plan = best.expect("there are sweeps");
        self.look_along();
        self.cool(SECOND, rng);
    }

    /// Makes the plan show everything again, with as little as is needed.
    pub(super) fn mend(&mut self, next: usize, rng: &mut StreamRng) {
        self.look_along();
        for _ in 0..MENDING {
            if self.ground.missed() == 0 {
                break;
            }
            self.try_change(usize::MAX, 0.05, DEAR_M, rng);
        }
        self.complete(ADDED, rng);
        self.drop_from(0, next);
        for _ in 0..CHANGES {
            self.try_change(next.saturating_mul(2), COLD_M, DEAR_M, rng);
        }
    }

    /// Looks in bands along the pasture, in turn one way and the other.
    fn begin_sweep(&mut self, bands: usize) {
        let (length_m, width_m) = self.size_m;
        let looks = (length_m / (STRIDE * self.ground.range_m())).ceil().max(1.0) as usize;
        for band in 0..bands {
            let y_m = (band as f32 + 0.5) * width_m / bands as f32;
            for look in 0..looks {
                let along_m = (look as f32 + 0.5) * length_m / looks as f32;
                let spot = if band % 2 == 0 {
                    Spot::facing(along_m, y_m, (1.0, 0.0))
                } else {
                    Spot::facing(length_m - along_m, y_m, (-1.0, 0.0))
                };
                self.plan.insert(self.plan.nodes.len(), Node::view(spot));
            }
        }
    }

    /// Tries changes, of which fewer and fewer are accepted that make the plan worse.
    fn cool(&mut self, (tries, hot_m): (usize, f32), rng: &mut StreamRng) {
        let cooling = (COLD_M / hot_m).powf(1.0 / tries as f32);
        let mut heat_m = hot_m;
        for tried in 0..tries {
            let price_m = PRICE_M * (1.0 + 10.0 * tried as f32 / tries as f32);
            self.try_change(usize::MAX, heat_m, price_m, rng);
            heat_m *= cooling;
        }
        self.complete(usize::MAX, rng);
        self.drop_from(0, usize::MAX);
    }

    /// Tries a change of one look.
    pub(super) fn try_change(&mut self, next: usize, heat_m: f32, price_m: f32, rng: &mut StreamRng) {
        if self.plan.nodes.is_empty() { return }
        let place = below(self.plan.nodes.len().min(next), rng);
        if self.plan.nodes[place].weed.is_some() { return }
        let spot = self.plan.nodes[place].spot;
        let cost = |views: &Self| views.plan.length_m() + price_m * views.ground.missed() as f32;
        let before_m = cost(self);
        let kind = uniform(rng);
        let chance = (uniform(rng) as f32).max(1e-9);
        let limit_m = before_m - heat_m * chance.ln();
        if kind < 0.9 {
            let spread_m = if uniform(rng) < 0.5 { 0.5 } else { 2.0 };
            let (x_m, y_m) = (spot.x_m + spread_m * bell(rng), spot.y_m + spread_m * bell(rng));
            let turn = if uniform(rng) < 0.1 { 1.0 } else { 0.2 };
            let moved = Spot::facing(x_m, y_m, cos_sin(spot.heading_rad + turn * bell(rng)));
            if !self.allows(&moved) { return }
            // Without a look at the ground first.
            let to_m = self.plan.leg_m(self.plan.before(place), &moved);
            let from_m = self.plan.after(place + 1).map_or(0.0, |after| self.plan.leg_m(&moved, after));
            if before_m - self.around_m(place) + to_m + from_m - price_m * self.ground.missed() as f32 > limit_m { return }
            self.change(place, place + 1, Some(moved));
            if cost(self) > limit_m { self.change(place, place + 1, Some(spot)); }
        } else if kind < 0.95 {
            self.change(place, place + 1, None);
            if cost(self) > limit_m { self.change(place, place, Some(spot)); }
        } else if self.ground.missed() > 0 {
            if let Some((place, spot)) = self.best_look(rng) {
                self.change(place, place, Some(spot));
                if cost(self) > limit_m { self.change(place, place + 1, None); }
            }
        } else {
            // In the middle of a leg.
            let Some(before) = place.checked_sub(1) else { return };
            let before = self.plan.nodes[before].spot;
            let middle = Spot::facing(0.5 * (before.x_m + spot.x_m) + bell(rng), 0.5 * (before.y_m + spot.y_m) + bell(rng), cos_sin(spot.heading_rad + bell(rng)));
            self.change(place, place, Some(middle));
            if cost(self) > limit_m { self.change(place, place + 1, None); }
        }
    }

    /// Counts what the plan will show.
    pub(super) fn look_along(&mut self) {
        self.ground.forget_looks();
        if self.ground.open() == 0 {
            return;
        }
        for place in 0..self.plan.nodes.len() {
            let radius_m = self.plan.radius_m.into();
            self.ground.add_leg(self.plan.before(place), &self.plan.nodes[place].spot, radius_m);
        }
    }

    /// Adds places to look from until the plan shows everything, or so many are added.
    pub(super) fn complete(&mut self, most: usize, rng: &mut StreamRng) {
        let mut added = 0;
        while self.ground.missed() > 0 && added < most {
            let Some((place, spot)) = self.best_look(rng) else { return };
            self.change(place, place, Some(spot));
            added += 1;
        }
    }

    /// The place to look from that shows most for its detour.
    fn best_look(&self, rng: &mut StreamRng) -> Option<(usize, Spot)> {
        let range_m = self.ground.range_m();
        let mut best: Option<(f32, usize, Spot)> = None;
        for _ in 0..CELLS {
            let (x_m, y_m) = self.ground.missed_at(below(self.ground.missed(), rng));
            #[expect(clippy::cast_possible_truncation, reason = "single precision is enough")]
            let first_rad = uniform(rng) as f32 * TAU / SIDES as f32;
            for side in 0..SIDES {
                let (cos, sin) = cos_sin(first_rad + TAU * side as f32 / SIDES as f32);
                for distance in DISTANCES {
                    let away_m = distance * range_m;
                    let spot = Spot::facing(x_m - away_m * cos, y_m - away_m * sin, (cos, sin));
                    if !self.allows(&spot) {
                        continue;
                    }
                    let gain = self.ground.gain(&spot);
                    if gain == 0 {
                        continue;
                    }
                    let (detour_m, place) = self.best_place(&spot);
                    let price = (detour_m + 0.5) / gain as f32;
                    if best.as_ref().is_none_or(|&(least, ..)| price < least) {
                        best = Some((price, place, spot));
                    }
                }
            }
        }
        best.map(|(_, place, spot)| (place, spot))
    }

    /// The shortest detour by which the plan can pass a spot, among the places that are nearest to it.
    fn best_place(&self, spot: &Spot) -> (f32, usize) {
        let mut best = (f32::INFINITY, self.plan.nodes.len());
        for place in 0..=self.plan.nodes.len() {
            let before = self.plan.before(place);
            let there_m = before.distance_to(spot);
            let least_m = self.plan.after(place).map_or(there_m, |after| {
                there_m + spot.distance_to(after) - self.plan.legs_m[place]
            });
            if least_m < best.0 {
                let detour_m = self.plan.detour_m(place, spot);
                if detour_m < best.0 {
                    best = (detour_m, place);
                }
            }
        }
        best
    }

    fn allows(&self, spot: &Spot) -> bool {
        let (length_m, width_m) = self.size_m;
        (-OUTSIDE_M..=length_m + OUTSIDE_M).contains(&spot.x_m)
            && (-OUTSIDE_M..=width_m + OUTSIDE_M).contains(&spot.y_m)
    }

    /// Replaces the nodes of some places by a look, or by nothing, and counts what is shown.
    fn change(&mut self, first: usize, end: usize, look: Option<Spot>) {
        let radius_m = self.plan.radius_m.into();
        // The legs to the nodes that go, and to the one behind them.
        for place in first..(end + 1).min(self.plan.nodes.len()) {
            self.ground.remove_leg(self.plan.before(place), &self.plan.nodes[place].spot, radius_m);
        }
        for _ in first..end {
            self.plan.remove(first);
        }
        if let Some(spot) = look {
            self.plan.insert(first, Node::view(spot));
        }
        let added = usize::from(look.is_some());
        for place in first..(first + added + 1).min(self.plan.nodes.len()) {
            self.ground.add_leg(self.plan.before(place), &self.plan.nodes[place].spot, radius_m);
        }
    }

    /// Leaves out places to look from, of the first so many, without which the plan is shorter and shows no less.
    pub(super) fn drop_from(&mut self, first: usize, most: usize) {
        let mut place = first;
        let mut looked = 0;
        while place < self.plan.nodes.len() && looked < most {
            if self.plan.nodes[place].weed.is_some() {
                place += 1;
                continue;
            }
            looked += 1;
            let (spot, missed) = (self.plan.nodes[place].spot, self.ground.missed());
            let length_m = self.around_m(place);
            self.change(place, place + 1, None);
            let is_shorter = self.plan.legs_m.get(place).copied().unwrap_or(0.0) <= length_m;
            if self.ground.missed() > missed || !is_shorter {
                self.change(place, place, Some(spot));
                place += 1;
            }
        }
    }

    /// Length of the legs to a place and from there.
    fn around_m(&self, place: usize) -> f32 {
        self.plan.legs_m[place] + self.plan.legs_m.get(place + 1).copied().unwrap_or(0.0)
    }

    /// Tries so many times to move one of the next few places to look from, so that the plan is shorter and shows no less.
    pub(super) fn shift(&mut self, next: usize, tries: usize, rng: &mut StreamRng) {
        let nodes = self.plan.nodes.iter().enumerate();
        let places: Vec<usize> =
            nodes.filter(|(_, node)| node.weed.is_none()).map(|(place, _)| place).take(next).collect();
        if places.is_empty() {
            return;
        }
        for _ in 0..tries {
            let place = places[below(places.len(), rng)];
            let spot = self.plan.nodes[place].spot;
            let spread_m = if uniform(rng) < 0.5 { 1.0 } else { 3.0 };
            let (x_m, y_m) = (spot.x_m + spread_m * bell(rng), spot.y_m + spread_m * bell(rng));
            let moved = Spot::facing(x_m, y_m, cos_sin(spot.heading_rad + 0.25 * bell(rng)));
            if !self.allows(&moved) {
                continue;
            }
            let before_m = self.around_m(place);
            let to_m = self.plan.leg_m(self.plan.before(place), &moved);
            let from_m = self.plan.after(place + 1).map_or(0.0, |after| self.plan.leg_m(&moved, after));
            if to_m + from_m > before_m - WORTH_M {
                continue;
            }
            let missed = self.ground.missed();
            self.change(place, place + 1, Some(moved));
            if self.ground.missed() > missed {
                self.change(place, place + 1, Some(spot));
            }
        }
    }
}

/// How many places are added at once at most while the mower drives.
pub(super) const ADDED: usize = MOST;
