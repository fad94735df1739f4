//! Same scenario and seed, same bytes; and what a seed draws does not depend on what else is drawn.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use std::collections::BTreeSet;

use proptest::prelude::*;
use swath_core::action::Action;
use swath_core::config::{Distribution, Scenario, ValidScenario};
use swath_core::env::{Beginning, Env};
use swath_core::geometry::Point;
use swath_core::rng::episode_seed;
use swath_tests::cases::cases;
use swath_tests::scene::scenarios;

fn play(env: &mut Env, tape: &[f32]) -> Vec<u32> {
    let mut observation = env.observation_spec().rows(1);
    env.observe(observation.as_mut());
    let mut seen: Vec<u32> = observation.features.iter().map(|value| value.to_bits()).collect();
    for &action in tape {
        let _ = env.step(Action::Continuous(&[action]), observation.as_mut());
        seen.extend(observation.features.iter().map(|value| value.to_bits()));
    }
    seen
}

fn tapes() -> impl Strategy<Value = Vec<f32>> {
    proptest::collection::vec(-1.0..=1.0_f32, 0..40)
}

fn weeds_of(scenario: &ValidScenario, seed: u64) -> Vec<Point> {
    let mut env = Env::new(scenario);
    env.reset(seed);
    env.weeds().positions().to_vec()
}

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn the_same_seed_and_actions_give_the_same_bytes(
        scenario in scenarios(), seed in any::<u64>(), tape in tapes(),
        (earlier_seed, earlier_tape) in (any::<u64>(), tapes()),
    ) {
        let scenario = scenario.check().unwrap();
        let mut first = Env::new(&scenario);
        first.reset(seed);
        let seen = play(&mut first, &tape);
        // The second one has lived before.
        let mut second = Env::new(&scenario);
        second.reset(earlier_seed);
        play(&mut second, &earlier_tape);
        second.reset(seed);
        prop_assert_eq!(play(&mut second, &tape), seen);
        prop_assert_eq!(second.snapshot(), first.snapshot());
        // The third one is a copy of the first in the middle of something.
        let mut third = first.clone();
        third.reset(seed);
        prop_assert_eq!(play(&mut third, &tape), play(&mut { first.reset(seed); first }, &tape));
    }

    #[test]
    fn episode_k_of_a_seed_is_episode_0_of_its_episode_seed(
        scenario in scenarios(), seed in any::<u64>(), k in 0..6_u64, tape in tapes(),
    ) {
        let scenario = scenario.check().unwrap();
        let (mut later, mut first) = (Env::new(&scenario), Env::new(&scenario));
        later.reset(seed);
        for _ in 0..k {
            play(&mut later, &tape);
            later.reset_next(Beginning::default());
        }
        first.reset(episode_seed(seed, k));
        prop_assert_eq!(later.weeds().positions(), first.weeds().positions());
        prop_assert_eq!(play(&mut later, &tape), play(&mut first, &tape));
        prop_assert_eq!(later.summary(), first.summary());
    }

    #[test]
    fn different_seeds_and_different_episodes_draw_different_weeds(
        scenario in scenarios(), seed in any::<u64>(), other in any::<u64>(), k in 1..1000_u64,
    ) {
        let mut scenario = scenario;
        scenario.weeds.count = scenario.weeds.count.max(1);
        let scenario = scenario.check().unwrap();
        prop_assert_eq!(episode_seed(seed, 0), seed);
        prop_assert_ne!(weeds_of(&scenario, seed), weeds_of(&scenario, episode_seed(seed, k)));
        if seed != other {
            prop_assert_ne!(weeds_of(&scenario, seed), weeds_of(&scenario, other));
        }
    }

    /// A sweep over the mower or its sensor meets the same weeds in every cell.
    #[test]
    fn weeds_do_not_depend_on_the_mower_its_sensor_or_what_an_agent_is_shown(
        scenario in scenarios(), other in scenarios(), seed in any::<u64>(),
    ) {
        let mut changed: Scenario = scenario.clone();
        changed.mower.turning_radius_m = other.mower.turning_radius_m;
        changed.mower.deck_width_m *= 0.5;
        changed.mower.speed_mps = 3.0;
        changed.sensor = other.sensor;
        changed.reward.weed = 7.0;
        changed.episode.budget = 0.25;
        changed.observation.rays = 3;
        changed.observation.nearest_weeds = 2;
        changed.pasture.headland_m = 1.0;
        prop_assert_eq!(
            weeds_of(&scenario.check().unwrap(), seed),
            weeds_of(&changed.check().unwrap(), seed)
        );
    }

    /// Evenly spread weeds are drawn one after the other, so a larger count only adds some.
    #[test]
    fn more_weeds_of_the_same_seed_begin_with_the_fewer(
        scenario in scenarios(), seed in any::<u64>(), more in 0..50_u32,
    ) {
        let mut scenario = scenario;
        scenario.weeds.distribution = Distribution::Uniform;
        let fewer = weeds_of(&scenario.clone().check().unwrap(), seed);
        scenario.weeds.count += more;
        let all = weeds_of(&scenario.check().unwrap(), seed);
        prop_assert_eq!(&all[..fewer.len()], &fewer[..]);
    }

    #[test]
    fn every_weed_stands_on_the_pasture_and_there_are_as_many_as_asked(
        scenario in scenarios(), seed in any::<u64>(), spread in 0.01..=1.0, seeds in 0.0..=1.0,
    ) {
        let mut scenario = scenario;
        let (length_m, width_m) = (scenario.pasture.length_m, scenario.pasture.width_m);
        scenario.weeds.sigma_m = spread * length_m.min(width_m);
        scenario.weeds.cluster_fraction = seeds;
        let weeds = weeds_of(&scenario.clone().check().unwrap(), seed);
        prop_assert_eq!(weeds.len(), scenario.weeds.count as usize);
        let is_on_it =
            |weed: &Point| (0.0..=length_m).contains(&weed.x) && (0.0..=width_m).contains(&weed.y);
        prop_assert!(weeds.iter().all(is_on_it));
    }
}

/// Rows of a batch are seeded s, s + 1, s + 2 ...; each goes through episodes of its own.
#[test]
fn the_episodes_of_neighbouring_seeds_are_all_different() {
    for first in [0, 1_000_000, u64::MAX - 99] {
        let seeds: BTreeSet<u64> =
            (0..100).flat_map(|row| (0..100).map(move |k| episode_seed(first + row, k))).collect();
        assert_eq!(seeds.len(), 10_000, "rows from {first}");
    }
}

#[test]
fn given_weeds_stand_where_they_were_given_in_that_order() {
    let mut scenario = Scenario::default();
    scenario.weeds.positions_m = Some(vec![[12.0, 3.5], [0.0, 0.0], [100.0, 40.0], [12.0, 3.5]]);
    let scenario = scenario.check().unwrap();
    for seed in [0, 1, u64::MAX] {
        let expected = [(12.0, 3.5), (0.0, 0.0), (100.0, 40.0), (12.0, 3.5)];
        assert_eq!(weeds_of(&scenario, seed), expected.map(|(x, y)| Point::new(x, y)));
    }
}
