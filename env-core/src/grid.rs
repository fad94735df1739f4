//! The pasture cut into cells: the one spatial index, for weeds and for seen ground.

use crate::geometry::{Footprint, Point, Side, XLimits};
use crate::math::{floor_index, larger, smaller};

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
    /// Cells in a metre.
    per_x_m: f64,
    per_y_m: f64,
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
        let (cell_x_m, cell_y_m) = (length_m / columns as f64, width_m / rows as f64);
        Self {
            columns,
            rows,
            words_per_row: columns.div_ceil(WORD),
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

    /// Size of the pasture along x and y, metres.
    #[must_use]
    pub fn size_m(&self) -> (f64, f64) {
        (self.columns as f64 * self.cell_x_m, self.rows as f64 * self.cell_y_m)
    }

    /// The column and row of the cell that holds a point; points outside belong to the nearest cell.
    #[must_use]
    pub fn cell_of(&self, point: Point) -> (usize, usize) {
        let column = floor_index(point.x * self.per_x_m).min(self.columns - 1);
        let row = floor_index(point.y * self.per_y_m).min(self.rows - 1);
        (column, row)
    }

    /// The middle of a cell, world frame, metres.
    #[must_use]
    pub fn centre(&self, column: usize, row: usize) -> Point {
        Point::new((column as f64 + 0.5) * self.cell_x_m, (row as f64 + 0.5) * self.cell_y_m)
    }

    /// First and last row that a footprint may reach.
    #[inline]
    fn rows_of(&self, footprint: &impl Footprint, reach: Reach) -> std::ops::Range<usize> {
        let (bottom_m, top_m) = footprint.y_range();
        let (low, high) = ((bottom_m - SLACK_M) * self.per_y_m, (top_m + SLACK_M) * self.per_y_m);
        let (first, end) = span(low, high, reach);
        first.min(self.rows)..end.min(self.rows)
    }

    /// The limits of a footprint in cells: where the row's line through its middle, or its whole height, may meet it.
    #[inline]
    fn limits_in_cells(&self, footprint: &impl Footprint, reach: Reach) -> XLimits {
        let half_m = if reach == Reach::Touch { 0.5 * self.cell_y_m } else { 0.0 };
        let XLimits { lower, upper } = *footprint.limits();
        let in_cells = |side: Side, widen: f64| Side {
            x_at_0_m: (side.x_at_0_m + widen * (side.slope.abs() * half_m + SLACK_M))
                * self.per_x_m,
            slope: side.slope * self.per_x_m,
        };
        XLimits {
            lower: lower.map(|side| in_cells(side, -1.0)),
            upper: upper.map(|side| in_cells(side, 1.0)),
        }
    }
}

/// First cell and end of the cells that `low..=high` reaches, both in cells.
#[inline]
fn span(low: f64, high: f64, reach: Reach) -> (usize, usize) {
    match reach {
        Reach::Touch => (floor_index(low), floor_index(high + 1.0)),
        // The centre of cell i lies at i + 1/2: from the first i not below low - 1/2 to the last one not above high - 1/2.
        Reach::Centre => (floor_index(low + (0.5 - 1e-12)), floor_index(high + 0.5)),
    }
}

/// A set of cells, one bit each.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CellSet {
    words: Vec<u64>,
    /// Number of cells of each row, so that rows without any are passed over.
    per_row: Vec<u32>,
}

impl CellSet {
    /// No cell of `grid`.
    #[must_use]
    pub fn empty(grid: &Grid) -> Self {
        Self { words: vec![0; grid.words_per_row * grid.rows], per_row: vec![0; grid.rows] }
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
        let tail = tail(grid);
        let fits = words.len() == grid.words_per_row * grid.rows
            && words
                .chunks_exact(grid.words_per_row)
                .all(|row| row[grid.words_per_row - 1] & !tail == 0);
        fits.then(|| {
            let per_row = words
                .chunks_exact(grid.words_per_row)
                .map(|row| row.iter().map(|word| word.count_ones()).sum())
                .collect();
            Self { words, per_row }
        })
    }

    /// The bits: 64 columns a word, each row in words of its own, lowest bit first.
    #[must_use]
    pub fn words(&self) -> &[u64] {
        &self.words
    }

    /// Takes every cell out.
    pub fn clear(&mut self) {
        self.words.fill(0);
        self.per_row.fill(0);
    }

