//! `horizon`: one plan over all that is known, made anew as the mower learns more.

mod anneal;
mod clairvoyant;
mod deadline;
mod open;
mod outlook;
mod plan;
mod rows;
mod spot;
mod views;
mod ways;

pub use clairvoyant::{Clairvoyant, ClairvoyantOptions};

use std::collections::HashMap;
use std::sync::{LazyLock, Mutex};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use swath_core::action::Command;
use swath_core::config::ConfigError;
use swath_core::geometry::Pose;
use swath_core::known::KnownWeed;
use swath_core::rng::{self, StreamRng};
use swath_core::site::Site;
use swath_core::view::View;

use crate::agent::{Agent, Decision, PIECE_M};
use crate::route::{ARRIVED_M, Route};
use deadline::Deadline;
use open::OpenGround;
use plan::{Node, Plan};
use rows::Rows;
use spot::{Spot, single};
use views::Views;
use ways::Ways;

/// Way between two plans if something new is known, and if not, metres.
const SOON_M: f64 = 1.5;
const LATE_M: f64 = 6.0;
/// Looks that are thought over each time, and how often all of them are.
const NEXT_LOOKS: usize = 5;
const ALL_LOOKS_EVERY: u32 = 8;
/// Most changes that may be asked for, and most time, milliseconds: an hour.
const MOST_ITERATIONS: usize = 100_000_000;
const MOST_TIME_MS: f64 = 3_600_000.0;
/// How much longer the first plan may take than the others.
const FIRST_TIME: f64 = 20.0;
/// For mowers that keep to their path: what single precision asks for, and more, metres.
const BAR_MARGIN_M: f64 = 0.02;
/// So near to where the mower looks it has looked, metres.
const LOOKED_M: f32 = 1e-4;
/// How many times fewer changes are tried of places to look from.
const MENDING: usize = 40;
/// How many times as many changes are tried for each of the first plans.
const SWEEP: usize = 2;
/// As many changes more are tried for every so many weeds that are planned.
const WEEDS: usize = 10;
/// So many weeds count twice: where there are few, most of the way is still open, and more thought shortens it.
const FIRST_WEEDS: usize = 40;
/// Another plan is taken if it is so much shorter, metres: a mower that often changes its mind drives to and fro.
const WORTH_M: f32 = 1.0;
/// Nothing comes of it any more when the mower has driven so many boustrophedon paths, or rows over everything where the headland
/// makes those longer.
const CAP: f64 = 3.0;

/// Share of the ground that must be seen before its weeds tell how many there are elsewhere.
const SEEN: f32 = 0.1;
/// Share of the ground from which on the rest is planned freely.
const NEARLY_ALL: f32 = 0.98;
/// Below this share of the boustrophedon path nobody thinks of rows, and below this one nothing is taken for its sake.
const FAR_BELOW: f32 = 0.6;
const SAFE: f32 = 0.85;
/// Rows shorter than this share of it leave room to look before the choice is made.
const SHORT: f32 = 0.91;
/// By how much a shortest path is longer than a straight at most, in turning radii: 7 pi / 3, for the way from a pose back to the
/// same pose turned round (Dubins, 1957).
const DETOUR: f32 = 7.34;

/// What an episode begins with that knows of no weed yet.
#[derive(Debug, Clone)]
struct First {
    sweep: Vec<Spot>,
    rows: Rows,
}

/// Those that were made in this process, by the pasture, the mower and where it begins; not more than so many.
static FIRST: LazyLock<Mutex<HashMap<String, First>>> = LazyLock::new(Mutex::default);
const MOST_FIRST: usize = 64;

/// Options of `horizon`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct HorizonOptions {
    /// How many changes are tried for a plan after something new is known, for every ten weeds and once more: twice as many for
    /// each of the first forty.
    pub iterations: usize,
    /// Time for a plan, milliseconds, up to an hour: as many of the changes as there is time for. The first plan, which is made
    /// once for a pasture, has 20 times as long. Infinite: no limit, and the same is decided everywhere.
    pub time_ms: f64,
    /// How far from either end of the bar a weed is planned to pass, metres, for mowers that do not keep to their path; with half
    /// the deck or more, weeds pass under its middle.
    pub bar_margin_m: f64,
}

