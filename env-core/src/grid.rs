//! The pasture cut into cells: the one spatial index, for weeds and for seen ground.

mod cells;
mod edges;

use std::ops::Range;

use crate::geometry::{Footprint, Point};
use crate::math::{floor_index, floor_indices, number};

pub(crate) use cells::Tile;
pub use cells::{Cell, CellSet};
use edges::{Edges, edges_of};

/// Slack that keeps the ranges on the safe side of rounding, metres.
const SLACK_M: f64 = 1e-6;
/// Cells along either side of a tile: one machine word holds a tile.
pub const TILE: usize = 8;
/// The first cell of every row of a tile.
pub(crate) const EVERY_ROW: u64 = 0x0101_0101_0101_0101;

/// How a pasture is cut: `columns` cells along x, `rows` along y, each about 1 m by 1 m, and 8 by 8 of them a tile.
///
/// A cell is exactly 1 m where the pasture's size is a whole number of metres; other sizes are cut evenly, into cells a
/// little smaller, so that every cell's centre lies on the pasture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    columns: usize,
    rows: usize,
    tile_columns: usize,
    tile_rows: usize,
    cell_x_m: f64,
    cell_y_m: f64,
    /// Cells in a metre.
    per_x_m: f64,
    per_y_m: f64,
}

impl Grid {
    /// The grid of a pasture of `length_m` by `width_m`, both positive.
    #[must_use]
    pub fn new(length_m: f64, width_m: f64) -> Self {
        Self::with_cells_of(1.0, length_m, width_m)
    }

    /// The same with cells of about `side_m`, never larger.
    #[must_use]
    pub fn with_cells_of(side_m: f64, length_m: f64, width_m: f64) -> Self {
        let count = |size_m: f64| floor_index((size_m / side_m - 1e-9).ceil()).max(1);
        let (columns, rows) = (count(length_m), count(width_m));
        let (cell_x_m, cell_y_m) = (length_m / columns as f64, width_m / rows as f64);
        Self {
            columns,
            rows,
            tile_columns: columns.div_ceil(TILE),
            tile_rows: rows.div_ceil(TILE),
            cell_x_m,
            cell_y_m,
            per_x_m: 1.0 / cell_x_m,
            per_y_m: 1.0 / cell_y_m,
        }
    }

