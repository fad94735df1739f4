//! The ground seen so far.

mod rays;

use std::ops::Range;
use std::sync::Arc;

use crate::geometry::Point;
use crate::grid::{Cell, CellSet, Grid};

use rays::Rays;

/// Which cells of the pasture have been seen: their centre was inside the triangle at a look, or under the bar.
#[derive(Debug, Clone)]
pub struct SeenGround {
    grid: Arc<Grid>,
    unseen: CellSet,
    unseen_count: usize,
}

impl SeenGround {
    /// Nothing seen yet.
    #[must_use]
    pub fn none(grid: Arc<Grid>) -> Self {
        Self { unseen: CellSet::full(&grid), unseen_count: grid.cells(), grid }
    }

    /// Forgets everything.
    pub(crate) fn clear(&mut self) {
        self.unseen.fill(&self.grid);
        self.unseen_count = self.grid.cells();
    }

    pub(crate) fn restore(&mut self, unseen: CellSet) {
        self.unseen_count = unseen.len();
        self.unseen = unseen;
    }

    pub(crate) fn unseen(&self) -> &CellSet {
        &self.unseen
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

    /// Takes note that these cells are seen.
    pub fn absorb<'a>(&mut self, cells: impl IntoIterator<Item = &'a Cell>) {
        for &cell in cells {
            self.unseen_count -= usize::from(self.unseen.remove(cell));
        }
    }

    /// Takes note that these cells of a tile are seen; returns whether all of them were unseen until now.
    pub(crate) fn absorb_tile(&mut self, tile: u32, bits: u64) -> bool {
        let were_in = self.unseen.remove_from_tile(tile as usize, bits);
        self.unseen_count -= if were_in { bits.count_ones() as usize } else { 0 };
        were_in
    }

    /// Gives `visit` the distances from `origin` to the nearest point of an unseen cell in some directions, metres, at most
    /// `cap_m`. A direction is the cosine and sine of a bearing from the heading, whose own are `heading`. Outside the pasture
    /// there is nothing to see.
    #[inline]
    pub fn ranges_to_unseen(
        &self,
        origin: Point,
        heading: (f64, f64),
        directions: &[(f64, f64)],
        cap_m: f64,
        visit: impl FnMut(f64),
    ) {
        Rays::new(&self.grid, &self.unseen, origin, cap_m).ranges_m(heading, directions, visit);
    }
}
