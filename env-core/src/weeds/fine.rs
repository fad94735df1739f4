//! Where weeds stand, more finely than by cells.

use std::ops::Range;

use crate::geometry::{Footprint, Point};
use crate::grid::{EVERY_ROW, Grid, TILE};
use crate::math::{floor_index, floor_indices, number, smaller};

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
    /// Their size along x and y, and the way from the middle to a corner, metres.
    size_m: [f64; 2],
    to_corner_m: f64,
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
        let cell_m = grid.cell_m();
        let size_m = [cell_m.0 / fine, cell_m.1 / fine];
        Self {
            power,
            per_m: [per_m.0, per_m.1],
            last: counts.map(|count| count - 1),
            size_m,
            to_corner_m: 0.5 * size_m[0].hypot(size_m[1]) + SLACK_M,
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

    /// Calls `visit` with each fine cell of the set in a box where `may_be_met`, asked for the distance from a point that
    /// all of it lies within, says so: the column and row of the cell that it belongs to, and its own bit.
    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "a word has 64 bits")]
    pub(super) fn for_each_within(
        &self,
        FineBox([[first_column, last_column], [first_row, last_row]]): FineBox,
        may_be_met: impl Fn(f64, Point) -> bool,
        mut visit: impl FnMut((usize, usize), u8),
    ) {
        let (left, right) = (first_column / TILE, last_column / TILE);
        let (bottom, top) = (first_row / TILE, last_row / TILE);
        let in_left = ((0xff << (first_column % TILE)) & 0xff) * EVERY_ROW;
        let in_right = (0xff >> (TILE - 1 - last_column % TILE)) * EVERY_ROW;
        let mut in_rows = u64::MAX << (TILE * (first_row % TILE));
        // Inclusive ranges would take twice as long.
        let (tile_rows, tile_columns) = (bottom..top + 1, left..right + 1);
        for tile_row in tile_rows {
            if tile_row == top {
                in_rows &= u64::MAX >> (TILE * (TILE - 1 - last_row % TILE));
            }
            let start = tile_row * self.tile_columns;
            let mut within = in_rows & in_left;
            for tile_column in tile_columns.clone() {
                if tile_column == right {
                    within &= in_right;
                }
                let mut bits = self.words[start + tile_column] & within;
                while bits != 0 {
                    let bit = bits.trailing_zeros() as u8;
                    bits &= bits - 1;
                    let (column, row) = (usize::from(bit) % TILE, usize::from(bit) / TILE);
                    let (column, row) = (tile_column * TILE + column, tile_row * TILE + row);
                    let [x_m, y_m] = self.size_m;
                    let middle =
                        Point::new((number(column) + 0.5) * x_m, (number(row) + 0.5) * y_m);
                    if may_be_met(self.to_corner_m, middle) {
                        visit((column >> self.power, row >> self.power), bit);
                    }
                }
                within = in_rows;
            }
            in_rows = u64::MAX;
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
