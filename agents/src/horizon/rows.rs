//! Rows: straight passes over all that is left, in the order in which the turns between them are shortest.

use swath_core::known::KnownWeed;
use swath_core::site::{Site, passes};

use super::open::OpenGround;
use super::plan::Node;
use super::spot::{Spot, single};
use super::ways::Ways;

/// How far apart in the order rows are that change places.
const WINDOW: usize = 60;
/// A change of the order is made if it is so much shorter, metres, and most rounds of changes.
const WORTH_M: f32 = 1e-3;
const ROUNDS: usize = 30;
/// Most rows between which lengths are kept: 4 MB.
const MOST_ROWS: usize = 512;
/// How far open ground must reach into a row to count, metres: more than rounding.
const INTO_M: f32 = 1e-2;

/// One row, and which way it is driven.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pass {
    row: usize,
    is_west: bool,
}

/// Where a row begins and ends that still has something to mow, metres along x.
type Span = Option<(f32, f32)>;

/// The rows of `bcp` as far as weeds are known or ground is open on them: whoever drives them all has mowed everything.
///
/// Two neighbours make a mower with a wide turn loop, so it mostly takes a row farther off and comes back for those between.
#[derive(Debug, Clone)]
pub(super) struct Rows {
    site: Site,
    ways: Ways,
    spans: Vec<Span>,
    is_driven: Vec<bool>,
    order: Vec<Pass>,
}

impl Rows {
    /// Rows over the whole pasture.
    pub(super) fn new(site: &Site, ways: Ways, start: &Spot) -> Self {
        let count = passes(site.width_m, site.deck_width_m);
        let whole = (0.0, single(site.length_m));
        let mut rows = Self {
            site: *site,
            ways,
            spans: vec![Some(whole); count],
            is_driven: vec![false; count],
            order: Vec::new(),
        };
        // Every stride from neighbour to neighbour up to rows between which half a circle is the turn.
        let wide = swath_core::math::floor_index(2.0 * site.turning_radius_m / site.deck_width_m);
        let mut best: Option<(f32, Vec<Pass>)> = None;
        for stride in 1..=(wide + 2).min(count) {
            let strided = (0..stride).flat_map(|first| (first..count).step_by(stride));
            rows.order = strided
                .enumerate()
                .map(|(place, row)| Pass { row, is_west: place % 2 == 1 })
                .collect();
            rows.shorten(start);
            let length_m = rows.length_m(start);
            if best.as_ref().is_none_or(|&(least_m, _)| length_m < least_m) {
                best = Some((length_m, rows.order.clone()));
            }
        }
        rows.order = best.expect("there is a row").1;
        rows
    }

    /// Whether nothing is left on any row.
    pub(super) fn are_driven(&self) -> bool {
        self.order.is_empty()
    }

    /// Length of all rows and turns from a spot on, metres.
    pub(super) fn length_m(&self, start: &Spot) -> f32 {
        let mut from = *start;
        let mut length_m = 0.0;
        for pass in &self.order {
            let (entry, exit) = self.ends(*pass);
            length_m += self.ways.leg_m(&from, &entry) + (exit.x_m - entry.x_m).abs();
            from = exit;
        }
        length_m
    }

    /// Where each row begins and ends, in order.
    pub(super) fn spots(&self) -> Vec<Spot> {
        let ends = self.order.iter().map(|pass| self.ends(*pass));
        ends.flat_map(|(entry, exit)| [entry, exit]).collect()
    }

