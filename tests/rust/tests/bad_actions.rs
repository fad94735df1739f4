//! A bad action is refused by name and leaves everything as it was; one that is merely too large is clipped, and said so.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use proptest::prelude::*;
use swath_core::action::{Action, ActionError, Command, Order};
use swath_core::config::{ActionKind, Scenario};
use swath_core::env::Env;
use swath_core::episode::{End, Outcome};
use swath_tests::cases::{cases, numbers};

fn env_of(kind: ActionKind) -> Env {
    let mut scenario = Scenario::default();
    scenario.action.kind = kind;
    Env::new(&scenario.check().unwrap())
}

/// A few metres into an episode.
fn running(kind: ActionKind) -> Env {
    let mut env = env_of(kind);
    env.reset(4);
    env.drive(Command { curvature_per_m: 0.2, distance_m: 7.3 }).unwrap();
    env
}

/// Tries a step that is refused: the state and the observation buffer must be as they were.
fn refused(env: &mut Env, action: &[f32]) -> ActionError {
    let before = env.snapshot();
    let mut untouched = env.observation_spec().rows(1);
    untouched.features.fill(-7.0);
    let mut observation = untouched.clone();
    let error = env.step(Action::Continuous(action), observation.as_mut()).unwrap_err();
    assert_eq!(env.snapshot(), before, "{action:?} changed the state");
    assert_eq!(observation, untouched, "{action:?} wrote an observation");
    error
}

#[test]
fn numbers_that_are_none_are_refused_by_their_place() {
    let (mut steer, mut drive) = (running(ActionKind::Steer), running(ActionKind::Drive));
    for (value, got) in [(f32::NAN, "NaN"), (f32::INFINITY, "inf"), (f32::NEG_INFINITY, "-inf")] {
        assert_eq!(
            refused(&mut steer, &[value]).to_string(),
            format!("`action[0]` must be finite, got {got}")
        );
        assert_eq!(
            refused(&mut drive, &[value, 0.0]).to_string(),
            format!("`action[0]` must be finite, got {got}")
        );
        assert_eq!(
            refused(&mut drive, &[0.0, value]).to_string(),
            format!("`action[1]` must be finite, got {got}")
        );
    }
}

#[test]
fn too_few_or_too_many_numbers_are_refused_by_their_count() {
    let (steer, drive) = (ActionKind::Steer, ActionKind::Drive);
    for (kind, action, text) in [
        (steer, &[][..], "`action` must have 1 value(s), got 0"),
        (steer, &[0.0, 0.0], "`action` must have 1 value(s), got 2"),
        (drive, &[0.0], "`action` must have 2 value(s), got 1"),
        (drive, &[0.0; 3], "`action` must have 2 value(s), got 3"),
        // The count is looked at first.
        (steer, &[f32::NAN, 0.0], "`action` must have 1 value(s), got 2"),
    ] {
        assert_eq!(refused(&mut running(kind), action).to_string(), text);
    }
}

#[test]
fn commands_that_the_mower_cannot_drive_are_refused_by_field() {
    let mut env = running(ActionKind::Steer);
    let before = env.snapshot();
    for (curvature_per_m, distance_m, text) in [
        (0.501, 1.0, "`curvature_per_m` must be within -1/R and 1/R, got 0.501"),
        (-0.6, 1.0, "`curvature_per_m` must be within -1/R and 1/R, got -0.6"),
        (f64::NAN, 1.0, "`curvature_per_m` must be within -1/R and 1/R, got NaN"),
        (f64::INFINITY, 1.0, "`curvature_per_m` must be within -1/R and 1/R, got inf"),
        (0.5, -1e-9, "`distance_m` must be from 0 to 1000000 m, got -0.000000001"),
        (0.5, f64::NAN, "`distance_m` must be from 0 to 1000000 m, got NaN"),
        (0.5, f64::INFINITY, "`distance_m` must be from 0 to 1000000 m, got inf"),
    ] {
        let error = env.drive(Command { curvature_per_m, distance_m }).unwrap_err();
        assert_eq!(error.to_string(), text);
        assert_eq!(env.snapshot(), before);
    }
    // 1/R as a planner computes it, with its rounding, is drivable.
    for curvature_per_m in [0.5, -0.5, 0.5 * (1.0 + 1e-12)] {
        assert!(env.drive(Command { curvature_per_m, distance_m: 0.1 }).is_ok());
    }
}

