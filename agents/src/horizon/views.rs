//! Places to look from, until a plan shows all ground that is still open.

use std::f32::consts::TAU;

use swath_core::math;
use swath_core::rng::{StreamRng, below, uniform};

use super::anneal::{bell, cooling};
use super::deadline::Deadline;
use super::open::OpenGround;
use super::plan::{Node, Plan};
use super::spot::{Spot, cos_sin, single};

/// The way between two looks in a band, in depths of the triangle.
const STRIDE: f32 = 0.67;
/// Open cells that are looked at in search of a better place to look from, and most places that are added at a time while the mower
/// drives.
const CELLS: usize = 6;
const ADDED: usize = 12;
/// From how many sides, and from how far away, in depths of the triangle.
const SIDES: usize = 12;
/// How many times every open cell is looked at before none of them can be seen.
const TIMES: usize = 3;
const DISTANCES: [f32; 3] = [0.45, 0.7, 0.95];
/// How far outside the pasture the mower may look from, metres.
const OUTSIDE_M: f32 = 6.0;
/// Share of changes that move a place to look from.
const MOVES: f64 = 0.9;
/// How much longer each of the first plans may become at the beginning, and the best of them then, metres.
const FIRST_M: f32 = 4.0;
const SECOND_M: f32 = 0.4;
const COLD_M: f32 = 0.02;
/// Changes between two looks at the clock.
const CLOCK: usize = 16;
/// What an open cell costs that is not shown while the mower drives, metres.
const DEAR_M: f32 = 10.0;
/// What an open cell costs at first that is not shown, metres.
const PRICE_M: f32 = 0.4;

/// Plans over open ground.
pub(super) struct Views<'a> {
    pub(super) plan: &'a mut Plan,
    pub(super) ground: &'a mut OpenGround,
    pub(super) size_m: (f32, f32),
    /// No more changes are tried from then on; what must be done is done all the same.
    pub(super) until: Option<Deadline>,
}

