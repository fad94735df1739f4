//! `clairvoyant`: what could be driven by a mower that knew every weed. A yardstick, not an online agent.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use swath_core::config::ConfigError;
use swath_core::geometry::Point;
use swath_core::rng;
use swath_core::view::View;

use super::anneal::anneal;
use super::plan::Plan;
use super::spot::{Spot, single};
use super::ways::Ways;
use super::{BAR_MARGIN_M, MOST_ITERATIONS};
use crate::agent::{Agent, Decision};
use crate::route::Route;

/// How far the tour goes on behind its last weed, metres, so that the bar is past it whatever single precision does.
const PAST_LAST_M: f64 = 0.01;

/// Options of `clairvoyant`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ClairvoyantOptions {
    /// How many changes of the tour are tried for each weed. More make it shorter.
    pub iterations: usize,
}

impl Default for ClairvoyantOptions {
    fn default() -> Self {
        Self { iterations: 10_000 }
    }
}

impl ClairvoyantOptions {
    /// The same options, if they can be used.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] naming the option, its value and what was expected.
    pub fn checked(self) -> Result<Self, ConfigError> {
        if !(1..=MOST_ITERATIONS).contains(&self.iterations) {
            let expected = format!("from 1 to {MOST_ITERATIONS}");
            return Err(ConfigError::value("clairvoyant.iterations", expected, self.iterations));
        }
        Ok(self)
    }
}

/// A tour of all weeds, planned before it starts by the means of `horizon`: insertion, then annealing over order, directions
/// and parts of the bar.
///
/// It is told where the weeds stand, which no mower knows; it looks at nothing. No bound is proven: a shorter tour may exist.
#[derive(Debug)]
pub struct Clairvoyant {
    options: ClairvoyantOptions,
    weeds: Vec<Point>,
    route: Route,
}

impl Clairvoyant {
    /// The yardstick for an instance with these weeds, world frame, metres.
    #[must_use]
    pub fn new(options: ClairvoyantOptions, weeds: &[Point]) -> Self {
        Self { options, weeds: weeds.to_vec(), route: Route::empty() }
    }

    fn tour(&self, view: &View) -> Plan {
        let site = view.site;
        let mut plan = Plan::new(Spot::from(view.pose), Ways::new(site));
        let reach_m = single((0.5 * site.deck_width_m - BAR_MARGIN_M).max(0.0));
        for (number, &weed) in (0..).zip(&self.weeds) {
            plan.insert_weed(number, weed, reach_m);
        }
        let rounds = self.options.iterations.saturating_mul(self.weeds.len());
        anneal(&mut plan, reach_m, rounds, None, &mut rng::agent_rng(0));
        plan
    }
}

impl Agent for Clairvoyant {
    fn reset(&mut self, view: &View) {
        let plan = self.tour(view);
        let mut route = Route::empty();
        let mut pose = view.pose;
        for (place, node) in plan.nodes.iter().enumerate() {
            let mut goal = node.spot.pose();
            if place + 1 == plan.nodes.len() {
                let (cos, sin) = (f64::from(node.spot.cos), f64::from(node.spot.sin));
                goal.x_m += PAST_LAST_M * cos;
                goal.y_m += PAST_LAST_M * sin;
            }
            let leg = plan.ways.way(pose, goal);
            route = if place == 0 { Route::along(&leg, view) } else { route.followed_by(&leg) };
            pose = goal;
        }
        self.route = route;
    }

    fn act(&mut self, view: &View) -> Decision {
        self.route.next(view).map_or(Decision::Done, Decision::Drive)
    }
}
