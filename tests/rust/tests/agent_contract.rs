//! What holds for every agent of the registry.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use swath_agents::agent::{self, Agent, Capped, Decision, PIECE_M};
use swath_agents::registry::{AGENTS, AgentSpec};
use swath_agents::runner::{run_agent, run_episode};
use swath_core::action::Command;
use swath_core::config::{Document, ValidScenario};
use swath_core::env::{Beginning, Env, Summary};
use swath_core::episode::Outcome;
use swath_core::geometry::{Point, Pose};
use swath_core::known::{KnownWeed, KnownWeeds};
use swath_core::site::Site;
use swath_core::view::View;
use swath_tests::agents;

/// The agent of the guide, compiled as a file of `agents/src` would be: it finds the contract in `crate::agent`.
#[path = "../../../examples/straight.rs"]
pub mod straight;

fn scenario(text: &str) -> ValidScenario {
    let mut document = Document::empty("test");
    document.overlay(text.parse().unwrap());
    document.scenario().unwrap()
}

/// Pastures that differ in what planners lean on: size, turning radius against deck, sensor against deck.
fn pastures() -> Vec<(&'static str, ValidScenario)> {
    vec![
        ("the field", Document::open("cowbot-field").unwrap().scenario().unwrap()),
        ("the pasture", Document::open("pasture").unwrap().scenario().unwrap()),
        (
            "clusters",
            scenario("weeds.count = 60\nweeds.distribution = 'gaussian'\npasture.headland_m = inf"),
        ),
        ("no weeds", scenario("weeds.count = 0")),
        ("wide turns", scenario("mower.turning_radius_m = 5.0\npasture.headland_m = inf")),
        // Neither is a number in single precision: one is rounded down, one up.
        ("turns of 1.4 m", scenario("mower.turning_radius_m = 1.4\nweeds.count = 15")),
        ("turns of 2.7 m", scenario("mower.turning_radius_m = 2.7\nweeds.count = 15")),
        ("narrow sight", scenario("sensor.width_m = 4.0\nsensor.range_m = 4.0")),
        (
            "odd size",
            scenario(
                "pasture.length_m = 47.3\npasture.width_m = 18.9\nweeds.count = 15\nmower.deck_width_m = 1.7",
            ),
        ),
    ]
}

fn for_every_agent(mut check: impl FnMut(&str, &AgentSpec, &str, &ValidScenario)) {
    for (pasture, scenario) in pastures() {
        for name in agents::quick().chain(["bcp:spacing=sensor"]) {
            check(name, &name.parse().unwrap(), pasture, &scenario);
        }
    }
}

/// Lets another agent decide, and looks at every decision.
struct Watched<'a, F> {
    inner: Box<dyn Agent>,
    watch: &'a mut F,
}

impl<F: FnMut(&View, Decision) -> Decision + Send> Agent for Watched<'_, F> {
    fn start(&self, site: &Site) -> Option<Pose> {
        self.inner.start(site)
    }

    fn reset(&mut self, view: &View) {
        self.inner.reset(view);
    }

    fn act(&mut self, view: &View) -> Decision {
        let decision = self.inner.act(view);
        (self.watch)(view, decision)
    }
}

fn run_watched(
    scenario: &ValidScenario,
    agent: &AgentSpec,
    seed: u64,
    weeds: Option<&[Point]>,
    mut watch: impl FnMut(&View, Decision) -> Decision + Send,
) -> (Summary, Outcome) {
    let mut env = Env::new(scenario);
    let mut agent = Watched { inner: agent.build(seed), watch: &mut watch };
    let outcome = run_agent(&mut env, &mut agent, seed, weeds, |_| ());
    (env.summary(), outcome)
}

#[test]
fn every_agent_stops_by_itself_before_its_safety_cap() {
    for_every_agent(|name, agent, pasture, scenario| {
        for seed in 0..3 {
            let episode = run_episode(scenario, agent, seed, None);
            assert_eq!(episode.outcome, Outcome::Done, "{name} on {pasture}, seed {seed}");
        }
    });
}

