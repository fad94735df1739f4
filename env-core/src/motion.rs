//! The motion of one command, cut where the sensor looks.

use std::cell::OnceCell;

use crate::action::Command;
use crate::geometry::{BarSweep, FRAMES, Frame, Frames, Pose, Sight, Triangle};
use crate::math::{larger, smaller, wrap_to_pi};
use crate::site::Site;

/// Way between two looks of the sensor, metres, counted from reset.
pub const LOOK_SPACING_M: f64 = 0.2;
/// A look this close after the end of a motion belongs to it: rounding must not push it into the next one.
pub(crate) const LOOK_SLACK_M: f64 = 1e-9;
/// Largest turn of one piece, radians: swept ground is tested in pieces of less than half a circle.
pub(crate) const MAX_TURN_RAD: f64 = 1.0;
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
    /// How many of them there are, and how many end at a look: the first ones.
    count: usize,
    looks: usize,
    /// Where the stretches end, worked out when something is near that may be met.
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
        let (start_m, taken) = (self.driven_m, self.looks as f64);
        let next_look_m = taken * LOOK_SPACING_M - self.start_path_m;
        if start_m >= distance_m && next_look_m > distance_m + LOOK_SLACK_M {
            return None;
        }
        let looks_m: [f64; FRAMES] =
            std::array::from_fn(|i| (taken + i as f64) * LOOK_SPACING_M - self.start_path_m);
        let mut ends_m = looks_m.map(|look_m| larger(smaller(look_m, distance_m), start_m));
        let until = |end_m: f64| {
            looks_m.iter().take_while(|&&look_m| look_m <= end_m + LOOK_SLACK_M).count()
        };
        let mut looks = until(distance_m);
        // Behind the last look the way may go on.
        let looked_m = if looks == 0 { start_m } else { ends_m[looks - 1] };
        let mut count = looks + usize::from(looks < FRAMES && looked_m < distance_m);
        let turn_per_m = curvature_per_m.abs();
        let is_gentle = |end_m: &f64| (end_m - start_m) * turn_per_m <= MAX_TURN_RAD;
        if !is_gentle(&ends_m[count - 1]) {
            count = ends_m.iter().take_while(|end_m| is_gentle(end_m)).count();
            if count == 0 {
                (count, ends_m[0]) = (1, start_m + MAX_TURN_RAD / turn_per_m);
            }
            let end_m = ends_m[count - 1];
            ends_m[count..].fill(end_m);
            looks = until(end_m).min(count);
        }
        self.looks += looks as u64;
        self.driven_m = ends_m[FRAMES - 1];
        let start = self.at;
        let end = start.advanced(curvature_per_m, self.driven_m - start_m);
        // Turns beyond half a circle are taken off, so that the heading loses no digits on a long way.
        let heading_rad = wrap_to_pi(end.pose.heading_rad);
        self.at = Frame { pose: Pose { heading_rad, ..end.pose }, ..end };
        let (start_path_m, stops) = (self.start_path_m, OnceCell::new());
        Some(Piece {
            start,
            end,
            curvature_per_m,
            start_path_m,
            start_m,
            ends_m,
            count,
            looks,
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

    /// Whether the mower may stand wherever it leads. Near the border it is false even where the mower may: the looks decide.
    pub(crate) fn is_within(&self, site: &Site) -> bool {
        let length_m = self.length_m();
        let sagitta_m = self.curvature_per_m.abs() * length_m * length_m / 8.0;
        site.allows_between(self.start.pose, self.end.pose, sagitta_m)
    }

    /// How many of its stretches end at a look: the first ones.
    pub(crate) fn looks(&self) -> usize {
        self.looks
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
                ends_at_look: place < self.looks,
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
