//! `horizon`: one plan over all that is known, made anew as the mower learns more.

mod anneal;
mod clairvoyant;
mod deadline;
mod open;
mod plan;
mod spot;
mod views;
mod ways;

pub use clairvoyant::{Clairvoyant, ClairvoyantOptions};

use std::collections::HashMap;
use std::sync::{LazyLock, Mutex};

use schemars::JsonSchema;
use serde::Deserialize;
use swath_core::action::Command;
use swath_core::config::ConfigError;
use swath_core::geometry::Pose;
use swath_core::known::KnownWeed;
use swath_core::rng::{self, StreamRng};
use swath_core::view::View;

use crate::agent::{Agent, Decision, PIECE_M};
use crate::route::{ARRIVED_M, Route};
use deadline::Deadline;
use open::OpenGround;
use plan::{Node, Plan};
use spot::{Spot, single};
use views::Views;
use ways::Ways;

/// Way between two plans if something new is known, and if not, metres.
const SOON_M: f64 = 1.5;
const LATE_M: f64 = 6.0;
/// Looks that are thought over each time, and how often all of them are.
const NEXT_LOOKS: usize = 5;
const ALL_LOOKS_EVERY: u32 = 8;
/// Most changes that may be asked for.
const MOST_ITERATIONS: usize = 100_000_000;
/// So near to where the mower looks it has looked, metres.
const LOOKED_M: f32 = 1e-4;
/// How many times fewer changes are tried of places to look from.
const MENDING: usize = 40;
/// How many times as many changes are tried for each of the first plans.
const SWEEP: usize = 3;
/// As many changes more are tried for every so many weeds that are planned.
const WEEDS: usize = 10;
/// Another plan is taken if it is so much shorter, metres: a mower that often changes its mind drives to and fro.
const WORTH_M: f32 = 1.0;
/// A plan is long when the mower has driven so many boustrophedon paths.
const CAP: f64 = 3.0;

/// The first plans that were made in this process, by the pasture, the mower and where it begins.
static SWEEPS: LazyLock<Mutex<HashMap<String, Vec<Spot>>>> = LazyLock::new(Mutex::default);

/// Options of `horizon`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct HorizonOptions {
    /// How many changes are tried for a plan after something new is known.
    pub iterations: usize,
    /// Time for a plan, milliseconds: as many of the changes as there is time for. Without it the same is decided everywhere.
    pub time_ms: f64,
    /// How far from either end of the bar a weed is planned to pass, metres, for mowers that do not keep to their path.
    pub bar_margin_m: f64,
}

impl Default for HorizonOptions {
    fn default() -> Self {
        Self { iterations: 5_000, time_ms: f64::INFINITY, bar_margin_m: 0.02 }
    }
}

impl HorizonOptions {
    /// The same options, if they can be used.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] naming the option, its value and what was expected.
    pub fn checked(self) -> Result<Self, ConfigError> {
        let Self { iterations, time_ms, bar_margin_m } = self;
        if !(1..=MOST_ITERATIONS).contains(&iterations) {
            let expected = format!("from 1 to {MOST_ITERATIONS}");
            return Err(ConfigError::value("horizon.iterations", expected, iterations));
        }
        if time_ms.is_nan() || time_ms < 0.0 {
            return Err(ConfigError::value("horizon.time_ms", "at least 0", time_ms));
        }
        if !(0.0..1000.0).contains(&bar_margin_m) {
            return Err(ConfigError::value("horizon.bar_margin_m", "from 0 to 1000", bar_margin_m));
        }
        Ok(self)
    }
}

/// The planner.
#[derive(Debug)]
pub struct Horizon {
    options: HorizonOptions,
    rng: StreamRng,
    state: Option<State>,
}

#[derive(Debug)]
struct State {
    ground: OpenGround,
    plan: Plan,
    /// The way to drive, and where it passes the first nodes of the plan.
    route: Route,
    passes_m: Vec<f64>,
    planned_at_m: f64,
    plans: u32,
    next_number: u32,
    fresh: Vec<KnownWeed>,
    known: usize,
    /// Where the present straight began, and after how long a way.
    straight: Option<(Spot, f64)>,
}

