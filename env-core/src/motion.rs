//! The motion of one command, cut where the sensor looks.

use std::cell::OnceCell;

use crate::action::Command;
use crate::geometry::{BarSweep, FRAMES, Frame, Frames, Sight, Triangle};
use crate::math::{larger, smaller};
use crate::site::Site;

/// Way between two looks of the sensor, metres, counted from reset.
pub const LOOK_SPACING_M: f64 = 0.2;
/// A look this close after the end of a motion belongs to it: rounding must not push it into the next one.
pub(crate) const LOOK_SLACK_M: f64 = 1e-9;
/// Largest turn of one piece, radians: swept ground is tested in pieces of less than half a circle.
const MAX_TURN_RAD: f64 = 1.0;
/// A piece is not longer than this, metres.
pub(crate) const MAX_PIECE_M: f64 = FRAMES as f64 * (LOOK_SPACING_M + LOOK_SLACK_M);

/// A command being carried out, piece by piece.
#[derive(Debug, Clone)]
pub struct Motion {
    command: Command,
    /// Where the next piece begins.
    at: Frame,
    start_path_m: f64,
    driven_m: f64,
    looks: u64,
}

/// A part of a motion without a look inside it.
#[derive(Debug, Clone, Copy)]
pub struct Stretch {
    /// Its number in its piece.
    pub index: u32,
    /// Where it begins.
    pub start: Frame,
    /// Where it ends.
    pub end: Frame,
    /// Signed curvature, 1/m, left positive.
    pub curvature_per_m: f64,
    /// Length, metres.
    pub length_m: f64,
    /// Way driven at its end since the command began, metres.
    pub driven_m: f64,
    /// Way driven at its end since reset, metres.
    pub path_m: f64,
    /// Whether the sensor looks where it ends.
    pub ends_at_look: bool,
}

/// A few stretches that follow each other, which turn by a radian at most.
#[derive(Debug, Clone)]
pub struct Piece {
    start: Frame,
    end: Frame,
    curvature_per_m: f64,
    /// Way driven before the command, and in it before the piece, metres.
    start_path_m: f64,
    start_m: f64,
    /// Ways driven in the command where the stretches end; those that are left over end with the last one.
    ends_m: [f64; FRAMES],
    is_look: [bool; FRAMES],
    count: usize,
    /// Where the stretches end: most pieces bring nothing new, and nobody asks.
    stops: OnceCell<Frames>,
}

impl Motion {
    /// A motion that begins at `start`, where the mower has come `path_m` and taken so many looks.
    pub(crate) fn new(command: Command, start: Frame, path_m: f64, looks: u64) -> Self {
        Self { command, at: start, start_path_m: path_m, driven_m: 0.0, looks }
    }

    /// The next piece; `None` at the end.
    #[inline]
    pub fn next_piece(&mut self) -> Option<Piece> {
        let Command { curvature_per_m, distance_m } = self.command;
        let turn_per_m = curvature_per_m.abs();
        let (start_m, mut driven_m) = (self.driven_m, self.driven_m);
        let (mut ends_m, mut is_look) = ([0.0; FRAMES], [false; FRAMES]);
        let mut count = 0;
        while count < FRAMES {
            let look_m = self.looks as f64 * LOOK_SPACING_M - self.start_path_m;
            if driven_m >= distance_m && look_m > distance_m + LOOK_SLACK_M {
                break;
            }
            let mut to_m = larger(smaller(look_m, distance_m), driven_m);
            if (to_m - start_m) * turn_per_m > MAX_TURN_RAD {
                if count > 0 {
                    break;
                }
                to_m = driven_m + MAX_TURN_RAD / turn_per_m;
            }
            driven_m = to_m;
            ends_m[count] = to_m;
            is_look[count] = look_m <= to_m + LOOK_SLACK_M;
            self.looks += u64::from(is_look[count]);
            count += 1;
        }
        if count == 0 {
            return None;
        }
        ends_m[count..].fill(driven_m);
        let start = self.at;
        let end = start.advanced(curvature_per_m, driven_m - start_m);
        (self.driven_m, self.at) = (driven_m, end);
        let (start_path_m, stops) = (self.start_path_m, OnceCell::new());
        Some(Piece {
            start,
            end,
            curvature_per_m,
            start_path_m,
            start_m,
            ends_m,
            is_look,
            count,
            stops,
        })
    }
}

impl Piece {
    /// Length, metres.
    fn length_m(&self) -> f64 {
        self.ends_m[FRAMES - 1] - self.start_m
    }

    /// Where it ends.
    pub(crate) fn end(&self) -> &Frame {
        &self.end
    }

    /// Way driven at its end, metres: since the command began, and since reset.
    pub(crate) fn driven_m(&self) -> f64 {
        self.ends_m[FRAMES - 1]
    }

    pub(crate) fn path_m(&self) -> f64 {
        self.start_path_m + self.driven_m()
    }

    /// Whether the mower may stand wherever it leads; near the border perhaps not, though it may.
    pub(crate) fn is_within(&self, site: &Site) -> bool {
        let length_m = self.length_m();
        let sagitta_m = self.curvature_per_m.abs() * length_m * length_m / 8.0;
        site.allows_between(self.start.pose, self.end.pose, sagitta_m)
    }

    /// Which stretches end at a look, lowest bit first.
    #[must_use]
    #[inline]
    pub(crate) fn looks_at(&self) -> u32 {
        self.is_look.iter().rev().fold(0, |bits, &is_look| bits << 1 | u32::from(is_look))
    }

    /// Where the stretches end; those that are left over end with the last one.
    #[must_use]
    #[inline]
    pub fn stops(&self) -> &Frames {
        let ways_m = || self.ends_m.map(|end_m| end_m - self.start_m);
        self.stops.get_or_init(|| Frames::along(&self.start, self.curvature_per_m, ways_m()))
    }

    /// The stretches, in order.
    #[inline]
    pub fn stretches(&self) -> impl Iterator<Item = Stretch> {
        let (mut start, mut start_m) = (self.start, self.start_m);
        (0..self.count).zip(0..).map(move |(place, index)| {
            let (end, driven_m) = (self.stops().at(place), self.ends_m[place]);
            let stretch = Stretch {
                index,
                start,
                end,
                curvature_per_m: self.curvature_per_m,
                length_m: driven_m - start_m,
                driven_m,
                path_m: self.start_path_m + driven_m,
                ends_at_look: self.is_look[place],
            };
            (start, start_m) = (end, driven_m);
            stretch
        })
    }

    /// The ground that a bar of `width_m` passes over on all of them, a hair wider than that on each.
    #[must_use]
    #[inline]
    pub fn sweep(&self, width_m: f64) -> BarSweep {
        let Self { start, end, curvature_per_m, .. } = *self;
        BarSweep::around(start, end, curvature_per_m, self.length_m(), width_m)
    }

    /// What a sensor may see on the way.
    #[must_use]
    #[inline]
    pub fn sight(&self, triangle: &Triangle) -> Sight {
        Sight::along(triangle, &self.start, &self.end, self.curvature_per_m, self.length_m())
    }
}
