//! Shortest paths from one pose to many.

use std::f64::consts::{PI, TAU};

use super::dubins::{DubinsPath, ONE_ARC, TOUCHING, Word, turn};
use super::{Frame, Pose};
use crate::math::{acos, atan2};

/// Where shortest paths to many goals begin.
///
/// It finds what [`shortest`](super::shortest) finds, and passes over words that cannot stay below a limit: a word's straight and
/// the turn between the two headings bound its length from below, without a single angle.
#[derive(Debug, Clone, Copy)]
pub struct Departure {
    start: Frame,
    radius_m: f64,
    /// Centres of the circles to the left and to the right.
    left: (f64, f64),
    right: (f64, f64),
}

impl Departure {
    /// Paths from `start` that turn with at least `radius_m`, which is finite and positive.
    #[must_use]
    pub fn new(start: Pose, radius_m: f64) -> Self {
        let start = Frame::from(start);
        let (left, right) = circles(&start, radius_m);
        Self { start, radius_m, left, right }
    }

    /// Where the paths begin.
    #[must_use]
    pub fn start(&self) -> &Frame {
        &self.start
    }

    /// The shortest path to `goal`, if it is shorter than `limit_m`.
    #[must_use]
    pub fn shortest_below(&self, goal: &Frame, limit_m: f64) -> Option<DubinsPath> {
        let (start_rad, goal_rad) = (self.start.pose.heading_rad, goal.pose.heading_rad);
        let (left, right) = circles(goal, self.radius_m);
        let to_left = turn(goal_rad - start_rad);
        let to_right = turn(start_rad - goal_rad);
        let mut best = Best { limit: limit_m / self.radius_m, found: None };

        let (x, y) = self.between(self.left, left);
        if let Some(p) = best.straight(x * x + y * y, to_left) {
            let pieces = if p < ONE_ARC {
                [to_left, 0.0, 0.0]
            } else {
                let along = atan2(y, x);
                [turn(along - start_rad), p, turn(goal_rad - along)]
            };
            best.offer(Word::Lsl, pieces);
        }
        let (rx, ry) = self.between(self.right, right);
        if let Some(p) = best.straight(rx * rx + ry * ry, to_right) {
            let pieces = if p < ONE_ARC {
                [to_right, 0.0, 0.0]
            } else {
                let along = atan2(ry, rx);
                [turn(start_rad - along), p, turn(along - goal_rad)]
            };
            best.offer(Word::Rsr, pieces);
        }
        let least = to_left.min(to_right);
        let (u, v) = self.between(self.left, right);
        if let Some(p) = best.straight(u * u + v * v - 4.0, least) {
            // The inner tangent: the line between the centres, turned by the angle whose tangent is 2 / p.
            let along = atan2(v * p + 2.0 * u, u * p - 2.0 * v);
            best.offer(Word::Lsr, [turn(along - start_rad), p, turn(along - goal_rad)]);
        }
        let (u, v) = self.between(self.right, left);
        if let Some(p) = best.straight(u * u + v * v - 4.0, least) {
            let along = atan2(v * p - 2.0 * u, u * p + 2.0 * v);
            best.offer(Word::Rsl, [turn(start_rad - along), p, turn(goal_rad - along)]);
        }
        // The middle arc of the other two words is more than half a circle.
        if best.limit > PI {
            if let Some(p) = middle(rx * rx + ry * ry)
                && p + turn(p - to_left) < best.limit
            {
                let t = turn(start_rad - atan2(ry, rx) + 0.5 * p);
                best.offer(Word::Rlr, [t, p, turn(start_rad - goal_rad - t + p)]);
            }
            if let Some(p) = middle(x * x + y * y)
                && p + turn(p + to_left) < best.limit
            {
                let t = turn(atan2(y, x) - start_rad + 0.5 * p);
                best.offer(Word::Lrl, [t, p, turn(goal_rad - start_rad - t + p)]);
            }
        }
        let (word, pieces) = best.found?;
        let lengths_m = pieces.map(|piece| piece * self.radius_m);
        Some(DubinsPath { start: self.start.pose, word, radius_m: self.radius_m, lengths_m })
    }

    /// The vector from one centre to another, in radii.
    fn between(&self, from: (f64, f64), to: (f64, f64)) -> (f64, f64) {
        ((to.0 - from.0) / self.radius_m, (to.1 - from.1) / self.radius_m)
    }
}

/// The shortest word so far, in radii.
struct Best {
    limit: f64,
    found: Option<(Word, [f64; 3])>,
}

impl Best {
    /// The straight from its square, if with arcs of at least `turned` it can stay below the limit.
    fn straight(&self, squared: f64, turned: f64) -> Option<f64> {
        let room = self.limit - turned;
        (squared > -TOUCHING && room > 0.0 && squared < room * room)
            .then(|| squared.max(0.0).sqrt())
    }

    fn offer(&mut self, word: Word, pieces: [f64; 3]) {
        let length = pieces.iter().sum();
        if length < self.limit {
            self.limit = length;
            self.found = Some((word, pieces));
        }
    }
}

/// The middle arc of RLR and LRL from the squared distance between the outer centres, in radii.
fn middle(squared: f64) -> Option<f64> {
    let cosine = 1.0 - squared / 8.0;
    (cosine.abs() <= 1.0 + TOUCHING).then(|| turn(TAU - acos(cosine)))
}

/// Centres of the circles to the left and to the right of a pose.
fn circles(at: &Frame, radius_m: f64) -> ((f64, f64), (f64, f64)) {
    let Pose { x_m, y_m, .. } = at.pose;
    let (across_x, across_y) = (-radius_m * at.sin, radius_m * at.cos);
    ((x_m + across_x, y_m + across_y), (x_m - across_x, y_m - across_y))
}
