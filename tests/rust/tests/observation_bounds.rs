//! Every observation has the length and lies within the bounds that its specification says, whatever the mower does.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use std::collections::BTreeSet;

use proptest::prelude::*;
use swath_core::action::{Action, Command};
use swath_core::config::{NamedStart, Scenario, Start};
use swath_core::env::{Beginning, Env};
use swath_core::observation::Observation;
use swath_tests::cases::cases;
use swath_tests::oracle::offsets;
use swath_tests::scene::scenarios;

/// Memory for one `features` observation of `numbers` numbers, none of them written yet.
fn filled(numbers: usize) -> Observation {
    Observation { features: vec![f32::NAN; numbers], ..Observation::default() }
}

fn is_within_bounds(env: &Env, observation: &[f32]) -> Result<(), String> {
    let spec = &env.observation_spec().parts()[0].bounds;
    if spec.len() != observation.len() {
        return Err(format!("{} numbers, not {}", observation.len(), spec.len()));
    }
    match spec.iter().zip(observation).find(|(f, value)| !(f.low..=f.high).contains(*value)) {
        Some((feature, value)) => Err(format!("{feature:?} is {value}")),
        None => Ok(()),
    }
}

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn every_observation_of_random_play_lies_within_its_bounds(
        scenario in scenarios(), seed in any::<u64>(),
        (nearest_weeds, rays) in (1..=64_usize, 1..=64_usize),
        (headland_m, budget) in (
            prop_oneof![Just(f64::INFINITY), Just(0.0), 0.0..40.0],
            prop_oneof![Just(f64::INFINITY), 0.01..1.0],
        ),
        steering in proptest::collection::vec(-1.3..1.3_f32, 1..60),
    ) {
        let mut scenario = scenario;
        scenario.observation.nearest_weeds = nearest_weeds;
        scenario.observation.rays = rays;
        scenario.pasture.headland_m = headland_m;
        scenario.episode.budget = budget;
        scenario.episode.control_period_s = 3.0;
        let mut env = Env::new(&scenario.check().unwrap());
        let mut observation = filled(7 + 3 * nearest_weeds + rays);
        env.reset(seed);
        env.observe(observation.as_mut());
        prop_assert_eq!(is_within_bounds(&env, &observation.features), Ok(()));
        for action in steering {
            observation.features.fill(f32::NAN);
            if env.step(Action::Continuous(&[action]), observation.as_mut()).is_err() {
                env.reset_next(Beginning::default());
                env.observe(observation.as_mut());
            }
            prop_assert_eq!(is_within_bounds(&env, &observation.features), Ok(()));
        }
    }

    /// The weeds listed are the nearest ones that are known, nearest first, as the mower sees them; zeros stand for none.
    #[test]
    #[expect(clippy::cast_possible_truncation, reason = "observations are float32 by contract")]
    fn the_weeds_that_are_listed_are_the_nearest_known_ones(
        scenario in scenarios(), seed in any::<u64>(), count in 0..400_u32,
        (nearest_weeds, range_m) in (1..=20_usize, 2.0..30.0),
        drive in proptest::collection::vec((-1.0..=1.0, 0.0..15.0), 1..6),
    ) {
        let mut scenario = scenario;
        scenario.weeds.count = count;
        scenario.sensor.range_m = range_m;
        scenario.observation.nearest_weeds = nearest_weeds;
        let scale_m = scenario.pasture.length_m + scenario.pasture.width_m;
        let radius_m = scenario.mower.turning_radius_m;
        let mut env = Env::new(&scenario.check().unwrap());
        env.lift_limits();
        env.reset(seed);
        for (share, distance_m) in drive {
            env.drive(Command { curvature_per_m: share / radius_m, distance_m }).unwrap();
        }
        let mut observation = filled(env.observation_spec().parts()[0].bounds.len());
        env.observe(observation.as_mut());
        let view = env.view();
        let mut offsets_m: Vec<(f64, f64)> =
            view.known_weeds.iter().map(|weed| offsets(view.pose, weed.position)).collect();
        offsets_m.sort_by(|a, b| a.0.hypot(a.1).total_cmp(&b.0.hypot(b.1)));
        let mut expected: Vec<f64> = offsets_m
            .iter()
            .take(nearest_weeds)
            .flat_map(|(ahead, left)| [ahead / scale_m, left / scale_m, 1.0])
            .map(|value| value.clamp(-1.0, 1.0))
            .collect();
        expected.resize(3 * nearest_weeds, 0.0);
        for (index, (found, expected)) in observation.features[7..].iter().zip(expected).enumerate() {
            prop_assert!((found - expected as f32).abs() < 1e-5, "{index}: {found}, not {expected}");
        }
        let known = view.known_weeds.len() as f64;
        let share = known / (known + nearest_weeds as f64);
        prop_assert!((observation.features[6] - share as f32).abs() < 1e-6);
    }

    /// Far outside the pasture, long after the budget: native runs have neither headland nor limits.
    #[test]
    fn observations_stay_within_bounds_without_limits(
        scenario in scenarios(), drive in proptest::collection::vec((-1.0..1.0, 0.0..3000.0), 1..5),
    ) {
        let radius_m = scenario.mower.turning_radius_m;
        let mut env = Env::new(&scenario.check().unwrap());
        env.lift_limits();
        env.reset(1);
        let mut observation = filled(env.observation_spec().parts()[0].bounds.len());
        for (share, distance_m) in drive {
            let curvature_per_m = 0.01 * share / radius_m;
            env.drive(Command { curvature_per_m, distance_m }).unwrap();
            env.observe(observation.as_mut());
            prop_assert_eq!(is_within_bounds(&env, &observation.features), Ok(()));
        }
    }
}

