//! Where weeds stand, more finely than by cells.

use crate::geometry::{Footprint, Point};
use crate::grid::Grid;
use crate::math::floor_index;

/// Fine cells along either side of a cell, as a power of two; fewer where a pasture would have more of them than that.
const FINEST: u32 = 2;
const MOST: usize = 1 << 18;
/// Slack that keeps the ranges on the safe side of rounding, metres.
const SLACK_M: f64 = 1e-6;

/// A set of fine cells, of which each cell has the same number along x and y.
///
/// A bar that passes beside standing weeds touches many cells that hold some, but few such fine cells.
#[derive(Debug, Clone)]
pub(super) struct FineCells {
    power: u32,
    columns: usize,
    rows: usize,
    /// Words of 64 columns of a row; those of the same columns row by row.
    words: Vec<u64>,
}

impl FineCells {
    /// No fine cell of `grid`.
    pub(super) fn empty(grid: &Grid) -> Self {
        let power = (0..=FINEST).rev().find(|power| grid.cells() << (2 * power) <= MOST);
        let power = power.unwrap_or(0);
        let (columns, rows) = (grid.columns() << power, grid.rows() << power);
        Self { power, columns, rows, words: vec![0; columns.div_ceil(64) * rows] }
    }

    /// Takes every fine cell out.
    pub(super) fn clear(&mut self) {
        self.words.fill(0);
    }

    /// The column and row of the fine cell that holds a point.
    #[inline]
    pub(super) fn place(&self, grid: &Grid, point: Point) -> (usize, usize) {
        let (x, y) = grid.in_cells(point.x, point.y);
        // A power of two, so that rounding puts no point into another cell.
        let fine = f64::from(1_u32 << self.power);
        (floor_index(x * fine).min(self.columns - 1), floor_index(y * fine).min(self.rows - 1))
    }

    /// Puts a fine cell in.
    pub(super) fn insert(&mut self, (column, row): (usize, usize)) {
        self.words[column / 64 * self.rows + row] |= 1 << (column % 64);
    }

    /// Takes a fine cell out.
    pub(super) fn remove(&mut self, (column, row): (usize, usize)) {
        self.words[column / 64 * self.rows + row] &= !(1 << (column % 64));
    }

    /// The cell that a fine cell belongs to, as column and row.
    #[inline]
    pub(super) fn cell(&self, (column, row): (usize, usize)) -> (usize, usize) {
        (column >> self.power, row >> self.power)
    }

    /// Calls `visit` with the column and row of each fine cell of the set in the box around a footprint.
    #[inline]
    pub(super) fn for_each_within<const SIDES: usize>(
        &self,
        grid: &Grid,
        footprint: &impl Footprint<SIDES>,
        mut visit: impl FnMut((usize, usize)),
    ) {
        let ((low_x_m, high_x_m), (low_y_m, high_y_m)) = (footprint.x_range(), footprint.y_range());
        let low = self.place(grid, Point::new(low_x_m - SLACK_M, low_y_m - SLACK_M));
        let high = self.place(grid, Point::new(high_x_m + SLACK_M, high_y_m + SLACK_M));
        for group in low.0 / 64..=high.0 / 64 {
            let first = low.0.saturating_sub(64 * group);
            let last = (high.0 - 64 * group).min(63);
            let columns = (u64::MAX << first) & (u64::MAX >> (63 - last));
            let start = group * self.rows;
            for (row, word) in (low.1..).zip(&self.words[start + low.1..=start + high.1]) {
                let mut bits = word & columns;
                while bits != 0 {
                    let column = 64 * group + bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    visit((column, row));
                }
            }
        }
    }
}