#[test]
fn every_command_is_one_that_the_mower_can_drive() {
    for_every_agent(|name, agent, pasture, scenario| {
        let max_per_m = 1.0 / scenario.mower.turning_radius_m + 1e-12;
        run_watched(scenario, agent, 1, None, |_, decision| {
            if let Decision::Drive(Command { curvature_per_m, distance_m }) = decision {
                assert!(
                    curvature_per_m.abs() <= max_per_m,
                    "{name} on {pasture}: curvature {curvature_per_m}"
                );
                assert!(
                    distance_m > 0.0 && distance_m.is_finite(),
                    "{name} on {pasture}: {distance_m} m"
                );
            }
            decision
        });
    });
}

#[test]
fn equal_seeds_give_equal_decisions_to_the_bit() {
    for_every_agent(|name, agent, pasture, scenario| {
        let log = || {
            let mut decisions = Vec::new();
            run_watched(scenario, agent, 5, None, |_, decision| {
                decisions.push(decision);
                decision
            });
            decisions
        };
        assert_eq!(log(), log(), "{name} on {pasture}");
    });
}

/// The fairness line. Two pastures look alike up to some decision: one of them lacks every weed that was not detected by
/// then. An agent that sees only its `View` cannot tell them apart before.
#[test]
fn a_decision_depends_on_nothing_that_was_not_seen() {
    for_every_agent(|name, agent, pasture, scenario| {
        for (seed, checked) in [(2, 40), (3, 300)] {
            let truth = run_to(scenario, agent, seed, None, checked);
            let known: Vec<Point> = truth
                .weeds
                .iter()
                .zip(truth.is_met.iter())
                .filter_map(|(&weed, &is_met)| is_met.then_some(weed))
                .collect();
            let poorer = run_to(scenario, agent, seed, Some(&known), checked);
            assert_eq!(truth.decisions, poorer.decisions, "{name} on {pasture}, seed {seed}");
        }
    });
}

/// A truth up to some decision.
struct Partial {
    weeds: Vec<Point>,
    is_met: Vec<bool>,
    decisions: Vec<Decision>,
}

fn run_to(
    scenario: &ValidScenario,
    agent: &AgentSpec,
    seed: u64,
    weeds: Option<&[Point]>,
    decisions: usize,
) -> Partial {
    let mut env = Env::new(scenario);
    let mut agent = agent.build(seed);
    env.lift_limits();
    env.reset_from(seed, Beginning { weeds, start: agent.start(env.site()) });
    agent.reset(&env.view());
    let mut taken = Vec::new();
    while taken.len() < decisions {
        let decision = agent.act(&env.view());
        taken.push(decision);
        let Decision::Drive(command) = decision else { break };
        env.drive(command).unwrap();
    }
    let weeds = env.weeds();
    let is_met =
        weeds.is_detected().iter().zip(weeds.is_mowed()).map(|(&seen, &cut)| seen || cut).collect();
    Partial { weeds: weeds.positions().to_vec(), is_met, decisions: taken }
}

/// Weeds where directions are undefined or borders decide: under the mower, beside it on the bar's line, twice in one place,
/// in the corners.
#[test]
fn no_weed_is_so_placed_that_an_agent_never_ends() {
    let at = |x_m: f64, y_m: f64| Point::new(x_m, y_m);
    let corners = [at(0.0, 0.0), at(100.0, 0.0), at(0.0, 40.0), at(100.0, 40.0)];
    let awkward: [&[Point]; 6] = [
        &[at(0.0, 1.0)],
        &[at(0.0, 2.0), at(0.0, 6.0)],
        &[at(30.0, 9.0), at(30.0, 9.0), at(30.0, 9.0)],
        &corners,
        &[at(100.0, 1.0), at(100.0, 39.0)],
        &[at(50.0, 1.0), at(50.0, 5.0), at(50.0, 9.0), at(50.0, 39.0)],
    ];
    let scenario = Document::open("pasture").unwrap().scenario().unwrap();
    for name in agents::quick() {
        for weeds in awkward {
            let episode = run_episode(&scenario, &name.parse().unwrap(), 0, Some(weeds));
            assert_eq!(episode.outcome, Outcome::Done, "{name}, {weeds:?}");
        }
    }
}

