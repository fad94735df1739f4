//! Unseen ground in pieces: bands as high as the sensor sees, cut into tiles, in the order of a boustrophedon search.

use crate::geometry::Point;
use crate::grid::Grid;
use crate::ground::SeenGround;
use crate::math::floor_index;
use crate::site::{Site, passes};

/// Length of a tile, in sensor ranges: how far a search goes on between two decisions.
const TILE_RANGES: f64 = 2.0 / 3.0;
/// Most tiles of a pasture; larger ones have longer tiles.
const MAX_TILES: usize = 16_384;

/// How a pasture is cut. The bands run along x, upwards from y = 0; the search goes along the first band to the right,
/// along the second to the left, and so on.
#[derive(Debug, Clone)]
pub(super) struct Tiles {
    grid: Grid,
    cell_x_m: f64,
    cell_y_m: f64,
    bands: usize,
    /// Columns of a tile.
    columns: usize,
    per_band: usize,
    /// Which tiles have been seen altogether, as far as that was noticed.
    is_done: Vec<bool>,
}

/// A column of a tile that holds unseen cells.
#[derive(Debug, Clone, Copy)]
pub(super) struct Column {
    /// Way from the band's beginning to the middle of the column, metres.
    pub(super) along_m: f64,
    /// Smallest distance of an unseen cell's centre from the band's middle line, metres.
    pub(super) nearest_m: f64,
    /// Number of unseen cells.
    pub(super) unseen: usize,
}

/// The unseen ground of a tile.
#[derive(Debug, Clone, Copy)]
pub(super) struct Unseen {
    /// Number of unseen cells.
    pub(super) count: usize,
    /// Number of all cells.
    pub(super) cells: usize,
    /// Middle of the unseen cells, world frame, metres.
    pub(super) middle: Point,
}

impl Tiles {
    pub(super) fn new(grid: Grid, site: &Site) -> Self {
        let (length_m, width_m) = grid.size_m();
        let (cell_x_m, cell_y_m) = (length_m / grid.columns() as f64, width_m / grid.rows() as f64);
        let spacing_m = site.sensor_width_m.max(site.deck_width_m).max(cell_y_m);
        let bands = passes(width_m, spacing_m).min(grid.rows());
        let wanted = floor_index(TILE_RANGES * site.sensor_range_m / cell_x_m).max(1);
        let columns = wanted.max((grid.columns() * bands).div_ceil(MAX_TILES)).min(grid.columns());
        let per_band = grid.columns().div_ceil(columns);
        let is_done = vec![false; bands * per_band];
        Self { grid, cell_x_m, cell_y_m, bands, columns, per_band, is_done }
    }

    /// The cells.
    pub(super) fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Forgets which tiles have been seen.
    pub(super) fn reset(&mut self) {
        self.is_done.fill(false);
    }

    /// Number of tiles; they are numbered in the order of the search.
    pub(super) fn len(&self) -> usize {
        self.is_done.len()
    }

    /// Whether a tile is known to have been seen altogether.
    pub(super) fn is_done(&self, tile: usize) -> bool {
        self.is_done[tile]
    }

    fn rows_of(&self, band: usize) -> std::ops::Range<usize> {
        band * self.grid.rows() / self.bands..(band + 1) * self.grid.rows() / self.bands
    }

    /// Whether the search goes along the band of a tile to the right.
    pub(super) fn is_rightward(&self, tile: usize) -> bool {
        (tile / self.per_band).is_multiple_of(2)
    }

    /// Height of the middle line of a tile's band, metres.
    pub(super) fn middle_y_m(&self, tile: usize) -> f64 {
        let rows = self.rows_of(tile / self.per_band);
        0.5 * (rows.start + rows.end) as f64 * self.cell_y_m
    }

    /// Distance of a band's outermost cell centres from its middle line, metres.
    pub(super) fn reach_m(&self, tile: usize) -> f64 {
        let rows = self.rows_of(tile / self.per_band);
        0.5 * (rows.len() - 1) as f64 * self.cell_y_m
    }

    /// Squared distance from a point to the nearest point of a tile, metres squared.
    pub(super) fn distance_m2(&self, tile: usize, from: Point) -> f64 {
        let (rows, columns) = (self.rows_of(tile / self.per_band), self.columns_of(tile));
        let gap = |at_m: f64, cells: std::ops::Range<usize>, cell_m: f64| {
            let (low_m, high_m) = (cells.start as f64 * cell_m, cells.end as f64 * cell_m);
            (low_m - at_m).max(at_m - high_m).max(0.0)
        };
        let dx = gap(from.x, columns, self.cell_x_m);
        let dy = gap(from.y, rows, self.cell_y_m);
        dx * dx + dy * dy
    }

