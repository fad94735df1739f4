//! The cheapest way to bring the mower to a place.

use std::f64::consts::TAU;

use super::way::{Fence, Way};
use crate::geometry::{Departure, Frame, Point, Pose};
use crate::math::{atan2, floor_index, sin_cos, wrap_to_tau};
use crate::motion::LOOK_SPACING_M;
use crate::site::Site;

/// Number of headings at which a place may be approached.
const HEADINGS: usize = 16;
/// How far from the middle of the bar a weed is taken, in half widths: the rest is kept for mowers that stray.
const BAR_SHARE: f64 = 0.9;
/// How far a weed's approach goes on behind it, metres, so that a decision always moves and the bar is past the weed.
const PAST_WEED_M: f64 = 1e-3;
/// Rounding in comparisons of lengths, metres.
const ROUNDING_M: f64 = 1e-9;
/// From how far unseen ground is looked at, in sensor ranges.
const VIEW_RANGES: [f64; 2] = [0.4, 0.8];

/// The headings, counter-clockwise from +x, with their cosines and sines.
#[derive(Debug, Clone)]
pub(super) struct Headings([Frame; HEADINGS]);

impl Headings {
    pub(super) fn new() -> Self {
        Self(std::array::from_fn(|i| {
            Frame::from(Pose::new(0.0, 0.0, TAU * i as f64 / HEADINGS as f64))
        }))
    }

    /// Every heading, the one nearest to `bearing_rad` first, then to its left and right by turns.
    fn nearest_first(&self, bearing_rad: f64) -> impl Iterator<Item = &Frame> {
        let nearest = floor_index(wrap_to_tau(bearing_rad) * HEADINGS as f64 / TAU + 0.5);
        (0..HEADINGS).map(move |i| {
            let aside = i.div_ceil(2);
            let index = if i % 2 == 1 { nearest + aside } else { nearest + HEADINGS - aside };
            &self.0[index % HEADINGS]
        })
    }
}

/// Ways from where the mower stands.
pub(super) struct Approach<'a> {
    headings: &'a Headings,
    departure: Departure,
    fence: Fence,
    weed_left_m: f64,
    view_back_m: [f64; 2],
    radius_m: f64,
}

impl<'a> Approach<'a> {
    pub(super) fn new(pose: Pose, site: &Site, headings: &'a Headings) -> Self {
        Self {
            headings,
            departure: Departure::new(pose, site.turning_radius_m),
            fence: Fence::new(site),
            weed_left_m: BAR_SHARE * 0.5 * site.deck_width_m,
            view_back_m: VIEW_RANGES.map(|share| share * site.sensor_range_m),
            radius_m: site.turning_radius_m,
        }
    }

    /// The cheapest way that ends with the bar over a weed: at any heading and offset along the bar on full lock or
    /// straight ahead, else at one of 16 headings with the weed at the middle of the bar or near one of its ends.
    pub(super) fn weed(&self, weed: Point) -> Option<Way> {
        let left_m = self.weed_left_m;
        let places = [(0.0, 0.0), (0.0, left_m), (0.0, -left_m)];
        let arc = self.single_arc(weed);
        let limit_m = arc.map_or(f64::INFINITY, |way| way.length_m());
        self.cheapest(weed, &places, PAST_WEED_M, limit_m).or(arc)
    }

    /// The cheapest way that ends with a look at a cell's centre straight ahead, if it is shorter than `limit_m`.
    pub(super) fn view(&self, cell: Point, limit_m: f64) -> Option<Way> {
        let places = self.view_back_m.map(|back_m| (back_m, 0.0));
        self.cheapest(cell, &places, LOOK_SPACING_M, limit_m)
    }

    /// The way to `goal` and straight on, if it stays within the fence and its Dubins path is shorter than `limit_m`.
    pub(super) fn pass(&self, goal: Pose, straight_m: f64, limit_m: f64) -> Option<(Way, f64)> {
        let goal = Frame::from(goal);
        let path = self.departure.shortest_below(&goal, limit_m)?;
        let way = Way::along(&path, goal, straight_m);
        self.fence.holds(&way).then(|| (way, path.length_m()))
    }

    /// The longest of three ways that stay within the fence: a full circle to the left, one to the right, straight ahead.
    /// Straight ahead where there is none.
    pub(super) fn pastime(&self) -> Way {
        let circle_m = TAU * self.radius_m;
        let way = |curvature_per_m: f64, length_m: f64| {
            Way::arc(self.departure.start(), curvature_per_m, length_m, 0.0)
        };
        let curvatures = [1.0 / self.radius_m, -1.0 / self.radius_m, 0.0];
        [1.0, 0.5, 0.25, 0.125]
            .iter()
            .flat_map(|share| curvatures.map(|curvature| way(curvature, share * circle_m)))
            .find(|way| self.fence.holds(way))
            .unwrap_or_else(|| way(0.0, circle_m))
    }

