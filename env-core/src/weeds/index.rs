//! Weeds sorted by the cells that they stand in.

use crate::geometry::Point;
use crate::grid::{Cell, CellSet, Grid};

/// Which weeds stand in which cell, found without a search.
#[derive(Debug, Clone)]
pub(super) struct CellIndex {
    /// Weed numbers sorted by tile, bit and number, and where each stands.
    by_cell: Vec<(u32, Point)>,
    /// Cells with a weed; for each of them, in order, its first place in `by_cell`, and behind the last one the end.
    occupied: CellSet,
    cell_first: Vec<u32>,
    /// For each word of `occupied` how many cells come before it.
    word_first: Vec<u32>,
    /// Room for sorting: a weed's place in the order of cells in the upper half, and its number.
    keys: Vec<u64>,
}

impl CellIndex {
    /// No weed.
    pub(super) fn none(grid: &Grid) -> Self {
        let occupied = CellSet::empty(grid);
        let word_first = vec![0; occupied.words().len()];
        let (by_cell, keys) = (Vec::new(), Vec::new());
        Self { by_cell, occupied, cell_first: vec![0], word_first, keys }
    }

    /// Sorts weeds anew.
    #[expect(clippy::cast_possible_truncation, reason = "the lower half of a key is wanted")]
    pub(super) fn build(&mut self, grid: &Grid, positions: &[Point]) {
        let Self { by_cell, occupied, cell_first, word_first, keys } = self;
        let count = |length: usize| {
            u32::try_from(length).expect("a scenario holds at most ten million weeds")
        };
        keys.clear();
        keys.extend((0..count(positions.len())).zip(positions).map(|(weed, &position)| {
            let Cell { tile, bit, .. } = grid.cell_at(position);
            (64 * tile as u64 + u64::from(bit)) << 32 | u64::from(weed)
        }));
        keys.sort_unstable();
        by_cell.clear();
        by_cell.extend(keys.iter().map(|&key| {
            let weed = key as u32;
            (weed, positions[weed as usize])
        }));
        occupied.clear();
        cell_first.clear();
        for (place, &(_, position)) in by_cell.iter().enumerate() {
            if occupied.insert(grid.cell_at(position)) {
                cell_first.push(count(place));
            }
        }
        cell_first.push(count(by_cell.len()));
        let mut cells = 0;
        for (first, word) in word_first.iter_mut().zip(occupied.words()) {
            *first = cells;
            cells += word.count_ones();
        }
    }

    /// The weeds of one cell that has some, ascending.
    #[inline]
    pub(super) fn in_cell(&self, cell: Cell) -> &[(u32, Point)] {
        let rank = self.occupied.rank_in_tile(cell.tile, cell.bit);
        let cell = self.word_first[cell.tile] as usize + rank;
        &self.by_cell[self.cell_first[cell] as usize..self.cell_first[cell + 1] as usize]
    }
}
