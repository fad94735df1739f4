//! The ground seen so far.

use std::ops::Range;
use std::sync::Arc;

use crate::geometry::Point;
use crate::grid::{Cell, CellSet, Grid, TILE};
use crate::math::{floor_index, larger, smaller};

/// Which cells of the pasture have been seen: their centre was inside the triangle at a look, or under the bar.
#[derive(Debug, Clone)]
pub struct SeenGround {
    grid: Arc<Grid>,
    unseen: CellSet,
    unseen_count: usize,
}

impl SeenGround {
    /// Nothing seen yet.
    #[must_use]
    pub fn none(grid: Arc<Grid>) -> Self {
        Self { unseen: CellSet::full(&grid), unseen_count: grid.cells(), grid }
    }

    /// Forgets everything.
    pub(crate) fn clear(&mut self) {
        self.unseen.fill(&self.grid);
        self.unseen_count = self.grid.cells();
    }

    pub(crate) fn restore(&mut self, unseen: CellSet) {
        self.unseen_count = unseen.len();
        self.unseen = unseen;
    }

    pub(crate) fn unseen(&self) -> &CellSet {
        &self.unseen
    }

    /// The cells.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Whether a cell has been seen.
    #[must_use]
    pub fn is_seen(&self, column: usize, row: usize) -> bool {
        !self.unseen.contains(&self.grid, column, row)
    }

    /// Calls `visit` with a column and bits, lowest first: which of the columns from there on are unseen in `row`. Every
    /// unseen cell of `columns` is among them, and no other.
    #[inline]
    pub fn for_each_unseen(
        &self,
        columns: Range<usize>,
        row: usize,
        mut visit: impl FnMut(usize, u64),
    ) {
        let mut first = columns.start;
        while first < columns.end {
            let left = columns.end - first;
            let mask = if left < 64 { !(u64::MAX << left) } else { u64::MAX };
            let bits = self.unseen.bits_from(&self.grid, first, row) & mask;
            if bits != 0 {
                visit(first, bits);
            }
            first += 64;
        }
    }

    /// Number of cells not seen yet.
    #[must_use]
    pub fn unseen_count(&self) -> usize {
        self.unseen_count
    }

    /// Share of the cells that have been seen, 0 to 1.
    #[must_use]
    pub fn fraction(&self) -> f64 {
        1.0 - self.unseen_count as f64 / self.grid.cells() as f64
    }

    /// Takes note that these cells are seen.
    pub fn absorb(&mut self, cells: &[Cell]) {
        for &cell in cells {
            self.unseen_count -= usize::from(self.unseen.remove(cell));
        }
    }

    /// Gives `visit` the distances from `origin` to the nearest point of an unseen cell in some directions (cosine and sine
    /// of the bearing in the world frame), metres, at most `cap_m`. Outside the pasture there is nothing to see.
    ///
    /// A ray walks from cell to cell (Amanatides & Woo, 1987, "A Fast Voxel Traversal Algorithm for Ray Tracing"), and over
    /// a tile without unseen cells at once.
    #[inline]
    pub fn ranges_to_unseen(
        &self,
        origin: Point,
        directions: impl Iterator<Item = (f64, f64)>,
        cap_m: f64,
        mut visit: impl FnMut(f64),
    ) {
        let at = self.grid.in_cells(origin.x, origin.y);
        let (columns, rows) = (self.grid.columns(), self.grid.rows());
        let (cells_x, cells_y) = (columns as f64, rows as f64);
        let is_inside = at.0 >= 0.0 && at.0 <= cells_x && at.1 >= 0.0 && at.1 <= cells_y;
        // All rays from within begin in one tile.
        let (tile_columns, tile_rows) = self.grid.tiles();
        let own_tile = (tile_of(at.0, tile_columns), tile_of(at.1, tile_rows));
        for (cos, sin) in directions {
            let (along_x, along_y) = self.grid.in_cells(cos, sin);
            let (x, y) = (Line::new(at.0, along_x), Line::new(at.1, along_y));
            let (mut enter_m, mut tile) = (0.0, own_tile);
            if !is_inside {
                enter_m = larger(x.entry_m(cells_x), y.entry_m(cells_y));
                let is_hit =
                    enter_m < cap_m && x.is_on(enter_m, cells_x) && y.is_on(enter_m, cells_y);
                if !is_hit {
                    visit(cap_m);
                    continue;
                }
                tile = (tile_of(x.at(enter_m), tile_columns), tile_of(y.at(enter_m), tile_rows));
            }
            visit(smaller(self.walk(&x, &y, tile, enter_m, cap_m), cap_m));
        }
    }

