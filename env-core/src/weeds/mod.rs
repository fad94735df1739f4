//! The weeds of an episode: where they stand, which were detected, which were mowed.

mod index;
mod placement;

use crate::geometry::{Footprint, Point};
use crate::grid::{CellSet, Grid};
use index::CellIndex;

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
    index: CellIndex,
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
        Self {
            grid,
            positions: Vec::new(),
            is_detected: Vec::new(),
            is_mowed: Vec::new(),
            index: CellIndex::none(&grid),
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

    /// Builds the index from positions, and the sets of cells from flags.
    fn index(&mut self) {
        self.index.build(&self.grid, &self.positions);
        self.undetected_cells.clear();
        self.unmowed_cells.clear();
        for (weed, &position) in
            self.positions.iter().enumerate().filter(|&(weed, _)| !self.is_mowed[weed])
        {
            let (column, row) = self.grid.cell_of(position);
            self.unmowed_cells.insert(&self.grid, column, row);
            if !self.is_detected[weed] {
                self.undetected_cells.insert(&self.grid, column, row);
            }
        }
    }

    /// Mows every standing weed in `footprint`; writes their numbers to `mowed`, ascending.
    pub fn mow(&mut self, footprint: &impl Footprint, mowed: &mut Vec<u32>) {
        let Self { grid, is_mowed, index, unmowed_cells, .. } = self;
        index.take(grid, unmowed_cells, footprint, |weed| !is_mowed[weed], mowed);
        for &weed in mowed.iter() {
            is_mowed[weed as usize] = true;
        }
    }

    /// Detects every standing weed in `footprint` that was not known; writes their numbers to `detected`, ascending.
    pub fn detect(&mut self, footprint: &impl Footprint, detected: &mut Vec<u32>) {
        let Self { grid, is_mowed, is_detected, index, undetected_cells, .. } = self;
        let is_sought = |weed: usize| !is_mowed[weed] && !is_detected[weed];
        index.take(grid, undetected_cells, footprint, is_sought, detected);
        for &weed in detected.iter() {
            is_detected[weed as usize] = true;
        }
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