    /// The known weeds on the rows as nodes, in the order in which they are mowed.
    pub(super) fn nodes(
        &self,
        weeds: impl IntoIterator<Item = KnownWeed>,
        reach_m: f32,
    ) -> Vec<Node> {
        let mut on_row: Vec<Vec<(f32, f32, u32)>> = vec![Vec::new(); self.spans.len()];
        for weed in weeds {
            let (x_m, y_m) = (single(weed.position.x), single(weed.position.y));
            on_row[self.row_of(y_m)].push((x_m, y_m, weed.number));
        }
        let mut nodes = Vec::new();
        for pass in &self.order {
            let (row_m, along) = (self.row_m(pass.row), if pass.is_west { -1.0 } else { 1.0 });
            let weeds = &mut on_row[pass.row];
            weeds.sort_by(|one, other| (along * one.0).total_cmp(&(along * other.0)));
            for &(x_m, y_m, number) in &*weeds {
                let left_m = (along * (y_m - row_m)).clamp(-reach_m, reach_m);
                nodes.push(Node::weed(number, (x_m, y_m), left_m, (along, 0.0)));
            }
        }
        nodes
    }

    /// Takes note that the first row has been driven to its end.
    pub(super) fn drive_first(&mut self, ground: &mut OpenGround) {
        let Pass { row, .. } = self.order.remove(0);
        self.is_driven[row] = true;
        // Ground that reaches into a row beside waits for that one.
        let rims_m = |row: usize| {
            (self.row_m(row) - 0.5 * self.deck_m(), self.row_m(row) + 0.5 * self.deck_m())
        };
        let (mut low_m, mut high_m) = rims_m(row);
        if row > 0 && self.is_driven[row - 1] {
            low_m = rims_m(row - 1).0;
        }
        if row + 1 < self.is_driven.len() && self.is_driven[row + 1] {
            high_m = rims_m(row + 1).1;
        }
        ground.settle_band(low_m, high_m);
    }

    /// Leaves out what need not be driven any more, and orders the rest from where the mower stands; `is_on_first` says that it
    /// is on the first row. Returns whether it still is.
    pub(super) fn trim(
        &mut self,
        ground: &OpenGround,
        weeds: impl IntoIterator<Item = KnownWeed>,
        start: &Spot,
        is_on_first: bool,
    ) -> bool {
        let on_row = self.order.first().copied().filter(|_| is_on_first);
        self.spans.fill(None);
        ground.for_each_open_span(|low_m, high_m, from_m, to_m| {
            let (first, last) = (self.row_of(low_m + INTO_M), self.row_of(high_m - INTO_M));
            for row in first..=last {
                if !self.is_driven[row] {
                    widen(&mut self.spans[row], from_m, to_m);
                }
            }
        });
        for weed in weeds {
            let x_m = single(weed.position.x);
            let row = self.row_of(single(weed.position.y));
            widen(&mut self.spans[row], x_m, x_m);
        }
        if let Some(pass) = on_row {
            self.leave_behind(pass, start.x_m);
        }
        let Self { spans, order, .. } = self;
        order.retain(|pass| spans[pass.row].is_some());
        let missing: Vec<usize> = (0..self.spans.len())
            .filter(|&row| {
                self.spans[row].is_some() && self.order.iter().all(|pass| pass.row != row)
            })
            .collect();
        self.order.extend(missing.into_iter().map(|row| Pass { row, is_west: false }));
        self.shorten(start);
        on_row.is_some() && self.order.first().copied() == on_row
    }

    /// Leaves out what lies behind on a row.
    fn leave_behind(&mut self, Pass { row, is_west }: Pass, x_m: f32) {
        let Some((low_m, high_m)) = self.spans[row] else { return };
        let (low_m, high_m) =
            if is_west { (low_m, high_m.min(x_m)) } else { (low_m.max(x_m), high_m) };
        self.spans[row] = (low_m < high_m).then_some((low_m, high_m));
    }

    /// Where a row is entered and left.
    fn ends(&self, pass: Pass) -> (Spot, Spot) {
        let (low_m, high_m) = self.spans[pass.row].expect("rows in the order have a span");
        let y_m = self.row_m(pass.row);
        if pass.is_west {
            let west = |x_m| Spot::facing(x_m, y_m, (-1.0, 0.0));
            (west(high_m), west(low_m))
        } else {
            let east = |x_m| Spot::facing(x_m, y_m, (1.0, 0.0));
            (east(low_m), east(high_m))
        }
    }