#[test]
fn the_agent_of_the_guide_crosses_the_pasture_and_stops() {
    let scenario = Document::open("pasture").unwrap().scenario().unwrap();
    let mut env = Env::new(&scenario);
    let mut agent = Capped(Box::new(straight::Straight));
    let outcome = run_agent(&mut env, &mut agent, 0, Some(&[]), |_| ());
    assert_eq!(outcome, Outcome::Done);
    let path_m = env.summary().path_length_m;
    assert!((100.0..=100.0 + PIECE_M).contains(&path_m), "{path_m} m");
}

/// An agent that sees a weed at (50, 20) for ever, however often it is driven over.
struct Haunted(Box<dyn Agent>);

impl Agent for Haunted {
    fn reset(&mut self, view: &View) {
        self.0.reset(view);
    }

    fn act(&mut self, view: &View) -> Decision {
        let mut known = KnownWeeds::none(view.site.length_m, view.site.width_m);
        known.add(KnownWeed { number: 0, position: Point::new(50.0, 20.0) });
        self.0.act(&View { known_weeds: &known, weeds_detected: 1, ..*view })
    }
}

/// Compares every decision with that of another agent, which is shown a list of the same weeds that was made anew.
struct Doubled {
    inner: Box<dyn Agent>,
    other: Box<dyn Agent>,
}

impl Agent for Doubled {
    fn start(&self, site: &Site) -> Option<Pose> {
        self.inner.start(site)
    }

    fn reset(&mut self, view: &View) {
        self.inner.reset(view);
        self.other.reset(view);
    }

    fn act(&mut self, view: &View) -> Decision {
        let mut known = KnownWeeds::none(view.site.length_m, view.site.width_m);
        view.known_weeds.iter().for_each(|weed| known.add(weed));
        let decision = self.inner.act(view);
        assert_eq!(decision, self.other.act(&View { known_weeds: &known, ..*view }));
        decision
    }
}

/// A list made anew, as a mirror makes one after a restore, does not say which numbers mowed weeds had.
#[test]
fn what_an_agent_decides_depends_on_what_is_known_not_on_how_the_list_came_about() {
    // With turns so wide, `horizon` weighs rows against the weeds that it expects.
    let mut wide = Document::open("cowbot-field").unwrap();
    wide.overlay("mower.turning_radius_m = 3.0\nweeds.count = 60".parse().unwrap());
    let scenarios = [wide.scenario().unwrap(), scenario("weeds.count = 60")];
    for scenario in &scenarios {
        for name in agents::quick() {
            let spec: AgentSpec = name.parse().unwrap();
            for seed in 0..3 {
                let mut doubled = Doubled { inner: spec.build(seed), other: spec.build(seed) };
                run_agent(&mut Env::new(scenario), &mut doubled, seed, None, |_| ());
            }
        }
    }
}

#[test]
fn a_planner_that_would_go_on_for_ever_is_capped() {
    let scenario = Document::open("pasture").unwrap().scenario().unwrap();
    // JUMP gives up at ten boustrophedon paths; SNAKE after 40 passes without a newly mowed weed, 7 before that to the top.
    let bcp_length_m = Env::new(&scenario).site().bcp_length_m;
    for (name, longest_m) in [("jump", 10.0 * bcp_length_m + 200.0), ("snake", 48.0 * 200.0)] {
        let mut env = Env::new(&scenario);
        let mut agent = Haunted(name.parse::<AgentSpec>().unwrap().build(0));
        let outcome = run_agent(&mut env, &mut agent, 0, Some(&[]), |_| ());
        assert_eq!(outcome, Outcome::Capped, "{name}");
        let path_m = env.summary().path_length_m;
        assert!(path_m < longest_m, "{name}: {path_m} m");
    }
}

/// A Gymnasium step may be shorter than the agent's command: it is asked again, from wherever the mower then is.
#[test]
fn an_agent_whose_commands_are_cut_short_still_does_its_job() {
    for_every_agent(|name, agent, pasture, scenario| {
        let (whole, _) = run_watched(scenario, agent, 4, None, |_, decision| decision);
        let (cut, outcome) = run_watched(scenario, agent, 4, None, |_, decision| match decision {
            Decision::Drive(command) => {
                Decision::Drive(Command { distance_m: command.distance_m.min(PIECE_M), ..command })
            }
            other => other,
        });
        assert_eq!(outcome, Outcome::Done, "{name} on {pasture}");
        assert_eq!(cut.weeds_mowed, whole.weeds_mowed, "{name} on {pasture}");
        // Equal but for the rounding of many additions.
        let difference_m = (cut.path_length_m - whole.path_length_m).abs();
        assert!(difference_m < 1e-6, "{name} on {pasture}: {difference_m} m");
    });
}

