//! The ground that is still to be searched, and how much of it a plan will show.

use swath_core::ground::SeenGround;
use swath_core::site::Site;

use super::spot::{Spot, single};
use super::ways::Ways;

/// Side of a cell, metres; a pasture that would have more than so many cells has larger ones.
const CELL_M: f64 = 0.5;
const MOST_CELLS: f64 = 65_536.0;
/// Spacing of the looks by which a turn is judged, metres; the mower looks more often than that.
const SPACING_M: f64 = 1.0;
/// Way between two looks of the mower, metres: so much later than planned it may see something.
const LATE_M: f32 = 0.2;

/// How far a cell may reach over a border that it is to keep, metres: rounding.
const BORDER_M: f32 = 1e-3;

/// A border of a piece of ground in the mower's frame: inside, `at + ahead * a + left * l` is not negative.
#[derive(Debug, Clone, Copy)]
struct Border {
    at_m: f32,
    ahead: f32,
    left: f32,
}

/// Cells of the pasture. One is open until the whole of it was inside of the triangle at a look, or its centre under the bar
/// with its corners at the sides: then no weed is hidden in it.
#[derive(Debug, Clone)]
pub(super) struct OpenGround {
    columns: usize,
    rows: usize,
    cell_x_m: f32,
    cell_y_m: f32,
    /// 1 if it is open, 0 if not: as wide as the counts, so that many are compared at once.
    is_open: Vec<u16>,
    open: usize,
    /// How many looks of the plan will show each cell, and how many open cells none will.
    looks: Vec<u16>,
    missed: usize,
    triangle: [Border; 3],
    range_m: f32,
    half_deck_m: f32,
}

impl OpenGround {
    pub(super) fn new(site: &Site) -> Self {
        let side_m = (site.length_m * site.width_m / MOST_CELLS).sqrt().max(CELL_M);
        let count =
            |size_m: f64| swath_core::math::floor_index((size_m / side_m - 1e-9).ceil()).max(1);
        let (columns, rows) = (count(site.length_m), count(site.width_m));
        let range_m = single(site.sensor_range_m);
        let side = single(0.5 * site.sensor_width_m / site.sensor_range_m);
        Self {
            columns,
            rows,
            cell_x_m: single(site.length_m / columns as f64),
            cell_y_m: single(site.width_m / rows as f64),
            is_open: vec![1; columns * rows],
            open: columns * rows,
            looks: vec![0; columns * rows],
            missed: columns * rows,
            triangle: [
                Border { at_m: range_m, ahead: -1.0, left: 0.0 },
                Border { at_m: 0.0, ahead: side, left: -1.0 },
                Border { at_m: 0.0, ahead: side, left: 1.0 },
            ],
            range_m,
            half_deck_m: single(0.5 * site.deck_width_m),
        }
    }

    /// Number of open cells.
    pub(super) fn open(&self) -> usize {
        self.open
    }

    /// The share of the ground that is not open.
    pub(super) fn settled_share(&self) -> f32 {
        1.0 - self.open as f32 / self.is_open.len() as f32
    }

    /// The centres of the open cells, metres.
    pub(super) fn open_centres(&self) -> Vec<(f32, f32)> {
        let open = (0..self.is_open.len()).filter(|&cell| self.is_open[cell] == 1);
        open.map(|cell| self.centre(cell)).collect()
    }

    /// Calls `visit` for each row of cells with open ones: its lower and upper border, and from where to where it is open, metres.
    pub(super) fn for_each_open_span(&self, mut visit: impl FnMut(f32, f32, f32, f32)) {
        for (row, cells) in self.is_open.chunks_exact(self.columns).enumerate() {
            let first = cells.iter().position(|&is_open| is_open == 1);
            let last = cells.iter().rposition(|&is_open| is_open == 1);
            if let (Some(first), Some(last)) = (first, last) {
                let (low_m, from_m) = (row as f32 * self.cell_y_m, first as f32 * self.cell_x_m);
                let to_m = (last + 1) as f32 * self.cell_x_m;
                visit(low_m, low_m + self.cell_y_m, from_m, to_m);
            }
        }
    }

    /// Takes note that all is mowed between two lines along the pasture, metres.
    pub(super) fn settle_band(&mut self, low_m: f32, high_m: f32) {
        for row in 0..self.rows {
            let (bottom_m, top_m) = (row as f32 * self.cell_y_m, (row + 1) as f32 * self.cell_y_m);
            if bottom_m < low_m - BORDER_M || top_m > high_m + BORDER_M {
                continue;
            }
            for cell in row * self.columns..(row + 1) * self.columns {
                let was_open = std::mem::take(&mut self.is_open[cell]);
                self.open -= usize::from(was_open);
                self.missed -= usize::from(was_open & u16::from(self.looks[cell] == 0));
            }
        }
    }

