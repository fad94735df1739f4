//! The observation `maps`: pictures of the surroundings.

use wide::{f32x8, i32x8};

use super::{Bound, Dtype, Part};
use crate::config::ValidScenario;
use crate::geometry::{Frame, Point};
use crate::grid::TILE;
use crate::ground::SeenGround;
use crate::math::floor_index;
use crate::view::View;

/// Points of a picture along each side.
const SIZE: usize = 32;
/// Number of scales.
const SCALES: usize = 4;
/// What each scale shows, in order.
const CHANNELS: [&str; 3] = ["unseen", "weeds", "outside"];
/// Points of the finest picture along the bar.
const POINTS_PER_BAR: f64 = 8.0;
/// How much coarser each scale is than the one before.
const COARSER: f64 = 3.0;
/// Points that are worked out together.
const LANES: usize = 8;

/// Writes the `maps` observation: 12 pictures of 32 x 32 points, scale by scale: unseen ground, known weeds, outside.
///
/// The mower is in the middle and looks up: row i and column j of the scale s are the square (15.5 - i) r ahead and
/// (15.5 - j) r to the left with r = B/8 x 3^s, its side. Values are shares of 255: of the square's area that is unseen
/// ground, and that lies outside the pasture; 255 for a square with a known weed.
///
/// Deviation: instead of the ground under the square the block of cells is averaged that its middle falls on, of 1, 2, 4 or
/// 8 cells a side, whichever is nearest in size; and what lies outside is that of a square along the axes.
#[derive(Debug, Clone)]
pub struct MapsEncoder {
    is_flat: bool,
    points_m: [f64; SCALES],
}

impl MapsEncoder {
    /// The encoder of a scenario.
    #[must_use]
    pub fn new(scenario: &ValidScenario) -> Self {
        let finest_m = scenario.mower.deck_width_m / POINTS_PER_BAR;
        let mut points_m = [finest_m; SCALES];
        for scale in 1..SCALES {
            points_m[scale] = points_m[scale - 1] * COARSER;
        }
        Self { is_flat: scenario.observation.flat, points_m }
    }

    /// The pictures.
    #[must_use]
    pub fn part(&self) -> Part {
        let channels = SCALES * CHANNELS.len();
        let shape =
            if self.is_flat { vec![channels * SIZE * SIZE] } else { vec![channels, SIZE, SIZE] };
        let bounds = vec![Bound { name: "maps".to_owned(), low: 0.0, high: 255.0 }];
        Part { name: "maps", dtype: Dtype::Uint8, shape, bounds }
    }

    /// Writes the pictures of `view`.
    pub fn encode(&self, view: &View, maps: &mut [u8]) {
        let frame = Frame::from(view.pose);
        let pictures = maps.chunks_exact_mut(CHANNELS.len() * SIZE * SIZE);
        for (&point_m, channels) in self.points_m.iter().zip(pictures) {
            let (unseen, rest) = channels.split_at_mut(SIZE * SIZE);
            let (weeds, outside) = rest.split_at_mut(SIZE * SIZE);
            write_ground(view.ground, &frame, point_m, unseen, outside);
            weeds.fill(0);
            for weed in view.known_weeds {
                if let Some(index) = point_of(&frame, point_m, weed.position) {
                    weeds[index] = u8::MAX;
                }
            }
        }
    }
}