#[test]
fn an_agent_can_be_used_again_after_reset() {
    for_every_agent(|name, spec, pasture, scenario| {
        let mut agent = spec.build(0);
        let mut run = |seed| {
            let mut env = Env::new(scenario);
            run_agent(&mut env, agent.as_mut(), seed, None, |_| ());
            env.summary()
        };
        let (first, _, again) = (run(1), run(2), run(1));
        assert_eq!(first, again, "{name} on {pasture}");
    });
}

#[test]
fn the_default_headland_is_wide_enough_for_every_planner() {
    let scenario = scenario("weeds.count = 80");
    for name in agents::quick() {
        for seed in 0..5 {
            let episode = run_episode(&scenario, &name.parse().unwrap(), seed, None);
            assert_eq!(episode.outcome, Outcome::Done, "{name}, seed {seed}");
        }
    }
}

/// Through `steer` a planner's path is followed, not driven: the tracker's margin on the bar has to make up for it.
#[test]
fn a_tracked_planner_mows_what_it_would_have_mowed_on_a_path_hardly_longer() {
    for_every_agent(|name, spec, pasture, scenario| {
        let (mut tracked_percent, mut native_percent) = (0.0, 0.0);
        let (mut tracked_m, mut native_m) = (0.0, 0.0);
        // Those that search, or weigh many places, take their time.
        let is_slow = ["horizon", "greedy", "learned"].iter().any(|slow| name.starts_with(slow));
        let seeds = if is_slow { 2 } else { 6 };
        for seed in 0..seeds {
            let mut env = Env::new(scenario);
            let outcome =
                run_agent(&mut env, spec.build_tracked(seed).as_mut(), seed, None, |_| ());
            assert_eq!(outcome, Outcome::Done, "{name} on {pasture}, seed {seed}");
            let percent = |summary: Summary| {
                100.0 * summary.weeds_mowed as f64 / (summary.weeds_total as f64).max(1.0)
            };
            let native = run_episode(scenario, spec, seed, None).summary;
            tracked_percent += percent(env.summary()) / seeds as f64;
            native_percent += percent(native) / seeds as f64;
            tracked_m += env.summary().path_length_m;
            native_m += native.path_length_m;
        }
        // The tracked path differs, so other weeds come into sight: a few points either way for planners that miss some.
        assert!(
            tracked_percent > native_percent - 6.0,
            "{name} on {pasture}: {tracked_percent} against {native_percent} %"
        );
        if matches!(name, "bcp" | "jump") {
            assert!(
                (tracked_percent - native_percent).abs() < 1e-9,
                "{name} on {pasture}: {tracked_percent} %"
            );
        }
        // A narrower deck takes more passes: one more of ten on a small pasture, so up to a seventh of the path.
        let longer_percent = 100.0 * (tracked_m / native_m - 1.0);
        let limit_percent = match name {
            "bcp" | "bcp:spacing=sensor" => 1.0,
            "bcp-tsp" | "react" => 3.0,
            // Who chooses among places may choose otherwise wherever the narrower deck leads to others.
            "greedy" | "learned" => 25.0,
            _ => 15.0,
        };
        assert!(longer_percent < limit_percent, "{name} on {pasture}: {longer_percent} % longer");
    });
}

/// The plan starts a hand's breadth beside the mower, since its deck is narrower: that is no reason for a loop.
#[test]
fn a_tracked_planner_sets_out_along_its_first_pass() {
    let scenario = Document::open("pasture").unwrap().scenario().unwrap();
    for name in ["bcp", "jump", "snake", "r-snake"] {
        let mut env = Env::new(&scenario);
        let mut agent = name.parse::<AgentSpec>().unwrap().build_tracked(0);
        env.reset_from(0, Beginning { weeds: Some(&[]), start: None });
        agent.reset(&env.view());
        while env.view().path_m < 20.0 {
            let Decision::Drive(command) = agent.act(&env.view()) else { panic!("{name} stops") };
            env.drive(command).unwrap();
            let pose = env.view().pose;
            assert!((0.8..=1.05).contains(&pose.y_m), "{name} is at {pose:?}");
        }
    }
}