    /// Follows a ray that enters a tile after `at_m` metres; returns after how many it meets an unseen cell, or anything from `cap_m` on if it does not.
    #[inline]
    fn walk(
        &self,
        x: &Line,
        y: &Line,
        (mut tile_x, mut tile_y): (usize, usize),
        mut at_m: f64,
        cap_m: f64,
    ) -> f64 {
        let words = self.unseen.words();
        let (columns, _) = self.grid.tiles();
        let mut index = tile_y * columns + tile_x;
        let row_step = y.step.wrapping_mul(columns);
        let (mut leaves_x_m, mut leaves_y_m) =
            (x.leaves_m(tile_x, TILE as f64), y.leaves_m(tile_y, TILE as f64));
        let (tile_x_m, tile_y_m) = (TILE as f64 * x.cell_m, TILE as f64 * y.cell_m);
        // Tiles beyond either end have numbers that are too large.
        while at_m < cap_m && tile_x < columns {
            let Some(&word) = words.get(index) else { break };
            if word != 0
                && let Some(hit_m) = first_hit(word, x, y, (tile_x, tile_y), at_m)
            {
                return hit_m;
            }
            if leaves_x_m < leaves_y_m {
                at_m = leaves_x_m;
                leaves_x_m += tile_x_m;
                tile_x = tile_x.wrapping_add(x.step);
                index = index.wrapping_add(x.step);
            } else {
                at_m = leaves_y_m;
                leaves_y_m += tile_y_m;
                tile_y = tile_y.wrapping_add(y.step);
                index = index.wrapping_add(row_step);
            }
        }
        f64::INFINITY
    }
}

/// In which of `tiles` tiles something is that is so many cells from the pasture's border.
#[inline]
fn tile_of(at: f64, tiles: usize) -> usize {
    floor_index(at * (1.0 / TILE as f64)).min(tiles - 1)
}

/// Follows a ray through a tile that it enters after `at_m` metres; returns after how many it meets a cell of `word`.
#[inline]
fn first_hit(word: u64, x: &Line, y: &Line, tile: (usize, usize), mut at_m: f64) -> Option<f64> {
    let (first_x, first_y) = (tile.0 * TILE, tile.1 * TILE);
    let (mut part_x, mut part_y) = (x.part(at_m, first_x), y.part(at_m, first_y));
    let (mut border_x_m, mut border_y_m) =
        (x.leaves_m(first_x + part_x, 1.0), y.leaves_m(first_y + part_y, 1.0));
    // Cells beyond the tile have numbers that are too large.
    while (part_x | part_y) < TILE {
        if word >> (part_y * TILE + part_x) & 1 == 1 {
            return Some(at_m);
        }
        if border_x_m < border_y_m {
            at_m = border_x_m;
            border_x_m += x.cell_m;
            part_x = part_x.wrapping_add(x.step);
        } else {
            at_m = border_y_m;
            border_y_m += y.cell_m;
            part_y = part_y.wrapping_add(y.step);
        }
    }
    None
}

/// A ray that moves slower than this along an axis, in cells a metre, counts as if it moved so fast: it gets nowhere.
const STANDSTILL: f64 = 1e-30;

/// A ray along one axis, in cells.
struct Line {
    at: f64,
    /// Cells a metre.
    along: f64,
    /// Metres a cell.
    cell_m: f64,
    /// What takes it one cell on: 1, or what takes 1 off.
    step: usize,
    /// 1 where it leaves a cell at its upper end, 0 where at its lower one.
    leaves_at: f64,
    /// `cell_m` with the sign of `along`.
    signed_cell_m: f64,
}

impl Line {
    #[inline]
    fn new(at: f64, along: f64) -> Self {
        let cell_m = 1.0 / larger(along.abs(), STANDSTILL);
        if along >= 0.0 {
            Self { at, along, cell_m, step: 1, leaves_at: 1.0, signed_cell_m: cell_m }
        } else {
            Self { at, along, cell_m, step: usize::MAX, leaves_at: 0.0, signed_cell_m: -cell_m }
        }
    }

    /// Way after which the ray enters the strip of `cells` cells, metres: 0 from within, infinite if never.
    fn entry_m(&self, cells: f64) -> f64 {
        let outside = if self.at < 0.0 { self.at } else { larger(self.at - cells, 0.0) };
        if outside == 0.0 {
            0.0
        } else if outside * self.along < 0.0 {
            outside.abs() * self.cell_m
        } else {
            f64::INFINITY
        }
    }

    /// Whether the ray is in the strip after `at_m` metres.
    fn is_on(&self, at_m: f64, cells: f64) -> bool {
        (-1e-9..=cells + 1e-9).contains(&self.at(at_m))
    }

    /// Where the ray is after `at_m` metres.
    #[inline]
    fn at(&self, at_m: f64) -> f64 {
        self.at + at_m * self.along
    }

    /// In which of the cells of a tile that begins with cell `first` the ray is after `at_m` metres.
    #[inline]
    fn part(&self, at_m: f64, first: usize) -> usize {
        floor_index(self.at(at_m) - first as f64).min(TILE - 1)
    }

    /// Way at which the ray leaves the part of that number, all of which have `size` cells, metres.
    #[inline]
    fn leaves_m(&self, part: usize, size: f64) -> f64 {
        ((part as f64 + self.leaves_at) * size - self.at) * self.signed_cell_m
    }
}