    /// Number of cells along x.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number of cells along y.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of cells.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.columns * self.rows
    }

    /// Number of cells that a set keeps a bit for: those of whole tiles.
    #[must_use]
    pub fn cells_kept(&self) -> usize {
        self.tile_columns * self.tile_rows * TILE * TILE
    }

    /// Number of tiles along x and y.
    #[must_use]
    pub fn tiles(&self) -> (usize, usize) {
        (self.tile_columns, self.tile_rows)
    }

    /// Size of a cell along x and y, metres.
    #[must_use]
    pub fn cell_m(&self) -> (f64, f64) {
        (self.cell_x_m, self.cell_y_m)
    }

    /// Size of the pasture along x and y, metres.
    #[must_use]
    pub fn size_m(&self) -> (f64, f64) {
        (self.columns as f64 * self.cell_x_m, self.rows as f64 * self.cell_y_m)
    }

    /// At most how many cells a footprint may touch that lies within `reach_m` of some point.
    #[must_use]
    pub(crate) fn cells_around(&self, reach_m: f64) -> usize {
        let across = |per_m: f64, cells: usize| {
            floor_index(2.0 * (reach_m + SLACK_M) * per_m + 2.0).min(cells)
        };
        across(self.per_x_m, self.columns) * across(self.per_y_m, self.rows)
    }

    /// A point in cells from the lower left corner.
    #[inline]
    #[must_use]
    pub(crate) fn in_cells(&self, x_m: f64, y_m: f64) -> (f64, f64) {
        (x_m * self.per_x_m, y_m * self.per_y_m)
    }

    /// The column and row of the cell that holds a point; points outside belong to the nearest cell.
    #[must_use]
    pub fn cell_of(&self, point: Point) -> (usize, usize) {
        let column = floor_index(point.x * self.per_x_m).min(self.columns - 1);
        let row = floor_index(point.y * self.per_y_m).min(self.rows - 1);
        (column, row)
    }

    /// The cell that holds a point; points outside belong to the nearest cell.
    #[must_use]
    pub fn cell_at(&self, point: Point) -> Cell {
        let (column, row) = self.cell_of(point);
        let (tile, bit) = self.place(column, row);
        Cell { column, row, tile, bit }
    }

    /// The middle of a cell, world frame, metres.
    #[inline]
    #[must_use]
    pub fn centre(&self, column: usize, row: usize) -> Point {
        let (x, y) = (number(column) + 0.5, number(row) + 0.5);
        Point::new(x * self.cell_x_m, y * self.cell_y_m)
    }

    /// The tile that holds a cell, and the cell's bit in it.
    #[inline]
    #[must_use]
    pub(crate) fn place(&self, column: usize, row: usize) -> (usize, u32) {
        let tile = row / TILE * self.tile_columns + column / TILE;
        (tile, u32::try_from(row % TILE * TILE + column % TILE).expect("below 64"))
    }

    /// The cells that a footprint may reach, as the first and the last column and row.
    #[inline]
    fn cells_of<const PAIRS: usize>(
        &self,
        footprint: &impl Footprint<PAIRS>,
    ) -> (Range<usize>, Range<usize>) {
        let cells = |(low_m, high_m): (f64, f64), per_m: f64, count: usize| {
            let (low, high) = ((low_m - SLACK_M) * per_m, (high_m + SLACK_M) * per_m);
            let [first, end] = floor_indices([low, high + 1.0]);
            first..end.min(count)
        };
        (
            cells(footprint.x_range(), self.per_x_m, self.columns),
            cells(footprint.y_range(), self.per_y_m, self.rows),
        )
    }

    /// Calls `visit` with every tile that a footprint may touch, and bits of its cells: of the first of its `words` those
    /// whose centre the footprint may hold, of the second those of which it may touch any ground. Tiles without either are
    /// left out.
    #[inline]
    pub(crate) fn for_each_touched<const PAIRS: usize>(
        &self,
        footprint: &impl Footprint<PAIRS>,
        words: impl Fn(usize) -> (u64, u64),
        mut visit: impl FnMut(Tile, u64, u64, &Edges<PAIRS>),
    ) {
        // Often the box around the footprint holds no cell of any set.
        let mut edges = None;
        self.for_each_in_box(self.cells_of(footprint), words, |tile, mut centres, mut grounds| {
            let edges = edges.get_or_insert_with(|| edges_of(self, footprint));
            let Some(at_first) = edges.at_first(tile) else { return };
            if centres != 0 {
                centres = edges.centres_within(&at_first, centres);
            }
            if grounds != 0 {
                grounds = edges.grounds_within(&at_first, grounds);
            }
            if centres | grounds != 0 {
                visit(tile, centres, grounds, edges);
            }
        });
    }

    /// Calls `visit` with every tile that holds some of these columns and rows, and the bits of their cells in both of its
    /// `words`. Tiles without any are left out.
    #[inline]
    pub(crate) fn for_each_in_box(
        &self,
        (columns, rows): (Range<usize>, Range<usize>),
        words: impl Fn(usize) -> (u64, u64),
        mut visit: impl FnMut(Tile, u64, u64),
    ) {
        let (tile_columns, tile_rows) = (tiles_of(&columns), tiles_of(&rows));
        for row in tile_rows {
            let first = row * self.tile_columns;
            let in_rows = rows_within(&rows, row);
            for column in tile_columns.clone() {
                let index = first + column;
                let (one, other) = words(index);
                if one | other == 0 {
                    continue;
                }
                let in_box = in_rows & columns_within(&columns, column);
                if (one | other) & in_box != 0 {
                    visit(Tile { index, column, row }, one & in_box, other & in_box);
                }
            }
        }
    }

    /// Whether some tile that these columns and rows reach has a cell in `words`: also where only the rest of it has, and
    /// where they reach more than four tiles.
    #[inline]
    pub(crate) fn may_meet(
        &self,
        (columns, rows): &(Range<usize>, Range<usize>),
        words: &[u64],
    ) -> bool {
        let (left, right) = (columns.start / TILE, columns.end.wrapping_sub(1) / TILE);
        let (bottom, top) = (rows.start / TILE, rows.end.wrapping_sub(1) / TILE);
        // Ranges without any cell have their last tile before the first.
        if (right.wrapping_sub(left) | top.wrapping_sub(bottom)) > 1 {
            return true;
        }
        let (first, last) = (bottom * self.tile_columns, top * self.tile_columns);
        (words[first + left] | words[first + right] | words[last + left] | words[last + right]) != 0
    }
}

/// The tiles that hold a range of columns or rows.
#[inline]
fn tiles_of(cells: &Range<usize>) -> Range<usize> {
    cells.start / TILE..cells.end.div_ceil(TILE)
}

/// The part of a range that lies in a tile which holds some of it: the first cell and the end, counted from the tile's first cell.
#[inline]
fn part_within(cells: &Range<usize>, tile: usize) -> (usize, usize) {
    let first = tile * TILE;
    (cells.start.max(first) - first, cells.end.min(first + TILE) - first)
}

/// The cells of a tile that lie in a range of columns which reaches it.
#[inline]
fn columns_within(columns: &Range<usize>, tile: usize) -> u64 {
    let (first, end) = part_within(columns, tile);
    ((0xff << first) & (0xff >> (TILE - end))) * EVERY_ROW
}

/// The cells of a tile that lie in a range of rows which reaches it.
#[inline]
fn rows_within(rows: &Range<usize>, tile: usize) -> u64 {
    let (first, end) = part_within(rows, tile);
    (u64::MAX << (TILE * first)) & (u64::MAX >> (TILE * (TILE - end)))
}