/// Whoever is told the weeds is no agent that could act for a mower.
#[test]
fn the_yardstick_alone_is_told_the_weeds_and_acts_in_no_environment() {
    let told: Vec<&str> =
        AGENTS.iter().filter(|entry| !entry.is_online).map(|entry| entry.name).collect();
    assert_eq!(told, ["clairvoyant"]);
    for entry in AGENTS {
        let spec: AgentSpec = entry.name.parse().unwrap();
        assert_eq!(spec.is_online(), entry.is_online, "{}", entry.name);
        assert_eq!(spec.online().is_ok(), entry.is_online, "{}", entry.name);
    }
    let refused = "clairvoyant".parse::<AgentSpec>().unwrap().online().unwrap_err().to_string();
    assert_eq!(
        refused,
        "`agent` must be an online agent where it acts in an environment: it would have to be told where the weeds stand, \
         got `clairvoyant`"
    );
}

#[test]
fn the_yardstick_mows_every_weed_on_a_shorter_way_than_any_agent() {
    for (pasture, scenario) in pastures() {
        let spec: AgentSpec = "clairvoyant:iterations=500".parse().unwrap();
        for seed in 0..2 {
            let told = run_episode(&scenario, &spec, seed, None);
            assert_eq!(told.outcome, Outcome::Done, "{pasture}, seed {seed}");
            assert_eq!(
                told.summary.weeds_mowed, told.summary.weeds_total,
                "{pasture}, seed {seed}"
            );
            for name in agents::quick() {
                let other = run_episode(&scenario, &name.parse().unwrap(), seed, None).summary;
                assert!(
                    other.weeds_mowed < other.weeds_total
                        || told.summary.path_length_m <= other.path_length_m,
                    "{name} on {pasture}, seed {seed}"
                );
            }
        }
    }
}

#[test]
fn one_agent_has_one_label_however_its_options_are_written() {
    for (written, label) in [
        ("bcp", "bcp"),
        ("bcp:spacing=deck", "bcp"),
        ("bcp:spacing=sensor", "bcp:spacing=sensor"),
        ("jump", "jump"),
        ("greedy:detour_m=16", "greedy"),
        ("greedy:detour_m=8", "greedy:detour_m=8.0"),
        ("greedy:detour_m=inf", "greedy:detour_m=inf"),
        ("horizon:time_ms=inf", "horizon"),
        ("horizon:time_ms=5:iterations=300", "horizon:iterations=300:time_ms=5.0"),
        ("horizon:iterations=300:time_ms=5.0", "horizon:iterations=300:time_ms=5.0"),
        ("clairvoyant:iterations=10000", "clairvoyant"),
    ] {
        let spec: AgentSpec = written.parse().unwrap();
        assert_eq!(spec.to_string(), label, "{written}");
        assert_eq!(label.parse::<AgentSpec>().unwrap(), spec, "{written}");
    }
}

#[test]
fn an_unknown_agent_or_option_is_refused_by_name() {
    let refused = |text: &str| text.parse::<AgentSpec>().unwrap_err().to_string();
    let names: Vec<&str> = AGENTS.iter().map(|entry| entry.name).collect();
    assert_eq!(
        refused("snak"),
        format!("`agent` must be one of {}, got `snak`; did you mean `snake`?", names.join(", "))
    );
    assert_eq!(
        refused("bcp:spacin=sensor"),
        "`bcp.spacin` is not a known key; did you mean `bcp.spacing`?"
    );
    assert_eq!(refused("bcp:spacing=wide"), "`bcp.spacing` must be `deck` or `sensor`, got `wide`");
    assert_eq!(refused("jump:speed=2"), "`jump.speed` is not a known key");
    assert_eq!(
        refused("bcp:spacing"),
        "`agent` must be written `name` or `name:option=value`, got `bcp:spacing`"
    );
}
