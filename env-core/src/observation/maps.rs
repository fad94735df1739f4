//! The observation `maps`: pictures of the surroundings.

use crate::config::ValidScenario;
use crate::geometry::{Frame, Point};
use crate::math::floor_index;
use crate::view::View;

use super::{Bound, Dtype, Part};

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
/// Most samples of a point along each side.
const MAX_SAMPLES: usize = 4;

/// Writes the `maps` observation: 12 pictures of 32 x 32 points, scale by scale: unseen ground, known weeds, outside.
///
/// The mower is in the middle and looks up: row i and column j of the scale s are the square (15.5 - i) r ahead and
/// (15.5 - j) r to the left with r = B/8 x 3^s, its side. Values are shares of 255: of the square's area that is unseen
/// ground, and that lies outside the pasture; 255 for a square with a known weed.
/// Deviation: the shares are those of sample points, about one a cell of the pasture and at most 4 x 4.
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
            write_ground(view, &frame, point_m, unseen, outside);
            weeds.fill(0);
            for weed in view.known_weeds.iter() {
                if let Some(index) = point_of(&frame, point_m, weed.position) {
                    weeds[index] = u8::MAX;
                }
            }
        }
    }
}

/// Writes the shares of unseen ground and of what lies outside.
fn write_ground(view: &View, frame: &Frame, point_m: f64, unseen: &mut [u8], outside: &mut [u8]) {
    let (ground, grid) = (view.ground, view.ground.grid());
    let (length_m, width_m) = grid.size_m();
    let samples = floor_index(point_m.round()).clamp(1, MAX_SAMPLES);
    let whole = samples * samples;
    let offset_m = |i: usize, k: usize| {
        (0.5 * SIZE as f64 - i as f64 - (k as f64 + 0.5) / samples as f64) * point_m
    };
    for i in 0..SIZE {
        for j in 0..SIZE {
            let (mut unseen_here, mut outside_here) = (0, 0);
            for k in 0..whole {
                let (ahead_m, left_m) = (offset_m(i, k / samples), offset_m(j, k % samples));
                let x = frame.pose.x_m + frame.cos * ahead_m - frame.sin * left_m;
                let y = frame.pose.y_m + frame.sin * ahead_m + frame.cos * left_m;
                if (0.0..=length_m).contains(&x) && (0.0..=width_m).contains(&y) {
                    let (column, row) = grid.cell_of(Point::new(x, y));
                    unseen_here += usize::from(!ground.is_seen(column, row));
                } else {
                    outside_here += 1;
                }
            }
            unseen[i * SIZE + j] = share(unseen_here, whole);
            outside[i * SIZE + j] = share(outside_here, whole);
        }
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

/// A share of 255, rounded.
fn share(part: usize, whole: usize) -> u8 {
    u8::try_from((part * 255 + whole / 2) / whole).expect("a part is at most the whole")
}
