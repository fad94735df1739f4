//! The pasture cut into cells: the one spatial index, for weeds and for seen ground.

use std::ops::Range;

use smallvec::SmallVec;
use wide::{f64x2, i16x16};

use crate::geometry::{Footprint, Point, SidePair};
use crate::math::{floor_index, floor_indices, number};

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
                centres = edges.cells_within(&at_first, centres, |pair| pair.to_centre);
            }
            if grounds != 0 {
                grounds = edges.cells_within(&at_first, grounds, |pair| pair.to_corner);
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

/// The unit of whole numbers in which cells are compared with an edge: so many for a step of a cell along x and y together.
const UNITS: f64 = 1500.0;
/// What rounding to whole units may take away over a tile.
const SLACK_UNITS: f64 = 16.0;

/// Two sides of a footprint in cells: how far a point is on the footprint's side of each, linear in column and row.
#[derive(Clone, Copy)]
struct EdgePair {
    /// For the lower left corner of the cell 0, 0.
    at_0: f64x2,
    per_column: f64x2,
    per_row: f64x2,
    /// How much more a cell has at its centre, and at the corner that has most.
    to_centre: f64x2,
    to_corner: f64x2,
}

impl EdgePair {
    #[inline]
    fn new(grid: &Grid, sides: &SidePair) -> Self {
        let (x, y) = (sides.x * grid.cell_x_m, sides.y * grid.cell_y_m);
        let scale = f64x2::splat(UNITS) / (x.abs() + y.abs());
        let (per_column, per_row) = (-x * scale, -y * scale);
        Self {
            at_0: sides.level * scale + SLACK_UNITS,
            per_column,
            per_row,
            to_centre: (per_column + per_row) * 0.5,
            to_corner: per_column.fast_max(f64x2::ZERO) + per_row.fast_max(f64x2::ZERO),
        }
    }

    /// How far inside a point is, in cells from a point that is so far inside.
    #[inline]
    fn at(&self, origin: f64x2, (x, y): (f64, f64)) -> f64x2 {
        origin + self.per_row * y + self.per_column * x
    }

    /// How much more than the first cell of a tile the cell has that has most, and the one that has least.
    #[inline]
    fn most_in_tile(&self) -> f64x2 {
        self.to_corner * (TILE - 1) as f64
    }

    #[inline]
    fn least_in_tile(&self) -> f64x2 {
        (self.per_column + self.per_row - self.to_corner) * (TILE - 1) as f64
    }

    /// All cells of a tile that are within one of the two, which passes through the tile; the first cell is so far inside.
    #[inline(never)]
    fn all_within(&self, place: usize, at_first: f64x2) -> u64 {
        let of = |pair: f64x2| pair.as_array()[place];
        let (at_first, per_column, per_row) = (of(at_first), of(self.per_column), of(self.per_row));
        // 16 bits hold what cells have of an edge that passes through their tile.
        debug_assert!(at_first.abs() < TILE as f64 * UNITS, "{at_first} is far from the edge");
        // Two rows at a time: what is below 0 is beyond the edge.
        let columns = i16x16::new([0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3, 4, 5, 6, 7]);
        let second_row = i16x16::new([0, 0, 0, 0, 0, 0, 0, 0, -1, -1, -1, -1, -1, -1, -1, -1]);
        let mut at = whole(at_first) + whole(per_column) * columns + (whole(per_row) & second_row);
        let two_rows = whole(per_row + per_row);
        let mut beyond = 0;
        for pair in 0..TILE / 2 {
            beyond |= u64::from(at.to_bitmask()) << (2 * TILE * pair);
            at += two_rows;
        }
        !beyond
    }
}

/// The sides of a footprint. Kept apart, or they would be worked out where no cell asks for them.
#[inline(never)]
fn edges_of<const PAIRS: usize>(grid: &Grid, footprint: &impl Footprint<PAIRS>) -> Edges<PAIRS> {
    Edges(footprint.sides().map(|sides| EdgePair::new(grid, &sides)))
}

/// The sides of a footprint in cells.
#[derive(Clone, Copy)]
pub(crate) struct Edges<const PAIRS: usize>([EdgePair; PAIRS]);

/// Whether some cells of a tile are so few that they are compared with an edge one by one, and not all at once.
///
/// One after the other is struck out: where a processor is not known to count bits, counting takes three times as long.
#[inline]
fn are_few(cells: u64) -> bool {
    const FEW_CELLS: usize = 3;
    (0..FEW_CELLS).fold(cells, |left, _| left & left.wrapping_sub(1)) == 0
}

/// Whether some number of a pair is negative.
#[inline]
fn has_negative(pair: f64x2) -> bool {
    pair.to_bitmask() != 0
}

impl<const PAIRS: usize> Edges<PAIRS> {
    /// Whether the footprint may hold a point, in cells from the lower left corner.
    #[inline]
    pub(crate) fn may_hold(&self, point: (f64, f64)) -> bool {
        !self.0.iter().any(|pair| has_negative(pair.at(pair.at_0, point)))
    }

    /// How far inside the lower left corner of a tile is; `None` if all of the tile is beyond a side.
    #[inline]
    fn at_first(&self, tile: Tile) -> Option<[f64x2; PAIRS]> {
        let corner = (number(tile.column * TILE), number(tile.row * TILE));
        let at_first = self.0.map(|pair| pair.at(pair.at_0, corner));
        let is_beyond = |(pair, &at_first): (&EdgePair, &f64x2)| {
            has_negative(at_first + pair.to_corner + pair.most_in_tile())
        };
        (!self.0.iter().zip(&at_first).any(is_beyond)).then_some(at_first)
    }

    /// Those of some cells of a tile that may have a certain point within all edges: their centre, or the corner that is
    /// furthest inside. `at_first` is how far inside the tile's lower left corner is, and `more` how much further inside a
    /// cell's point is than its lower left corner.
    #[inline]
    fn cells_within(
        &self,
        at_first: &[f64x2; PAIRS],
        cells: u64,
        more: impl Fn(&EdgePair) -> f64x2,
    ) -> u64 {
        let edges = &self.0;
        let at_first: [f64x2; PAIRS] = std::array::from_fn(|i| at_first[i] + more(&edges[i]));
        if are_few(cells) {
            return self.few_within(&at_first, cells);
        }
        let mut within = cells;
        for (pair, at_first) in edges.iter().zip(at_first) {
            // Mostly the whole tile is within both.
            let passing = (at_first + pair.least_in_tile()).to_bitmask();
            if passing == 0 {
                continue;
            }
            // One that has all of it beyond is not asked cell by cell: 16 bits hold what passes through a tile only.
            if has_negative(at_first + pair.most_in_tile()) {
                return 0;
            }
            for place in 0..2 {
                if passing >> place & 1 == 1 {
                    within &= pair.all_within(place, at_first);
                }
            }
        }
        within
    }

    /// Those of some cells; `at_first` is how far inside the first cell of the tile is.
    #[inline]
    fn few_within(&self, at_first: &[f64x2; PAIRS], mut cells: u64) -> u64 {
        let mut within = cells;
        while cells != 0 {
            let bit = cells.trailing_zeros() as usize;
            let cell = (number(bit % TILE), number(bit / TILE));
            let is_beyond =
                |(pair, &at_first): (&EdgePair, &f64x2)| has_negative(pair.at(at_first, cell));
            if self.0.iter().zip(at_first).any(is_beyond) {
                within &= !(1 << bit);
            }
            cells &= cells - 1;
        }
        within
    }
}

/// A number of units that 16 bits hold, rounded to a whole one, sixteen times.
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "the lowest 16 bits are wanted")]
fn whole(units: f64) -> i16x16 {
    // A number so large has no bits left for a fraction; its lowest ones are those of the whole number.
    const NO_FRACTION: f64 = 1.5 * (1_u64 << 52) as f64;
    i16x16::splat((units + NO_FRACTION).to_bits() as i16)
}

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
    index: usize,
    column: usize,
    row: usize,
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