/// Writes the shares of unseen ground and of what lies outside, in float32 and in cells.
#[expect(clippy::cast_possible_truncation, reason = "pictures are exact to a hair's breadth")]
fn write_ground(
    ground: &SeenGround,
    frame: &Frame,
    point_m: f64,
    unseen: &mut [u8],
    outside: &mut [u8],
) {
    let grid = ground.grid();
    let (columns, rows) = (grid.columns(), grid.rows());
    let block = Block::nearest_to(point_m / grid.cell_m().0.max(grid.cell_m().1));
    // From a point to the next one on its left, and to the one below it.
    let step = |x: f64, y: f64| {
        let (x, y) = grid.in_cells(x * point_m, y * point_m);
        (x as f32, y as f32)
    };
    let (right, down) = (step(frame.sin, -frame.cos), step(-frame.cos, -frame.sin));
    let size = step(1.0, 1.0);
    let middle = grid.in_cells(frame.pose.x_m, frame.pose.y_m);
    let half = 0.5 * (SIZE as f32 - 1.0);
    let lanes = f32x8::new([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    let (x_axis, y_axis) = (Strip::new(size.0, columns), Strip::new(size.1, rows));
    for i in 0..SIZE {
        let below = i as f32 - half;
        for first in (0..SIZE).step_by(LANES) {
            let across = lanes + f32x8::splat(first as f32 - half);
            let at = |middle: f64, right: f32, down: f32| {
                across * f32x8::splat(right) + f32x8::splat(middle as f32 + below * down)
            };
            let (x, y) = (at(middle.0, right.0, down.0), at(middle.1, right.1, down.1));
            let shares = f32x8::splat(255.0) * x_axis.share(x) * y_axis.share(y);
            let unseen_shares = block.unseen_shares(ground, x_axis.cell(x), y_axis.cell(y));
            let place = i * SIZE + first..i * SIZE + first + LANES;
            write_bytes(f32x8::splat(255.0) - shares, &mut outside[place.clone()]);
            write_bytes(shares * unseen_shares, &mut unseen[place]);
        }
    }
}

/// Writes values from 0 to 255, rounded.
#[inline]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "they fit a byte")]
fn write_bytes(values: f32x8, bytes: &mut [u8]) {
    let whole = (values + f32x8::HALF).fast_trunc_int().to_array();
    for (byte, value) in bytes.iter_mut().zip(whole) {
        *byte = value as u8;
    }
}

/// One axis of the pasture, in cells.
struct Strip {
    half: f32x8,
    per_size: f32x8,
    end: f32x8,
    last: f32x8,
}

impl Strip {
    /// `cells` cells, for points of `size` cells.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "they are few")]
    #[expect(clippy::cast_precision_loss, reason = "beyond 2^24 cells a map is as coarse as that")]
    fn new(size: f32, cells: usize) -> Self {
        // Rounding may lead beyond the last cell, never the other way round.
        let last = (cells - 1) as f32;
        let last = if last as usize >= cells { last.next_down() } else { last };
        Self {
            half: f32x8::splat(0.5 * size),
            per_size: f32x8::splat(1.0 / size),
            end: f32x8::splat(cells as f32),
            last: f32x8::splat(last),
        }
    }

    /// Which share of the points lies in the strip.
    #[inline]
    fn share(&self, at: f32x8) -> f32x8 {
        let high = (at + self.half).fast_min(self.end);
        let low = (at - self.half).fast_max(f32x8::ZERO);
        ((high - low) * self.per_size).fast_max(f32x8::ZERO).fast_min(f32x8::ONE)
    }

    /// In which cells their middles lie, or which are nearest.
    #[inline]
    fn cell(&self, at: f32x8) -> i32x8 {
        at.fast_max(f32x8::ZERO).fast_min(self.last).fast_trunc_int()
    }
}

/// A square of cells whose unseen ground is averaged.
#[derive(Clone, Copy)]
struct Block {
    /// Cells a side: 1, 2, 4 or 8.
    side: usize,
    /// Its bits at the lower left of a tile.
    bits: u64,
}

impl Block {
    /// The block whose side is nearest to `cells`, by their ratio.
    fn nearest_to(cells: f64) -> Self {
        let side = match cells {
            c if c < std::f64::consts::SQRT_2 => 1,
            c if c < 2.0 * std::f64::consts::SQRT_2 => 2,
            c if c < 4.0 * std::f64::consts::SQRT_2 => 4,
            _ => TILE,
        };
        let columns = 0xff >> (TILE - side);
        let bits = (0..side).fold(0, |bits, row| bits | columns << (TILE * row));
        Self { side, bits }
    }

    /// Which shares of the blocks that hold some cells are unseen, 0 to 1.
    #[inline]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        clippy::cast_sign_loss,
        reason = "columns and rows are few"
    )]
    fn unseen_shares(self, ground: &SeenGround, column: i32x8, row: i32x8) -> f32x8 {
        let (grid, words) = (ground.grid(), ground.unseen().words());
        let splat = |value: usize| i32x8::splat(value as i32);
        let whole = splat(!(self.side - 1));
        let (column, row) = (column & whole, row & whole);
        let tile: i32x8 = (row >> 3) * splat(grid.tiles().0) + (column >> 3);
        let bit: i32x8 = ((row & splat(TILE - 1)) << 3) | (column & splat(TILE - 1));
        let (tile, bit) = (tile.to_array(), bit.to_array());
        let bits: [u64; LANES] =
            std::array::from_fn(|lane| words[tile[lane] as usize] >> (bit[lane] & 63) & self.bits);
        if self.side == 1 {
            return f32x8::from_i32x8(i32x8::new(bits.map(|bit| bit as i32)));
        }
        // A block on the border has fewer cells.
        let side = splat(self.side);
        let cells = side.min(splat(grid.columns()) - column) * side.min(splat(grid.rows()) - row);
        let unseen = i32x8::new(bits.map(|bits| bits.count_ones() as i32));
        f32x8::from_i32x8(unseen) / f32x8::from_i32x8(cells)
    }
}

/// The index of the point of a picture that a place of the world falls on.
fn point_of(frame: &Frame, point_m: f64, place: Point) -> Option<usize> {
    let (ahead_m, left_m) = frame.offsets_to(place);
    let half = 0.5 * SIZE as f64;
    let (down, right) = (half - ahead_m / point_m, half - left_m / point_m);
    let inside = 0.0..SIZE as f64;
    (inside.contains(&down) && inside.contains(&right))
        .then(|| floor_index(down) * SIZE + floor_index(right))
}
