//! A snapshot that is not what `snapshot` returned is refused by name, and the environment stays as it was.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use std::sync::{Arc, Mutex};

use proptest::prelude::*;
use swath_core::action::{Action, Command};
use swath_core::config::{Scenario, ValidScenario};
use swath_core::env::{Env, SnapshotError};
use swath_tests::cases::cases;
use swath_tests::watch::ends_within;

/// A pasture of 12 x 5 m with five weeds: its snapshots are short enough to try every byte.
fn small() -> ValidScenario {
    let mut scenario = Scenario::default();
    scenario.pasture.length_m = 12.0;
    scenario.pasture.width_m = 5.0;
    scenario.weeds.count = 5;
    scenario.sensor.range_m = 4.0;
    scenario.sensor.width_m = 4.0;
    scenario.check().unwrap()
}

/// After a drive that has detected and mowed some weeds and left others.
fn driven() -> Env {
    let mut env = Env::new(&small());
    env.reset(7);
    env.drive(Command { curvature_per_m: 0.1, distance_m: 5.5 }).unwrap();
    let summary = env.summary();
    assert!(summary.weeds_mowed > 0 && summary.weeds_detected < 5, "{summary:?}");
    assert!(!env.view().known_weeds.is_empty());
    env
}

/// The text of every refusal says what is wrong with which argument, in one line.
fn is_well_said(error: &SnapshotError) -> bool {
    let text = error.to_string();
    text.starts_with("`snapshot` must ") && text.contains(", got ") && !text.contains('\n')
}

/// Every snapshot that differs from `good` in one byte.
fn damaged_in_one_byte(good: &[u8]) -> impl Iterator<Item = (usize, u8, Vec<u8>)> {
    (0..good.len()).flat_map(move |place| {
        (1..=u8::MAX).map(move |flipped| {
            let mut bytes = good.to_vec();
            bytes[place] ^= flipped;
            (place, flipped, bytes)
        })
    })
}

#[test]
fn a_snapshot_with_any_byte_changed_is_refused() {
    let mut env = driven();
    let good = env.snapshot();
    let mut accepted = Vec::new();
    for (place, flipped, bytes) in damaged_in_one_byte(&good) {
        match env.restore(&bytes) {
            Ok(()) => {
                accepted.push((place, flipped));
                env.restore(&good).unwrap();
            }
            Err(error) => assert!(is_well_said(&error), "{error}"),
        }
        assert_eq!(env.snapshot(), good, "byte {place} flipped by {flipped:#04x}");
    }
    assert!(
        accepted.is_empty(),
        "{} of {} damaged snapshots were accepted, such as byte {} flipped by {:#04x}",
        accepted.len(),
        255 * good.len(),
        accepted[0].0,
        accepted[0].1
    );
}

/// Whatever is accepted, the environment can go on from there.
#[test]
fn no_snapshot_that_is_accepted_hangs_or_breaks_a_later_step() {
    let at = Arc::new(Mutex::new((0, 0)));
    let seen = Arc::clone(&at);
    let outcome = ends_within(20, move || {
        let good = driven().snapshot();
        let mut env = Env::new(&small());
        let mut observation = env.observation_spec().rows(1);
        let is_one_bit = |&(_, flipped, _): &(usize, u8, Vec<u8>)| flipped.is_power_of_two();
        for (place, flipped, bytes) in damaged_in_one_byte(&good).filter(is_one_bit) {
            *seen.lock().unwrap() = (place, flipped);
            if env.restore(&bytes).is_ok() {
                let _ = env.step(Action::Continuous(&[0.3]), observation.as_mut());
                let _ = env.drive(Command { curvature_per_m: -0.5, distance_m: 2.0 });
                let _ = env.summary();
                let again = env.snapshot();
                assert_eq!(env.restore(&again), Ok(()));
            }
        }
    });
    let (place, flipped) = *at.lock().unwrap();
    assert_eq!(outcome, Ok(()), "byte {place} flipped by {flipped:#04x}");
}

#[test]
fn a_snapshot_cut_short_at_any_place_is_refused() {
    let mut env = driven();
    let good = env.snapshot();
    for length in 0..good.len() {
        let error = env.restore(&good[..length]).unwrap_err();
        assert!(is_well_said(&error), "{error}");
        assert_eq!(env.snapshot(), good, "{length} bytes");
    }
}

#[test]
fn a_snapshot_with_anything_appended_is_refused() {
    let mut env = driven();
    let good = env.snapshot();
    for tail in [&[0][..], &[1, 2, 3], &good] {
        let error = env.restore(&[&good, tail].concat()).unwrap_err();
        assert!(is_well_said(&error), "{error}");
        assert_eq!(env.snapshot(), good);
    }
}

/// The version is the first number of a snapshot.
#[test]
fn a_snapshot_of_another_version_is_refused_by_its_number() {
    let mut env = driven();
    let good = env.snapshot();
    let mut newer = good.clone();
    newer[0] = good[0] + 1;
    let error = env.restore(&newer).unwrap_err();
    assert_eq!(error, SnapshotError::Version { got: u32::from(good[0]) + 1 });
    assert!(is_well_said(&error), "{error}");
    assert_eq!(env.snapshot(), good);
}

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn random_bytes_are_refused(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        let mut env = driven();
        let good = env.snapshot();
        let error = env.restore(&bytes).unwrap_err();
        prop_assert!(is_well_said(&error), "{error}");
        prop_assert_eq!(env.snapshot(), good);
    }

    /// The right version and the right scenario, and then anything.
    #[test]
    fn random_bytes_after_a_good_beginning_are_refused(
        kept in 33..80_usize, bytes in proptest::collection::vec(any::<u8>(), 0..400),
    ) {
        let mut env = driven();
        let good = env.snapshot();
        let damaged = [&good[..kept], &bytes[..]].concat();
        prop_assume!(damaged != good);
        let error = env.restore(&damaged).unwrap_err();
        prop_assert!(is_well_said(&error), "{error}");
        prop_assert_eq!(env.snapshot(), good);
    }

    #[test]
    fn a_snapshot_with_bytes_lost_doubled_or_swapped_is_refused(
        place in any::<prop::sample::Index>(), other in any::<prop::sample::Index>(), kind in 0..3,
    ) {
        let mut env = driven();
        let good = env.snapshot();
        let (place, other) = (place.index(good.len()), other.index(good.len()));
        let mut damaged = good.clone();
        match kind {
            0 => { damaged.remove(place); }
            1 => damaged.insert(place, good[other]),
            _ => damaged.swap(place, other),
        }
        prop_assume!(damaged != good);
        let error = env.restore(&damaged);
        prop_assert!(error.is_err(), "accepted");
        prop_assert!(is_well_said(&error.unwrap_err()));
        prop_assert_eq!(env.snapshot(), good);
    }
}
