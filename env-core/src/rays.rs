//! How far it is along a ray to the nearest cell of a set.

use wide::{CmpLe, f64x2};

use crate::geometry::Point;
use crate::grid::{CellSet, Grid, TILE};
use crate::math::{floor_index, larger, smaller};

/// A ray that moves slower than this along an axis, in cells a metre, counts as if it moved so fast: it gets nowhere.
const STANDSTILL: f64 = 1e-30;
/// A tile and the pasture end so much earlier, as a share of the way there or of their size, so that rounding leads no ray
/// beyond.
const HAIR: f64 = 1e-10;
/// Half a tile, in cells.
const HALF_TILE: f64 = 0.5 * TILE as f64;
/// Added to a number below 2^51, leaves no bits for a fraction: the lowest ones are those of the nearest whole number.
const NO_FRACTION: f64 = 1.5 * (1_u64 << 52) as f64;

/// Steps along x, y, or both at once, in places of a row-by-row list; only 1, 2 and 3 are asked for.
type Steps = [usize; 4];

/// Steps in a list with rows of that many places, by the signs of the ray: 1 where it goes down along x, 2 along y.
const fn steps(columns: usize) -> [Steps; 4] {
    let (left, down) = (usize::MAX, columns.wrapping_neg());
    [
        [0, 1, columns, columns + 1],
        [0, left, columns, columns - 1],
        [0, 1, down, down.wrapping_add(1)],
        [0, left, down, down.wrapping_sub(1)],
    ]
}

const CELL_STEPS: [Steps; 4] = steps(TILE);

/// The rays from one point through the cells of a set.
///
/// A ray walks from cell to cell (Amanatides & Woo, 1987, "A Fast Voxel Traversal Algorithm for Ray Tracing"), and over a
/// tile without cells of the set at once. Pairs are of x and y, and in cells unless they say metres.
pub(crate) struct Rays<'a> {
    words: &'a [u64],
    tiles: (usize, usize),
    tile_steps: [Steps; 4],
    cap_m: f64,
    cells_per_m: f64x2,
    origin: f64x2,
    /// Half the size of the pasture.
    half: f64x2,
    /// From the origin to the middle of the pasture.
    to_middle: f64x2,
    /// The tile nearest to the origin, and the way to its middle.
    tile: (usize, f64x2),
    is_inside: bool,
}

impl<'a> Rays<'a> {
    /// The rays from `origin`, up to `cap_m` metres long.
    #[inline]
    pub(crate) fn new(grid: &Grid, cells: &'a CellSet, origin: Point, cap_m: f64) -> Self {
        let (x, y) = grid.in_cells(1.0, 1.0);
        let cells_per_m = f64x2::new([x, y]);
        let origin = cells_per_m * f64x2::new([origin.x, origin.y]);
        let half = f64x2::new([grid.columns() as f64, grid.rows() as f64]) * f64x2::splat(0.5);
        let to_middle = half - origin;
        let [beside, beyond] = (to_middle.abs() - half).to_array();
        let tiles = grid.tiles();
        Self {
            words: cells.words(),
            tiles,
            tile_steps: steps(tiles.0),
            cap_m,
            cells_per_m,
            origin,
            half,
            to_middle,
            tile: tile_at(origin, origin, tiles),
            is_inside: larger(beside, beyond) <= 0.0,
        }
    }

    /// Gives `visit` how far it is to the nearest point of a cell of the set in some directions (cosine and sine of the
    /// bearing in the world frame), metres, at most the cap.
    #[inline]
    pub(crate) fn ranges_m(
        &self,
        directions: impl Iterator<Item = (f64, f64)>,
        mut visit: impl FnMut(f64),
    ) {
        // A ray is worked out before the one ahead of it is followed: the processor need not wait for its quotients.
        let mut rays = directions.map(|direction| self.ray(direction));
        let mut next = rays.next();
        while let Some(ray) = next {
            next = rays.next();
            visit(smaller(self.range_m(&ray), self.cap_m));
        }
    }

    #[inline]
    fn ray(&self, (cos, sin): (f64, f64)) -> Ray {
        let along = f64x2::new([cos, sin]) * self.cells_per_m;
        let speed = along.abs().fast_max(f64x2::splat(STANDSTILL));
        let cell_m = f64x2::splat(1.0) / speed;
        let (signs, quadrant) = (along & f64x2::splat(-0.0), along.to_bitmask() as usize);
        let mut ray = Ray { speed, cell_m, signs, quadrant, ..Ray::default() };
        let border_m = ray.leaves_m(self.to_middle, self.half * f64x2::splat(1.0 - HAIR));
        ray.end_m = smaller(least(border_m), self.cap_m);
        ray.tile_m = ray.leaves_m(self.tile.1, f64x2::splat(HALF_TILE));
        ray
    }