    /// The columns of a tile, along x.
    fn columns_of(&self, tile: usize) -> std::ops::Range<usize> {
        let (first, all) = (tile % self.per_band * self.columns, self.grid.columns());
        let end = (first + self.columns).min(all);
        if self.is_rightward(tile) { first..end } else { all - end..all - first }
    }

    /// The unseen ground of a tile; `None` if there is none, which is noted.
    pub(super) fn look_into(&mut self, tile: usize, ground: &SeenGround) -> Option<Unseen> {
        if self.is_done[tile] {
            return None;
        }
        let (rows, columns) = (self.rows_of(tile / self.per_band), self.columns_of(tile));
        let (mut count, mut columns_sum, mut rows_sum) = (0, 0, 0);
        for row in rows.clone() {
            ground.for_each_unseen(columns.clone(), row, |first, bits| {
                let here = bits.count_ones() as usize;
                count += here;
                rows_sum += row * here;
                columns_sum += first * here + sum_of_places(bits);
            });
        }
        if count == 0 {
            self.is_done[tile] = true;
            return None;
        }
        let mean = |sum: usize| sum as f64 / count as f64 + 0.5;
        Some(Unseen {
            count,
            cells: rows.len() * columns.len(),
            middle: Point::new(mean(columns_sum) * self.cell_x_m, mean(rows_sum) * self.cell_y_m),
        })
    }

    /// Writes the columns of a tile that hold unseen cells, in the order of the search.
    pub(super) fn write_columns(&self, tile: usize, ground: &SeenGround, list: &mut Vec<Column>) {
        let (rows, columns) = (self.rows_of(tile / self.per_band), self.columns_of(tile));
        let is_rightward = self.is_rightward(tile);
        // Twice the offset from the middle line, in cells, is a whole number.
        let (middle, last) = (rows.start + rows.end - 1, columns.end - 1 + columns.start);
        list.clear();
        for i in columns {
            let column = if is_rightward { i } else { last - i };
            let (mut unseen, mut nearest) = (0, usize::MAX);
            for row in rows.clone() {
                if !ground.is_seen(column, row) {
                    unseen += 1;
                    nearest = nearest.min((2 * row).abs_diff(middle));
                }
            }
            if unseen > 0 {
                let from_start =
                    if is_rightward { column } else { self.grid.columns() - 1 - column };
                list.push(Column {
                    along_m: (from_start as f64 + 0.5) * self.cell_x_m,
                    nearest_m: 0.5 * nearest as f64 * self.cell_y_m,
                    unseen,
                });
            }
        }
    }

    /// The centre of the unseen cell of a tile that is nearest to a point of the tile; `None` if the tile holds none.
    pub(super) fn nearest_unseen(
        &self,
        tile: usize,
        ground: &SeenGround,
        to: Point,
    ) -> Option<Point> {
        let (middle, _) = self.grid.cell_of(to);
        let mut nearest: Option<(f64, Point)> = None;
        for row in self.rows_of(tile / self.per_band) {
            ground.for_each_unseen(self.columns_of(tile), row, |first, bits| {
                // Of a row only the unseen cells next to the point's column can be the nearest.
                let at = middle.saturating_sub(first).min(63);
                let (up_to, from) = (bits & (u64::MAX >> (63 - at)), bits & (u64::MAX << at));
                let below = 63_u32.checked_sub(up_to.leading_zeros());
                let above = (from != 0).then(|| from.trailing_zeros());
                for place in below.into_iter().chain(above) {
                    let centre = self.grid.centre(first + place as usize, row);
                    let distance_m2 = (centre - to).norm_squared();
                    if nearest.is_none_or(|(nearest_m2, _)| distance_m2 < nearest_m2) {
                        nearest = Some((distance_m2, centre));
                    }
                }
            });
        }
        nearest.map(|(_, centre)| centre)
    }
}

/// The sum of the places of all bits that are set.
fn sum_of_places(mut bits: u64) -> usize {
    let mut sum = 0;
    while bits != 0 {
        sum += bits.trailing_zeros() as usize;
        bits &= bits - 1;
    }
    sum
}
