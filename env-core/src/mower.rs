//! The mower: a Dubins car that follows exact arcs.

use crate::action::Command;
use crate::geometry::{BarSweep, Frame, Pose, Sight, Triangle};
use crate::math::{larger, smaller, wrap_to_pi};

/// Way between two looks of the sensor, metres, counted from reset.
pub const LOOK_SPACING_M: f64 = 0.2;
/// A look this close after the end of a motion belongs to it: rounding must not push it into the next one.
const LOOK_SLACK_M: f64 = 1e-9;
/// Largest turn of one piece, radians: swept ground is tested in pieces of less than half a circle.
const MAX_TURN_RAD: f64 = 1.0;
/// Most stretches of one piece.
const MAX_STRETCHES: usize = 5;
/// A piece is not longer than this, metres.
pub(crate) const MAX_PIECE_M: f64 = MAX_STRETCHES as f64 * (LOOK_SPACING_M + LOOK_SLACK_M);

/// Where the mower is and how far it has come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mower {
    at: Frame,
    path_m: f64,
    looks: u64,
}

/// A piece of a motion without a look inside it.
#[derive(Debug, Clone, Copy)]
pub struct Stretch {
    /// Where it begins.
    pub start: Frame,
    /// Where it ends.
    pub end: Frame,
    /// Signed curvature, 1/m, left positive.
    pub curvature_per_m: f64,
    /// Length, metres.
    pub length_m: f64,
    /// Whether the sensor looks there.
    pub ends_at_look: bool,
}

impl Mower {
    /// A mower that has just been put down at `pose`; its look at path 0 is taken.
    #[must_use]
    pub fn at(pose: Pose) -> Self {
        Self::restore(pose, 0.0, 1)
    }

    /// Whether a mower that has come `path_m` has taken `looks` looks, one more or less for rounding.
    pub(crate) fn looks_fit(path_m: f64, looks: u64) -> bool {
        path_m >= 0.0 && (path_m / LOOK_SPACING_M + 1.0 - looks as f64).abs() <= 1.0 + LOOK_SLACK_M
    }

    pub(crate) fn restore(pose: Pose, path_m: f64, looks: u64) -> Self {
        Self { at: pose.into(), path_m, looks }
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
        Motion {
            command,
            start: self.at,
            start_path_m: self.path_m,
            driven_m: 0.0,
            looks: self.looks,
            piece: Piece {
                curvature_per_m: command.curvature_per_m,
                frames: [self.at; MAX_STRETCHES + 1],
                lengths_m: [0.0; MAX_STRETCHES],
                is_look: [false; MAX_STRETCHES],
                count: 0,
            },
        }
    }

    /// Moves along one stretch.
    pub fn follow(&mut self, stretch: &Stretch) {
        self.at = stretch.end;
        self.path_m += stretch.length_m;
        self.looks += u64::from(stretch.ends_at_look);
    }

    /// Comes to rest: turns beyond half a circle are taken off, and the direction is found from the heading, so that
    /// rounding does not add up over commands.
    pub(crate) fn rest(&mut self) {
        let heading_rad = wrap_to_pi(self.at.pose.heading_rad);
        self.at = Pose { heading_rad, ..self.at.pose }.into();
    }
}

/// A command being carried out, piece by piece.
#[derive(Debug, Clone)]
pub struct Motion {
    command: Command,
    start: Frame,
    start_path_m: f64,
    driven_m: f64,
    looks: u64,
    piece: Piece,
}

impl Motion {
    /// The next piece; `None` at the end.
    ///
    /// Not an iterator: a piece is large, and is lent, not copied.
    #[inline]
    pub fn next_piece(&mut self) -> Option<&Piece> {
        let Command { curvature_per_m, distance_m } = self.command;
        let turn_per_m = curvature_per_m.abs();
        let piece = &mut self.piece;
        let (piece_start_m, mut driven_m, mut looks) = (self.driven_m, self.driven_m, self.looks);
        piece.frames[0] = piece.frames[piece.count];
        let mut count = 0;
        while count < MAX_STRETCHES {
            let look_m = looks as f64 * LOOK_SPACING_M - self.start_path_m;
            if driven_m >= distance_m && look_m > distance_m + LOOK_SLACK_M {
                break;
            }
            let mut to_m = larger(smaller(look_m, distance_m), driven_m);
            if (to_m - piece_start_m) * turn_per_m > MAX_TURN_RAD {
                if count > 0 {
                    break;
                }
                to_m = driven_m + MAX_TURN_RAD / turn_per_m;
            }
            let is_look = look_m <= to_m + LOOK_SLACK_M;
            piece.lengths_m[count] = to_m - driven_m;
            piece.is_look[count] = is_look;
            count += 1;
            // Every point is found from the start of the command, so that errors do not add up along it.
            piece.frames[count] = self.start.advanced(curvature_per_m, to_m);
            driven_m = to_m;
            looks += u64::from(is_look);
        }
        piece.count = count;
        (self.driven_m, self.looks) = (driven_m, looks);
        (count > 0).then_some(&self.piece)
    }
}

/// A few stretches that follow each other, which turn by a radian at most.
#[derive(Debug, Clone)]
pub struct Piece {
    curvature_per_m: f64,
    /// Where the stretches begin and end.
    frames: [Frame; MAX_STRETCHES + 1],
    lengths_m: [f64; MAX_STRETCHES],
    is_look: [bool; MAX_STRETCHES],
    count: usize,
}

impl Piece {
    /// The stretches, in order.
    #[inline]
    pub fn stretches(&self) -> impl Iterator<Item = Stretch> {
        (0..self.count).map(|i| Stretch {
            start: self.frames[i],
            end: self.frames[i + 1],
            curvature_per_m: self.curvature_per_m,
            length_m: self.lengths_m[i],
            ends_at_look: self.is_look[i],
        })
    }

    /// The ground that a bar of `width_m` passes over on all of them, a hair wider than that on each.
    #[must_use]
    #[inline]
    pub fn sweep(&self, width_m: f64) -> BarSweep {
        let length_m = self.lengths_m[..self.count].iter().sum();
        let (start, end) = (self.frames[0], self.frames[self.count]);
        BarSweep::around(start, end, self.curvature_per_m, length_m, width_m)
    }

    /// What a sensor sees from its looks, and perhaps a little more; `None` without a look.
    #[must_use]
    #[inline]
    pub fn sight(&self, triangle: Triangle) -> Option<Sight<'_>> {
        let last = self.is_look[..self.count].iter().rposition(|&is_look| is_look)?;
        Some(Sight::new(triangle, &self.frames[1..=last + 1]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sensor_looks_at_every_fifth_of_a_metre_however_the_way_is_cut() {
        for steps in [1, 3, 7, 50] {
            let mut mower = Mower::at(Pose::new(0.0, 0.0, 0.0));
            let mut looked_at_m = Vec::new();
            for _ in 0..steps {
                let command = Command { curvature_per_m: 0.1, distance_m: 10.0 / f64::from(steps) };
                let mut motion = mower.motion(command);
                while let Some(piece) = motion.next_piece() {
                    for stretch in piece.stretches() {
                        mower.follow(&stretch);
                        if stretch.ends_at_look {
                            looked_at_m.push(mower.path_m());
                        }
                    }
                }
            }
            assert_eq!(looked_at_m.len(), 50, "{steps} steps");
            for (i, path_m) in looked_at_m.iter().enumerate() {
                assert!((path_m - 0.2 * (i as f64 + 1.0)).abs() < 1e-8, "look {i} at {path_m}");
            }
        }
    }
}
