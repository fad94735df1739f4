//! How far it is along a ray to the nearest cell of a set.

use wide::f64x2;

use crate::geometry::Point;
use crate::grid::{CellSet, Grid, TILE};
use crate::math::{floor_index, larger, smaller};

/// A ray that moves slower than this along an axis, in cells a metre, counts as if it moved so fast: it gets nowhere.
const STANDSTILL: f64 = 1e-30;
/// By this share of their size the pasture, its tiles and its cells end earlier, so that rounding leads no ray beyond them,
/// and one along a border between two cells keeps to that which it heads for.
const HAIR: f64 = 1e-12;
/// Who stands so near to a border, in cells, may have crossed it.
const BESIDE: f64 = 1e-9;
/// Half a tile, in cells.
const HALF_TILE: f64 = 0.5 * TILE as f64;
/// A number so large has no bits left for a fraction; added to a smaller one, its lowest bits are the nearest whole number.
const NO_FRACTION: f64 = 1.5 * (1_u64 << 52) as f64;

/// What takes a ray on by a column (1), by a row (2) or by both (3), in places of a list of rows.
type Steps = [usize; 4];

/// The steps where a row has so many places, by the quadrant of the ray.
const fn steps(columns: usize) -> [Steps; 4] {
    let (left, down) = (usize::MAX, columns.wrapping_neg());
    [
        [0, 1, columns, columns.wrapping_add(1)],
        [0, left, columns, columns.wrapping_add(left)],
        [0, 1, down, down.wrapping_add(1)],
        [0, left, down, down.wrapping_add(left)],
    ]
}

/// The cells of a tile that a ray from one of them can meet, by quadrant and by the number of that one.
static AHEAD: [[u64; TILE * TILE]; 4] = {
    const EACH_ROW: u64 = 0x0101_0101_0101_0101;
    let mut ahead = [[0; TILE * TILE]; 4];
    let mut cell = 0;
    while cell < TILE * TILE {
        let (column, row) = (cell % TILE, cell / TILE);
        let rightwards = EACH_ROW * (0xff << column & 0xff);
        let leftwards = EACH_ROW * (0xff >> (TILE - 1 - column));
        let upwards = u64::MAX << (TILE * row);
        let downwards = u64::MAX >> (TILE * (TILE - 1 - row));
        ahead[0][cell] = rightwards & upwards;
        ahead[1][cell] = leftwards & upwards;
        ahead[2][cell] = rightwards & downwards;
        ahead[3][cell] = leftwards & downwards;
        cell += 1;
    }
    ahead
};

/// The rays from one point through the cells of a set.
///
/// A ray walks from cell to cell (Amanatides & Woo, 1987, "A Fast Voxel Traversal Algorithm for Ray Tracing"), and over a
/// tile without cells of the set at once. Pairs are of x and y, in cells unless they say metres; which axis comes next is
/// worked out without a branch, since no processor could foresee it. Nor could it foresee the last tile of a ray: how many
/// there are is counted beforehand, so that it need not wait for the walk to find out.
pub(super) struct Rays<'a> {
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
    is_inside: bool,
    /// The tile nearest to the origin, and the way to its middle.
    tile: (usize, f64x2),
}

