//! What the mower knows: the ground it has seen and the weeds it has still to mow.

use std::ops::Range;

use crate::deck::Cut;
use crate::geometry::{Footprint, Point};
use crate::grid::{CellSet, Grid, Reach};
use crate::known::{KnownWeed, KnownWeeds};
use crate::math;
use crate::sensor::Percept;
use crate::weeds::Weeds;

/// Which cells of the pasture have been seen: their centre was inside the triangle at a look, or under the bar.
#[derive(Debug, Clone)]
pub struct SeenGround {
    grid: Grid,
    unseen: CellSet,
    unseen_count: usize,
}

impl SeenGround {
    fn new(grid: Grid) -> Self {
        Self { grid, unseen: CellSet::full(&grid), unseen_count: grid.cells() }
    }

    /// The cells.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Whether a cell has been seen.
    #[must_use]
    pub fn is_seen(&self, column: usize, row: usize) -> bool {
        !self.unseen.contains(&self.grid, column, row)
    }

    /// Calls `visit` with a column and bits, lowest first: which of the columns from there on are unseen in `row`. Every
    /// unseen cell of `columns` is among them, and no other.
    #[inline]
    pub fn for_each_unseen(
        &self,
        columns: Range<usize>,
        row: usize,
        mut visit: impl FnMut(usize, u64),
    ) {
        let mut first = columns.start;
        while first < columns.end {
            let left = columns.end - first;
            let mask = if left < 64 { !(u64::MAX << left) } else { u64::MAX };
            let bits = self.unseen.bits_from(&self.grid, first, row) & mask;
            if bits != 0 {
                visit(first, bits);
            }
            first += 64;
        }
    }

    /// Number of cells not seen yet.
    #[must_use]
    pub fn unseen_count(&self) -> usize {
        self.unseen_count
    }

    /// Share of the cells that have been seen, 0 to 1.
    #[must_use]
    pub fn fraction(&self) -> f64 {
        1.0 - self.unseen_count as f64 / self.grid.cells() as f64
    }

    /// Distance from `origin` to unseen ground along `bearing_rad` (world frame), at most `cap_m`.
    ///
    /// The ray is sampled every metre; outside the pasture there is nothing to see.
    #[must_use]
    pub fn range_to_unseen(&self, origin: Point, bearing_rad: f64, cap_m: f64) -> f64 {
        if self.unseen_count == 0 {
            return cap_m;
        }
        let (sin, cos) = math::sin_cos(bearing_rad);
        let (length_m, width_m) = self.grid.size_m();
        // The samples on the pasture: those between entering and leaving both of its strips.
        let (enter_x, leave_x) = strip_m(origin.x, cos, length_m);
        let (enter_y, leave_y) = strip_m(origin.y, sin, width_m);
        let mut distance_m = enter_x.max(enter_y).max(0.0).ceil();
        let leave_m = leave_x.min(leave_y);
        while distance_m < cap_m && distance_m <= leave_m {
            let point = Point::new(origin.x + distance_m * cos, origin.y + distance_m * sin);
            let (column, row) = self.grid.cell_of(point);
            if !self.is_seen(column, row) {
                return distance_m;
            }
            distance_m += 1.0;
        }
        cap_m
    }

    fn absorb(&mut self, footprint: &impl Footprint) {
        let Self { grid, unseen, unseen_count } = self;
        if *unseen_count > 0 {
            *unseen_count -= unseen.remove_where(grid, footprint, Reach::Centre, |column, row| {
                footprint.contains(grid.centre(column, row))
            });
        }
    }
}

/// Where a ray enters and leaves the strip 0..=`size_m` of one axis, metres along it; `slope` is its progress on that axis.
fn strip_m(from_m: f64, slope: f64, size_m: f64) -> (f64, f64) {
    if slope.abs() < 1e-12 {
        let is_inside = (0.0..=size_m).contains(&from_m);
        return if is_inside { (0.0, f64::INFINITY) } else { (f64::INFINITY, 0.0) };
    }
    let (a, b) = (-from_m / slope, (size_m - from_m) / slope);
    (a.min(b), a.max(b))
}

/// What the mower has learnt since reset.
#[derive(Debug, Clone)]
pub struct Belief {
    ground: SeenGround,
    known: KnownWeeds,
    /// For each detection the weed's number in the pasture, and the other way round: the link that only the environment
    /// follows.
    weed_of: Vec<u32>,
    number_of: Vec<Option<u32>>,
}

impl Belief {
    /// A mower that knows nothing yet.
    #[must_use]
    pub fn new(grid: Grid) -> Self {
        let (length_m, width_m) = grid.size_m();
        Self {
            ground: SeenGround::new(grid),
            known: KnownWeeds::none(length_m, width_m),
            weed_of: Vec::new(),
            number_of: Vec::new(),
        }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        let grid = self.ground.grid;
        self.ground.unseen.fill(&grid);
        self.ground.unseen_count = grid.cells();
        self.known.clear();
        self.weed_of.clear();
        self.number_of.clear();
    }

    /// Puts a belief back; `weed_of` lists the weeds in the order of their detection.
    pub(crate) fn restore(&mut self, unseen: CellSet, weed_of: Vec<u32>, weeds: &Weeds) {
        self.ground.unseen_count = unseen.len();
        self.ground.unseen = unseen;
        self.known.clear();
        self.weed_of.clear();
        self.number_of.clear();
        for weed in weed_of {
            self.note(weed, weeds);
            if weeds.is_mowed()[weed as usize] {
                self.strike_out(weed);
            }
        }
    }

    /// Adds a weed just detected.
    fn note(&mut self, weed: u32, weeds: &Weeds) {
        let number = self.detected();
        self.known.add(KnownWeed { number, position: weeds.positions()[weed as usize] });
        self.weed_of.push(weed);
        if self.number_of.len() <= weed as usize {
            self.number_of.resize(weeds.positions().len(), None);
        }
        self.number_of[weed as usize] = Some(number);
    }

    /// Removes a weed just mowed, if it was known.
    fn strike_out(&mut self, weed: u32) {
        if let Some(number) = self.number_of.get(weed as usize).copied().flatten() {
            self.known.remove(number);
        }
    }

    /// Strikes out mowed weeds; the ground under the bar counts as seen.
    pub fn absorb_cut(&mut self, cut: &Cut) {
        self.ground.absorb(&cut.sweep);
        for &weed in cut.mowed {
            self.strike_out(weed);
        }
    }

    /// Notes new weeds, in the order of their numbers, and the ground seen.
    pub fn absorb_percept(&mut self, percept: &Percept, weeds: &Weeds) {
        self.ground.absorb(&percept.footprint);
        for &weed in percept.detected {
            self.note(weed, weeds);
        }
    }

    /// The ground seen so far.
    #[must_use]
    pub fn ground(&self) -> &SeenGround {
        &self.ground
    }

    /// Weeds detected and not yet mowed, in the order of detection.
    #[must_use]
    pub fn known(&self) -> &KnownWeeds {
        &self.known
    }

    /// Number of weeds ever detected.
    #[must_use]
    pub fn detected(&self) -> u32 {
        u32::try_from(self.weed_of.len()).expect("a scenario holds at most ten million weeds")
    }

    pub(crate) fn unseen_cells(&self) -> &CellSet {
        &self.ground.unseen
    }

    pub(crate) fn weed_of(&self) -> &[u32] {
        &self.weed_of
    }
}
