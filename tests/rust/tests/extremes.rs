//! What a scenario accepts, an environment can play: whatever number stands in it, an episode begins, steps end, and
//! rewards and observations are numbers. A number with which that cannot be is for the check to refuse.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use swath_agents::runner::run_summary;
use swath_core::action::{Action, MAX_DISTANCE_M};
use swath_core::config::{ActionKind, Distribution, Scenario, Start, from_table};
use swath_core::env::Env;
use swath_core::episode::{End, Outcome};
use swath_core::observation::{Bound, Observation};
use swath_tests::cases::numbers;
use swath_tests::watch::ends_within;
use toml::{Table, Value};

/// Far longer than a few steps take, however small or large the numbers.
const PATIENCE_S: u64 = 3;
/// Powers of ten from the smallest normal number to the largest.
const POWERS: [i32; 12] = [-307, -100, -17, -9, -6, -3, 3, 6, 9, 17, 100, 307];

/// A few steps of an episode: what is wrong with one of them, if anything.
fn play(scenario: &Scenario) -> Result<(), String> {
    let Ok(scenario) = scenario.clone().check() else { return Ok(()) };
    let mut env = Env::new(&scenario);
    let spec = env.observation_spec().parts()[0].bounds.clone();
    let mut observation =
        Observation { features: vec![f32::NAN; spec.len()], ..Default::default() };
    let length = numbers(&env);
    env.reset(1);
    if !env.site().bcp_length_m.is_finite() {
        return Err(format!("a boustrophedon path of {} m", env.site().bcp_length_m));
    }
    for action in [[0.0, 1.0], [1.0, 1.0], [-1.0, 0.3], [0.5, -1.0]] {
        let step = env
            .step(Action::Continuous(&action[..length]), observation.as_mut())
            .map_err(|e| e.to_string())?;
        if !step.terms.total().is_finite() {
            return Err(format!("a reward of {:?}", step.terms));
        }
        let is_outside =
            |(feature, value): &(&Bound, &f32)| !(feature.low..=feature.high).contains(*value);
        if let Some((feature, value)) = spec.iter().zip(&observation.features).find(is_outside) {
            return Err(format!("{} observed as {value}", feature.name));
        }
        if step.end != End::Running {
            break;
        }
    }
    env.restore(&env.snapshot()).map_err(|error| error.to_string())
}

fn complaint(what: &str, scenario: Scenario) -> Option<String> {
    let outcome = ends_within(PATIENCE_S, move || play(&scenario)).and_then(|played| played);
    outcome.err().map(|error| format!("{what}: {error}"))
}

/// The default scenario with one number changed, and how that is written.
fn with(block: &str, key: &str, value: f64) -> (String, Scenario) {
    let keys = Table::from_iter([(key.to_owned(), Value::Float(value))]);
    let table = Table::from_iter([(block.to_owned(), Value::Table(keys))]);
    let scenario: Scenario = from_table(table, "").unwrap();
    (format!("{block}.{key} = {value:e}"), scenario)
}

#[test]
fn every_accepted_number_can_be_played() {
    let mut complaints = Vec::new();
    for (block, key) in [
        ("pasture", "headland_m"),
        ("weeds", "sigma_m"),
        ("weeds", "cluster_fraction"),
        ("mower", "turning_radius_m"),
        ("mower", "speed_mps"),
        ("mower", "deck_width_m"),
        ("sensor", "range_m"),
        ("sensor", "width_m"),
        ("episode", "control_period_s"),
        ("episode", "budget"),
        ("episode", "seen_goal"),
    ] {
        for power in POWERS {
            let (what, mut scenario) = with(block, key, 10.0_f64.powi(power));
            scenario.weeds.distribution = Distribution::Gaussian;
            scenario.action.kind = ActionKind::Drive;
            complaints.extend(complaint(&what, scenario));
        }
    }
    assert!(complaints.is_empty(), "{complaints:#?}");
}

