//! The fairness line: what an agent sees depends on what was detected and on nothing else. Two truths that differ in
//! undetected weeds look the same, to the bit, from the first step to the last.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use proptest::prelude::*;
use swath_core::config::ObservationKind;
use swath_core::env::{Beginning, Env};
use swath_core::geometry::Point;
use swath_core::mirror::{News, Told};
use swath_core::observation::Observation;
use swath_tests::cases::cases;
use swath_tests::scene::{self, Scene};
use swath_tests::sight::{Sight, sight};

fn observation(env: &mut Env) -> Vec<u32> {
    let mut observation = env.observation_spec().rows(1);
    env.observe(observation.as_mut());
    let Observation { features, candidates, action_mask, maps } = observation;
    assert!(!features.is_empty() && !candidates.is_empty() && !maps.is_empty());
    let bits = features.iter().chain(&candidates).map(|value| value.to_bits());
    let mask = action_mask.iter().map(|&is_open| u32::from(is_open != 0));
    bits.chain(mask).chain(maps.iter().map(|&value| value.into())).collect()
}

/// Scenes whose observations show all that there is to show.
fn scenes() -> impl Strategy<Value = Scene> {
    scene::scenes().prop_map(|mut scene| {
        scene.scenario.observation.kind = ObservationKind::Dict;
        scene
    })
}

/// What an agent is shown at the start and after each command, here and elsewhere.
fn sights(scene: &Scene) -> Vec<(Sight, Vec<u32>, News)> {
    let mut env = scene.env();
    let mut told = Told::nothing(env.view().ground.grid());
    let mut shown = |env: &mut Env, is_whole: bool| {
        let mut news = News::default();
        told.news(&env.view(), is_whole, &mut news);
        (sight(&env.view()), observation(env), news)
    };
    let mut sights = vec![shown(&mut env, true)];
    for &command in &scene.drive {
        env.drive(command).unwrap();
        sights.push(shown(&mut env, false));
    }
    sights
}

/// The same scene with the weeds that it never detects taken away.
fn without_undetected(scene: &Scene) -> Scene {
    let env = scene.driven();
    let detected = env.weeds().is_detected();
    let weeds = scene.weeds.iter().zip(detected).filter(|(_, is)| **is).map(|(weed, _)| *weed);
    Scene { weeds: weeds.collect(), ..scene.clone() }
}

/// The same scene with weeds added that it does not detect, among the others at these places of the list.
fn with_undetected(scene: &Scene, added: &[(Point, prop::sample::Index)]) -> Scene {
    let strangers = Scene { weeds: added.iter().map(|(weed, _)| *weed).collect(), ..scene.clone() };
    let env = strangers.driven();
    let mut weeds = scene.weeds.clone();
    for ((weed, place), is_detected) in added.iter().zip(env.weeds().is_detected()) {
        if !is_detected {
            weeds.insert(place.index(weeds.len() + 1), *weed);
        }
    }
    Scene { weeds, ..scene.clone() }
}

/// A scene, and weeds to be added to it.
fn scenes_and_strangers() -> impl Strategy<Value = (Scene, Vec<(Point, prop::sample::Index)>)> {
    scenes().prop_flat_map(|scene| {
        let (length_m, width_m) = (scene.scenario.pasture.length_m, scene.scenario.pasture.width_m);
        let point = (0.0..=length_m, 0.0..=width_m).prop_map(|(x, y)| Point::new(x, y));
        let strangers = proptest::collection::vec((point, any::<prop::sample::Index>()), 1..80);
        (Just(scene), strangers)
    })
}

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn undetected_weeds_that_vanish_change_nothing_that_is_seen(scene in scenes()) {
        let fewer = without_undetected(&scene);
        prop_assert_eq!(sights(&scene), sights(&fewer));
    }

    #[test]
    fn undetected_weeds_that_appear_change_nothing_that_is_seen(
        (scene, strangers) in scenes_and_strangers(),
    ) {
        let more = with_undetected(&scene, &strangers);
        prop_assert_eq!(sights(&scene), sights(&more));
    }

    #[test]
    fn undetected_weeds_that_move_change_nothing_that_is_seen(
        (scene, strangers) in scenes_and_strangers(),
    ) {
        let moved = with_undetected(&without_undetected(&scene), &strangers);
        prop_assert_eq!(sights(&scene), sights(&moved));
    }

    /// Weeds are drawn cluster by cluster, so the order would tell which belong together.
    #[test]
    fn the_order_in_which_weeds_were_drawn_changes_nothing_that_is_seen(
        (scene, weeds) in scenes().prop_flat_map(|scene| {
            let weeds = Just(scene.weeds.clone()).prop_shuffle();
            (Just(scene), weeds)
        }),
    ) {
        let shuffled = Scene { weeds, ..scene.clone() };
        prop_assert_eq!(sights(&scene), sights(&shuffled));
    }

    /// The seed says where weeds stand, so it must not be seen either.
    #[test]
    fn the_seed_changes_nothing_that_is_seen(
        scene in scenes(), seed in any::<u64>(), other_seed in any::<u64>(),
    ) {
        let valid = scene.valid();
        let seen_with = |seed: u64, episode: u32| {
            let beginning = Beginning { weeds: Some(&scene.weeds), start: Some(scene.start) };
            let mut env = Env::new(&valid);
            env.reset_from(seed, beginning);
            for _ in 0..episode {
                env.reset_next(beginning);
            }
            for &command in &scene.drive {
                let _ = env.drive(command);
            }
            (sight(&env.view()), observation(&mut env))
        };
        prop_assert_eq!(seen_with(seed, 0), seen_with(other_seed, 3));
    }

    /// How many weeds there are, and how they are spread, is not public: it is in no number of the site.
    #[test]
    fn what_is_said_about_weeds_beforehand_changes_nothing_that_is_seen(
        scene in scenes(), count in 0..500_u32,
    ) {
        let mut told_otherwise = scene.clone();
        told_otherwise.scenario.weeds.count = count;
        told_otherwise.scenario.weeds.sigma_m = 1.5;
        told_otherwise.scenario.weeds.cluster_fraction = 0.7;
        prop_assert_eq!(sights(&scene), sights(&told_otherwise));
    }
}