    /// Opens the cells again in which the middle of ground lies that was not seen after all, as where a mower strays from
    /// the path that it was told to drive. Returns whether there are any.
    pub(super) fn reopen(&mut self, seen: &SeenGround) -> bool {
        let grid = seen.grid();
        for row in 0..grid.rows() {
            for column in (0..grid.columns()).filter(|&column| !seen.is_seen(column, row)) {
                let middle = grid.centre(column, row);
                let place = |at_m: f64, cell_m: f32, most: usize| {
                    swath_core::math::floor_index(at_m / f64::from(cell_m)).min(most - 1)
                };
                let cell = place(middle.y, self.cell_y_m, self.rows) * self.columns
                    + place(middle.x, self.cell_x_m, self.columns);
                let was_open = std::mem::replace(&mut self.is_open[cell], 1);
                self.open += usize::from(1 - was_open);
                self.missed += usize::from((1 - was_open) & u16::from(self.looks[cell] == 0));
            }
        }
        self.open > 0
    }

    /// Number of open cells that the plan will not show.
    pub(super) fn missed(&self) -> usize {
        self.missed
    }

    /// The centre of the `index`-th of the open cells that the plan will not show, metres.
    pub(super) fn missed_at(&self, index: usize) -> (f32, f32) {
        let is_missed = |cell: &usize| self.is_open[*cell] == 1 && self.looks[*cell] == 0;
        self.centre((0..self.looks.len()).filter(is_missed).nth(index).expect("so many are missed"))
    }

    fn centre(&self, cell: usize) -> (f32, f32) {
        let (column, row) = (cell % self.columns, cell / self.columns);
        ((column as f32 + 0.5) * self.cell_x_m, (row as f32 + 0.5) * self.cell_y_m)
    }

    /// Takes note of a look. `late_m` is how far the mower may have driven since: so much less counts as seen.
    pub(super) fn settle_look(&mut self, from: &Spot, late_m: f32) {
        let triangle =
            self.triangle.map(|border| Border { at_m: border.at_m - 1e-4 - late_m, ..border });
        let bar = self.bar(0.2 + late_m);
        self.settle(from, &triangle, self.sight_m(from, 0.0), true);
        self.settle(from, &bar, self.under_m(from, 0.0), false);
    }

    /// Takes note of the looks on a straight.
    pub(super) fn settle_straight(&mut self, from: &Spot, straight_m: f32) {
        let mut seen = self.seen_on_straight(straight_m);
        // Here the looks at both ends are known.
        for (seen, exact) in seen.iter_mut().zip(self.triangle) {
            seen.at_m = exact.at_m - 1e-4;
        }
        seen[0].at_m += straight_m;
        self.settle(from, &seen, self.sight_m(from, straight_m), true);
    }

    fn settle<const BORDERS: usize>(
        &mut self,
        from: &Spot,
        borders: &[Border; BORDERS],
        heights_m: (f32, f32),
        is_whole: bool,
    ) {
        let shape = self.shape();
        let Self { is_open, looks, open, missed, columns, .. } = self;
        shape.for_each_row(from, borders, heights_m, is_whole, &mut |row, first, end| {
            let cells = row * *columns + first..row * *columns + end;
            for (is_open, looks) in is_open[cells.clone()].iter_mut().zip(&looks[cells]) {
                *open -= usize::from(*is_open);
                *missed -= usize::from(*is_open & u16::from(*looks == 0));
                *is_open = 0;
            }
        });
    }

    /// What is certainly seen on a straight, wherever on it the mower looks.
    fn seen_on_straight(&self, straight_m: f32) -> [Border; 5] {
        let [far, left, right] = self.planned_triangle();
        let side_m = self.triangle[1].ahead * (self.range_m - LATE_M);
        [
            Border { at_m: far.at_m + straight_m, ..far },
            left,
            right,
            Border { at_m: side_m, ahead: 0.0, left: 1.0 },
            Border { at_m: side_m, ahead: 0.0, left: -1.0 },
        ]
    }

    /// Forgets the plan.
    pub(super) fn forget_looks(&mut self) {
        self.looks.fill(0);
        self.missed = self.open;
    }