impl Horizon {
    /// The planner.
    #[must_use]
    pub fn new(options: HorizonOptions) -> Self {
        Self { options, rng: rng::agent_rng(0), state: None }
    }

    fn begin(view: &View, iterations: usize) -> State {
        let site = view.site;
        let start = Spot::from(view.pose);
        let mut ground = OpenGround::new(site);
        let mut plan = Plan::new(start, Ways::new(site));
        let size_m = (single(site.length_m), single(site.width_m));
        // The same for every episode that begins there.
        let key = format!("{site:?} {:?} {iterations}", view.pose);
        let known = SWEEPS.lock().expect("nobody panics with it").get(&key).cloned();
        let spots = known.unwrap_or_else(|| {
            let mut rng = rng::agent_rng(1);
            Views { plan: &mut plan, ground: &mut ground, size_m }.sweep(
                single(site.sensor_width_m),
                SWEEP * iterations,
                &mut rng,
            );
            let spots: Vec<Spot> = plan.nodes.iter().map(|node| node.spot).collect();
            SWEEPS.lock().expect("nobody panics with it").insert(key, spots.clone());
            spots
        });
        plan.nodes = spots.into_iter().map(Node::view).collect();
        plan.measure_all();
        ground.forget_looks();
        State {
            ground,
            plan,
            route: Route::empty(),
            passes_m: Vec::new(),
            planned_at_m: f64::NEG_INFINITY,
            plans: 0,
            next_number: 0,
            fresh: Vec::new(),
            known: 0,
            straight: None,
        }
    }
}

impl State {
    /// Takes in what the mower knows now.
    fn perceive(&mut self, view: &View) {
        let here = Spot::from(view.pose);
        // Between two looks the mower has driven a little since the last one.
        let late_m = single(view.path_m.rem_euclid(PIECE_M));
        if late_m < LOOKED_M || late_m > single(PIECE_M) - LOOKED_M {
            self.ground.settle_look(&here, 0.0);
            self.settle_straight(&here, view.path_m);
        } else {
            self.ground.settle_look(&here, late_m);
        }
        let fresh = view.known_weeds.since(self.next_number);
        if let Some(last) = fresh.last() {
            self.next_number = last.number + 1;
            self.fresh.extend_from_slice(fresh);
        }
        self.known = view.known_weeds.len();
    }

    /// A straight shows more than its single looks do: what lies beside it is seen piece by piece.
    fn settle_straight(&mut self, here: &Spot, path_m: f64) {
        let is_on = |start: &Spot, straight_m: f32| {
            let (ahead_m, left_m) = start.offsets_to(here);
            (here.heading_rad - start.heading_rad).abs() < 1e-5
                && left_m.abs() < 1e-3
                && (ahead_m - straight_m).abs() < 1e-3
        };
        if let Some((start, start_m)) = self.straight {
            let straight_m = single(path_m - start_m);
            if is_on(&start, straight_m) {
                // As much of it as looks beside the mower's place; whole looks.
                let looks = ((self.ground.range_m() + 1.0) / single(PIECE_M)).floor();
                let back_m = straight_m.min(single(PIECE_M) * looks);
                let (x_m, y_m) = (here.x_m - back_m * start.cos, here.y_m - back_m * start.sin);
                self.ground.settle_straight(&Spot { x_m, y_m, ..start }, back_m);
                return;
            }
        }
        self.straight = Some((*here, path_m));
    }

    fn is_due(&mut self, view: &View) -> bool {
        let driven_m = view.path_m - self.planned_at_m;
        driven_m >= LATE_M
            || (!self.fresh.is_empty() && driven_m >= SOON_M)
            || self.route.is_driven(view)
    }