    /// Puts every cell of `grid` in.
    pub fn fill(&mut self, grid: &Grid) {
        for row in self.words.chunks_exact_mut(grid.words_per_row) {
            row.fill(u64::MAX);
            row[grid.words_per_row - 1] = tail(grid);
        }
        self.per_row
            .fill(u32::try_from(grid.columns).expect("a pasture has at most 64 million columns"));
    }

    /// Number of cells in the set.
    #[must_use]
    pub fn len(&self) -> usize {
        self.per_row.iter().map(|&count| count as usize).sum()
    }

    /// Whether the set holds no cell.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.per_row.iter().all(|&count| count == 0)
    }

    /// Whether a cell is in the set.
    #[must_use]
    pub fn contains(&self, grid: &Grid, column: usize, row: usize) -> bool {
        self.words[row * grid.words_per_row + column / WORD] >> (column % WORD) & 1 == 1
    }

    /// Which of the 64 columns from `first` on a row has in the set, lowest bit first; columns beyond the grid are not in it.
    #[inline]
    #[must_use]
    pub fn bits_from(&self, grid: &Grid, first: usize, row: usize) -> u64 {
        let words = &self.words[row * grid.words_per_row..(row + 1) * grid.words_per_row];
        let (word, shift) = (first / WORD, first % WORD);
        let low = words[word] >> shift;
        match words.get(word + 1) {
            Some(next) if shift > 0 => low | next << (WORD - shift),
            _ => low,
        }
    }

    /// The word that holds a cell, and how many cells of the set come before it in that word.
    #[inline]
    #[must_use]
    pub fn rank_in_word(&self, grid: &Grid, column: usize, row: usize) -> (usize, usize) {
        let word = row * grid.words_per_row + column / WORD;
        let before = self.words[word] & !(u64::MAX << (column % WORD));
        (word, before.count_ones() as usize)
    }

    /// Puts a cell in.
    pub fn insert(&mut self, grid: &Grid, column: usize, row: usize) {
        let word = &mut self.words[row * grid.words_per_row + column / WORD];
        let bit = 1 << (column % WORD);
        self.per_row[row] += u32::from(*word & bit == 0);
        *word |= bit;
    }

    /// Takes out every cell that a footprint may reach and for which `is_out` holds; returns how many.
    ///
    /// `is_out` is asked for cells of the set only, rows upwards, columns ascending.
    #[inline]
    pub fn remove_where(
        &mut self,
        grid: &Grid,
        footprint: &impl Footprint,
        reach: Reach,
        mut is_out: impl FnMut(usize, usize) -> bool,
    ) -> usize {
        let rows = grid.rows_of(footprint, reach);
        if self.per_row[rows.clone()].iter().all(|&count| count == 0) {
            return 0;
        }
        let XLimits { lower: [l0, l1], upper: [u0, u1] } = grid.limits_in_cells(footprint, reach);
        let mut removed = 0;
        for row in rows {
            if self.per_row[row] == 0 {
                continue;
            }
            let y_m = (row as f64 + 0.5) * grid.cell_y_m;
            let at_row = |side: Side| side.x_at_0_m + side.slope * y_m;
            let low = larger(at_row(l0), at_row(l1));
            let high = smaller(at_row(u0), at_row(u1));
            let (first, end) = span(low, high, reach);
            let end = end.min(grid.columns);
            if first >= end {
                continue;
            }
            let mut removed_here = 0;
            for word_index in first / WORD..=(end - 1) / WORD {
                let word = &mut self.words[row * grid.words_per_row + word_index];
                let mut bits = *word & mask(first, end, word_index);
                while bits != 0 {
                    if is_out(word_index * WORD + bits.trailing_zeros() as usize, row) {
                        *word &= !(bits & bits.wrapping_neg());
                        removed_here += 1;
                    }
                    bits &= bits - 1;
                }
            }
            self.per_row[row] -= removed_here;
            removed += removed_here as usize;
        }
        removed
    }
}

/// The bits that a row's last word may have.
fn tail(grid: &Grid) -> u64 {
    u64::MAX >> (grid.words_per_row * WORD - grid.columns)
}

/// The bits of word `word` that stand for the columns `first..end`.
#[inline]
fn mask(first: usize, end: usize, word: usize) -> u64 {
    let from = first.saturating_sub(word * WORD);
    let to = (end - word * WORD).min(WORD);
    (u64::MAX << from) & (u64::MAX >> (WORD - to))
}
