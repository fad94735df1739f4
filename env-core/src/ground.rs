//! The ground seen so far.

use std::ops::Range;

use crate::geometry::Point;
use crate::grid::{Cell, CellSet, Grid, TILE};
use crate::math::{floor_index, larger, smaller};

/// Which cells of the pasture have been seen: their centre was inside the triangle at a look, or under the bar.
#[derive(Debug, Clone)]
pub struct SeenGround {
    grid: Grid,
    unseen: CellSet,
    unseen_count: usize,
    /// The tiles as cells, and those of them that hold unseen cells.
    tile_grid: Grid,
    unseen_tiles: CellSet,
}

impl SeenGround {
    /// Nothing seen yet.
    #[must_use]
    pub fn none(grid: Grid) -> Self {
        let tile_grid = grid.of_tiles();
        Self {
            grid,
            unseen: CellSet::full(&grid),
            unseen_count: grid.cells(),
            tile_grid,
            unseen_tiles: CellSet::full(&tile_grid),
        }
    }

    /// Forgets everything.
    pub(crate) fn clear(&mut self) {
        self.unseen.fill(&self.grid);
        self.unseen_tiles.fill(&self.tile_grid);
        self.unseen_count = self.grid.cells();
    }

    pub(crate) fn restore(&mut self, unseen: CellSet) {
        self.unseen_count = unseen.len();
        self.unseen = unseen;
        self.unseen_tiles.clear();
        for (tile, &word) in self.unseen.words().iter().enumerate() {
            if word != 0 {
                self.unseen_tiles.insert(self.tile_grid.cell_number(tile));
            }
        }
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
            if self.unseen.words()[cell.tile] == 0 {
                self.unseen_tiles.remove(self.tile_grid.cell_number(cell.tile));
            }
        }
    }

    /// Writes the distances from `origin` to the nearest point of an unseen cell in some directions (cosine and sine of the
    /// bearing in the world frame) to `ranges_m`, metres, at most `cap_m`. Outside the pasture there is nothing to see.
    ///
    /// A ray walks from tile to tile, and within those that hold unseen cells from cell to cell (Amanatides & Woo, 1987, "A
    /// Fast Voxel Traversal Algorithm for Ray Tracing").
    pub fn ranges_to_unseen(
        &self,
        origin: Point,
        directions: impl Iterator<Item = (f64, f64)>,
        cap_m: f64,
        mut visit: impl FnMut(f64),
    ) {
        let at = self.grid.in_cells(origin.x, origin.y);
        let (cells_x, cells_y) = (self.grid.columns() as f64, self.grid.rows() as f64);
        let is_inside = at.0 >= 0.0 && at.0 <= cells_x && at.1 >= 0.0 && at.1 <= cells_y;
        for (cos, sin) in directions {
            if self.unseen_count == 0 {
                visit(cap_m);
                continue;
            }
            let (along_x, along_y) = self.grid.in_cells(cos, sin);
            let (x, y) = (Line::new(at.0, along_x), Line::new(at.1, along_y));
            let mut enter_m = 0.0;
            if !is_inside {
                enter_m = larger(x.entry_m(cells_x), y.entry_m(cells_y));
                let is_hit =
                    enter_m < cap_m && x.is_on(enter_m, cells_x) && y.is_on(enter_m, cells_y);
                if !is_hit {
                    visit(cap_m);
                    continue;
                }
            }
            visit(smaller(self.walk(&x, &y, enter_m, cap_m), cap_m));
        }
    }

    /// Walks over blocks of tiles; returns after how many metres an unseen cell is met, or anything above `cap_m`.
    #[inline]
    fn walk(&self, x: &Line, y: &Line, enter_m: f64, cap_m: f64) -> f64 {
        const SIZE: f64 = (TILE * TILE) as f64;
        let (words, tile_words) = (self.unseen.words(), self.unseen_tiles.words());
        let (columns, _) = self.grid.tiles();
        let (block_columns, block_rows) = self.tile_grid.tiles();
        let mut at_m = enter_m;
        let (mut block_x, mut block_y) =
            (x.block(at_m, SIZE, block_columns), y.block(at_m, SIZE, block_rows));
        // Blocks beyond either end have numbers that are too large.
        while at_m < cap_m && block_x < block_columns && block_y < block_rows {
            let first = ((block_x * TILE * TILE) as f64, (block_y * TILE * TILE) as f64);
            let tiles = tile_words[block_y * block_columns + block_x];
            let hit_m =
                first_hit(tiles, x, y, first, TILE as f64, at_m, cap_m, |tile_x, tile_y, at_m| {
                    let (tile_x, tile_y) = (block_x * TILE + tile_x, block_y * TILE + tile_y);
                    let first = ((tile_x * TILE) as f64, (tile_y * TILE) as f64);
                    let word = words[tile_y * columns + tile_x];
                    first_hit(word, x, y, first, 1.0, at_m, cap_m, |_, _, at_m| Some(at_m))
                });
            if let Some(hit_m) = hit_m {
                return hit_m;
            }
            let (leaves_x_m, leaves_y_m) = (x.leaves_m(first.0, SIZE), y.leaves_m(first.1, SIZE));
            if leaves_x_m < leaves_y_m {
                at_m = leaves_x_m;
                block_x = block_x.wrapping_add(x.step);
            } else {
                at_m = leaves_y_m;
                block_y = block_y.wrapping_add(y.step);
            }
        }
        f64::INFINITY
    }
}