    fn replan(&mut self, view: &View, options: &HorizonOptions, rng: &mut StreamRng) {
        let site = view.site;
        let until = Deadline::within(options.time_ms);
        let passed =
            self.passes_m.iter().take_while(|&&pass_m| pass_m <= view.path_m + ARRIVED_M).count();
        self.plan.nodes.drain(..passed);
        self.plan.start = Spot::from(view.pose);
        let is_settled = self.ground.open() == 0;
        self.plan.retain(|node| match node.weed {
            Some(weed) => view.known_weeds.holds(weed.number),
            None => !is_settled,
        });
        // Weeds that the plan has passed in vain come back.
        let planned: Vec<u32> =
            self.plan.nodes.iter().filter_map(|node| node.weed.map(|weed| weed.number)).collect();
        self.fresh = view
            .known_weeds
            .iter()
            .filter(|weed| !planned.contains(&weed.number))
            .copied()
            .collect();
        let here = view.pose.position();
        self.fresh.sort_by(|one, other| {
            (one.position - here).norm_squared().total_cmp(&(other.position - here).norm_squared())
        });
        let reach_m = single((0.5 * site.deck_width_m - options.bar_margin_m).max(0.0));
        let is_new = !self.fresh.is_empty();
        for weed in self.fresh.drain(..) {
            self.plan.insert_weed(weed.number, weed.position, reach_m);
        }
        let weeds = planned.len();
        let rounds = if is_new {
            options.iterations + options.iterations * weeds / WEEDS
        } else {
            options.iterations / 3
        };
        let size_m = (single(site.length_m), single(site.width_m));
        let looks =
            if self.plans.is_multiple_of(ALL_LOOKS_EVERY) { usize::MAX } else { NEXT_LOOKS };
        let finish = |plan: &mut Plan, ground: &mut OpenGround, rng: &mut StreamRng| {
            if !is_settled {
                Views { plan, ground, size_m }.mend(looks, options.iterations / MENDING, rng);
            }
        };
        let mut kept = self.plan.clone();
        anneal::anneal(&mut self.plan, reach_m, rounds.max(1), until, rng);
        finish(&mut self.plan, &mut self.ground, rng);
        if !is_settled {
            // What the changes have saved may be lost again where more looks are needed.
            finish(&mut kept, &mut self.ground, rng);
            if kept.length_m() < self.plan.length_m() + WORTH_M {
                self.plan = kept;
            }
        }
        self.plans += 1;
        self.planned_at_m = view.path_m;
        self.lay_route(view);
    }

    /// The way through the first nodes of the plan, as far as it may be driven before the next plan.
    fn lay_route(&mut self, view: &View) {
        let (mut route, mut pose, mut end_m) = (Route::empty(), view.pose, view.path_m);
        self.passes_m.clear();
        for node in &self.plan.nodes {
            let goal: Pose = node.spot.pose();
            let leg = self.plan.ways.way(pose, goal);
            route = if self.passes_m.is_empty() {
                Route::along(&leg, view)
            } else {
                route.followed_by(&leg)
            };
            end_m += leg.length_m();
            self.passes_m.push(end_m);
            pose = goal;
            if end_m > view.path_m + LATE_M {
                break;
            }
        }
        self.route = route;
    }
}

impl Agent for Horizon {
    fn reset(&mut self, view: &View) {
        self.rng = rng::agent_rng(0);
        self.state = Some(Self::begin(view, self.options.iterations));
    }

    fn act(&mut self, view: &View) -> Decision {
        let Self { options, rng, state } = self;
        let state = state.as_mut().expect("an episode has begun");
        state.perceive(view);
        if state.ground.open() == 0 && state.known == 0 {
            return Decision::Done;
        }
        if view.path_m > CAP * view.site.bcp_length_m {
            return Decision::Capped;
        }
        if state.is_due(view) {
            state.replan(view, options, rng);
        }
        // To the next look at most.
        let to_look_m = PIECE_M - view.path_m.rem_euclid(PIECE_M);
        let to_look_m = if to_look_m < 1e-6 { PIECE_M } else { to_look_m };
        let ahead = Command { curvature_per_m: 0.0, distance_m: PIECE_M };
        let command = state.route.next(view).unwrap_or(ahead);
        Decision::Drive(Command { distance_m: command.distance_m.min(to_look_m), ..command })
    }
}