#[test]
fn a_step_before_the_first_reset_is_refused_by_name() {
    let mut env = env_of(ActionKind::Steer);
    let error = refused(&mut env, &[0.0]);
    assert_eq!(error, ActionError::NotReset);
    assert_eq!(error.to_string(), "`reset` must come before the first step");
    let drive = env.drive(Command { curvature_per_m: 0.0, distance_m: 1.0 });
    assert_eq!(drive, Err(ActionError::NotReset));
    assert_eq!(env.end(), None);
}

#[test]
fn a_step_after_the_end_is_refused_by_name_until_the_next_reset() {
    let mut env = running(ActionKind::Steer);
    let step = env.drive(Command { curvature_per_m: 0.0, distance_m: 500.0 }).unwrap();
    assert_eq!(step.end, End::Terminated(Outcome::LeftHeadland));
    let error = refused(&mut env, &[0.0]);
    assert_eq!(error, ActionError::EpisodeOver);
    assert_eq!(error.to_string(), "`reset` must come before the next step: the episode has ended");
    assert_eq!(env.end(), Some(step.end));
    env.reset(5);
    assert_eq!(env.end(), Some(End::Running));
    assert!(env.drive(Command { curvature_per_m: 0.0, distance_m: 1.0 }).is_ok());
}

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn an_action_outside_its_range_is_clipped_and_reported(
        values in [prop_oneof![-1.5..1.5_f32, any::<f32>()], prop_oneof![-1.5..1.5_f32, any::<f32>()]],
        is_drive in any::<bool>(),
    ) {
        let kind = if is_drive { ActionKind::Drive } else { ActionKind::Steer };
        let action = &values[..if is_drive { 2 } else { 1 }];
        prop_assume!(action.iter().all(|value| value.is_finite()));
        let clipped: Vec<f32> = action.iter().map(|value| value.clamp(-1.0, 1.0)).collect();
        let (mut env, mut other) = (running(kind), running(kind));
        let mut observation = env.observation_spec().rows(1);
        let step = env.step(Action::Continuous(action), observation.as_mut()).unwrap();
        let expected = other.step(Action::Continuous(&clipped), observation.as_mut()).unwrap();
        prop_assert_eq!(step.is_clipped, action.iter().any(|value| value.abs() > 1.0));
        prop_assert!(!expected.is_clipped);
        prop_assert_eq!(env.snapshot(), other.snapshot());
        prop_assert_eq!(step.terms, expected.terms);
    }

    /// `steer` drives one control period, `drive` the share (a + 1) / 2 of it; the first number is the share of 1/R.
    #[test]
    fn an_action_is_the_command_that_it_stands_for(
        values in [-1.0..=1.0_f32, -1.0..=1.0_f32],
        (radius_m, speed_mps, control_period_s) in (0.5..5.0, 0.2..3.0, 0.1..4.0),
    ) {
        for kind in [ActionKind::Steer, ActionKind::Drive] {
            let mut scenario = Scenario::default();
            scenario.action.kind = kind;
            scenario.mower.turning_radius_m = radius_m;
            scenario.mower.speed_mps = speed_mps;
            scenario.episode.control_period_s = control_period_s;
            let env = Env::new(&scenario.check().unwrap());
            let action = &values[..numbers(&env)];
            let (order, _) = env.decoder().decode(Action::Continuous(action)).unwrap();
            let Order::Drive(command) = order else { panic!("{order:?}") };
            let share = if kind == ActionKind::Steer { 1.0 } else { 0.5 * (f64::from(values[1]) + 1.0) };
            let distance_m = share * speed_mps * control_period_s;
            prop_assert!((command.curvature_per_m - f64::from(values[0]) / radius_m).abs() < 1e-12);
            prop_assert!((command.distance_m - distance_m).abs() < 1e-12);
            // And back: float32 carries seven digits.
            let back = env.decoder().encode(command).unwrap();
            prop_assert_eq!(back.len(), action.len());
            prop_assert!(back.iter().zip(action).all(|(b, a)| (b - a).abs() < 1e-6), "{back:?}");
        }
    }

    /// Commands longer than a control period, or sharper than the mower can turn, become the nearest action.
    #[test]
    fn every_command_becomes_an_action_in_range(
        curvature_per_m in -2.0..2.0, distance_m in 0.0..50.0, is_drive in any::<bool>(),
    ) {
        let env = env_of(if is_drive { ActionKind::Drive } else { ActionKind::Steer });
        let action = env.decoder().encode(Command { curvature_per_m, distance_m }).unwrap();
        prop_assert_eq!(action.len(), numbers(&env));
        prop_assert!(action.iter().all(|value| (-1.0..=1.0).contains(value)), "{action:?}");
    }
}
