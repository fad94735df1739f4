//! A pass: one straight way across the pasture, along x.

use std::f64::consts::PI;

use swath_core::action::Command;
use swath_core::geometry::Pose;
use swath_core::math::wrap_to_pi;
use swath_core::site::Site;
use swath_core::view::View;

use crate::route::Route;

/// Offsets below this are rounding, metres and radians.
const ON_THE_LINE: f64 = 1e-9;
/// A mower this near the beginning of its first pass is on it, metres and radians.
const AT_START_M: f64 = 0.25;
const AT_START_RAD: f64 = 0.1;
/// Way within which an offset is steered away, metres.
const SETTLE_M: f64 = 1.0;

/// The direction of a pass, and what lies ahead, above and below of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Heading {
    /// Along +x, heading 0.
    East,
    /// Along -x, heading pi.
    West,
}

impl Heading {
    /// The direction of pass number `pass`; the first goes east, then they alternate.
    #[must_use]
    pub fn of_pass(pass: usize) -> Self {
        if pass.is_multiple_of(2) { Self::East } else { Self::West }
    }

    /// Radians from +x.
    #[must_use]
    pub fn rad(self) -> f64 {
        match self {
            Self::East => 0.0,
            Self::West => PI,
        }
    }

    /// +1 eastwards, -1 westwards: the sign of a step along the pass in x, and of a step to the left in y.
    #[must_use]
    pub fn sign(self) -> f64 {
        match self {
            Self::East => 1.0,
            Self::West => -1.0,
        }
    }

    /// How far along the pass x lies, 0 to the pasture's length.
    #[must_use]
    pub fn along(self, x_m: f64, site: &Site) -> f64 {
        match self {
            Self::East => x_m,
            Self::West => site.length_m - x_m,
        }
    }

    /// The pose `along_m` along a pass at height `y_m`.
    #[must_use]
    pub fn pose(self, along_m: f64, y_m: f64, site: &Site) -> Pose {
        Pose::new(self.along(along_m, site), y_m, self.rad())
    }

    /// The shortest way to the beginning of a pass at height `y_m`.
    #[must_use]
    pub fn way_to_pass(self, y_m: f64, view: &View) -> Route {
        Route::shortest_to(self.pose(0.0, y_m, view.site), view)
    }

    /// The way to the beginning of the first pass, at height `y_m`; `None` if the mower stands there already, or so near that
    /// [`Heading::hold`] will do: the shortest path a hair to the side is a loop.
    #[must_use]
    pub fn way_to_first_pass(self, y_m: f64, view: &View) -> Option<Route> {
        let first = self.pose(0.0, y_m, view.site);
        let is_there = view.pose.distance_to(&first) < AT_START_M
            && wrap_to_pi(view.pose.heading_rad - first.heading_rad).abs() < AT_START_RAD;
        (!is_there).then(|| self.way_to_pass(y_m, view))
    }

    /// Drives straight on at height `y_m` for `distance_m`.
    ///
    /// A mower on the line goes exactly straight; one that float32 actions have moved off it by a hair is steered back.
    #[must_use]
    pub fn hold(self, y_m: f64, distance_m: f64, view: &View) -> Command {
        let off_heading_rad = wrap_to_pi(view.pose.heading_rad - self.rad());
        let off_left_m = self.sign() * (view.pose.y_m - y_m);
        let is_on_line = off_heading_rad.abs() < ON_THE_LINE && off_left_m.abs() < ON_THE_LINE;
        let max_per_m = 1.0 / view.site.turning_radius_m;
        let back_per_m = -(off_heading_rad + off_left_m / SETTLE_M) / distance_m.max(PIECE_FLOOR_M);
        let curvature_per_m =
            if is_on_line { 0.0 } else { back_per_m.clamp(-max_per_m, max_per_m) };
        Command { curvature_per_m, distance_m }
    }
}

/// Shortest way over which a heading is corrected, metres.
const PIECE_FLOOR_M: f64 = 0.05;
