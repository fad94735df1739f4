//! The weeds of an episode: where they stand, which were detected, which were mowed.

mod ahead;
mod index;
mod placement;

use std::sync::Arc;

use crate::geometry::{Footprint, Point};
use crate::grid::{CellSet, Grid};
use crate::ground::SeenGround;
use index::CellIndex;

pub use ahead::Ahead;
pub use placement::draw;

/// All weeds of an episode, found through the grid.
///
/// A cell is looked into only while it holds a weed that is still sought, so ground without news costs the same
/// whatever grows there.
#[derive(Debug, Clone)]
pub struct Weeds {
    grid: Arc<Grid>,
    positions: Vec<Point>,
    is_detected: Vec<bool>,
    is_mowed: Vec<bool>,
    index: Box<CellIndex>,
    /// Cells that hold a weed neither detected nor mowed.
    undetected_cells: CellSet,
    /// Cells that hold a weed not mowed.
    unmowed_cells: CellSet,
}

impl Weeds {
    /// A pasture without weeds.
    #[must_use]
    pub fn none(grid: Arc<Grid>) -> Self {
        let cells = CellSet::empty(&grid);
        Self {
            positions: Vec::new(),
            is_detected: Vec::new(),
            is_mowed: Vec::new(),
            index: Box::new(CellIndex::none(&grid)),
            grid,
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
        let Self { grid, positions, is_detected, is_mowed, index, .. } = self;
        let (undetected, unmowed) = (&mut self.undetected_cells, &mut self.unmowed_cells);
        undetected.clear();
        unmowed.clear();
        index.build(grid, positions, |weed, cell| {
            if !is_mowed[weed] {
                unmowed.insert(cell);
                if !is_detected[weed] {
                    undetected.insert(cell);
                }
            }
        });
    }

    /// Finds the standing weeds, and the unseen cells by their centre, for which `test` has an answer; it has none for points
    /// outside `footprint`.
    pub fn find_standing<const SIDES: usize, T>(
        &self,
        footprint: &impl Footprint<SIDES>,
        test: impl Fn(Point) -> Option<T>,
        ground: &SeenGround,
        ahead: &mut Ahead<T>,
    ) {
        let is_sought = |weed: usize| !self.is_mowed[weed];
        self.find(footprint, test, &self.unmowed_cells, is_sought, ground, ahead);
    }

    /// The same with the standing weeds that were not detected yet.
    pub fn find_undetected<const SIDES: usize, T>(
        &self,
        footprint: &impl Footprint<SIDES>,
        test: impl Fn(Point) -> Option<T>,
        ground: &SeenGround,
        ahead: &mut Ahead<T>,
    ) {
        let is_sought = |weed: usize| !self.is_mowed[weed] && !self.is_detected[weed];
        self.find(footprint, test, &self.undetected_cells, is_sought, ground, ahead);
    }

    /// Weeds and ground are looked up in one go, since the same cells are touched.
    #[inline]
    fn find<const SIDES: usize, T>(
        &self,
        footprint: &impl Footprint<SIDES>,
        test: impl Fn(Point) -> Option<T>,
        weed_cells: &CellSet,
        is_sought: impl Fn(usize) -> bool,
        ground: &SeenGround,
        ahead: &mut Ahead<T>,
    ) {
        let Self { grid, index, .. } = self;
        ahead.clear();
        let Ahead { weeds: found, cells } = ahead;
        let (unseen, weed_cells) = (ground.unseen().words(), weed_cells.words());
        let words = |tile: usize| (unseen[tile], weed_cells[tile]);
        grid.for_each_touched(footprint, words, |tile, unseen, weeds| {
            tile.for_each(unseen, |cell| {
                cells.extend(test(grid.centre(cell.column, cell.row)).map(|answer| (cell, answer)));
            });
            tile.for_each(weeds, |cell| {
                for &(weed, position) in index.in_cell(cell) {
                    if let Some(answer) = test(position)
                        && is_sought(weed as usize)
                    {
                        found.push((weed, answer));
                    }
                }
            });
        });
        found.sort_unstable_by_key(|&(weed, _)| weed);
    }

    /// Takes note that these standing weeds were mowed.
    pub fn mow(&mut self, mowed: &[u32]) {
        for &weed in mowed {
            self.is_mowed[weed as usize] = true;
            self.clear_cell(weed);
        }
    }

    /// Takes note that these standing weeds were detected.
    pub fn detect(&mut self, detected: &[u32]) {
        for &weed in detected {
            self.is_detected[weed as usize] = true;
            self.clear_cell(weed);
        }
    }

    /// Strikes out the cell of a weed where none is sought any more.
    fn clear_cell(&mut self, weed: u32) {
        let cell = self.grid.cell_at(self.positions[weed as usize]);
        let standing =
            self.index.in_cell(cell).iter().filter(|&&(weed, _)| !self.is_mowed[weed as usize]);
        if standing.clone().next().is_none() {
            self.unmowed_cells.remove(cell);
        }
        if standing.clone().all(|&(weed, _)| self.is_detected[weed as usize]) {
            self.undetected_cells.remove(cell);
        }
    }

    /// The cells that the weeds are found through.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
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
