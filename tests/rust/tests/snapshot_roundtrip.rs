//! A restored environment goes on byte for byte as the first one would have: here, in a copy and in a fresh environment.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use proptest::prelude::*;
use swath_core::action::{Action, ActionError, Command};
use swath_core::config::{ActionKind, Scenario, ValidScenario};
use swath_core::env::{Beginning, Env, SnapshotError, Step};
use swath_core::geometry::{Point, Pose};
use swath_tests::cases::{cases, numbers};
use swath_tests::scene::scenarios;

/// What a step gave back, bit for bit: terms, weeds, way, and the observation.
type Trace = Vec<(Result<Step, ActionError>, Vec<u32>)>;

/// Plays actions until they are used up, also past the end of the episode.
fn play(env: &mut Env, actions: &[[f32; 2]]) -> Trace {
    let length = numbers(env);
    let mut observation = env.observation_spec().rows(1);
    actions
        .iter()
        .map(|action| {
            let step = env.step(Action::Continuous(&action[..length]), observation.as_mut());
            (step, observation.features.iter().map(|value| value.to_bits()).collect())
        })
        .collect()
}

fn tapes() -> impl Strategy<Value = Vec<[f32; 2]>> {
    proptest::collection::vec([-1.2..1.2_f32, -0.5..1.0_f32], 0..60)
}

/// Scenarios with every limit in place, of both action kinds.
fn limited_scenarios() -> impl Strategy<Value = ValidScenario> {
    (scenarios(), any::<bool>(), 0.05..1.5, 0.1..4.0, 0.2..=1.0, 0.0..20.0).prop_map(
        |(mut scenario, is_drive, budget, control_period_s, seen_goal, headland_m)| {
            scenario.action.kind = if is_drive { ActionKind::Drive } else { ActionKind::Steer };
            scenario.pasture.headland_m = headland_m;
            scenario.episode.budget = budget;
            scenario.episode.control_period_s = control_period_s;
            scenario.episode.seen_goal = seen_goal;
            scenario.check().unwrap()
        },
    )
}

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn a_restored_environment_goes_on_as_the_first_one(
        scenario in limited_scenarios(), seed in any::<u64>(),
        (before, after) in (tapes(), tapes()), other_seed in any::<u64>(),
    ) {
        let mut env = Env::new(&scenario);
        env.reset(seed);
        play(&mut env, &before);
        let snapshot = env.snapshot();
        let first = play(&mut env, &after);
        let end = env.snapshot();

        // Back in the same environment, which has gone on meanwhile.
        env.restore(&snapshot).unwrap();
        prop_assert_eq!(&env.snapshot(), &snapshot);
        prop_assert_eq!(&play(&mut env, &after), &first);
        prop_assert_eq!(&env.snapshot(), &end);

        // In a fresh one, and in one in the middle of another episode.
        let mut fresh = Env::new(&scenario);
        let mut busy = Env::new(&scenario);
        busy.reset(other_seed);
        play(&mut busy, &before);
        for mut other in [fresh.clone(), busy] {
            other.restore(&snapshot).unwrap();
            prop_assert_eq!(&play(&mut other, &after), &first);
            prop_assert_eq!(&other.snapshot(), &end);
            prop_assert_eq!(other.summary(), env.summary());
        }
        fresh.restore(&end).unwrap();
        prop_assert_eq!(fresh.end(), env.end());
    }

    #[test]
    fn the_next_episode_after_a_restore_is_the_next_episode(
        scenario in limited_scenarios(), seed in any::<u64>(), tape in tapes(), episodes in 0..4,
    ) {
        let mut env = Env::new(&scenario);
        env.reset(seed);
        for _ in 0..episodes {
            env.reset_next(Beginning::default());
        }
        let snapshot = env.snapshot();
        env.reset_next(Beginning::default());
        let next = play(&mut env, &tape);
        let mut fresh = Env::new(&scenario);
        fresh.restore(&snapshot).unwrap();
        fresh.reset_next(Beginning::default());
        prop_assert_eq!(play(&mut fresh, &tape), next);
        prop_assert_eq!(fresh.snapshot(), env.snapshot());
    }

    #[test]
    fn taking_a_snapshot_changes_nothing(
        scenario in limited_scenarios(), seed in any::<u64>(), tape in tapes(),
    ) {
        let (mut quiet, mut watched) = (Env::new(&scenario), Env::new(&scenario));
        quiet.reset(seed);
        watched.reset(seed);
        for action in &tape {
            let _ = watched.snapshot();
            prop_assert_eq!(play(&mut watched, &[*action]), play(&mut quiet, &[*action]));
        }
        prop_assert_eq!(watched.snapshot(), quiet.snapshot());
    }

    /// Weeds and start pose that the caller gave are part of the state.
    #[test]
    fn a_beginning_of_the_callers_is_restored_too(
        scenario in limited_scenarios(), tape in tapes(),
        (x, y, heading_rad) in (0.0..1.0, 0.0..1.0, -3.0..3.0),
        weeds in proptest::collection::vec((0.0..=1.0, 0.0..=1.0), 0..40),
    ) {
        let (length_m, width_m) = (scenario.pasture.length_m, scenario.pasture.width_m);
        let weeds: Vec<Point> =
            weeds.iter().map(|(x, y)| Point::new(x * length_m, y * width_m)).collect();
        let start = Pose::new(x * length_m, y * width_m, heading_rad);
        let mut env = Env::new(&scenario);
        env.reset_from(0, Beginning { weeds: Some(&weeds), start: Some(start) });
        let mut fresh = Env::new(&scenario);
        fresh.restore(&env.snapshot()).unwrap();
        prop_assert_eq!(fresh.weeds().positions(), &weeds[..]);
        prop_assert_eq!(fresh.view().pose, start);
        prop_assert_eq!(play(&mut fresh, &tape), play(&mut env, &tape));
    }
}