impl<'a> Rays<'a> {
    /// The rays from `origin`, up to `cap_m` metres long.
    #[inline]
    pub(super) fn new(grid: &Grid, cells: &'a CellSet, origin: Point, cap_m: f64) -> Self {
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
            is_inside: larger(beside, beyond) <= 0.0,
            tile: tile_at(origin, origin, tiles),
        }
    }

    /// Gives `visit` how far it is to the nearest point of a cell of the set in some directions (cosine and sine of the
    /// bearing from a heading, whose own are given), metres, at most the cap.
    #[inline]
    pub(super) fn ranges_m(
        &self,
        (cos, sin): (f64, f64),
        directions: &[(f64, f64)],
        mut visit: impl FnMut(f64),
    ) {
        let ahead = f64x2::new([cos, sin]) * self.cells_per_m;
        let left = f64x2::new([-sin, cos]) * self.cells_per_m;
        let mut rays = directions
            .iter()
            .map(|&(cos, sin)| self.ray(f64x2::splat(cos) * ahead + f64x2::splat(sin) * left));
        // A ray is worked out before the one ahead of it is followed: the processor need not wait for its quotients.
        let mut next = rays.next();
        while let Some(ray) = next {
            next = rays.next();
            visit(smaller(self.range_m(&ray), self.cap_m));
        }
    }

    /// The ray that moves so many cells a metre.
    #[inline]
    fn ray(&self, along: f64x2) -> Ray {
        let speed = along.abs().fast_max(f64x2::splat(STANDSTILL));
        let cell_m = f64x2::splat(1.0) / speed;
        let mut ray = Ray {
            speed,
            cell_m,
            signs: along & f64x2::splat(-0.0),
            quadrant: along.to_bitmask() as usize,
            ..Ray::default()
        };
        let border_m = ray.leaves_m(self.to_middle, self.half * f64x2::splat(1.0 - HAIR));
        ray.end_m = smaller(least(border_m), self.cap_m);
        ray.tile_m = ray.leaves_m(self.tile.1, f64x2::splat(HALF_TILE));
        ray.tiles_ahead = ray.tiles_after(self.tile.1);
        ray
    }

    /// The way to the first cell of the set, metres; anything from the cap on if there is none.
    #[inline]
    fn range_m(&self, ray: &Ray) -> f64 {
        let (mut begins_m, mut index, mut borders_m) = (0.0, self.tile.0, ray.tile_m);
        let mut tiles_ahead = ray.tiles_ahead;
        if !self.is_inside {
            let enters_m = ray.leaves_m(self.to_middle, -self.half);
            begins_m = -least(-enters_m);
            if begins_m < 0.0 || begins_m >= ray.end_m {
                return f64::INFINITY;
            }
            let entry = self.origin + ((f64x2::splat(begins_m) * ray.speed) ^ ray.signs);
            let (first, to_middle) = tile_at(entry, self.origin, self.tiles);
            index = first;
            // Rounding may put the entry behind a border of the tile.
            borders_m = ray.leaves_m(to_middle, f64x2::splat(HALF_TILE));
            borders_m = borders_m.fast_max(f64x2::splat(begins_m));
            tiles_ahead = ray.tiles_after(to_middle);
        }
        let steps = &self.tile_steps[ray.quadrant];
        let tile_m = ray.cell_m * f64x2::splat(TILE as f64);
        // The first tile counts wherever the ray ends.
        let mut enters_m = f64::NEG_INFINITY;
        while let Some(&word) = self.words.get(index) {
            // One that begins where the ray ends may have been counted, too.
            if word != 0
                && enters_m < ray.end_m
                && let Some(hit_m) = ray.first_hit(word, larger(enters_m, begins_m), borders_m)
            {
                return hit_m;
            }
            if tiles_ahead <= 0 {
                break;
            }
            tiles_ahead -= 1;
            let (border_m, crossed) = cross(&mut borders_m, tile_m);
            enters_m = border_m;
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

/// How many whole cells are left where a ray has so many cells to go in a tile: the lowest bits of a pair.
#[inline]
fn whole_cells(left: f64x2) -> f64x2 {
    (left - f64x2::splat(0.5 + HAIR))
        .fast_max(f64x2::ZERO)
        .fast_min(f64x2::splat((TILE - 1) as f64))
        + f64x2::splat(NO_FRACTION)
}

/// The smaller of a pair.
#[inline]
fn least(pair: f64x2) -> f64 {
    let [x, y] = pair.to_array();
    smaller(x, y)
}

/// Takes a ray over the nearer of the next borders of a column and a row, or over both if they are equally near, and puts
/// those behind them in their place. Returns the way there, and which they are, as [`Steps`] numbers them.
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
    /// The same as a number: 1 if it goes to the left, and 2 if it goes down.
    quadrant: usize,
    /// Ways to where it leaves the columns and the rows of the tile nearest to the origin.
    tile_m: f64x2,
    /// Way to where it leaves the pasture, at most the cap.
    end_m: f64,
    /// How many tiles it enters after the one nearest to the origin.
    tiles_ahead: i32,
}

impl Ray {
    /// Ways to where the ray leaves the columns and the rows of a rectangle; or enters them, if half the size is negative.
    #[inline]
    fn leaves_m(&self, to_middle: f64x2, half: f64x2) -> f64x2 {
        ((to_middle ^ self.signs) + half) * self.cell_m
    }

    /// How many tiles the ray enters before its end, after one whose middle is so far from the origin.
    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "the lowest bits are wanted")]
    fn tiles_after(&self, to_middle: f64x2) -> i32 {
        // The lowest bits of a sum with this are the nearest whole number of tiles.
        const PARTS_OF_TILES: f64 = NO_FRACTION * TILE as f64;
        // A ray that hardly leaves the border of a tile crosses it.
        let to_middle = (to_middle ^ self.signs) - f64x2::splat(BESIDE);
        let beyond_middle = f64x2::splat(self.end_m) * self.speed - to_middle;
        let [x, y] = (beyond_middle + f64x2::splat(PARTS_OF_TILES)).to_array().map(f64::to_bits);
        x.wrapping_add(y) as i32
    }

    /// The number of the cell behind which so many whole ones are left, as [`whole_cells`] has them.
    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "the lowest bits are wanted")]
    fn cell(&self, whole: f64x2) -> usize {
        // What makes of the cells left the number of one, by quadrant.
        const NUMBERS: [u64; 4] = [0o77, 0o70, 0o07, 0o00];
        let [x, y] = whole.to_array().map(f64::to_bits);
        (x.wrapping_add(y.wrapping_mul(TILE as u64)) ^ NUMBERS[self.quadrant]) as usize
    }

    /// The way to the first cell of a tile that the ray meets, if it meets one. It enters the tile after `at_m` metres, and
    /// leaves its columns and rows after `leaves_m`.
    #[inline]
    fn first_hit(&self, word: u64, mut at_m: f64, leaves_m: f64x2) -> Option<f64> {
        const STEPS: [Steps; 4] = steps(TILE);
        // How many cells are left in the tile, whole ones and a part of one.
        let left = (leaves_m - f64x2::splat(at_m)) * self.speed;
        let whole = whole_cells(left);
        let part = (left - (whole - f64x2::splat(NO_FRACTION))).fast_max(f64x2::ZERO);
        let mut cell = self.cell(whole);
        // Many rays that meet no cell of the set have none in the box around their way either, which is sooner asked.
        let leaves_tile_m = least(leaves_m);
        // Rounding may have the ray leave before it enters.
        let last_m = f64x2::splat(larger(leaves_tile_m, at_m));
        let last = self.cell(whole_cells((leaves_m - last_m) * self.speed));
        let (ahead, behind) = (&AHEAD[self.quadrant], &AHEAD[self.quadrant ^ 3]);
        let word = word & ahead[cell % 64] & behind[last % 64];
        if word == 0 {
            return None;
        }
        let mut borders_m = part * self.cell_m + f64x2::splat(at_m);
        let end_m = leaves_tile_m * (1.0 - HAIR);
        while word >> (cell % 64) & 1 == 0 {
            let (border_m, crossed) = cross(&mut borders_m, self.cell_m);
            if border_m >= end_m {
                return None;
            }
            at_m = border_m;
            cell = cell.wrapping_add(STEPS[self.quadrant][crossed]);
        }
        Some(at_m)
    }
}