impl Default for HorizonOptions {
    fn default() -> Self {
        Self { iterations: 5_000, time_ms: f64::INFINITY, bar_margin_m: BAR_MARGIN_M }
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
        if !(0.0..=MOST_TIME_MS).contains(&time_ms) && time_ms != f64::INFINITY {
            let expected = format!("from 0 to {MOST_TIME_MS}, or inf");
            return Err(ConfigError::value("horizon.time_ms", expected, time_ms));
        }
        if !(0.0..=1000.0).contains(&bar_margin_m) {
            return Err(ConfigError::value("horizon.bar_margin_m", "from 0 to 1000", bar_margin_m));
        }
        Ok(self)
    }

    /// How many changes are tried for so many weeds.
    fn rounds(&self, weeds: usize) -> usize {
        self.iterations * (WEEDS + weeds + weeds.min(FIRST_WEEDS)) / WEEDS
    }

    /// How far from the bar's middle weeds are planned to pass, metres.
    fn reach_m(&self, site: &Site) -> f32 {
        single((0.5 * site.deck_width_m - self.bar_margin_m).max(0.0))
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
    /// Length of the first plan and of rows over everything, metres.
    sweep_m: f32,
    rows_m: f32,
    /// How long the whole way will be without rows, metres, and how much of the ground was seen when that was found out.
    expected: Option<(f32, f32)>,
    /// The other way to do it, as long as it is one.
    rows: Option<Rows>,
    is_on_rows: bool,
    is_on_first: bool,
}

impl Horizon {
    /// The planner.
    #[must_use]
    pub fn new(options: HorizonOptions) -> Self {
        Self { options, rng: rng::agent_rng(0), state: None }
    }

    /// How many plans it has made in this episode; those along rows, which take no thought, are not among them.
    #[must_use]
    pub fn plans(&self) -> u32 {
        self.state.as_ref().map_or(0, |state| state.plans)
    }