    /// Adds what is seen on the shortest way from one spot to another.
    pub(super) fn add_leg(&mut self, from: &Spot, to: &Spot, ways: &Ways) {
        self.change_leg(from, to, ways, 1, 1);
    }

    /// Takes it out again.
    pub(super) fn remove_leg(&mut self, from: &Spot, to: &Spot, ways: &Ways) {
        self.change_leg(from, to, ways, u16::MAX, 0);
    }

    /// Straights are seen from as a whole, turns from a few spots.
    fn change_leg(&mut self, from: &Spot, to: &Spot, ways: &Ways, change: u16, turning: u16) {
        let way = ways.way(from.pose(), to.pose());
        let mut start = from.pose();
        for segment in way.segments() {
            if segment.length_m <= 0.0 {
                continue;
            }
            if segment.curvature_per_m == 0.0 {
                self.change(&start.into(), single(segment.length_m), change, turning);
            } else {
                let looks = swath_core::math::floor_index(segment.length_m / SPACING_M) + 1;
                let apart_m = segment.length_m / looks as f64;
                for look in 1..=looks {
                    let at = start.advanced(segment.curvature_per_m, apart_m * look as f64);
                    self.change(&at.into(), 0.0, change, turning);
                }
            }
            start = start.advanced(segment.curvature_per_m, segment.length_m);
        }
    }

    /// How many open cells that the plan will not show a look would show.
    pub(super) fn gain(&self, from: &Spot) -> usize {
        let mut gain = 0;
        let shape = self.shape();
        shape.for_each_row(
            from,
            &self.planned_triangle(),
            self.sight_m(from, 0.0),
            true,
            &mut |row, first, end| {
                let cells = row * self.columns + first..row * self.columns + end;
                let both = self.is_open[cells.clone()].iter().zip(&self.looks[cells]);
                gain += both
                    .map(|(is_open, looks)| usize::from(*is_open & u16::from(*looks == 0)))
                    .sum::<usize>();
            },
        );
        gain
    }

    /// Depth of the triangle, metres.
    pub(super) fn range_m(&self) -> f32 {
        self.range_m
    }

    fn shape(&self) -> Shape {
        Shape { columns: self.columns, rows: self.rows, cell_m: (self.cell_x_m, self.cell_y_m) }
    }

    /// The ground under the bar, so far behind and ahead, in which a cell's centre lies whose corners are under it too.
    fn bar(&self, reach_m: f32) -> [Border; 4] {
        let side_m = self.half_deck_m
            - 0.5 * (self.cell_x_m * self.cell_x_m + self.cell_y_m * self.cell_y_m).sqrt();
        [
            Border { at_m: reach_m, ahead: 1.0, left: 0.0 },
            Border { at_m: reach_m, ahead: -1.0, left: 0.0 },
            Border { at_m: side_m, ahead: 0.0, left: 1.0 },
            Border { at_m: side_m, ahead: 0.0, left: -1.0 },
        ]
    }

    /// Changes how often each cell is shown that is seen on a straight; `change` returns by how many the cells shown grow.
    fn change(&mut self, from: &Spot, straight_m: f32, change: u16, turning: u16) {
        let shape = self.shape();
        let seen = self.seen_on_straight(straight_m);
        let mut bar = self.bar(LATE_M + 0.5 * single(SPACING_M));
        bar[1].at_m += straight_m;
        let (sight_m, under_m) = (self.sight_m(from, straight_m), self.under_m(from, straight_m));
        let Self { is_open, looks, missed, columns, .. } = self;
        let mut shown = 0;
        let mut visit = |row: usize, first: usize, end: usize| {
            let cells = row * *columns + first..row * *columns + end;
            let mut turned = 0_u16;
            for (is_open, looks) in is_open[cells.clone()].iter().zip(&mut looks[cells]) {
                *looks = looks.wrapping_add(change);
                turned += *is_open & u16::from(*looks == turning);
            }
            shown += usize::from(turned);
        };
        shape.for_each_row(from, &seen, sight_m, true, &mut visit);
        shape.for_each_row(from, &bar, under_m, false, &mut visit);
        if turning == 1 {
            *missed -= shown;
        } else {
            *missed += shown;
        }
    }

