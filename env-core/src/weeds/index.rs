//! Weeds sorted by the cells that they stand in.

use std::ops::Range;

use crate::geometry::Point;
use crate::grid::{Cell, CellSet, Grid};

/// A weed as the index keeps it.
#[derive(Debug, Clone, Copy)]
pub(super) struct IndexedWeed {
    pub(super) number: u32,
    pub(super) state: State,
    pub(super) position: Point,
}

/// What is asked of a weed before where it stands.
#[derive(Debug, Clone, Copy)]
pub(super) struct State {
    /// The bit of its fine cell.
    pub(super) fine_bit: u8,
    /// Not mowed.
    pub(super) is_standing: bool,
    /// Neither mowed nor detected.
    pub(super) is_sought: bool,
}

/// Which weeds stand in which cell, found without a search.
#[derive(Debug, Clone)]
pub(super) struct CellIndex {
    /// Weeds sorted by tile, bit and number.
    by_cell: Vec<IndexedWeed>,
    /// Cells with a weed; for each of them, in order, its first place in `by_cell`, and behind the last one the end.
    occupied: CellSet,
    cell_first: Vec<u32>,
    /// For each word of `occupied` how many cells come before it.
    word_first: Vec<u32>,
    /// Tile and bit of each weed's cell, and its state; of use only while the index is built.
    place_of: Vec<(usize, u32, State)>,
}

impl CellIndex {
    /// No weed.
    pub(super) fn none(grid: &Grid) -> Self {
        let occupied = CellSet::empty(grid);
        let word_first = vec![0; occupied.words().len()];
        Self {
            by_cell: Vec::new(),
            occupied,
            cell_first: vec![0],
            word_first,
            place_of: Vec::new(),
        }
    }

    /// Sorts weeds anew, and calls `visit` with each of them and its cell, which returns its state.
    pub(super) fn build(
        &mut self,
        grid: &Grid,
        positions: &[Point],
        mut visit: impl FnMut(usize, Cell) -> State,
    ) {
        let Self { by_cell, occupied, cell_first, word_first, place_of } = self;
        occupied.clear();
        place_of.clear();
        place_of.extend(positions.iter().enumerate().map(|(weed, &position)| {
            let cell = grid.cell_at(position);
            occupied.insert(cell);
            (cell.tile, cell.bit, visit(weed, cell))
        }));
        let mut cells = 0;
        for (first, word) in word_first.iter_mut().zip(occupied.words()) {
            *first = cells;
            cells += word.count_ones();
        }
        // How many weeds each cell has; summed up, the place behind its last one.
        cell_first.clear();
        cell_first.reserve(positions.len() + 1);
        cell_first.resize(cells as usize + 1, 0);
        for (tile, bit, _) in place_of.iter_mut() {
            let rank = word_first[*tile] as usize + occupied.rank_in_tile(*tile, *bit);
            cell_first[rank] += 1;
            *tile = rank;
        }
        let mut end = 0;
        for first in cell_first.iter_mut() {
            end += *first;
            *first = end;
        }
        // From the last weed to the first, so that those of a cell come out ascending, and its first place is left.
        by_cell.clear();
        let state = State { fine_bit: 0, is_standing: false, is_sought: false };
        let nobody = IndexedWeed { number: 0, state, position: Point::origin() };
        by_cell.resize(positions.len(), nobody);
        let count = u32::try_from(positions.len()).expect("at most ten million weeds");
        let places = (0..count).zip(positions).zip(&*place_of);
        for ((number, &position), &(rank, _, state)) in places.rev() {
            cell_first[rank] -= 1;
            by_cell[cell_first[rank] as usize] = IndexedWeed { number, state, position };
        }
    }

    /// The weeds of one cell that has some, ascending.
    #[inline]
    pub(super) fn in_cell(&self, cell: Cell) -> &[IndexedWeed] {
        &self.by_cell[self.places(cell)]
    }

    /// The same, to take note of what has become of them.
    pub(super) fn in_cell_mut(&mut self, cell: Cell) -> &mut [IndexedWeed] {
        let places = self.places(cell);
        &mut self.by_cell[places]
    }

    #[inline]
    fn places(&self, cell: Cell) -> Range<usize> {
        let rank = self.occupied.rank_in_tile(cell.tile, cell.bit);
        let cell = self.word_first[cell.tile] as usize + rank;
        self.cell_first[cell] as usize..self.cell_first[cell + 1] as usize
    }
}
