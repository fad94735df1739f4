//! Sets of cells.

use std::ops::Range;

use smallvec::SmallVec;

use super::{EVERY_ROW, Grid, TILE, columns_within, rows_within, tiles_of};
use crate::geometry::Footprint;

/// A cell, and where a set keeps it.
#[derive(Debug, Clone, Copy)]
pub struct Cell {
    /// Along x, from 0.
    pub column: usize,
    /// Along y, from 0.
    pub row: usize,
    pub(crate) tile: usize,
    pub(crate) bit: u32,
}

/// A tile: its place in a set, and its place on the pasture in tiles.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tile {
    pub(super) index: usize,
    pub(super) column: usize,
    pub(super) row: usize,
}

impl Tile {
    /// Calls `visit` with the cells of these bits.
    #[inline]
    pub(crate) fn for_each(self, mut bits: u64, mut visit: impl FnMut(Cell)) {
        while bits != 0 {
            let bit = bits.trailing_zeros();
            let at = bit as usize;
            let (column, row) = (self.column * TILE + at % TILE, self.row * TILE + at / TILE);
            visit(Cell { column, row, tile: self.index, bit });
            bits &= bits - 1;
        }
    }
}

/// A set of cells, one bit each.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CellSet {
    words: SmallVec<[u64; NEAR_WORDS]>,
}

/// So many words of a set lie within it, and no further memory has to be fetched: those of 100 m by 40 m, and a few more.
const NEAR_WORDS: usize = 72;

impl CellSet {
    /// No cell of `grid`.
    #[must_use]
    pub fn empty(grid: &Grid) -> Self {
        Self { words: SmallVec::from_elem(0, grid.tile_columns * grid.tile_rows) }
    }

    /// Every cell of `grid`.
    #[must_use]
    pub fn full(grid: &Grid) -> Self {
        let mut set = Self::empty(grid);
        set.fill(grid);
        set
    }

    /// The set with these bits; `None` if they are not those of a set of `grid`.
    #[must_use]
    pub fn from_words(grid: &Grid, words: Vec<u64>) -> Option<Self> {
        let all = Self::full(grid);
        let fits = words.len() == all.words.len()
            && words.iter().zip(&all.words).all(|(word, all)| word & !all == 0);
        fits.then(|| Self { words: words.into() })
    }

    /// The bits: a word a tile, tiles row by row, and within a tile the cells row by row, lowest bit first.
    #[inline]
    #[must_use]
    pub fn words(&self) -> &[u64] {
        &self.words
    }

    /// Takes every cell out.
    pub fn clear(&mut self) {
        self.words.fill(0);
    }

    /// Puts every cell of `grid` in.
    pub fn fill(&mut self, grid: &Grid) {
        // How many cells of a tile the pasture still has; then the bits of as many columns, and of as many rows.
        let left = |tile: usize, cells: usize| (cells - tile * TILE).min(TILE);
        for (tile_row, words) in self.words.chunks_exact_mut(grid.tile_columns).enumerate() {
            let rows = u64::MAX >> (64 - TILE * left(tile_row, grid.rows));
            words.fill(rows);
            let columns = 0xff_u64 >> (TILE - left(grid.tile_columns - 1, grid.columns));
            words[grid.tile_columns - 1] = rows & (columns * EVERY_ROW);
        }
    }

    /// Number of cells in the set.
    #[must_use]
    pub fn len(&self) -> usize {
        self.words.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Whether the set holds no cell.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.words.iter().all(|&word| word == 0)
    }

    /// Whether a cell is in the set.
    #[inline]
    #[must_use]
    pub fn contains(&self, grid: &Grid, column: usize, row: usize) -> bool {
        let (tile, bit) = grid.place(column, row);
        self.words[tile] >> bit & 1 == 1
    }

    /// Which of the 64 columns from `first` on a row has in the set, lowest bit first; columns beyond the grid are not in it.
    #[inline]
    #[must_use]
    pub fn bits_from(&self, grid: &Grid, first: usize, row: usize) -> u64 {
        let start = row / TILE * grid.tile_columns;
        let words = &self.words[start + first / TILE..start + grid.tile_columns];
        let eighth = |word: &u64| word >> (TILE * (row % TILE)) & 0xff;
        // Of the first tile the columns before `first` are shifted out, which makes room for a ninth tile.
        let shift = first % TILE;
        let bits = words.iter().take(TILE).rev().fold(0, |bits, word| bits << TILE | eighth(word));
        let ninth = words.get(TILE).map_or(0, eighth);
        if shift == 0 { bits } else { bits >> shift | ninth << (64 - shift) }
    }

    /// Puts a cell in; returns whether it was not in yet.
    pub fn insert(&mut self, cell: Cell) -> bool {
        let word = &mut self.words[cell.tile];
        let is_new = *word >> cell.bit & 1 == 0;
        *word |= 1 << cell.bit;
        is_new
    }

    /// Takes a cell out; returns whether it was in.
    pub fn remove(&mut self, cell: Cell) -> bool {
        let word = &mut self.words[cell.tile];
        let was_in = *word >> cell.bit & 1 == 1;
        *word &= !(1 << cell.bit);
        was_in
    }

    /// Takes these cells of a tile out if all of them are in; returns whether they were.
    pub(crate) fn remove_from_tile(&mut self, tile: usize, bits: u64) -> bool {
        match self.words.get_mut(tile) {
            Some(word) if *word & bits == bits => {
                *word &= !bits;
                true
            }
            _ => false,
        }
    }

    /// Calls `visit` with every cell of the set that a footprint may touch, once.
    pub fn for_each_touched<const PAIRS: usize>(
        &self,
        grid: &Grid,
        footprint: &impl Footprint<PAIRS>,
        mut visit: impl FnMut(Cell),
    ) {
        let words = |tile: usize| (0, self.words[tile]);
        grid.for_each_touched(footprint, words, |tile, _, bits, _| tile.for_each(bits, &mut visit));
    }

    /// Calls `visit` with every cell of the set whose centre a footprint may hold, once.
    pub(crate) fn for_each_held<const PAIRS: usize>(
        &self,
        grid: &Grid,
        footprint: &impl Footprint<PAIRS>,
        mut visit: impl FnMut(Cell),
    ) {
        let words = |tile: usize| (self.words[tile], 0);
        grid.for_each_touched(footprint, words, |tile, bits, _, _| tile.for_each(bits, &mut visit));
    }

    /// Calls `visit` with the cells of the set in these columns and rows.
    #[inline]
    pub fn for_each_in(
        &self,
        grid: &Grid,
        columns: Range<usize>,
        rows: Range<usize>,
        mut visit: impl FnMut(Cell),
    ) {
        for row in tiles_of(&rows) {
            let in_rows = rows_within(&rows, row);
            for column in tiles_of(&columns) {
                let index = row * grid.tile_columns + column;
                let bits = self.words[index] & in_rows & columns_within(&columns, column);
                Tile { index, column, row }.for_each(bits, &mut visit);
            }
        }
    }
}