    fn deck_m(&self) -> f32 {
        single(self.site.deck_width_m)
    }

    /// The middle of a row, metres.
    fn row_m(&self, row: usize) -> f32 {
        (row as f32 + 0.5) * self.deck_m()
    }

    fn row_of(&self, y_m: f32) -> usize {
        let row = swath_core::math::floor_index((y_m / self.deck_m()).max(0.0).into());
        row.min(self.spans.len() - 1)
    }

    /// Changes the order until nothing is gained: runs of rows are driven the other way round, and single ones moved.
    fn shorten(&mut self, start: &Spot) {
        let count = self.order.len();
        let mut turns = Turns::new(self.spans.len());
        for _ in 0..ROUNDS {
            let mut is_better = false;
            for first in 0..count {
                for last in first..count.min(first + WINDOW) {
                    is_better |= self.try_reverse(first, last, start, &mut turns);
                }
            }
            for from in 0..count {
                for to in from.saturating_sub(WINDOW)..count.min(from + WINDOW) {
                    is_better |= self.try_move(from, to, start, &mut turns);
                }
            }
            if !is_better {
                return;
            }
        }
    }

    fn try_reverse(&mut self, first: usize, last: usize, start: &Spot, turns: &mut Turns) -> bool {
        let turned = |pass: Pass| Pass { is_west: !pass.is_west, ..pass };
        let (head, tail) = (self.order[first], self.order[last]);
        let (before, after) = (self.pass_before(first), self.order.get(last + 1).copied());
        let mut leg_m = |from: Option<Pass>, to: Option<Pass>| {
            to.map_or(0.0, |to| turns.leg_m(self, start, from, to))
        };
        let now_m = leg_m(before, Some(head)) + leg_m(Some(tail), after);
        let then_m = leg_m(before, Some(turned(tail))) + leg_m(Some(turned(head)), after);
        if then_m > now_m - WORTH_M {
            return false;
        }
        self.order[first..=last].reverse();
        self.order[first..=last].iter_mut().for_each(|pass| *pass = turned(*pass));
        true
    }

    fn try_move(&mut self, from: usize, to: usize, start: &Spot, turns: &mut Turns) -> bool {
        if from == to {
            return false;
        }
        let pass = self.order[from];
        let (before, after) = (self.pass_before(from), self.order.get(from + 1).copied());
        let mut leg_m = |from: Option<Pass>, to: Pass| turns.leg_m(self, start, from, to);
        let mut won_m = leg_m(before, pass);
        if let Some(after) = after {
            won_m += leg_m(Some(pass), after) - leg_m(before, after);
        }
        // Between which two rows it comes.
        let place = if to > from { to + 1 } else { to };
        let (before, after) = (self.pass_before(place), self.order.get(place).copied());
        for pass in [pass, Pass { is_west: !pass.is_west, ..pass }] {
            let mut cost_m = leg_m(before, pass);
            if let Some(after) = after {
                cost_m += leg_m(Some(pass), after) - leg_m(before, after);
            }
            if cost_m < won_m - WORTH_M {
                self.order.remove(from);
                self.order.insert(to, pass);
                return true;
            }
        }
        false
    }

    /// The pass before that place in the order; none before the first one, where the mower starts.
    fn pass_before(&self, place: usize) -> Option<Pass> {
        place.checked_sub(1).map(|before| self.order[before])
    }
}

/// Lengths of the ways from the end of one row to the beginning of another, each worked out once while orders are tried.
struct Turns {
    rows: usize,
    /// By where from, the start first, and by where to; not a number where it was not asked for yet.
    legs_m: Vec<f32>,
}

impl Turns {
    fn new(rows: usize) -> Self {
        let legs = if rows <= MOST_ROWS { (2 * rows + 1) * 2 * rows } else { 0 };
        Self { rows, legs_m: vec![f32::NAN; legs] }
    }