/// From a square millimetre to the largest pasture, square or a strip.
#[test]
fn every_accepted_size_of_a_pasture_can_be_played() {
    let mut complaints = Vec::new();
    for (length_m, width_m) in [
        (1e-3, 1e-3),
        (1e-9, 1e-9),
        (1e-3, 100.0),
        (100.0, 1e-3),
        (8e3, 8e3),
        (8e6, 1.0),
        (1.0, 8e6),
    ] {
        let mut scenario = Scenario::default();
        scenario.pasture.length_m = length_m;
        scenario.pasture.width_m = width_m;
        scenario.mower.deck_width_m = length_m.min(width_m).min(2.0);
        complaints.extend(complaint(&format!("{length_m:e} x {width_m:e} m"), scenario));
    }
    assert!(complaints.is_empty(), "{complaints:#?}");
}

/// A strip takes as much room as the squares of 8 m by 8 m that its cells are kept in.
#[test]
fn a_strip_of_more_squares_than_the_largest_pasture_has_is_refused() {
    for (length_m, width_m) in [(8e6 + 1.0, 1.0), (1.0, 8e6 + 1.0), (8000.0, 8001.0)] {
        let mut scenario = Scenario::default();
        (scenario.pasture.length_m, scenario.pasture.width_m) = (length_m, width_m);
        scenario.mower.deck_width_m = 1.0;
        let line = scenario.check().unwrap_err().to_string();
        let expected = "`pasture.length_m x pasture.width_m` must be at most 64000000 m2";
        assert!(line.starts_with(expected), "{line}");
    }
}

/// A cluster much wider than a strip hardly ever hits the strip.
#[test]
fn every_accepted_spread_of_a_cluster_can_be_drawn() {
    let mut complaints = Vec::new();
    for (length_m, width_m) in [(100.0, 40.0), (1e4, 1.0), (1e6, 10.0), (8e6, 1.0), (1.0, 8e6)] {
        let (shorter_m, longer_m) = (f64::min(length_m, width_m), f64::max(length_m, width_m));
        for sigma_m in [1e-9, shorter_m, 10.0 * shorter_m, longer_m, length_m + width_m] {
            let mut scenario = Scenario::default();
            scenario.pasture.length_m = length_m;
            scenario.pasture.width_m = width_m;
            scenario.mower.deck_width_m = 1.0;
            scenario.weeds.count = 640;
            scenario.weeds.distribution = Distribution::Gaussian;
            scenario.weeds.sigma_m = sigma_m;
            let what = format!("sigma of {sigma_m:e} m on {length_m:e} x {width_m:e} m");
            complaints.extend(complaint(&what, scenario));
        }
    }
    assert!(complaints.is_empty(), "{complaints:#?}");
}

#[test]
fn every_accepted_start_can_be_played() {
    let mut complaints = Vec::new();
    for far in [1e6, 1e11, 1e15, 1e17, 1e300] {
        for start in [[far, 0.0, 0.0], [0.0, -far, 0.0], [1.0, 1.0, far], [far, far, -far]] {
            let mut scenario = Scenario::default();
            scenario.pasture.headland_m = f64::INFINITY;
            scenario.mower.start = Start::Pose(start);
            complaints.extend(complaint(&format!("start at {start:?}"), scenario));
        }
    }
    assert!(complaints.is_empty(), "{complaints:#?}");
}

/// The largest counts that a document may ask for.
#[test]
fn every_accepted_count_can_be_played() {
    let mut scenario = Scenario::default();
    scenario.weeds.count = 1_000_000;
    scenario.observation.nearest_weeds = 64;
    scenario.observation.rays = 64;
    assert_eq!(complaint("a million weeds", scenario), None);
}

/// Where one arc, or one pass, is longer than a command may be: the way is driven in several.
#[test]
fn planners_drive_ways_longer_than_a_command() {
    let mut wide_turns = Scenario::default();
    wide_turns.pasture.headland_m = f64::INFINITY;
    wide_turns.mower.turning_radius_m = 3.5e5;
    let mut long_passes = Scenario::default();
    (long_passes.pasture.length_m, long_passes.pasture.width_m) = (1.1 * MAX_DISTANCE_M, 2.0);
    for (scenario, agent) in [(&wide_turns, "jump"), (&long_passes, "bcp")] {
        let scenario = scenario.clone().check().unwrap();
        let (summary, outcome) = run_summary(&scenario, &agent.parse().unwrap(), 3);
        assert!(summary.path_length_m > MAX_DISTANCE_M, "{agent}: {summary:?}");
        assert_eq!((outcome, summary.weeds_mowed), (Outcome::Done, summary.weeds_total), "{agent}");
    }
}
