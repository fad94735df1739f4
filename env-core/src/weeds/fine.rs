//! Where weeds stand, more finely than by cells.

use std::ops::Range;

use crate::geometry::{Footprint, Point};
use crate::grid::{EVERY_ROW, Grid, TILE};
use crate::math::{floor_index, floor_indices, smaller};

/// Fine cells along either side of a cell, as a power of two; fewer where a pasture would have more of them than that.
const FINEST: u32 = 2;
const MOST: usize = 1 << 18;
/// Slack that keeps the ranges on the safe side of rounding, metres.
const SLACK_M: f64 = 1e-6;

/// A set of fine cells, of which each cell has the same number along x and y, and 8 by 8 of them make a tile.
///
/// A bar that passes beside standing weeds touches many cells that hold some, but few such fine cells.
#[derive(Debug, Clone)]
pub(super) struct FineCells {
    power: u32,
    /// For x and y: how many there are in a metre, and the last one.
    per_m: [f64; 2],
    last: [usize; 2],
    tile_columns: usize,
    /// A word a tile, tiles row by row, and within a tile the fine cells row by row, lowest bit first.
    words: Vec<u64>,
}

/// A fine cell: its tile, and its bit in it, which no other fine cell of the same cell has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FineCell {
    tile: usize,
    pub(super) bit: u8,
}

/// The first and the last column and row of some fine cells.
#[derive(Debug, Clone, Copy)]
pub(super) struct FineBox([[usize; 2]; 2]);

impl FineCells {
    /// No fine cell of `grid`.
    pub(super) fn empty(grid: &Grid) -> Self {
        let power = (0..=FINEST).rev().find(|power| grid.cells() << (2 * power) <= MOST);
        let power = power.unwrap_or(0);
        // A power of two, so that rounding puts no point into another cell.
        let fine = f64::from(1_u32 << power);
        let per_m = grid.in_cells(fine, fine);
        let counts = [grid.columns() << power, grid.rows() << power];
        let [tile_columns, tile_rows] = counts.map(|count| count.div_ceil(TILE));
        Self {
            power,
            per_m: [per_m.0, per_m.1],
            last: counts.map(|count| count - 1),
            tile_columns,
            words: vec![0; tile_columns * tile_rows],
        }
    }

    /// Takes every fine cell out.
    pub(super) fn clear(&mut self) {
        self.words.fill(0);
    }

    /// The fine cell that holds a point.
    pub(super) fn at(&self, point: Point) -> FineCell {
        let at = |i: usize, at_m: f64| floor_index(at_m * self.per_m[i]).min(self.last[i]);
        let (column, row) = (at(0, point.x), at(1, point.y));
        let tile = row / TILE * self.tile_columns + column / TILE;
        let bit = u8::try_from(row % TILE * TILE + column % TILE).expect("below 64");
        FineCell { tile, bit }
    }

    /// Puts a fine cell in.
    pub(super) fn insert(&mut self, cell: FineCell) {
        self.words[cell.tile] |= 1 << cell.bit;
    }

    /// Takes a fine cell out.
    pub(super) fn remove(&mut self, cell: FineCell) {
        self.words[cell.tile] &= !(1 << cell.bit);
    }

    /// Those that a footprint may touch; `None` if it ends below the first one.
    #[inline]
    pub(super) fn around(&self, footprint: &impl Footprint<0>) -> Option<FineBox> {
        let (x_range, y_range) = (footprint.x_range(), footprint.y_range());
        let is_below = smaller(x_range.1, y_range.1) < -SLACK_M;
        (!is_below).then(|| FineBox([self.range(0, x_range), self.range(1, y_range)]))
    }

    /// The columns and rows of the cells that some fine cells belong to.
    #[inline]
    pub(super) fn cells_of(&self, FineBox(ranges): FineBox) -> (Range<usize>, Range<usize>) {
        let [columns, rows] =
            ranges.map(|[first, last]| first >> self.power..(last >> self.power) + 1);
        (columns, rows)
    }

    /// Calls `visit` with each fine cell of the set in a box: the column and row of the cell that it belongs to, and its own
    /// bit.
    #[inline]
    pub(super) fn for_each_in(
        &self,
        FineBox([[first_column, last_column], [first_row, last_row]]): FineBox,
        mut visit: impl FnMut((usize, usize), u8),
    ) {
        let (left, right) = (first_column / TILE, last_column / TILE);
        let (bottom, top) = (first_row / TILE, last_row / TILE);
        let in_left = ((0xff << (first_column % TILE)) & 0xff) * EVERY_ROW;
        let in_right = (0xff >> (TILE - 1 - last_column % TILE)) * EVERY_ROW;
        let in_bottom = u64::MAX << (TILE * (first_row % TILE));
        let in_top = u64::MAX >> (TILE * (TILE - 1 - last_row % TILE));
        let mut visit_tile = |column: usize, row: usize, within: u64| {
            let bits = self.words[row * self.tile_columns + column] & within;
            if bits != 0 {
                self.for_each_of((column, row), bits, &mut visit);
            }
        };
        let (across, up) = (right.wrapping_sub(left), top.wrapping_sub(bottom));
        if across < 2 && up < 2 {
            // Mostly there are four tiles at most; those that are the same have all their cells in the first one's turn.
            let (in_left, in_right) =
                if across == 0 { (in_left & in_right, 0) } else { (in_left, in_right) };
            let (in_bottom, in_top) =
                if up == 0 { (in_bottom & in_top, 0) } else { (in_bottom, in_top) };
            visit_tile(left, bottom, in_left & in_bottom);
            visit_tile(right, bottom, in_right & in_bottom);
            visit_tile(left, top, in_left & in_top);
            visit_tile(right, top, in_right & in_top);
            return;
        }
        let within = |at: usize, first: (usize, u64), last: (usize, u64)| {
            let only = |(tile, cells): (usize, u64)| if at == tile { cells } else { u64::MAX };
            only(first) & only(last)
        };
        for row in bottom..=top {
            let in_rows = within(row, (bottom, in_bottom), (top, in_top));
            for column in left..=right {
                let in_columns = within(column, (left, in_left), (right, in_right));
                visit_tile(column, row, in_columns & in_rows);
            }
        }
    }

    /// The same for these bits of a tile. Kept apart, or the way past tiles without any would be longer.
    #[inline(never)]
    #[expect(clippy::cast_possible_truncation, reason = "a word has 64 bits")]
    fn for_each_of(
        &self,
        (tile_column, tile_row): (usize, usize),
        mut bits: u64,
        visit: &mut impl FnMut((usize, usize), u8),
    ) {
        while bits != 0 {
            let bit = bits.trailing_zeros() as u8;
            bits &= bits - 1;
            let (column, row) = (usize::from(bit) % TILE, usize::from(bit) / TILE);
            let (column, row) = (tile_column * TILE + column, tile_row * TILE + row);
            visit((column >> self.power, row >> self.power), bit);
        }
    }

    /// The first and the last fine cell that a range along x or y may reach, which does not end below 0; a range beyond the
    /// last one has a first one behind that.
    #[inline]
    fn range(&self, axis: usize, (low_m, high_m): (f64, f64)) -> [usize; 2] {
        let (per_m, last) = (self.per_m[axis], self.last[axis]);
        let [first, end] = floor_indices([(low_m - SLACK_M) * per_m, (high_m + SLACK_M) * per_m]);
        [first, end.min(last)]
    }
}