#[test]
fn before_the_first_reset_there_is_a_state_too() {
    let scenario = Scenario::default().check().unwrap();
    let snapshot = Env::new(&scenario).snapshot();
    let mut env = Env::new(&scenario);
    env.reset(5);
    env.restore(&snapshot).unwrap();
    assert_eq!(env.end(), None);
    let mut observation = env.observation_spec().rows(1);
    assert_eq!(
        env.step(Action::Continuous(&[0.0]), observation.as_mut()),
        Err(ActionError::NotReset)
    );
}

/// A scenario is another one as soon as a single number differs, and the same one however it was written.
#[test]
fn a_snapshot_of_another_scenario_is_refused_by_name() {
    let scenario = Scenario::default();
    let mut env = Env::new(&scenario.clone().check().unwrap());
    env.reset(3);
    let snapshot = env.snapshot();
    let mut same = Env::new(&Scenario::default().check().unwrap());
    assert_eq!(same.restore(&snapshot), Ok(()));

    let changes: [fn(&mut Scenario); 6] = [
        |s| s.mower.speed_mps = 1.5,
        |s| s.pasture.headland_m = f64::INFINITY,
        |s| s.weeds.count = 41,
        |s| s.reward.path_per_m = 0.5,
        |s| s.observation.rays = 9,
        |s| s.action.kind = ActionKind::Drive,
    ];
    for change in changes {
        let mut other = scenario.clone();
        change(&mut other);
        let mut env = Env::new(&other.check().unwrap());
        env.reset(3);
        let before = env.snapshot();
        let error = env.restore(&snapshot).unwrap_err();
        assert_eq!(error, SnapshotError::Scenario);
        assert_eq!(
            error.to_string(),
            "`snapshot` must come from an environment of the same scenario, got another scenario's"
        );
        assert_eq!(env.snapshot(), before);
    }
}

#[test]
fn a_mower_that_has_turned_thousands_of_times_can_be_restored() {
    let mut scenario = Scenario::default();
    scenario.mower.turning_radius_m = 0.1;
    scenario.pasture.headland_m = f64::INFINITY;
    scenario.episode.budget = f64::INFINITY;
    let mut env = Env::new(&scenario.check().unwrap());
    env.reset(1);
    env.drive(Command { curvature_per_m: 10.0, distance_m: 5000.0 }).unwrap();
    let snapshot = env.snapshot();
    env.restore(&snapshot).unwrap();
    assert_eq!(env.snapshot(), snapshot);
}
