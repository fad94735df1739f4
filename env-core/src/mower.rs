//! The mower: a Dubins car that follows exact arcs.

use std::f64::consts::PI;

use crate::action::Command;
use crate::geometry::{Frame, Pose};
use crate::math::{self, wrap_to_pi};
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
    ///
    /// Whole turns are taken off the heading, so that it stays what the direction is, however many there were.
    #[must_use]
    pub fn at(pose: Pose) -> Self {
        let Frame { cos, sin, .. } = pose.into();
        let heading_rad = pose.heading_rad;
        let is_within_a_turn = (-PI..PI).contains(&heading_rad);
        let heading_rad =
            if is_within_a_turn { heading_rad } else { wrap_to_pi(math::atan2(sin, cos)) };
        Self::restore(Frame { pose: Pose { heading_rad, ..pose }, cos, sin }, 0.0, 1)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::MAX_TURN_RAD;
    use crate::rng::{Stream, stream, uniform};

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

    /// A mower's state, bit for bit.
    fn bits(mower: &Mower) -> [u64; 7] {
        let Frame { pose, cos, sin } = mower.frame();
        let numbers = [pose.x_m, pose.y_m, pose.heading_rad, cos, sin, mower.path_m()];
        let [x, y, heading, cos, sin, path] = numbers.map(f64::to_bits);
        [x, y, heading, cos, sin, path, mower.looks()]
    }

    #[test]
    fn a_piece_driven_at_once_leads_where_its_stretches_lead_and_turns_by_a_radian_at_most() {
        let mut rng = stream(5, Stream::Weeds);
        for radius_m in [0.01, 0.15, 0.2, 0.5, 2.0, 5.0, f64::INFINITY] {
            for _ in 0..50 {
                let mut at_once = Mower::at(Pose::new(3.0, -1.0, 6.0 * uniform(&mut rng)));
                let mut by_stretches = at_once;
                let mut way_m = 0.0;
                for _ in 0..3 {
                    let (curvature_per_m, distance_m) = (1.0 / radius_m, 2.0 * uniform(&mut rng));
                    let mut motion = at_once.motion(Command { curvature_per_m, distance_m });
                    let (from_m, mut pieces) = (way_m, 0);
                    while let Some(piece) = motion.next_piece() {
                        pieces += 1;
                        at_once.follow_all(&piece);
                        let begin_m = way_m;
                        for stretch in piece.stretches() {
                            by_stretches.follow(&stretch);
                            way_m += stretch.length_m;
                            let looks_m = by_stretches.looks() as f64 * LOOK_SPACING_M;
                            assert!(looks_m + 1e-8 > way_m, "no look is left out");
                        }
                        assert!((way_m - begin_m) * curvature_per_m <= MAX_TURN_RAD + 1e-9);
                        let [x, y, _, cos, sin, path, looks] = bits(&at_once);
                        let [x2, y2, _, cos2, sin2, path2, looks2] = bits(&by_stretches);
                        assert_eq!(
                            [x, y, cos, sin, path, looks],
                            [x2, y2, cos2, sin2, path2, looks2]
                        );
                    }
                    assert!((way_m - from_m - distance_m).abs() < 1e-9, "{pieces} pieces");
                    at_once.rest();
                    by_stretches.rest();
                    assert_eq!(bits(&at_once), bits(&by_stretches));
                }
            }
        }
    }
}
