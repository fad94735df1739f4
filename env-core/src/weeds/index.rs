//! Weeds sorted by the cells that they stand in.

use crate::geometry::{Footprint, Point};
use crate::grid::{CellSet, Grid, Reach};

/// Which weeds stand in which cell.
#[derive(Debug, Clone)]
pub(super) struct CellIndex {
    /// Weed numbers sorted by row, column and number; the column of each, and where each row begins.
    by_cell: Vec<u32>,
    columns: Vec<u32>,
    row_start: Vec<u32>,
}

impl CellIndex {
    /// No weed.
    pub(super) fn none(grid: &Grid) -> Self {
        Self { by_cell: Vec::new(), columns: Vec::new(), row_start: vec![0; grid.rows() + 1] }
    }

    /// Sorts weeds anew.
    pub(super) fn build(&mut self, grid: &Grid, positions: &[Point]) {
        let Self { by_cell, columns, row_start } = self;
        let cell_of = |weed: u32| grid.cell_of(positions[weed as usize]);
        let count =
            u32::try_from(positions.len()).expect("a scenario holds at most ten million weeds");
        by_cell.clear();
        by_cell.extend(0..count);
        by_cell.sort_unstable_by_key(|&weed| {
            let (column, row) = cell_of(weed);
            (row, column, weed)
        });
        columns.clear();
        row_start.fill(0);
        for &weed in by_cell.iter() {
            let (column, row) = cell_of(weed);
            columns.push(u32::try_from(column).expect("a pasture has at most 64 million columns"));
            row_start[row + 1] += 1;
        }
        for row in 0..grid.rows() {
            row_start[row + 1] += row_start[row];
        }
    }

    /// Writes the weeds in `footprint` that are sought to `found`, ascending; `cells` are those that may hold any, and lose
    /// those that hold no more.
    pub(super) fn take(
        &self,
        grid: &Grid,
        cells: &mut CellSet,
        footprint: &impl Footprint,
        positions: &[Point],
        is_sought: impl Fn(usize) -> bool,
        found: &mut Vec<u32>,
    ) {
        found.clear();
        cells.remove_where(grid, footprint, Reach::Touch, |column, row| {
            let mut is_cleared = true;
            for &weed in self.in_cell(column, row).iter().filter(|&&weed| is_sought(weed as usize))
            {
                if footprint.contains(positions[weed as usize]) {
                    found.push(weed);
                } else {
                    is_cleared = false;
                }
            }
            is_cleared
        });
        found.sort_unstable();
    }

    /// The weeds of one cell, ascending.
    fn in_cell(&self, column: usize, row: usize) -> &[u32] {
        let (from, to) = (self.row_start[row] as usize, self.row_start[row + 1] as usize);
        let columns = &self.columns[from..to];
        let first = from + columns.partition_point(|&c| (c as usize) < column);
        let last = from + columns.partition_point(|&c| (c as usize) <= column);
        &self.by_cell[first..last]
    }
}