    /// The way to the first cell of the set, metres; anything from the cap on if there is none.
    #[inline]
    fn range_m(&self, ray: &Ray) -> f64 {
        let (mut at_m, mut index, mut borders_m) = (0.0, self.tile.0, ray.tile_m);
        if !self.is_inside {
            let enters_m = ray.leaves_m(self.to_middle, -self.half);
            at_m = -least(-enters_m);
            if at_m < 0.0 || at_m >= ray.end_m {
                return f64::INFINITY;
            }
            let entry = self.origin + (f64x2::splat(at_m) * ray.speed ^ ray.signs);
            let (first, to_middle) = tile_at(entry, self.origin, self.tiles);
            index = first;
            borders_m = ray.leaves_m(to_middle, f64x2::splat(HALF_TILE));
        }
        let steps = &self.tile_steps[ray.quadrant];
        let tile_m = ray.cell_m * f64x2::splat(TILE as f64);
        while let Some(&word) = self.words.get(index) {
            if word != 0
                && let Some(hit_m) = ray.first_hit(word, at_m, borders_m)
            {
                return hit_m;
            }
            let (border_m, crossed) = cross(&mut borders_m, tile_m);
            if border_m >= ray.end_m {
                break;
            }
            at_m = border_m;
            index = index.wrapping_add(steps[crossed]);
        }
        f64::INFINITY
    }
}

/// The number of the tile nearest to a point, and the way from the origin to its middle.
#[inline]
fn tile_at(point: f64x2, origin: f64x2, tiles: (usize, usize)) -> (usize, f64x2) {
    let [x, y] = (point * f64x2::splat(1.0 / TILE as f64)).to_array();
    let (column, row) = (floor_index(x).min(tiles.0 - 1), floor_index(y).min(tiles.1 - 1));
    let first = f64x2::new([column as f64, row as f64]) * f64x2::splat(TILE as f64);
    (row * tiles.0 + column, first + f64x2::splat(HALF_TILE) - origin)
}

/// The smaller of a pair.
#[inline]
fn least(pair: f64x2) -> f64 {
    let [x, y] = pair.to_array();
    smaller(x, y)
}

/// Moves a ray over the nearer of the borders that it reaches after so many metres along x and y, or over both if they are
/// equally near; puts the borders after them in their place. Returns how far it is there, and which: 1 for x, 2 for y, 3 for both.
#[inline]
fn cross(borders_m: &mut f64x2, apart_m: f64x2) -> (f64, usize) {
    let [x, y] = borders_m.to_array();
    let others_m = f64x2::new([y, x]);
    let is_nearer = borders_m.simd_le(others_m);
    let [nearer_m, _] = borders_m.fast_min(others_m).to_array();
    *borders_m += is_nearer & apart_m;
    (nearer_m, is_nearer.to_bitmask() as usize)
}

/// A ray along x and y.
#[derive(Default)]
struct Ray {
    /// Cells a metre, without the sign.
    speed: f64x2,
    /// Metres a cell.
    cell_m: f64x2,
    /// The sign bits of the direction.
    signs: f64x2,
    /// Bit 0 is set where the ray goes down along x, bit 1 along y.
    quadrant: usize,
    /// Ways to where it leaves the columns and the rows of the tile nearest to the origin.
    tile_m: f64x2,
    /// Way to where it leaves the pasture, at most the cap.
    end_m: f64,
}

impl Ray {
    /// Ways to where the ray leaves the columns and the rows of a rectangle; to where it enters them if `half` its size is negative.
    #[inline]
    fn leaves_m(&self, to_middle: f64x2, half: f64x2) -> f64x2 {
        ((to_middle ^ self.signs) + half) * self.cell_m
    }

    /// The way to the first cell of a tile that the ray meets, if it meets one. It enters the tile after `at_m` metres, and
    /// leaves its columns and rows after `leaves_m`.
    #[inline]
    fn first_hit(&self, word: u64, mut at_m: f64, leaves_m: f64x2) -> Option<f64> {
        const FLIP: [u64; 4] = [63, 56, 7, 0];
        // Cells that are left until the tile ends; how many of them are whole ones.
        let left = (leaves_m - f64x2::splat(at_m)) * self.speed;
        let rounded = (left - f64x2::splat(0.5)).fast_min(f64x2::splat((TILE - 1) as f64))
            + f64x2::splat(NO_FRACTION);
        let part = left - (rounded - f64x2::splat(NO_FRACTION));
        let mut borders_m = part * self.cell_m + f64x2::splat(at_m);
        let steps = &CELL_STEPS[self.quadrant];
        let [x, y] = rounded.to_array().map(f64::to_bits);
        let mut bit = (x + TILE as u64 * y) ^ FLIP[self.quadrant];
        let end_m = least(leaves_m) * (1.0 - HAIR);
        while word >> (bit & 63) & 1 == 0 {
            let (border_m, crossed) = cross(&mut borders_m, self.cell_m);
            if border_m >= end_m {
                return None;
            }
            at_m = border_m;
            bit = bit.wrapping_add(steps[crossed] as u64);
        }
        Some(at_m)
    }
}