    /// How far above a spot the ground lies that is seen from it and from a straight that begins there, at least and at most.
    fn sight_m(&self, from: &Spot, straight_m: f32) -> (f32, f32) {
        let (ahead_m, beside_m) =
            (self.range_m * from.sin, self.range_m * self.triangle[1].ahead * from.cos);
        let (left_m, right_m, end_m) =
            (ahead_m + beside_m, ahead_m - beside_m, straight_m * from.sin);
        let low_m = left_m.min(right_m).min(0.0) + end_m.min(0.0);
        (low_m, left_m.max(right_m).max(0.0) + end_m.max(0.0))
    }

    /// The same for the ground under the bar.
    fn under_m(&self, from: &Spot, straight_m: f32) -> (f32, f32) {
        let (reach_m, end_m) = (self.half_deck_m + 1.0, straight_m * from.sin);
        (end_m.min(0.0) - reach_m, end_m.max(0.0) + reach_m)
    }

    /// The triangle as far as it is certainly looked at from a planned spot.
    fn planned_triangle(&self) -> [Border; 3] {
        let [far, left, right] = self.triangle;
        let late_m = LATE_M * self.triangle[1].ahead;
        [
            Border { at_m: far.at_m - LATE_M, ..far },
            Border { at_m: -late_m, ..left },
            Border { at_m: -late_m, ..right },
        ]
    }
}

/// Rows of a block, which are worked out together.
const BLOCK: usize = 8;

/// How the pasture is cut.
struct Shape {
    columns: usize,
    rows: usize,
    cell_m: (f32, f32),
}

