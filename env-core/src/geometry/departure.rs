//! Shortest paths from one pose to many.

use std::f64::consts::{PI, TAU};

use super::dubins::{DubinsPath, ONE_ARC, PHANTOM_CIRCLE_RAD, TOUCHING, Word};
use super::{Frame, Pose};
use crate::math::{acos, atan2, wrap_to_pi};

/// A vector of the plane.
type Vector = (f64, f64);

/// How far an angle may be misjudged without trigonometry, as a sine.
const MISJUDGED: f64 = 1e-6;

/// Where shortest paths to many goals begin.
///
/// It finds what [`shortest`](super::shortest) finds. Words that cannot stay below a limit are passed over before any angle
/// is worked out: their straight is known, and their arcs are at least as long as their chords.
#[derive(Debug, Clone, Copy)]
pub struct Departure {
    start: Frame,
    radius_m: f64,
    per_radius: f64,
    /// Centres of the circles to the left and to the right.
    left: Vector,
    right: Vector,
}

impl Departure {
    /// Paths from `start` that turn with at least `radius_m`, which is finite and positive.
    #[must_use]
    pub fn new(start: Pose, radius_m: f64) -> Self {
        let heading_rad = wrap_to_pi(start.heading_rad);
        let start = Frame::from(Pose { heading_rad, ..start });
        let (left, right) = circles(&start, radius_m);
        Self { start, radius_m, per_radius: 1.0 / radius_m, left, right }
    }

    /// Where the paths begin.
    #[must_use]
    pub fn start(&self) -> &Frame {
        &self.start
    }

    /// The shortest path to `goal`, whose heading lies within a circle of 0, if it is shorter than `limit_m`.
    #[must_use]
    pub fn shortest_below(&self, goal: &Frame, limit_m: f64) -> Option<DubinsPath> {
        let (left, right) = circles(goal, self.radius_m);
        let turned_rad = goal.pose.heading_rad - self.start.pose.heading_rad;
        let mut best = Best {
            start: (self.start.cos, self.start.sin),
            goal: (goal.cos, goal.sin),
            start_rad: self.start.pose.heading_rad,
            goal_rad: goal.pose.heading_rad,
            to_left: turn(turned_rad),
            to_right: turn(-turned_rad),
            limit: limit_m * self.per_radius,
            found: None,
        };
        let (left_left, right_right) =
            (self.between(self.left, left), self.between(self.right, right));
        best.try_lsl(left_left);
        best.try_rsr(right_right);
        best.try_lsr(self.between(self.left, right));
        best.try_rsl(self.between(self.right, left));
        best.try_rlr(right_right);
        best.try_lrl(left_left);
        let (word, pieces) = best.found?;
        let lengths_m = pieces.map(|piece| piece * self.radius_m);
        Some(DubinsPath { start: self.start.pose, word, radius_m: self.radius_m, lengths_m })
    }

    /// The vector from one centre to another, in radii.
    fn between(&self, from: Vector, to: Vector) -> Vector {
        ((to.0 - from.0) * self.per_radius, (to.1 - from.1) * self.per_radius)
    }
}

/// The shortest word so far, in radii. Each `try_` gets the vector between the centres of the word's outer circles.
struct Best {
    /// Direction of the start and of the goal, as vectors and as angles.
    start: Vector,
    goal: Vector,
    start_rad: f64,
    goal_rad: f64,
    /// Turn between the two, to the left and to the right.
    to_left: f64,
    to_right: f64,
    limit: f64,
    found: Option<(Word, [f64; 3])>,
}

impl Best {
    fn try_lsl(&mut self, along: Vector) {
        let Some(p) = self.straight(squared(along), self.to_left) else { return };
        if p < ONE_ARC {
            self.offer(Word::Lsl, [self.to_left, 0.0, 0.0]);
        } else if p + self.to_left + detour(self.start, along, self.goal, self.to_left, p)
            < self.limit
        {
            let along_rad = atan2(along.1, along.0);
            let pieces = [turn(along_rad - self.start_rad), p, turn(self.goal_rad - along_rad)];
            self.offer(Word::Lsl, pieces);
        }
    }

    fn try_rsr(&mut self, along: Vector) {
        let Some(p) = self.straight(squared(along), self.to_right) else { return };
        if p < ONE_ARC {
            self.offer(Word::Rsr, [self.to_right, 0.0, 0.0]);
        } else if p + self.to_right + detour(self.goal, along, self.start, self.to_right, p)
            < self.limit
        {
            let along_rad = atan2(along.1, along.0);
            let pieces = [turn(self.start_rad - along_rad), p, turn(along_rad - self.goal_rad)];
            self.offer(Word::Rsr, pieces);
        }
    }

    fn try_lsr(&mut self, between: Vector) {
        let Some(p) = self.straight(squared(between) - 4.0, self.to_left.min(self.to_right)) else {
            return;
        };
        // The inner tangent: the line between the centres, turned by the angle whose tangent is 2 / p.
        let along = (between.0 * p - 2.0 * between.1, between.1 * p + 2.0 * between.0);
        let length = p * p + 4.0;
        if p + least_turn(self.start, along, length) + least_turn(self.goal, along, length)
            < self.limit
        {
            let along_rad = atan2(along.1, along.0);
            let pieces = [turn(along_rad - self.start_rad), p, turn(along_rad - self.goal_rad)];
            self.offer(Word::Lsr, pieces);
        }
    }