    fn begin(view: &View, options: &HorizonOptions) -> State {
        let site = view.site;
        let start = Spot::from(view.pose);
        let mut ground = OpenGround::new(site);
        let mut plan = Plan::new(start, Ways::new(site));
        let size_m = (single(site.length_m), single(site.width_m));
        // The same for every episode that begins there.
        let HorizonOptions { iterations, time_ms, .. } = options;
        let key = format!("{site:?} {:?} {iterations} {time_ms}", view.pose);
        let known = FIRST.lock().expect("nobody panics with it").get(&key).cloned();
        let First { sweep, rows } = known.unwrap_or_else(|| {
            let mut rng = rng::agent_rng(1);
            let until = Deadline::within(FIRST_TIME * time_ms);
            Views { plan: &mut plan, ground: &mut ground, size_m, until }.sweep(
                single(site.sensor_width_m),
                SWEEP * iterations,
                &mut rng,
            );
            let sweep = plan.nodes.iter().map(|node| node.spot).collect();
            let first = First { sweep, rows: Rows::new(site, plan.ways, &start) };
            let mut firsts = FIRST.lock().expect("nobody panics with it");
            if firsts.len() >= MOST_FIRST {
                firsts.clear();
            }
            firsts.insert(key, first.clone());
            first
        });
        plan.nodes = sweep.into_iter().map(Node::view).collect();
        plan.measure_all();
        ground.forget_looks();
        let sweep_m = plan.length_m();
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
            sweep_m,
            rows_m: rows.length_m(&start),
            expected: None,
            rows: Some(rows),
            is_on_rows: false,
            is_on_first: false,
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
        for weed in view.known_weeds.since(self.next_number) {
            self.next_number = weed.number + 1;
            self.fresh.push(weed);
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
            || (!self.fresh.is_empty() && driven_m >= SOON_M && !self.is_on_rows)
            || self.route.is_driven(view)
    }

    fn replan(&mut self, view: &View, options: &HorizonOptions, rng: &mut StreamRng) {
        let site = view.site;
        let until = Deadline::within(options.time_ms);
        self.planned_at_m = view.path_m;
        let passed =
            self.passes_m.iter().take_while(|&&pass_m| pass_m <= view.path_m + ARRIVED_M).count();
        self.plan.nodes.drain(..passed);
        self.plan.start = Spot::from(view.pose);
        if self.is_on_rows && self.follow_rows(view, passed, options) {
            return;
        }
        self.ground.reopen(view.ground);
        let is_settled = self.ground.open() == 0;
        self.plan.retain(|node| match node.weed {
            Some(weed) => view.known_weeds.holds(weed.number),
            None => !is_settled,
        });
        // Weeds that the plan has passed in vain come back.
        let planned: Vec<u32> =
            self.plan.nodes.iter().filter_map(|node| node.weed.map(|weed| weed.number)).collect();
        self.fresh =
            view.known_weeds.iter().filter(|weed| !planned.contains(&weed.number)).collect();
        let here = view.pose.position();
        self.fresh.sort_by(|one, other| {
            (one.position - here).norm_squared().total_cmp(&(other.position - here).norm_squared())
        });
        let reach_m = options.reach_m(site);
        let is_new = !self.fresh.is_empty();
        for weed in self.fresh.drain(..) {
            self.plan.insert_weed(weed.number, weed.position, reach_m);
        }
        let rounds = if is_new { options.rounds(planned.len()) } else { options.iterations / 3 };
        self.improve(site, is_settled, rounds.max(1), until, options, rng);
        let is_lost = !is_settled && self.plan.nodes.is_empty();
        if is_lost || self.should_take_rows(view, until, options) {
            self.is_on_rows = true;
            self.plan.nodes.clear();
            if self.follow_rows(view, 0, options) {
                return;
            }
        }
        self.lay_route(view);
    }

    /// Tries so many changes of the plan, and has it show all that is open; the plan as it was stays unless that is worth it.
    fn improve(
        &mut self,
        site: &Site,
        is_settled: bool,
        rounds: usize,
        until: Option<Deadline>,
        options: &HorizonOptions,
        rng: &mut StreamRng,
    ) {
        let size_m = (single(site.length_m), single(site.width_m));
        let looks =
            if self.plans.is_multiple_of(ALL_LOOKS_EVERY) { usize::MAX } else { NEXT_LOOKS };
        self.plans += 1;
        let mut kept = self.plan.clone();
        anneal::anneal(&mut self.plan, options.reach_m(site), rounds, until, rng);
        if is_settled {
            return;
        }
        let mut mend = |plan: &mut Plan, ground: &mut OpenGround| {
            let mut views = Views { plan, ground, size_m, until };
            views.mend(looks, options.iterations / MENDING, rng);
            ground.missed()
        };
        let missed = mend(&mut self.plan, &mut self.ground);
        // What the changes have saved may be lost again where more looks are needed.
        let missed_by_kept = mend(&mut kept, &mut self.ground);
        let is_as_short = kept.length_m() < self.plan.length_m() + WORTH_M;
        if missed_by_kept < missed || (missed_by_kept == missed && is_as_short) {
            self.plan = kept;
        }
    }

    /// Whether rows are the better way to do the rest.
    ///
    /// Where it would not take far less than the boustrophedon path without them, rows are also taken before it is too late to
    /// keep within it: to drive on until the next plan costs no more than the way there and back, and a turn.
    fn should_take_rows(
        &mut self,
        view: &View,
        until: Option<Deadline>,
        options: &HorizonOptions,
    ) -> bool {
        let (driven_m, bcp_m) = (single(view.path_m), single(view.site.bcp_length_m));
        let planned_m = driven_m + self.plan.length_m();
        // Most that it may become: weeds in a small piece of ground take more than as many do in a large one.
        let seen = self.ground.settled_share();
        let most_m = self.sweep_m + (planned_m - self.sweep_m) / seen.max(SEEN);
        if most_m < FAR_BELOW * bcp_m {
            return false;
        }
        let Some(rows) = &mut self.rows else { return false };
        rows.trim(&self.ground, view.known_weeds, &self.plan.start, false);
        let rows_m = driven_m + rows.length_m(&self.plan.start);
        let look_m = 2.0 * single(LATE_M) + DETOUR * single(view.site.turning_radius_m);
        let are_short = self.rows_m < SHORT * bcp_m;
        let is_last_chance = are_short && rows_m <= bcp_m && rows_m + look_m > bcp_m;
        let limit_m = if is_last_chance { rows_m.min(SAFE * bcp_m) } else { rows_m };
        if most_m < limit_m {
            return false;
        }
        // Where rows save little, no guess is worth them: they are taken when what is known alone takes longer.
        planned_m > limit_m
            || are_short && self.expected_m(view, seen, until, options).min(most_m) > limit_m
    }

    /// How long the whole way will be without rows by the weeds that are likely, metres, as far as there was ground to tell.
    fn expected_m(
        &mut self,
        view: &View,
        seen: f32,
        until: Option<Deadline>,
        options: &HorizonOptions,
    ) -> f32 {
        if seen > SEEN && self.expected.is_none_or(|(_, then)| seen > then + SEEN) {
            let (plan, ground) = (&self.plan, &self.ground);
            let left_m =
                outlook::length_m(plan, ground, self.next_number, until, options, view.site);
            self.expected = Some((single(view.path_m) + left_m, seen));
        }
        self.expected.map_or(0.0, |(expected_m, _)| expected_m)
    }

    /// Drives on along the rows, of which so many ends were passed; false when nothing is left for them to show or mow.
    fn follow_rows(&mut self, view: &View, passed: usize, options: &HorizonOptions) -> bool {
        let Some(rows) = &mut self.rows else { return false };
        let passed = passed + usize::from(self.is_on_first);
        for _ in 0..passed / 2 {
            rows.drive_first(&mut self.ground);
        }
        self.fresh.clear();
        self.is_on_first =
            rows.trim(&self.ground, view.known_weeds, &self.plan.start, passed % 2 == 1);
        if self.ground.settled_share() > NEARLY_ALL || rows.are_driven() {
            // From here on it is a plan like any other, to begin with in the order of the rows.
            self.plan.nodes = rows.nodes(view.known_weeds, options.reach_m(view.site));
            self.plan.measure_all();
            self.is_on_rows = false;
            self.rows = None;
            return false;
        }
        let ends = rows.spots().into_iter().skip(usize::from(self.is_on_first));
        self.plan.nodes = ends.map(Node::view).collect();
        self.lay_route(view);
        true
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
        self.state = Some(Self::begin(view, &self.options));
    }

    fn act(&mut self, view: &View) -> Decision {
        let Self { options, rng, state } = self;
        let state = state.as_mut().expect("an episode has begun");
        state.perceive(view);
        if state.ground.open() == 0 && state.known == 0 {
            if view.ground.unseen_count() == 0 || !state.ground.reopen(view.ground) {
                return Decision::Done;
            }
            state.planned_at_m = f64::NEG_INFINITY;
        }
        if view.path_m > CAP * view.site.bcp_length_m.max(state.rows_m.into()) {
            return Decision::Capped;
        }
        if state.is_due(view) {
            state.replan(view, options, rng);
        }
        // To the next look at most.
        let to_look_m = PIECE_M - view.path_m.rem_euclid(PIECE_M);
        let to_look_m = if to_look_m < 1e-6 { PIECE_M } else { to_look_m };
        let ahead = Command { curvature_per_m: 0.0, distance_m: PIECE_M };
        let command = match state.route.next(view) {
            Some(command) => command,
            // No row is left over ground that can be seen from nowhere: under the bar at least its cells of 1 m were seen.
            None if state.plan.nodes.is_empty() => {
                let is_seen = view.ground.unseen_count() == 0;
                return if is_seen { Decision::Done } else { Decision::Capped };
            }
            None => ahead,
        };
        Decision::Drive(Command { distance_m: command.distance_m.min(to_look_m), ..command })
    }
}