    /// The shortest way with `point` so far ahead and to the left of where its Dubins path ends, over all headings and
    /// `places`, if it is shorter than `limit_m`.
    fn cheapest(
        &self,
        point: Point,
        places: &[(f64, f64)],
        straight_m: f64,
        limit_m: f64,
    ) -> Option<Way> {
        let start = self.departure.start();
        let bearing_rad = start.pose.bearing_to(point);
        let bound = Bound::new(start, bearing_rad, self.radius_m);
        let distance_m = (point - start.pose.position()).norm();
        let reach_m =
            places.iter().map(|(ahead_m, left_m)| ahead_m.abs() + left_m.abs()).fold(0.0, f64::max);
        let (mut best, mut limit_m) = (None, limit_m - straight_m);
        for heading in self.headings.nearest_first(bearing_rad) {
            let end = bound.loss_m(heading);
            if bound.least_m(distance_m - reach_m, end) >= limit_m {
                continue;
            }
            for &(ahead_m, left_m) in places {
                let x_m = point.x - ahead_m * heading.cos + left_m * heading.sin;
                let y_m = point.y - ahead_m * heading.sin - left_m * heading.cos;
                let goal =
                    Frame { pose: Pose::new(x_m, y_m, heading.pose.heading_rad), ..*heading };
                if bound.least_m(bound.progress_m(&goal), end) >= limit_m {
                    continue;
                }
                let Some(path) = self.departure.shortest_below(&goal, limit_m) else { continue };
                let way = Way::along(&path, goal, straight_m);
                if self.fence.holds(&way) {
                    limit_m = path.length_m();
                    best = Some(way);
                }
            }
        }
        best
    }

    /// The shortest way straight ahead or on full lock that ends with a weed under the bar.
    fn single_arc(&self, weed: Point) -> Option<Way> {
        let (ahead_m, left_m) = self.departure.start().offsets_to(weed);
        let arc_length_m = |turn: f64| {
            // The weed seen from the turning centre, which lies one radius to the side.
            let (x, y) = (ahead_m, self.radius_m - turn * left_m);
            let off_m = (x * x + y * y).sqrt() - self.radius_m;
            (off_m.abs() <= self.weed_left_m).then(|| self.radius_m * wrap_to_tau(atan2(x, y)))
        };
        let straight_m = (ahead_m >= 0.0 && left_m.abs() <= self.weed_left_m).then_some(ahead_m);
        let arcs = [(0.0, straight_m), (1.0, arc_length_m(1.0)), (-1.0, arc_length_m(-1.0))];
        let mut best: Option<Way> = None;
        for (turn, length_m) in arcs {
            let Some(length_m) = length_m else { continue };
            let curvature_per_m = turn / self.radius_m;
            let way = Way::arc(self.departure.start(), curvature_per_m, length_m, PAST_WEED_M);
            if best.is_none_or(|best| way.length_m() < best.length_m()) && self.fence.holds(&way) {
                best = Some(way);
            }
        }
        best
    }
}

/// A bound on the length of paths in one direction, from below.
///
/// A path that starts at the angle a to the direction cannot make full progress in it before it has turned by a: with the
/// radius R that costs at least R (a - sin a) of way. The same holds at its end.
struct Bound {
    start: Frame,
    bearing_rad: f64,
    /// The direction.
    cos: f64,
    sin: f64,
    radius_m: f64,
    start_rad: f64,
    start_loss_m: f64,
}

/// An angle to the direction, and the way that it costs.
#[derive(Clone, Copy)]
struct Loss {
    angle_rad: f64,
    loss_m: f64,
}

impl Bound {
    fn new(start: &Frame, bearing_rad: f64, radius_m: f64) -> Self {
        let (sin, cos) = sin_cos(bearing_rad);
        let mut bound = Self {
            start: *start,
            bearing_rad,
            cos,
            sin,
            radius_m,
            start_rad: 0.0,
            start_loss_m: 0.0,
        };
        let Loss { angle_rad, loss_m } = bound.loss_m(start);
        bound.start_rad = angle_rad;
        bound.start_loss_m = loss_m;
        bound
    }

    /// What the heading of `at` costs.
    fn loss_m(&self, at: &Frame) -> Loss {
        let apart_rad = (at.pose.heading_rad - self.bearing_rad).abs();
        let within_rad = if apart_rad > TAU { apart_rad - TAU } else { apart_rad };
        let angle_rad = within_rad.min(TAU - within_rad);
        let sine = (self.cos * at.sin - self.sin * at.cos).abs();
        Loss { angle_rad, loss_m: self.radius_m * (angle_rad - sine) }
    }

    /// How far `goal` lies ahead in the direction, metres.
    fn progress_m(&self, goal: &Frame) -> f64 {
        let (x_m, y_m) = (goal.pose.x_m - self.start.pose.x_m, goal.pose.y_m - self.start.pose.y_m);
        x_m * self.cos + y_m * self.sin
    }

    /// No path that makes so much progress, to a heading that costs `end`, is shorter than this, metres.
    fn least_m(&self, progress_m: f64, end: Loss) -> f64 {
        // A path too short for both turns saves what they have in common; a - sin a is at most a^3 / 6.
        let turns_rad = self.start_rad + end.angle_rad;
        let shared_rad = 0.5 * (turns_rad - progress_m.max(0.0) / self.radius_m).max(0.0);
        let shared_m = self.radius_m * shared_rad * shared_rad * shared_rad / 3.0;
        progress_m + self.start_loss_m + end.loss_m - shared_m - ROUNDING_M
    }
}