impl Shape {
    /// Calls `visit` with a row, its first column and the end of its columns, for the cells whose centre lies within borders,
    /// or all of which do; the ground within lies so far above the spot at least and at most.
    #[inline]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "casts from floats saturate, and what is left is not below 0"
    )]
    fn for_each_row<const BORDERS: usize>(
        &self,
        from: &Spot,
        borders: &[Border; BORDERS],
        (low_m, high_m): (f32, f32),
        is_whole: bool,
        visit: &mut impl FnMut(usize, usize, usize),
    ) {
        let (cell_x_m, cell_y_m) = self.cell_m;
        // In world axes, relative to the spot: at + x dx + y dy.
        let borders = borders.map(|border| {
            let x = border.ahead * from.cos - border.left * from.sin;
            let y = border.ahead * from.sin + border.left * from.cos;
            let rim = if is_whole { 0.5 * (x.abs() * cell_x_m + y.abs() * cell_y_m) } else { 0.0 };
            (border.at_m - rim, x, y)
        });
        let first_row = ((from.y_m + low_m) / cell_y_m).max(0.0) as usize;
        let end_row = (((from.y_m + high_m) / cell_y_m + 1.0).max(0.0) as usize).min(self.rows);
        let slopes = borders.map(|(_, x, _)| if x.abs() < 1e-6 { 0.0 } else { 1.0 / x });
        // In blocks, whose rows the compiler takes several at once.
        for block in (first_row..end_row).step_by(BLOCK) {
            let dy_m: [f32; BLOCK] =
                std::array::from_fn(|i| ((block + i) as f32 + 0.5) * cell_y_m - from.y_m);
            let mut low_m = [-from.x_m; BLOCK];
            let mut high_m = [self.columns as f32 * cell_x_m - from.x_m; BLOCK];
            for (&(at, _, y), &slope) in borders.iter().zip(&slopes) {
                let here: [f32; BLOCK] = dy_m.map(|dy_m| at + y * dy_m);
                for i in 0..BLOCK {
                    let border_m = -here[i] * slope;
                    if slope > 0.0 {
                        low_m[i] = if border_m > low_m[i] { border_m } else { low_m[i] };
                    } else if slope < 0.0 {
                        high_m[i] = if border_m < high_m[i] { border_m } else { high_m[i] };
                    } else if here[i] < 0.0 {
                        high_m[i] = f32::NEG_INFINITY;
                    }
                }
            }
            let column =
                |at_m: [f32; BLOCK]| at_m.map(|at_m| ((at_m + from.x_m) / cell_x_m + 0.5) as i32);
            let (first, end) = (column(low_m), column(high_m));
            for (i, row) in (block..end_row).enumerate().take(BLOCK) {
                // Where low is not above high, neither column is below 0.
                if low_m[i] <= high_m[i] {
                    let (first, end) = (first[i] as usize, (end[i] as usize).min(self.columns));
                    if first < end {
                        visit(row, first, end);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use swath_core::config::Document;
    use swath_core::geometry::Pose;
    use swath_core::grid::Grid;
    use swath_core::rng::{agent_rng, uniform};

    use super::*;

    /// The cells within borders, each asked by itself; those that rounding may decide are left open.
    fn cells_within(
        shape: &Shape,
        from: &Spot,
        borders: &[Border],
        is_whole: bool,
    ) -> Vec<Option<bool>> {
        let (cell_x_m, cell_y_m) = shape.cell_m;
        let is_inside = |cell: usize| {
            let (column, row) = (cell % shape.columns, cell / shape.columns);
            let mut least_m = f32::INFINITY;
            let corners = [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)];
            for (x, y) in if is_whole { &corners[..] } else { &[(0.5, 0.5)] } {
                let dx_m = (column as f32 + x) * cell_x_m - from.x_m;
                let dy_m = (row as f32 + y) * cell_y_m - from.y_m;
                let (ahead_m, left_m) =
                    (from.cos * dx_m + from.sin * dy_m, from.cos * dy_m - from.sin * dx_m);
                for border in borders {
                    let inside_m = border.at_m + border.ahead * ahead_m + border.left * left_m;
                    least_m = least_m.min(inside_m);
                }
            }
            (least_m.abs() > 1e-3).then_some(least_m > 0.0)
        };
        (0..shape.columns * shape.rows).map(is_inside).collect()
    }

    fn assert_cells<const BORDERS: usize>(
        shape: &Shape,
        from: &Spot,
        borders: &[Border; BORDERS],
        heights_m: (f32, f32),
        is_whole: bool,
    ) {
        let mut found = vec![false; shape.columns * shape.rows];
        shape.for_each_row(from, borders, heights_m, is_whole, &mut |row, first, end| {
            found[row * shape.columns + first..row * shape.columns + end].fill(true);
        });
        let expected = cells_within(shape, from, borders, is_whole);
        for (cell, (found, expected)) in found.into_iter().zip(expected).enumerate() {
            assert!(expected.is_none_or(|is| is == found), "cell {cell} from {from:?}");
        }
    }

    #[test]
    fn the_rows_of_some_ground_hold_the_cells_within_its_borders_and_no_others() {
        let mut rng = agent_rng(4);
        let mut anywhere = |size_m: f64| 1.4 * size_m * uniform(&mut rng) - 0.2 * size_m;
        for (length_m, width_m) in [(40.0, 24.0), (33.3, 17.7), (30.0, 0.4), (2.0, 25.0)] {
            let size = format!("pasture.length_m = {length_m}\npasture.width_m = {width_m}");
            let mut document = Document::open("pasture").unwrap();
            document.overlay((size + "\nmower.deck_width_m = 0.3").parse().unwrap());
            let ground = OpenGround::new(&Site::new(&document.scenario().unwrap()));
            let shape = ground.shape();
            for turn in 0..200 {
                let heading_rad = f64::from(turn) * std::f64::consts::PI / 20.0;
                let at = Pose::new(anywhere(length_m), anywhere(width_m), heading_rad);
                let (from, straight_m) = (Spot::from(at), if turn % 2 == 0 { 0.0 } else { 7.0 });
                let (seen, bar) = (ground.seen_on_straight(straight_m), ground.bar(1.0));
                let (sight_m, under_m) =
                    (ground.sight_m(&from, straight_m), ground.under_m(&from, 0.0));
                assert_cells(&shape, &from, &seen, sight_m, true);
                assert_cells(&shape, &from, &bar, under_m, false);
            }
        }
    }

    #[test]
    fn ground_that_was_not_seen_after_all_is_open_again_and_nothing_else() {
        let site = Site::new(&Document::open("pasture").unwrap().scenario().unwrap());
        let mut ground = OpenGround::new(&site);
        let all = ground.open();
        ground.settle_band(0.0, single(site.width_m));
        assert_eq!((ground.open(), ground.missed()), (0, 0));
        // Of a pasture of 100 x 40 m in cells of 1 m nothing was seen: one cell in four of half that size holds a middle.
        let grid = Grid::new(site.length_m, site.width_m);
        let mut seen = SeenGround::none(Arc::new(grid));
        assert!(ground.reopen(&seen));
        assert_eq!((ground.open(), ground.missed(), all), (4_000, 4_000, 16_000));
        // Once more changes nothing.
        assert!(ground.reopen(&seen));
        assert_eq!(ground.open(), 4_000);
        ground.settle_band(0.0, single(site.width_m));
        for row in 0..grid.rows() {
            for column in 0..grid.columns() {
                seen.absorb(&[grid.cell_at(grid.centre(column, row))]);
            }
        }
        assert!(!ground.reopen(&seen));
    }
}