impl Views<'_> {
    /// The shortest way found to look at the whole pasture: sweeps in bands, as many as there is hardly room for and one more,
    /// annealed with so many changes each.
    pub(super) fn sweep(&mut self, sensor_width_m: f32, tries: usize, rng: &mut StreamRng) {
        let fitting = math::floor_index((self.size_m.1 / sensor_width_m).into()).max(1);
        let mut best: Option<Plan> = None;
        for bands in [fitting, fitting, fitting + 1] {
            self.plan.nodes.clear();
            self.plan.measure_all();
            self.begin_sweep(bands);
            self.look_along();
            self.complete(usize::MAX, rng);
            self.cool(tries, FIRST_M, rng);
            if best.as_ref().is_none_or(|best| self.plan.length_m() < best.length_m()) {
                best = Some(self.plan.clone());
            }
        }
        *self.plan = best.expect("there are sweeps");
        self.look_along();
        self.cool(tries, SECOND_M, rng);
    }

    /// Makes the plan show everything again, with as little as is needed, and with so many changes.
    pub(super) fn mend(&mut self, next: usize, tries: usize, rng: &mut StreamRng) {
        self.look_along();
        for tried in 0..tries {
            if self.ground.missed() == 0 || self.is_late(tried) {
                break;
            }
            self.try_change(usize::MAX, 0.05, DEAR_M, rng);
        }
        self.complete(ADDED, rng);
        self.drop_looks(next);
        for tried in 0..tries / 2 {
            if self.is_late(tried) {
                break;
            }
            self.try_change(next.saturating_mul(2), COLD_M, DEAR_M, rng);
        }
        // What was too dear is not forgotten, or the plan might end before the ground does.
        self.complete(ADDED, rng);
    }

    /// Looks in bands along the pasture, in turn one way and the other.
    fn begin_sweep(&mut self, bands: usize) {
        let (length_m, width_m) = self.size_m;
        let looks = math::floor_index((length_m / (STRIDE * self.ground.range_m())).into()) + 1;
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
    fn cool(&mut self, tries: usize, hot_m: f32, rng: &mut StreamRng) {
        let cooling = cooling(hot_m, COLD_M, tries);
        let mut heat_m = hot_m;
        for tried in 0..tries {
            if self.is_late(tried) {
                break;
            }
            let price_m = PRICE_M * (1.0 + 10.0 * tried as f32 / tries as f32);
            self.try_change(usize::MAX, heat_m, price_m, rng);
            heat_m *= cooling;
        }
        self.complete(usize::MAX, rng);
        self.drop_looks(usize::MAX);
    }

    /// Whether it is too late for another change after so many; the clock is looked at now and then.
    fn is_late(&self, tried: usize) -> bool {
        tried.is_multiple_of(CLOCK) && self.until.is_some_and(Deadline::is_over)
    }

    /// Tries a change of one of the first so many nodes, if it is a place to look from: it is moved, left out, or gets another one
    /// before it.
    fn try_change(&mut self, next: usize, heat_m: f32, price_m: f32, rng: &mut StreamRng) {
        let count = self.plan.nodes.len().min(next);
        if count == 0 {
            return;
        }
        let place = below(count, rng);
        let Node { spot, weed: None } = self.plan.nodes[place] else { return };
        let kind = uniform(rng);
        let spared_m = heat_m * single(-math::ln(1.0 - uniform(rng)));
        let limit_m = self.plan.length_m() + price_m * self.ground.missed() as f32 + spared_m;
        let (first, end, look) = if kind < MOVES {
            let spread_m = if uniform(rng) < 0.5 { 0.5 } else { 2.0 };
            let turn_rad = if uniform(rng) < 0.1 { 1.0 } else { 0.2 };
            (place, place + 1, Some(Self::near(&spot, spread_m, turn_rad, rng)))
        } else if kind < 0.5 * (1.0 + MOVES) {
            (place, place + 1, None)
        } else if self.ground.missed() > 0 {
            let Some((place, look)) = self.best_look(rng) else { return };
            (place, place, Some(look))
        } else {
            // In the middle of a leg.
            let before = *self.plan.before(place);
            let (x_m, y_m) = (0.5 * (before.x_m + spot.x_m), 0.5 * (before.y_m + spot.y_m));
            (place, place, Some(Self::near(&Spot { x_m, y_m, ..spot }, 1.0, 1.0, rng)))
        };
        if look.as_ref().is_some_and(|look| !self.allows(look)) {
            return;
        }
        // Mostly the way alone tells that it is too long, which is known more quickly than what it shows.
        if end > first
            && let Some(look) = look
            && self.plan.length_m() + self.replaced_m(first, &look) > limit_m
        {
            return;
        }
        self.change(first, end, look);
        if self.plan.length_m() + price_m * self.ground.missed() as f32 > limit_m {
            let before = (end > first).then_some(spot);
            self.change(first, first + usize::from(look.is_some()), before);
        }
    }

    /// A spot somewhere near another one.
    fn near(spot: &Spot, spread_m: f32, turn_rad: f32, rng: &mut StreamRng) -> Spot {
        let (x_m, y_m) = (spot.x_m + spread_m * bell(rng), spot.y_m + spread_m * bell(rng));
        Spot::facing(x_m, y_m, cos_sin(spot.heading_rad + turn_rad * bell(rng)))
    }

    /// How much longer the plan would be with another spot at that place.
    fn replaced_m(&self, place: usize, spot: &Spot) -> f32 {
        let to_m = self.plan.leg_m(self.plan.before(place), spot);
        let after = self.plan.after(place + 1);
        to_m + after.map_or(0.0, |after| self.plan.leg_m(spot, after)) - self.around_m(place)
    }

    /// Counts what the plan will show.
    fn look_along(&mut self) {
        self.ground.forget_looks();
        if self.ground.open() == 0 {
            return;
        }
        for place in 0..self.plan.nodes.len() {
            let to = &self.plan.nodes[place].spot;
            self.ground.add_leg(self.plan.before(place), to, &self.plan.ways);
        }
    }

    /// Adds places to look from until the plan shows everything, or so many are added.
    fn complete(&mut self, most: usize, rng: &mut StreamRng) {
        let mut added = 0;
        while self.ground.missed() > 0 && added < most {
            let Some((place, spot)) = self.best_look(rng).or_else(|| self.any_look(rng)) else {
                return;
            };
            self.change(place, place, Some(spot));
            added += 1;
        }
    }

    /// The place to look from that shows most for its detour, of those that show some of the open cells.
    fn best_look(&self, rng: &mut StreamRng) -> Option<(usize, Spot)> {
        let looks = (0..CELLS).filter_map(|_| {
            let cell = below(self.ground.missed(), rng);
            self.look_at(cell, rng)
        });
        let best = looks.reduce(|best, look| if look.0 < best.0 { look } else { best });
        best.map(|(_, place, spot)| (place, spot))
    }

    /// A place to look from that shows anything at all: where cells that chance has chosen cannot be seen, others may, or the same
    /// ones from other sides.
    fn any_look(&self, rng: &mut StreamRng) -> Option<(usize, Spot)> {
        let mut cells = (0..TIMES).flat_map(|_| 0..self.ground.missed());
        let (_, place, spot) = cells.find_map(|cell| self.look_at(cell, rng))?;
        Some((place, spot))
    }

    /// The place that shows most for its detour, of those from which that open cell may be seen, and what it costs.
    fn look_at(&self, cell: usize, rng: &mut StreamRng) -> Option<(f32, usize, Spot)> {
        let range_m = self.ground.range_m();
        let mut best: Option<(f32, usize, Spot)> = None;
        let (x_m, y_m) = self.ground.missed_at(cell);
        let first_rad = single(uniform(rng)) * TAU / SIDES as f32;
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
        best
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
        let ((length_m, width_m), outside_m) =
            (self.size_m, self.plan.ways.outside_m().min(OUTSIDE_M));
        (-outside_m..=length_m + outside_m).contains(&spot.x_m)
            && (-outside_m..=width_m + outside_m).contains(&spot.y_m)
    }

    /// Replaces the nodes of some places by a look, or by nothing, and counts what is shown.
    fn change(&mut self, first: usize, end: usize, look: Option<Spot>) {
        let ways = self.plan.ways;
        // The legs to the nodes that go, and to the one behind them.
        for place in first..(end + 1).min(self.plan.nodes.len()) {
            self.ground.remove_leg(self.plan.before(place), &self.plan.nodes[place].spot, &ways);
        }
        for _ in first..end {
            self.plan.remove(first);
        }
        if let Some(spot) = look {
            self.plan.insert(first, Node::view(spot));
        }
        let added = usize::from(look.is_some());
        for place in first..(first + added + 1).min(self.plan.nodes.len()) {
            self.ground.add_leg(self.plan.before(place), &self.plan.nodes[place].spot, &ways);
        }
    }

    /// Leaves out places to look from, of the first so many, without which the plan is shorter and shows no less.
    fn drop_looks(&mut self, most: usize) {
        let (mut place, mut looked) = (0, 0);
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
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use swath_core::config::Document;
    use swath_core::grid::Grid;
    use swath_core::ground::SeenGround;
    use swath_core::rng::agent_rng;
    use swath_core::site::Site;

    use super::super::ways::Ways;
    use super::*;

    fn site(overlay: &str) -> Site {
        let mut document = Document::open("cowbot-field").unwrap();
        document.overlay(overlay.parse().unwrap());
        Site::new(&document.scenario().unwrap())
    }

    #[test]
    fn a_plan_shows_all_open_ground_again_whatever_was_left_out_of_it() {
        for overlay in
            ["", "sensor.range_m = 8.0\nsensor.width_m = 8.0", "pasture.headland_m = 1.5"]
        {
            let site = site(overlay);
            let mut plan = Plan::new(Spot::new(0.0, 0.0, 0.0), Ways::new(&site));
            let mut ground = OpenGround::new(&site);
            let size_m = (single(site.length_m), single(site.width_m));
            let mut rng = agent_rng(1);
            Views { plan: &mut plan, ground: &mut ground, size_m, until: None }.sweep(
                single(site.sensor_width_m),
                300,
                &mut rng,
            );
            for round in 0..20 {
                let (mut plan, mut ground) = (plan.clone(), ground.clone());
                for _ in 0..3 {
                    let place = below(plan.nodes.len(), &mut rng);
                    plan.remove(place);
                }
                Views { plan: &mut plan, ground: &mut ground, size_m, until: None }
                    .mend(5, 125, &mut rng);
                assert_eq!(ground.missed(), 0, "{overlay}, round {round}");
            }
        }
    }

    #[test]
    fn the_last_ground_is_looked_at_however_far_away_it_is() {
        let site = site("");
        let size_m = (single(site.length_m), single(site.width_m));
        let grid = Grid::new(site.length_m, site.width_m);
        let mut seen = SeenGround::none(Arc::new(grid));
        let last = (grid.columns() - 1, grid.rows() - 1);
        for row in 0..grid.rows() {
            for column in (0..grid.columns()).filter(|&column| (column, row) != last) {
                seen.absorb(&[grid.cell_at(grid.centre(column, row))]);
            }
        }
        for seed in 0..20 {
            let mut plan = Plan::new(Spot::new(0.0, 0.0, 0.0), Ways::new(&site));
            let mut ground = OpenGround::new(&site);
            // One cell is open, and the way there is longer than what a cell is worth to a single change.
            ground.settle_band(0.0, size_m.1);
            ground.reopen(&seen);
            assert_eq!(ground.open(), 1);
            Views { plan: &mut plan, ground: &mut ground, size_m, until: None }.mend(
                5,
                500,
                &mut agent_rng(seed),
            );
            assert_eq!(ground.missed(), 0, "seed {seed}");
        }
    }

    #[test]
    fn a_time_that_is_over_ends_all_changes_but_leaves_no_ground_out() {
        let site = site("");
        let mut plan = Plan::new(Spot::new(0.0, 0.0, 0.0), Ways::new(&site));
        let mut ground = OpenGround::new(&site);
        let size_m = (single(site.length_m), single(site.width_m));
        let until = Deadline::within(0.0);
        // As many changes would take days.
        Views { plan: &mut plan, ground: &mut ground, size_m, until }.sweep(
            single(site.sensor_width_m),
            1 << 40,
            &mut agent_rng(1),
        );
        assert_eq!(ground.missed(), 0);
    }
}