/// Follows a ray that enters a square of eight by eight parts after `at_m` metres from part to part, and asks `visit` at those
/// that are set in `word`, until it has an answer.
#[inline]
#[expect(clippy::too_many_arguments, reason = "one loop for tiles and cells")]
fn first_hit(
    word: u64,
    x: &Line,
    y: &Line,
    first: (f64, f64),
    size: f64,
    mut at_m: f64,
    cap_m: f64,
    visit: impl Fn(usize, usize, f64) -> Option<f64>,
) -> Option<f64> {
    if word == 0 {
        return None;
    }
    let (mut part_x, mut part_y) = (x.part(at_m, first.0, size), y.part(at_m, first.1, size));
    let mut border_x_m = x.leaves_m(first.0 + part_x as f64 * size, size);
    let mut border_y_m = y.leaves_m(first.1 + part_y as f64 * size, size);
    let (part_x_m, part_y_m) = (x.cell_m * size, y.cell_m * size);
    // Parts beyond the square have numbers that are too large.
    while (part_x | part_y) < TILE && at_m < cap_m {
        if word >> (part_y * TILE + part_x) & 1 == 1 {
            let answer = visit(part_x, part_y, at_m);
            if answer.is_some() {
                return answer;
            }
        }
        if border_x_m < border_y_m {
            at_m = border_x_m;
            border_x_m += part_x_m;
            part_x = part_x.wrapping_add(x.step);
        } else {
            at_m = border_y_m;
            border_y_m += part_y_m;
            part_y = part_y.wrapping_add(y.step);
        }
    }
    None
}

/// A ray along one axis, in cells.
struct Line {
    at: f64,
    /// Cells a metre.
    along: f64,
    /// Metres a cell; infinite where the ray does not move.
    cell_m: f64,
    /// What takes it one cell on: 1, or what takes 1 off.
    step: usize,
    is_forward: bool,
}

impl Line {
    #[inline]
    fn new(at: f64, along: f64) -> Self {
        let is_forward = along >= 0.0;
        let step = if is_forward { 1 } else { usize::MAX };
        Self { at, along, cell_m: 1.0 / along.abs(), step, is_forward }
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
        (-1e-9..=cells + 1e-9).contains(&(self.at + at_m * self.along))
    }

    /// In which of `blocks` blocks of `size` cells the ray is after `at_m` metres.
    #[inline]
    fn block(&self, at_m: f64, size: f64, blocks: usize) -> usize {
        floor_index((self.at + at_m * self.along) * (1.0 / size)).min(blocks - 1)
    }

    /// In which of the eight parts of `size` from `first` the ray is after `at_m` metres.
    #[inline]
    fn part(&self, at_m: f64, first: f64, size: f64) -> usize {
        floor_index((self.at + at_m * self.along - first) * (1.0 / size)).min(TILE - 1)
    }

    /// Way at which the ray leaves the block of `size` from `first`, metres.
    #[inline]
    fn leaves_m(&self, first: f64, size: f64) -> f64 {
        let way = if self.is_forward { first + size - self.at } else { self.at - first };
        way * self.cell_m
    }
}
