//! The weeds of an episode: where they stand, which were detected, which were mowed.

mod placement;

use crate::geometry::{Footprint, Point};
use crate::grid::{CellSet, Grid, Reach};

pub use placement::draw;

/// All weeds of an episode, found through the grid.
///
/// A cell is looked into only while it holds a weed that is still sought, so ground without news costs the same
/// whatever grows there.
#[derive(Debug, Clone)]
pub struct Weeds {
    grid: Grid,
    positions: Vec<Point>,
    is_detected: Vec<bool>,
    is_mowed: Vec<bool>,
    /// Weed numbers sorted by row, column and number, and where each row begins.
    by_cell: Vec<u32>,
    columns: Vec<u32>,
    row_start: Vec<u32>,
    /// Cells that may hold a weed neither detected nor mowed.
    undetected_cells: CellSet,
    /// Cells that hold a weed not mowed.
    unmowed_cells: CellSet,
}

impl Weeds {
    /// A pasture without weeds.
    #[must_use]
    pub fn none(grid: Grid) -> Self {
        let cells = CellSet::empty(&grid);
        let (positions, is_detected, is_mowed, by_cell, columns) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let row_start = vec![0; grid.rows() + 1];
        Self {
            grid,
            positions,
            is_detected,
            is_mowed,
            by_cell,
            columns,
            row_start,
            undetected_cells: cells.clone(),
            unmowed_cells: cells,
        }
    }

    /// Replaces all weeds by those that `fill` writes; none of them is detected or mowed.
    pub fn plant(&mut self, fill: impl FnOnce(&mut Vec<Point>)) {
        self.positions.clear();
        fill(&mut self.positions);
        let count = self.positions.len();
        for flags in [&mut self.is_detected, &mut self.is_mowed] {
            flags.clear();
            flags.resize(count, false);
        }
        self.index();
    }

    /// Puts weeds back as they stood: where, which ones detected, whether mowed.
    pub(crate) fn restore(&mut self, positions: Vec<Point>, detected: &[u32], is_mowed: Vec<bool>) {
        debug_assert!(positions.len() == is_mowed.len(), "one flag a weed");
        self.is_detected.clear();
        self.is_detected.resize(positions.len(), false);
        for &weed in detected {
            self.is_detected[weed as usize] = true;
        }
        self.positions = positions;
        self.is_mowed = is_mowed;
        self.index();
    }

    /// Builds the index over cells from positions and flags.
    fn index(&mut self) {
        let Self { grid, positions, by_cell, columns, row_start, .. } = self;
        let cell_of = |weed: u32| grid.cell_of(positions[weed as usize]);
        by_cell.clear();
        by_cell.extend(
            0..u32::try_from(positions.len()).expect("a scenario holds at most ten million weeds"),
        );
        by_cell.sort_unstable_by_key(|&weed| {
            let (column, row) = cell_of(weed);
            (row, column, weed)
        });
        columns.clear();
        row_start.fill(0);
        self.undetected_cells.clear();
        self.unmowed_cells.clear();
        for &weed in by_cell.iter() {
            let (column, row) = cell_of(weed);
            columns.push(u32::try_from(column).expect("a pasture has at most 64 million columns"));
            row_start[row + 1] += 1;
            if !self.is_mowed[weed as usize] {
                self.unmowed_cells.insert(grid, column, row);
                if !self.is_detected[weed as usize] {
                    self.undetected_cells.insert(grid, column, row);
                }
            }
        }
        for row in 0..grid.rows() {
            row_start[row + 1] += row_start[row];
        }
    }

    /// Mows every standing weed in `footprint`; writes their numbers to `mowed`, ascending.
    pub fn mow(&mut self, footprint: &impl Footprint, mowed: &mut Vec<u32>) {
        mowed.clear();
        let Self { grid, positions, is_mowed, by_cell, columns, row_start, unmowed_cells, .. } =
            self;
        unmowed_cells.remove_where(grid, footprint, Reach::Touch, |column, row| {
            let mut is_cleared = true;
            for &weed in in_cell(by_cell, columns, row_start, column, row) {
                if is_mowed[weed as usize] {
                    continue;
                }
                if footprint.contains(positions[weed as usize]) {
                    is_mowed[weed as usize] = true;
                    mowed.push(weed);
                } else {
                    is_cleared = false;
                }
            }
            is_cleared
        });
        mowed.sort_unstable();
    }

    /// Detects every standing weed in `footprint` that was not known; writes their numbers to `detected`, ascending.
    pub fn detect(&mut self, footprint: &impl Footprint, detected: &mut Vec<u32>) {
        detected.clear();
        let Self {
            grid,
            positions,
            is_mowed,
            is_detected,
            by_cell,
            columns,
            row_start,
            undetected_cells,
            ..
        } = self;
        undetected_cells.remove_where(grid, footprint, Reach::Touch, |column, row| {
            let mut is_cleared = true;
            for &weed in in_cell(by_cell, columns, row_start, column, row) {
                if is_mowed[weed as usize] || is_detected[weed as usize] {
                    continue;
                }
                if footprint.contains(positions[weed as usize]) {
                    is_detected[weed as usize] = true;
                    detected.push(weed);
                } else {
                    is_cleared = false;
                }
            }
            is_cleared
        });
        detected.sort_unstable();
    }

    /// Where the weeds stand, in the order in which they were drawn or given; world frame, metres.
    #[must_use]
    pub fn positions(&self) -> &[Point] {
        &self.positions
    }

    /// Which weeds the sensor has seen, in the same order.
    #[must_use]
    pub fn is_detected(&self) -> &[bool] {
        &self.is_detected
    }

    /// Which weeds were mowed, in the same order.
    #[must_use]
    pub fn is_mowed(&self) -> &[bool] {
        &self.is_mowed
    }
}

/// The weeds of one cell, ascending.
fn in_cell<'a>(
    by_cell: &'a [u32],
    columns: &[u32],
    row_start: &[u32],
    column: usize,
    row: usize,
) -> &'a [u32] {
    let (from, to) = (row_start[row] as usize, row_start[row + 1] as usize);
    let first = from + columns[from..to].partition_point(|&c| (c as usize) < column);
    let last = from + columns[from..to].partition_point(|&c| (c as usize) <= column);
    &by_cell[first..last]
}
