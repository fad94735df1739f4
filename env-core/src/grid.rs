//! The pasture cut into cells: the one spatial index, for weeds and for seen ground.

use serde::{Deserialize, Serialize};

use crate::geometry::{Footprint, Point};
use crate::math::floor_index;

/// Slack that keeps the ranges on the safe side of rounding, metres.
const SLACK_M: f64 = 1e-6;
/// Cells of one machine word.
const WORD: usize = 64;

/// How a pasture is cut: `columns` cells along x, `rows` along y, each about 1 m by 1 m.
///
/// A cell is exactly 1 m where the pasture's size is a whole number of metres; other sizes are cut evenly, into cells a
/// little smaller, so that every cell's centre lies on the pasture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    columns: usize,
    rows: usize,
    words_per_row: usize,
    cell_x_m: f64,
    cell_y_m: f64,
}

/// Some cells of one row that a footprint may reach: the set bits of `mask` in word `word` of row `row`.
#[derive(Debug, Clone, Copy)]
pub struct Stripe {
    row: usize,
    word: usize,
    mask: u64,
}

/// Which cells a footprint reaches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reach {
    /// Those whose centre may lie in it.
    Centre,
    /// Those of which any point may lie in it.
    Touch,
}

impl Grid {
    /// The grid of a pasture of `length_m` by `width_m`, both positive.
    #[must_use]
    pub fn new(length_m: f64, width_m: f64) -> Self {
        let count = |size_m: f64| floor_index((size_m - 1e-9).ceil()).max(1);
        let (columns, rows) = (count(length_m), count(width_m));
        Self {
            columns,
            rows,
            words_per_row: columns.div_ceil(WORD),
            cell_x_m: length_m / columns as f64,
            cell_y_m: width_m / rows as f64,
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

    /// Size of the pasture along x and y, metres.
    #[must_use]
    pub fn size_m(&self) -> (f64, f64) {
        (self.columns as f64 * self.cell_x_m, self.rows as f64 * self.cell_y_m)
    }

    /// The column and row of the cell that holds a point; points outside belong to the nearest cell.
    #[must_use]
    pub fn cell_of(&self, point: Point) -> (usize, usize) {
        let column = floor_index(point.x / self.cell_x_m).min(self.columns - 1);
        let row = floor_index(point.y / self.cell_y_m).min(self.rows - 1);
        (column, row)
    }

    /// The middle of a cell, world frame, metres.
    #[must_use]
    pub fn centre(&self, column: usize, row: usize) -> Point {
        Point::new((column as f64 + 0.5) * self.cell_x_m, (row as f64 + 0.5) * self.cell_y_m)
    }

    /// Calls `visit` with every stripe of cells that `footprint` may reach, rows upwards, columns ascending.
    #[inline]
    pub fn for_each_stripe(
        &self,
        footprint: &impl Footprint,
        reach: Reach,
        mut visit: impl FnMut(Stripe),
    ) {
        // Centres lie half a cell from a cell's sides: shrink the strip to its middle line, and the columns likewise.
        let inset = if reach == Reach::Centre { 0.5 } else { 0.0 };
        let (bottom_m, top_m) = footprint.y_range();
        let Some((first_row, last_row)) = span(bottom_m, top_m, self.cell_y_m, inset, self.rows)
        else {
            return;
        };
        for row in first_row..=last_row {
            let from_m = (row as f64 + inset) * self.cell_y_m;
            let to_m = (row as f64 + 1.0 - inset) * self.cell_y_m;
            let (left_m, right_m) = footprint.x_range(from_m - SLACK_M, to_m + SLACK_M);
            let Some((first, last)) = span(left_m, right_m, self.cell_x_m, inset, self.columns)
            else {
                continue;
            };
            for word in first / WORD..=last / WORD {
                let mut mask = u64::MAX;
                if word == first / WORD {
                    mask &= u64::MAX << (first % WORD);
                }
                if word == last / WORD {
                    mask &= u64::MAX >> (WORD - 1 - last % WORD);
                }
                visit(Stripe { row, word, mask });
            }
        }
    }
}

/// First and last index of the cells whose inner part (the cell less `inset` of its size on either side) meets `from_m..=to_m`.
#[inline]
fn span(from_m: f64, to_m: f64, cell_m: f64, inset: f64, count: usize) -> Option<(usize, usize)> {
    let low = (from_m - SLACK_M) / cell_m - inset;
    let high = (to_m + SLACK_M) / cell_m - inset;
    if low > high || high < 0.0 {
        return None;
    }
    // Whole cells begin where the range does; centres are the first ones not before it.
    let first = if inset > 0.0 { floor_index(low + (1.0 - 1e-12)) } else { floor_index(low) };
    let last = floor_index(high).min(count - 1);
    (first <= last).then_some((first, last))
}

/// A set of cells, one bit each.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CellSet {
    words: Vec<u64>,
}

impl CellSet {
    /// No cell of `grid`.
    #[must_use]
    pub fn empty(grid: &Grid) -> Self {
        Self { words: vec![0; grid.words_per_row * grid.rows] }
    }

