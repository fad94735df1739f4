//! `horizon`: one plan over all that is known, made anew as the mower learns more.

mod anneal;
mod open;
mod plan;
mod spot;
mod views;

use std::collections::HashMap;
use std::sync::{LazyLock, Mutex};

use schemars::JsonSchema;
use serde::Deserialize;
use swath_core::geometry::{Pose, shortest};
use swath_core::known::KnownWeed;
use swath_core::rng::{self, StreamRng};
use swath_core::view::View;

use crate::agent::{Agent, Decision, PIECE_M};
use crate::route::{ARRIVED_M, Route};
use open::OpenGround;
use plan::{Node, Plan};
use spot::Spot;
use views::Views;

/// Way between two plans if something new is known, and if not, metres.
const SOON_M: f64 = 1.5;
const LATE_M: f64 = 6.0;
/// Looks that are thought over each time, and how often all of them are.
const NEXT_LOOKS: usize = 5;
const ALL_LOOKS_EVERY: u32 = 8;
/// How many more changes are tried for each weed that is planned.
const PER_WEED: usize = 150;
/// Another plan is taken if it is so much shorter, metres: a mower that often changes its mind drives to and fro.
const WORTH_M: f32 = 1.0;
/// A plan is long when the mower has driven so many boustrophedon paths.
const CAP: f64 = 3.0;

/// Options of `horizon`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct HorizonOptions {
    /// How many changes are tried for a plan after something new is known.
    pub iterations: usize,
}

impl Default for HorizonOptions {
    fn default() -> Self {
        Self { iterations: 5_000 }
    }
}

/// The planner.
#[derive(Debug)]
pub struct Horizon {
    iterations: usize,
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
    /// The planner, which tries so many changes for every plan.
    #[must_use]
    pub fn new(iterations: usize) -> Self {
        Self { iterations, rng: rng::agent_rng(0), state: None }
    }

    fn begin(&mut self, view: &View) -> State {
        let site = view.site;
        let start = Spot::from(view.pose);
        let mut ground = OpenGround::new(site);
        let mut plan = Plan::new(start, site.turning_radius_m as f32);
        // The same for every episode that begins there.
        let key = format!("{site:?} {:?}", view.pose);
        static SWEEPS: LazyLock<Mutex<HashMap<String, Vec<Spot>>>> = LazyLock::new(Mutex::default);
        let known = SWEEPS.lock().expect("nobody panics with it").get(&key).cloned();
        let spots = known.unwrap_or_else(|| {
            let size_m = (site.length_m as f32, site.width_m as f32);
            let mut rng = rng::agent_rng(1);
            Views { plan: &mut plan, ground: &mut ground, size_m }.sweep(site.sensor_width_m as f32, &mut rng);
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
        // Between two looks the mower has driven a little since the last one.
        let since_m = view.path_m.rem_euclid(PIECE_M);
        let late_m = if since_m < 1e-6 || since_m > PIECE_M - 1e-6 { 0.0 } else { since_m };
        let here = Spot::from(view.pose);
        self.ground.settle_look(&here, late_m as f32);
        // A straight shows more than its single looks do: what lies beside it is seen piece by piece.
        let is_straight = self.straight.is_some_and(|(start, _)| {
            let (x_m, y_m) = (here.x_m - start.x_m, here.y_m - start.y_m);
            (here.heading_rad - start.heading_rad).abs() < 1e-5 && (start.cos * y_m - start.sin * x_m).abs() < 1e-3
        });
        if let Some((start, start_m)) = self.straight.filter(|_| is_straight) {
            let straight_m = (view.path_m - start_m) as f32;
            let kept_m = straight_m.min(0.2 * (5.0 * self.ground.range_m() + 5.0).floor());
            let from = Spot { x_m: here.x_m - kept_m * start.cos, y_m: here.y_m - kept_m * start.sin, ..start };
            self.ground.settle_straight(&from, kept_m);
        } else {
            self.straight = Some((here, view.path_m));
        }
        let fresh = view.known_weeds.since(self.next_number);
        if let Some(last) = fresh.last() {
            self.next_number = last.number + 1;
            self.fresh.extend_from_slice(fresh);
        }
        self.known = view.known_weeds.len();
    }

    fn is_due(&mut self, view: &View) -> bool {
        let driven_m = view.path_m - self.planned_at_m;
        driven_m >= LATE_M || (!self.fresh.is_empty() && driven_m >= SOON_M) || self.route.is_driven(view)
    }

    fn replan(&mut self, view: &View, iterations: usize, rng: &mut StreamRng) {
        let site = view.site;
        let passed = self.passes_m.iter().take_while(|&&pass_m| pass_m <= view.path_m + ARRIVED_M).count();
        self.plan.nodes.drain(..passed);
        self.plan.start = Spot::from(view.pose);
        let is_settled = self.ground.open() == 0;
        self.plan.retain(|node| match node.weed {
            Some(weed) => view.known_weeds.holds(weed.number),
            None => !is_settled,
        });
        // Weeds that the plan has passed in vain come back.
        let planned: Vec<u32> = self.plan.nodes.iter().filter_map(|node| node.weed.map(|weed| weed.number)).collect();
        self.fresh = view.known_weeds.iter().filter(|weed| !planned.contains(&weed.number)).copied().collect();
        let here = view.pose.position();
        self.fresh.sort_by(|one, other| (one.position - here).norm_squared().total_cmp(&(other.position - here).norm_squared()));
        let reach_m = (0.49 * site.deck_width_m) as f32;
        let is_new = !self.fresh.is_empty();
        for weed in self.fresh.drain(..) {
            self.plan.insert_weed(weed.number, weed.position, reach_m);
        }
        let weeds = planned.len();
        let rounds = if is_new { iterations + PER_WEED * weeds } else { iterations / 3 };
        let size_m = (site.length_m as f32, site.width_m as f32);
        let looks = if self.plans.is_multiple_of(ALL_LOOKS_EVERY) { usize::MAX } else { NEXT_LOOKS };
        let mut finish = |plan: &mut Plan, ground: &mut OpenGround, rng: &mut StreamRng| {
            if !is_settled {
                Views { plan, ground, size_m }.mend(looks, rng);
            }
        };
        let mut kept = self.plan.clone();
        anneal::anneal(&mut self.plan, reach_m, rounds.max(1), rng);
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
            let leg = shortest(pose, goal, view.site.turning_radius_m).expect("a checked scenario has a turning radius");
            route = if self.passes_m.is_empty() { Route::along(&leg, view) } else { route.followed_by(&leg) };
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
        self.state = Some(self.begin(view));
    }

    fn act(&mut self, view: &View) -> Decision {
        let Self { iterations, rng, state } = self;
        let state = state.as_mut().expect("an episode has begun");
        state.perceive(view);
        if state.ground.open() == 0 && state.known == 0 {
            return Decision::Done;
        }
        if view.path_m > CAP * view.site.bcp_length_m {
            return Decision::Capped;
        }
        if state.is_due(view) {
            state.replan(view, *iterations, rng);
        }
        // To the next look at most.
        let to_look_m = PIECE_M - view.path_m.rem_euclid(PIECE_M);
        let to_look_m = if to_look_m < 1e-6 { PIECE_M } else { to_look_m };
        let ahead = swath_core::action::Command { curvature_per_m: 0.0, distance_m: PIECE_M };
        let command = state.route.next(view).unwrap_or(ahead);
        Decision::Drive(swath_core::action::Command { distance_m: command.distance_m.min(to_look_m), ..command })
    }
}
