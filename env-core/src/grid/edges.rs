//! The sides of a footprint, in cells.

use wide::{f64x2, i16x16};

use super::{Grid, TILE, Tile};
use crate::geometry::{Footprint, SidePair};
use crate::math::number;

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
pub(super) fn edges_of<const PAIRS: usize>(
    grid: &Grid,
    footprint: &impl Footprint<PAIRS>,
) -> Edges<PAIRS> {
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
    pub(super) fn at_first(&self, tile: Tile) -> Option<[f64x2; PAIRS]> {
        let corner = (number(tile.column * TILE), number(tile.row * TILE));
        let at_first = self.0.map(|pair| pair.at(pair.at_0, corner));
        let is_beyond = |(pair, &at_first): (&EdgePair, &f64x2)| {
            has_negative(at_first + pair.to_corner + pair.most_in_tile())
        };
        (!self.0.iter().zip(&at_first).any(is_beyond)).then_some(at_first)
    }

    /// Those of some cells of a tile whose centre may be within.
    #[inline]
    pub(super) fn centres_within(&self, at_first: &[f64x2; PAIRS], cells: u64) -> u64 {
        self.cells_within(at_first, cells, |pair| pair.to_centre)
    }

    /// Those of some cells of a tile of which any ground may be within.
    #[inline]
    pub(super) fn grounds_within(&self, at_first: &[f64x2; PAIRS], cells: u64) -> u64 {
        self.cells_within(at_first, cells, |pair| pair.to_corner)
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
