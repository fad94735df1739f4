//! Weeds sorted by the cells that they stand in.

use std::ops::Range;

use crate::geometry::Point;
use crate::grid::{Cell, Grid, TILE};

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
    tiles: Vec<Tile>,
    /// For each cell with a weed, in order, its first place in `by_cell`, and behind the last one the end.
    cell_first: Vec<u32>,
    /// Tile and bit of each weed's cell, and its state; of use only while the index is built.
    place_of: Vec<(usize, u32, State)>,
}

/// What the index knows of a tile.
#[derive(Debug, Clone, Copy, Default)]
struct Tile {
    /// Its cells with a weed, row by row, lowest bit first.
    occupied: u64,
    /// How many of them come before each row.
    before_row: [u8; TILE],
    /// How many cells with a weed come before its first one.
    first: u32,
}

/// How many bits each byte has set: where a processor is not known to count bits, this takes half the instructions.
const ONES: [u8; 256] = {
    let mut ones = [0; 256];
    let mut byte = 1;
    while byte < 256 {
        ones[byte] = ones[byte / 2] + [0, 1][byte % 2];
        byte += 1;
    }
    ones
};

impl Tile {
    /// How many cells with a weed come before that of a bit.
    #[inline]
    fn rank(&self, bit: u32) -> usize {
        let (row, column) = (bit as usize / TILE, bit as usize % TILE);
        let before = self.occupied.to_le_bytes()[row] & !(u8::MAX << column);
        self.first as usize + usize::from(self.before_row[row] + ONES[usize::from(before)])
    }
}

impl CellIndex {
    /// No weed.
    pub(super) fn none(grid: &Grid) -> Self {
        let (across, up) = grid.tiles();
        let tiles = vec![Tile::default(); across * up];
        Self { by_cell: Vec::new(), tiles, cell_first: vec![0], place_of: Vec::new() }
    }

    /// Sorts weeds anew, and calls `visit` with each of them and its cell, which returns its state.
    pub(super) fn build(
        &mut self,
        grid: &Grid,
        positions: &[Point],
        mut visit: impl FnMut(usize, Cell) -> State,
    ) {
        let Self { by_cell, tiles, cell_first, place_of } = self;
        tiles.fill(Tile::default());
        place_of.clear();
        place_of.extend(positions.iter().enumerate().map(|(weed, &position)| {
            let cell = grid.cell_at(position);
            tiles[cell.tile].occupied |= 1 << cell.bit;
            (cell.tile, cell.bit, visit(weed, cell))
        }));
        let mut cells = 0;
        for tile in tiles.iter_mut() {
            if tile.occupied != 0 {
                tile.first = cells;
                let mut before = 0;
                for (row, occupied) in tile.occupied.to_le_bytes().into_iter().enumerate() {
                    tile.before_row[row] = before;
                    before += ONES[usize::from(occupied)];
                }
                cells += u32::from(before);
            }
        }
        // How many weeds each cell has; summed up, the place behind its last one.
        cell_first.clear();
        cell_first.reserve(positions.len() + 1);
        cell_first.resize(cells as usize + 1, 0);
        for (tile, bit, _) in place_of.iter_mut() {
            let rank = tiles[*tile].rank(*bit);
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
        let rank = self.tiles[cell.tile].rank(cell.bit);
        let [first, end] = self.cell_first[rank..].first_chunk().expect("an end follows");
        *first as usize..*end as usize
    }
}
