//! `bcp`: the boustrophedon coverage path, the paper's upper bound.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use swath_core::geometry::Pose;
use swath_core::site::{Site, passes};
use swath_core::view::View;

use crate::agent::{Agent, Decision};
use crate::pass::Heading;
use crate::route::{ARRIVED_M, Route};

/// How far apart the passes lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Spacing {
    /// One deck width: every point is mowed.
    #[default]
    Deck,
    /// One sensor width, at most the pasture's: the search sweep, which the paper calls the lower boustrophedon path.
    Sensor,
}

/// Options of `bcp`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct BcpOptions {
    /// How far apart the passes lie: `deck` (default) or `sensor`.
    pub spacing: Spacing,
}

/// Parallel passes along x in alternating directions, joined by the shortest Dubins turns; section V-B of the paper.
///
/// Passes lie at s/2 + i s for i = 0 .. ceil(W/s) - 1, with s the deck or the sensor width. It plans nothing and never looks.
///
/// Deviation: the search sweep (`spacing = "sensor"`) is reported as what it is. It is no lower bound: it misses weeds in the
/// blind corners where passes start, and shorter paths see every cell.
#[derive(Debug, Clone)]
pub struct Bcp {
    options: BcpOptions,
    pass: usize,
    turn: Option<Route>,
}

impl Bcp {
    /// The planner with these options.
    #[must_use]
    pub fn new(options: BcpOptions) -> Self {
        Self { options, pass: 0, turn: None }
    }

    fn spacing_m(&self, site: &Site) -> f64 {
        match self.options.spacing {
            Spacing::Deck => site.deck_width_m,
            Spacing::Sensor => site.sensor_width_m.min(site.width_m),
        }
    }

    fn pass_y(&self, site: &Site) -> f64 {
        (self.pass as f64 + 0.5) * self.spacing_m(site)
    }
}

impl Agent for Bcp {
    fn start(&self, site: &Site) -> Option<Pose> {
        let is_sweep = self.options.spacing == Spacing::Sensor;
        is_sweep.then(|| Heading::East.pose(0.0, 0.5 * self.spacing_m(site), site))
    }

    fn reset(&mut self, view: &View) {
        self.pass = 0;
        self.turn = Heading::East.way_to_first_pass(self.pass_y(view.site), view);
    }

    fn act(&mut self, view: &View) -> Decision {
        loop {
            if let Some(command) = self.turn.as_mut().and_then(|turn| turn.next(view)) {
                return Decision::Drive(command);
            }
            self.turn = None;
            let heading = Heading::of_pass(self.pass);
            let left_m = view.site.length_m - heading.along(view.pose.x_m, view.site);
            if left_m > ARRIVED_M {
                return Decision::Drive(heading.hold(self.pass_y(view.site), left_m, view));
            }
            self.pass += 1;
            if self.pass == passes(view.site.width_m, self.spacing_m(view.site)) {
                return Decision::Done;
            }
            self.turn = Some(Heading::of_pass(self.pass).way_to_pass(self.pass_y(view.site), view));
        }
    }
}
