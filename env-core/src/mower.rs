//! The mower: a Dubins car that follows exact arcs.

use crate::action::Command;
use crate::geometry::{Frame, Pose};
use crate::math::wrap_to_pi;
use crate::motion::{LOOK_SLACK_M, LOOK_SPACING_M, Motion, Piece, Stretch};

/// Where the mower is and how far it has come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mower {
    at: Frame,
    path_m: f64,
    looks: u64,
}

impl Mower {
    /// A mower that has just been put down at `pose`; its look at path 0 is taken.
    #[must_use]
    pub fn at(pose: Pose) -> Self {
        Self::restore(pose.into(), 0.0, 1)
    }

    /// Whether a mower that has come `path_m` has taken `looks` looks, one more or less for rounding.
    pub(crate) fn looks_fit(path_m: f64, looks: u64) -> bool {
        path_m >= 0.0 && (path_m / LOOK_SPACING_M + 1.0 - looks as f64).abs() <= 1.0 + LOOK_SLACK_M
    }

    pub(crate) fn restore(at: Frame, path_m: f64, looks: u64) -> Self {
        Self { at, path_m, looks }
    }

    /// Where the mower stands.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.at.pose
    }

    /// Where the mower stands, with its direction.
    #[must_use]
    pub fn frame(&self) -> Frame {
        self.at
    }

    /// Way driven since reset, metres.
    #[must_use]
    pub fn path_m(&self) -> f64 {
        self.path_m
    }

    /// Number of looks taken, the one at the start included.
    #[must_use]
    pub fn looks(&self) -> u64 {
        self.looks
    }

    /// Way to the next look, metres.
    #[must_use]
    pub fn to_next_look_m(&self) -> f64 {
        self.looks as f64 * LOOK_SPACING_M - self.path_m
    }

    /// A command in pieces, cut where the sensor looks: at path 0, 0.2, 0.4 ... m, wherever steps begin and end.
    #[must_use]
    pub fn motion(&self, command: Command) -> Motion {
        Motion::new(command, self.at, self.path_m, self.looks)
    }

    /// Moves along one stretch.
    pub fn follow(&mut self, stretch: &Stretch) {
        (self.at, self.path_m) = (stretch.end, stretch.path_m);
        self.looks += u64::from(stretch.ends_at_look);
    }

    /// Moves along a piece at once.
    pub fn follow_all(&mut self, piece: &Piece) {
        (self.at, self.path_m) = (*piece.end(), piece.path_m());
        self.looks += piece.looks() as u64;
    }

    /// Comes to rest: turns beyond half a circle are taken off, and the direction gets its length of 1 back, which rounding
    /// took from it.
    pub(crate) fn rest(&mut self) {
        let Frame { pose, cos, sin } = self.at;
        // One step of Newton's towards the root: what is missing is its square, far below the last bit.
        let scale = 1.5 - 0.5 * (cos * cos + sin * sin);
        let pose = Pose { heading_rad: wrap_to_pi(pose.heading_rad), ..pose };
        self.at = Frame { pose, cos: scale * cos, sin: scale * sin };
    }
}