    /// Every cell of `grid`.
    #[must_use]
    pub fn full(grid: &Grid) -> Self {
        let mut set = Self::empty(grid);
        set.fill(grid);
        set
    }

    /// Takes every cell out.
    pub fn clear(&mut self) {
        self.words.fill(0);
    }

    /// Puts every cell of `grid` in.
    pub fn fill(&mut self, grid: &Grid) {
        let tail = u64::MAX >> (grid.words_per_row * WORD - grid.columns);
        for row in self.words.chunks_exact_mut(grid.words_per_row) {
            row.fill(u64::MAX);
            row[grid.words_per_row - 1] = tail;
        }
    }

    /// Whether the set has as many words as `grid` asks for and no bit outside it.
    #[must_use]
    pub fn fits(&self, grid: &Grid) -> bool {
        let tail = u64::MAX >> (grid.words_per_row * WORD - grid.columns);
        self.words.len() == grid.words_per_row * grid.rows
            && self
                .words
                .chunks_exact(grid.words_per_row)
                .all(|row| row[grid.words_per_row - 1] & !tail == 0)
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
    #[must_use]
    pub fn contains(&self, grid: &Grid, column: usize, row: usize) -> bool {
        self.words[row * grid.words_per_row + column / WORD] >> (column % WORD) & 1 == 1
    }

    /// Puts a cell in.
    pub fn insert(&mut self, grid: &Grid, column: usize, row: usize) {
        self.words[row * grid.words_per_row + column / WORD] |= 1 << (column % WORD);
    }

    /// Takes a cell out.
    pub fn remove(&mut self, grid: &Grid, column: usize, row: usize) {
        self.words[row * grid.words_per_row + column / WORD] &= !(1 << (column % WORD));
    }

    /// Calls `visit` with the column and row of every cell of the set in a stripe, ascending.
    #[inline]
    pub fn for_each_in(&self, grid: &Grid, stripe: Stripe, mut visit: impl FnMut(usize, usize)) {
        let mut bits = self.words[stripe.row * grid.words_per_row + stripe.word] & stripe.mask;
        while bits != 0 {
            visit(stripe.word * WORD + bits.trailing_zeros() as usize, stripe.row);
            bits &= bits - 1;
        }
    }

    /// Takes out every cell of a stripe for which `is_out` holds; returns how many.
    #[inline]
    pub fn remove_in(
        &mut self,
        grid: &Grid,
        stripe: Stripe,
        mut is_out: impl FnMut(usize, usize) -> bool,
    ) -> usize {
        let word = &mut self.words[stripe.row * grid.words_per_row + stripe.word];
        let mut bits = *word & stripe.mask;
        let mut removed = 0;
        while bits != 0 {
            let bit = bits & bits.wrapping_neg();
            if is_out(stripe.word * WORD + bits.trailing_zeros() as usize, stripe.row) {
                *word &= !bit;
                removed += 1;
            }
            bits &= bits - 1;
        }
        removed
    }
}
