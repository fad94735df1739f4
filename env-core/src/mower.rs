//! The mower: a Dubins car that follows exact arcs.

use crate::action::Command;
use crate::geometry::{Frame, Pose};
use crate::math::wrap_to_pi;

/// Way between two looks of the sensor, metres, counted from reset.
pub const LOOK_SPACING_M: f64 = 0.2;
/// A look this close after the end of a motion belongs to it: rounding must not push it into the next one.
const LOOK_SLACK_M: f64 = 1e-9;
/// Largest turn of one stretch, radians: swept ground is tested in pieces of less than half a circle.
const MAX_TURN_RAD: f64 = 1.0;

/// Where the mower is and how far it has come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mower {
    pose: Pose,
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
        Self { pose, path_m: 0.0, looks: 1 }
    }

    /// Whether a mower that has come `path_m` has taken `looks` looks, one more or less for rounding.
    pub(crate) fn looks_fit(path_m: f64, looks: u64) -> bool {
        path_m >= 0.0 && (path_m / LOOK_SPACING_M + 1.0 - looks as f64).abs() <= 1.0 + LOOK_SLACK_M
    }

    pub(crate) fn restore(pose: Pose, path_m: f64, looks: u64) -> Self {
        Self { pose, path_m, looks }
    }

    /// Where the mower stands.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.pose
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

    /// The stretches of a command, cut where the sensor looks: at path 0, 0.2, 0.4 ... m, wherever steps begin and end.
    #[must_use]
    pub fn motion(&self, command: Command) -> Motion {
        let start = Frame::from(self.pose);
        let start_path_m = self.path_m;
        Motion { command, start, start_path_m, driven_m: 0.0, at: start, looks: self.looks }
    }

    /// Moves along one stretch.
    pub fn follow(&mut self, stretch: &Stretch) {
        self.pose = stretch.end.pose;
        self.pose.heading_rad = wrap_to_pi(self.pose.heading_rad);
        self.path_m += stretch.length_m;
        self.looks += u64::from(stretch.ends_at_look);
    }
}

/// A command being carried out: an iterator over its stretches.
#[derive(Debug, Clone)]
pub struct Motion {
    command: Command,
    start: Frame,
    start_path_m: f64,
    driven_m: f64,
    at: Frame,
    looks: u64,
}

impl Iterator for Motion {
    type Item = Stretch;

    fn next(&mut self) -> Option<Stretch> {
        let Command { curvature_per_m, distance_m } = self.command;
        let look_m = self.looks as f64 * LOOK_SPACING_M - self.start_path_m;
        if self.driven_m >= distance_m && look_m > distance_m + LOOK_SLACK_M {
            return None;
        }
        let mut to_m = look_m.min(distance_m).max(self.driven_m);
        if (to_m - self.driven_m) * curvature_per_m.abs() > MAX_TURN_RAD {
            to_m = self.driven_m + MAX_TURN_RAD / curvature_per_m.abs();
        }
        let ends_at_look = look_m <= to_m + LOOK_SLACK_M;
        // Every point is found from the start of the command, so that errors do not add up along it.
        let end = self.start.advanced(curvature_per_m, to_m);
        let length_m = to_m - self.driven_m;
        let stretch = Stretch { start: self.at, end, curvature_per_m, length_m, ends_at_look };
        self.driven_m = to_m;
        self.at = end;
        self.looks += u64::from(ends_at_look);
        Some(stretch)
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
                for stretch in mower.motion(command) {
                    mower.follow(&stretch);
                    if stretch.ends_at_look {
                        looked_at_m.push(mower.path_m());
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