    fn leg_m(&mut self, rows: &Rows, start: &Spot, from: Option<Pass>, to: Pass) -> f32 {
        let number = |pass: Pass| 2 * pass.row + usize::from(pass.is_west);
        let way_m = || {
            let from = from.map_or(*start, |from| rows.ends(from).1);
            rows.ways.leg_m(&from, &rows.ends(to).0)
        };
        let place = from.map_or(0, |from| 1 + number(from)) * 2 * self.rows + number(to);
        match self.legs_m.get_mut(place) {
            Some(leg_m) => {
                if leg_m.is_nan() {
                    *leg_m = way_m();
                }
                *leg_m
            }
            None => way_m(),
        }
    }
}

fn widen(span: &mut Span, from_m: f32, to_m: f32) {
    *span =
        Some(span.map_or((from_m, to_m), |(low_m, high_m)| (low_m.min(from_m), high_m.max(to_m))));
}

#[cfg(test)]
mod tests {
    use super::*;
    use swath_core::config::Document;

    fn site(toml: &str) -> Site {
        let mut document = Document::open("pasture").unwrap();
        document.overlay(toml.parse().unwrap());
        Site::new(&document.scenario().unwrap())
    }

    #[test]
    fn rows_in_the_best_order_are_no_longer_than_the_boustrophedon_path_and_shorter_where_it_loops()
    {
        for (toml, least_saved) in [
            ("mower.turning_radius_m = 1.0", 0.0),
            ("mower.turning_radius_m = 2.0", 0.04),
            ("mower.turning_radius_m = 3.0", 0.07),
            ("mower.turning_radius_m = 4.0", 0.09),
            ("mower.turning_radius_m = 5.0", 0.11),
            ("mower.turning_radius_m = 5.0\npasture.length_m = 36.0\npasture.width_m = 26.0", 0.2),
            ("mower.turning_radius_m = 5.0\npasture.width_m = 3.0", 0.0),
        ] {
            let site = site(toml);
            let start = Spot::new(0.0, 0.5 * site.deck_width_m, 0.0);
            let rows = Rows::new(&site, Ways::new(&site), &start);
            let share = f64::from(rows.length_m(&start)) / site.bcp_length_m;
            assert!(share <= 1.0 - least_saved + 1e-4, "{toml}: {share}");
        }
    }

    #[test]
    fn only_rows_with_open_ground_or_known_weeds_are_driven_and_only_as_far_as_there_are_some() {
        let site = site("");
        let start = Spot::new(0.0, 1.0, 0.0);
        let mut rows = Rows::new(&site, Ways::new(&site), &start);
        let mut ground = OpenGround::new(&site);
        ground.settle_band(0.0, 38.0);
        let weed =
            |number, x, y| KnownWeed { number, position: swath_core::geometry::Point::new(x, y) };
        let weeds = [weed(0, 90.0, 4.5), weed(1, 60.0, 5.9), weed(2, 70.0, 5.0)];
        rows.trim(&ground, weeds, &start, false);
        let ends: Vec<(f32, f32)> = rows.spots().iter().map(|spot| (spot.x_m, spot.y_m)).collect();
        // The whole of the last row, and on the way back the third one from its last weed to its first.
        assert_eq!(ends, [(0.0, 39.0), (100.0, 39.0), (90.0, 5.0), (60.0, 5.0)]);
        let order: Vec<u32> =
            rows.nodes(weeds, 0.9).iter().map(|node| node.weed.unwrap().number).collect();
        assert_eq!(order, [0, 2, 1]);
        rows.drive_first(&mut ground);
        assert_eq!(ground.open(), 0);
        rows.trim(&ground, weeds, &Spot::new(100.0, 39.0, 0.0), false);
        assert_eq!(rows.spots().len(), 2);
        rows.drive_first(&mut ground);
        rows.trim(&ground, [], &Spot::new(60.0, 5.0, 0.0), false);
        assert!(rows.are_driven());
    }
}