#[test]
fn a_default_observation_has_39_numbers_with_a_name_and_finite_bounds_each() {
    let env = Env::new(&Scenario::default().check().unwrap());
    let spec = &env.observation_spec().parts()[0].bounds;
    assert_eq!(spec.len(), 39);
    let names: BTreeSet<&str> = spec.iter().map(|feature| feature.name.as_str()).collect();
    assert_eq!(names.len(), 39);
    assert!(spec.iter().all(|f| f.low.is_finite() && f.high.is_finite() && f.low < f.high));
}

#[test]
fn an_observation_can_be_made_before_the_first_reset() {
    let mut env = Env::new(&Scenario::default().check().unwrap());
    let mut observation = filled(39);
    env.observe(observation.as_mut());
    assert_eq!(is_within_bounds(&env, &observation.features), Ok(()));
}

/// From the middle of the default pasture 3 m ahead, at (53, 20): the seen ground ends 12 m ahead with column 64, 2 m to the
/// left with row 21, and 3 m behind where the drive began. The weeds: 5 m ahead and 1 m to the left, 9 m ahead and 2 m to
/// the right, and one behind, which nobody has seen.
#[test]
#[expect(clippy::cast_possible_truncation, reason = "observations are float32 by contract")]
fn an_observation_worked_out_by_hand() {
    let mut scenario = Scenario::default();
    scenario.mower.start = Start::Named(NamedStart::Centre);
    scenario.weeds.positions_m = Some(vec![[62.0, 18.0], [58.0, 21.0], [30.0, 20.0]]);
    let mut env = Env::new(&scenario.check().unwrap());
    env.reset(0);
    env.drive(Command { curvature_per_m: 0.0, distance_m: 3.0 }).unwrap();
    let mut observation = filled(39);
    env.observe(observation.as_mut());
    let seen_fraction = env.summary().seen_fraction;
    for (index, expected) in [
        (0, 2.0 * (53.0 + 10.0) / 120.0 - 1.0),
        (1, 2.0 * (20.0 + 10.0) / 60.0 - 1.0),
        (2, 1.0),
        (3, 0.0),
        (4, 1.0 - 3.0 / 2229.236),
        (5, seen_fraction),
        (6, 2.0 / 10.0),
        (7, 5.0 / 140.0),
        (8, 1.0 / 140.0),
        (9, 1.0),
        (10, 9.0 / 140.0),
        (11, -2.0 / 140.0),
        (12, 1.0),
        (13, 0.0),
        (15, 0.0),
        (31, 12.0 / 48.0),
        (33, 2.0 / 48.0),
        (35, 3.0 / 48.0),
    ] {
        let value = observation.features[index];
        assert!(
            (value - expected as f32).abs() < 1e-6,
            "number {index} is {value}, not {expected}"
        );
    }
}