    fn try_rsl(&mut self, between: Vector) {
        let Some(p) = self.straight(squared(between) - 4.0, self.to_left.min(self.to_right)) else {
            return;
        };
        let along = (between.0 * p + 2.0 * between.1, between.1 * p - 2.0 * between.0);
        let length = p * p + 4.0;
        if p + least_turn(along, self.start, length) + least_turn(along, self.goal, length)
            < self.limit
        {
            let along_rad = atan2(along.1, along.0);
            let pieces = [turn(self.start_rad - along_rad), p, turn(self.goal_rad - along_rad)];
            self.offer(Word::Rsl, pieces);
        }
    }

    fn try_rlr(&mut self, between: Vector) {
        let Some(p) = self.middle(between) else { return };
        if p + turn(p - self.to_left) < self.limit {
            let t = turn(self.start_rad - atan2(between.1, between.0) + 0.5 * p);
            self.offer(Word::Rlr, [t, p, turn(self.to_right - t + p)]);
        }
    }

    fn try_lrl(&mut self, between: Vector) {
        let Some(p) = self.middle(between) else { return };
        if p + turn(p - self.to_right) < self.limit {
            let t = turn(atan2(between.1, between.0) - self.start_rad + 0.5 * p);
            self.offer(Word::Lrl, [t, p, turn(self.to_left - t + p)]);
        }
    }

    /// The straight from its square, if with arcs of at least `turned` it can stay below the limit.
    fn straight(&self, squared: f64, turned: f64) -> Option<f64> {
        let room = self.limit - turned;
        (squared > -TOUCHING && room > 0.0 && squared < room * room)
            .then(|| squared.max(0.0).sqrt())
    }

    /// The middle arc of RLR and LRL, if the word exists and its middle arc alone stays below the limit.
    fn middle(&self, between: Vector) -> Option<f64> {
        // It is more than half a circle, and as asin(x) <= x pi / 2 at least (2 - d / 4) pi for centres d apart.
        let squared = squared(between);
        let room = 2.0 - self.limit / PI;
        if self.limit <= PI || (room > 0.0 && squared <= 16.0 * room * room) {
            return None;
        }
        let cosine = 1.0 - squared / 8.0;
        (cosine >= -1.0 - TOUCHING).then(|| turn(TAU - acos(cosine)))
    }

    fn offer(&mut self, word: Word, pieces: [f64; 3]) {
        let length = pieces.iter().sum();
        if length < self.limit {
            self.limit = length;
            self.found = Some((word, pieces));
        }
    }
}

fn squared((x, y): Vector) -> f64 {
    x * x + y * y
}

fn cross(a: Vector, b: Vector) -> f64 {
    a.0 * b.1 - a.1 * b.0
}

/// A full circle if turning left by `turned` from the unit vector `from` to the unit vector `to` does not pass the
/// direction of `along`, which is `length` long; 0 if it does, or nearly does.
fn detour(from: Vector, along: Vector, to: Vector, turned: f64, length: f64) -> f64 {
    let slack = MISJUDGED * length;
    let (behind, before) = (cross(from, along), cross(along, to));
    let is_passed = if turned <= PI {
        behind >= -slack && before >= -slack
    } else {
        behind >= -slack || before >= -slack
    };
    if is_passed { 0.0 } else { TAU }
}

/// At least so much has one to turn left from the direction of `from` to that of `to`: the chord is no longer than its arc.
/// `length` is the product of the lengths of the two.
fn least_turn(from: Vector, to: Vector, length: f64) -> f64 {
    let cosine = (from.0 * to.0 + from.1 * to.1) / length;
    let sine = cross(from, to) / length;
    if sine >= -MISJUDGED && cosine > 0.0 && sine < MISJUDGED {
        // Nothing or a full circle: too near to tell.
        0.0
    } else if sine >= 0.0 {
        (2.0 * (1.0 - cosine)).max(0.0).sqrt()
    } else {
        PI + (2.0 * (1.0 + cosine)).max(0.0).sqrt()
    }
}

/// An arc in [0, 2 pi), phantom full circles removed, from an angle that is off by a few circles at most.
fn turn(mut angle_rad: f64) -> f64 {
    while angle_rad < 0.0 {
        angle_rad += TAU;
    }
    while angle_rad >= TAU {
        angle_rad -= TAU;
    }
    if angle_rad > TAU - PHANTOM_CIRCLE_RAD { 0.0 } else { angle_rad }
}

/// Centres of the circles to the left and to the right of a pose.
fn circles(at: &Frame, radius_m: f64) -> (Vector, Vector) {
    let Pose { x_m, y_m, .. } = at.pose;
    let (across_x, across_y) = (-radius_m * at.sin, radius_m * at.cos);
    ((x_m + across_x, y_m + across_y), (x_m - across_x, y_m - across_y))
}
