//! What is mowed, what is detected and what ground is seen depend on the path alone, not on the steps in which it is driven.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use std::collections::BTreeSet;

use proptest::prelude::*;
use swath_core::action::Command;
use swath_core::deck::Cut;
use swath_core::env::{Env, Watch};
use swath_core::episode::End;
use swath_core::geometry::Point;
use swath_core::grid::Grid;
use swath_core::sensor::Percept;
use swath_tests::cases::cases;
use swath_tests::scene::{Scene, scenes};

/// Poses and paths after up to 100 m in up to 400 pieces: each adds a rounding error of 1e-14 m.
const TOLERANCE_M: f64 = 1e-9;

/// Every command of a scene cut at these shares of its length.
fn cut(drive: &[Command], cuts: &[Vec<f64>]) -> Vec<Command> {
    let pieces = drive.iter().zip(cuts).flat_map(|(&command, shares)| {
        let mut ends: Vec<f64> = shares.iter().map(|share| share * command.distance_m).collect();
        ends.sort_by(f64::total_cmp);
        ends.push(command.distance_m);
        let begins = std::iter::once(0.0).chain(ends.clone());
        ends.clone()
            .into_iter()
            .zip(begins)
            .map(move |(end_m, begin_m)| Command { distance_m: end_m - begin_m, ..command })
            .collect::<Vec<_>>()
    });
    pieces.collect()
}

/// A scene, and the same with its drive cut at random places; some of them where the sensor looks.
fn scenes_cut_in_two_ways() -> impl Strategy<Value = (Scene, Scene)> {
    let cuts = proptest::collection::vec(proptest::collection::vec(0.0..=1.0, 0..40), 8);
    (scenes(), cuts).prop_map(|(scene, cuts)| {
        let drive = cut(&scene.drive, &cuts);
        (scene.clone(), Scene { drive, ..scene })
    })
}

fn unseen(env: &Env) -> Vec<(usize, usize)> {
    let view = env.view();
    let grid: &Grid = view.ground.grid();
    (0..grid.rows())
        .flat_map(|row| (0..grid.columns()).map(move |column| (column, row)))
        .filter(|&(column, row)| !view.ground.is_seen(column, row))
        .collect()
}

fn known(env: &Env) -> Vec<(u32, Point)> {
    env.view().known_weeds.iter().map(|weed| (weed.number, weed.position)).collect()
}

/// Hears which cells are seen for the first time.
#[derive(Default)]
struct Listener {
    seen: BTreeSet<(usize, usize)>,
}

impl Watch for Listener {
    fn on_cut(&mut self, _path_m: f64, cut: &Cut) {
        self.seen.extend(cut.seen.iter().map(|cell| (cell.column, cell.row)));
    }

    fn on_look(&mut self, _path_m: f64, percept: &Percept) {
        self.seen.extend(percept.seen.iter().map(|cell| (cell.column, cell.row)));
    }
}

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn a_drive_mows_detects_and_sees_the_same_however_it_is_cut(
        (whole, pieces) in scenes_cut_in_two_ways(),
    ) {
        let (whole, pieces) = (whole.driven(), pieces.driven());
        prop_assert_eq!(whole.weeds().is_mowed(), pieces.weeds().is_mowed());
        prop_assert_eq!(whole.weeds().is_detected(), pieces.weeds().is_detected());
        prop_assert_eq!(unseen(&whole), unseen(&pieces));
        prop_assert_eq!(known(&whole), known(&pieces));
    }

    #[test]
    fn a_drive_ends_at_the_same_place_however_it_is_cut(
        (whole, pieces) in scenes_cut_in_two_ways(),
    ) {
        let (whole, pieces) = (whole.driven(), pieces.driven());
        let (a, b) = (whole.view(), pieces.view());
        prop_assert!((a.path_m - b.path_m).abs() < TOLERANCE_M, "{} m, {} m", a.path_m, b.path_m);
        prop_assert!(a.pose.distance_to(&b.pose) < TOLERANCE_M, "{:?}, {:?}", a.pose, b.pose);
        let apart_rad = a.pose.heading_rad - b.pose.heading_rad;
        prop_assert!(apart_rad.sin().abs() < TOLERANCE_M && apart_rad.cos() > 0.0);
    }

    /// Near the border the looks decide, and where the mower leaves, what lies behind that look is not met any more.
    #[test]
    fn a_mower_leaves_the_headland_at_the_same_look_however_its_way_is_cut(
        (whole, pieces) in scenes_cut_in_two_ways(), headland_m in 0.0..3.0,
    ) {
        let driven = |scene: Scene| {
            let mut scene = scene;
            scene.scenario.pasture.headland_m = headland_m;
            let mut env = scene.env();
            let mut drive = scene.drive.iter();
            while env.end() == Some(End::Running)
                && let Some(&command) = drive.next()
            {
                env.drive(command).unwrap();
            }
            env
        };
        let (whole, pieces) = (driven(whole), driven(pieces));
        prop_assert_eq!(whole.end(), pieces.end());
        let (a, b) = (whole.view(), pieces.view());
        prop_assert!((a.path_m - b.path_m).abs() < TOLERANCE_M, "{} m, {} m", a.path_m, b.path_m);
        prop_assert_eq!(whole.weeds().is_mowed(), pieces.weeds().is_mowed());
        prop_assert_eq!(unseen(&whole), unseen(&pieces));
        prop_assert_eq!(known(&whole), known(&pieces));
    }

    /// A piece that brings ground alone is driven stretch by stretch for who listens, and at once for nobody.
    #[test]
    fn a_drive_leads_to_the_same_bytes_whoever_listens(scene in scenes(), headland_m in 0.0..3.0) {
        let mut scene = scene;
        scene.scenario.pasture.headland_m = headland_m;
        let (mut alone, mut heard, mut listener) = (scene.env(), scene.env(), Listener::default());
        let before = unseen(&alone).len();
        for &command in &scene.drive {
            if alone.end() == Some(End::Running) {
                let step = alone.drive(command).unwrap();
                prop_assert_eq!(heard.drive_watched(command, &mut listener).unwrap(), step);
                prop_assert_eq!(heard.snapshot(), alone.snapshot());
            }
        }
        prop_assert_eq!(listener.seen.len(), before - unseen(&alone).len());
    }

    /// Steps that end exactly where the sensor looks, or a whole number of them between two looks.
    #[test]
    fn the_length_of_a_control_period_changes_nothing(
        scene in scenes(), steps_per_look in 1..5_u32, looks_per_step in 1..8_u32,
    ) {
        let scene = Scene {
            drive: scene.drive.iter().map(|&command| Command { distance_m: 8.4, ..command }).collect(),
            ..scene
        };
        let in_steps_of = |step_m: f64| {
            let mut env = scene.env();
            for &command in &scene.drive {
                // The last step of each piece is whatever is left of its 8.4 m.
                let mut left_m = command.distance_m;
                while left_m > 1e-9 {
                    let distance_m = step_m.min(left_m);
                    env.drive(Command { distance_m, ..command }).unwrap();
                    left_m -= distance_m;
                }
            }
            env
        };
        let whole = scene.driven();
        for step_m in [0.2 / f64::from(steps_per_look), 0.2 * f64::from(looks_per_step)] {
            let steps = in_steps_of(step_m);
            prop_assert_eq!(whole.weeds().is_mowed(), steps.weeds().is_mowed(), "{} m", step_m);
            prop_assert_eq!(known(&whole), known(&steps), "{} m", step_m);
            prop_assert_eq!(unseen(&whole), unseen(&steps), "{} m", step_m);
        }
    }

    #[test]
    fn a_step_reports_the_way_and_the_weeds_of_that_step(scene in scenes()) {
        let mut env = scene.env();
        for &command in &scene.drive {
            let before = env.summary();
            let step = env.drive(command).unwrap();
            let after = env.summary();
            prop_assert!((step.distance_m - command.distance_m).abs() < TOLERANCE_M);
            prop_assert!((after.path_length_m - before.path_length_m - step.distance_m).abs() < TOLERANCE_M);
            prop_assert_eq!(after.weeds_mowed - before.weeds_mowed, step.weeds_mowed as usize);
        }
    }
}

/// A weed 12.1 m ahead of a triangle 12 m deep is first shown by the look at 0.2 m: not by a step that ends at 0.15 m, and
/// not before the mower has come to 0.2 m.
#[test]
fn the_sensor_looks_at_every_fifth_of_a_metre_and_not_where_steps_end() {
    let mut scenario = swath_core::config::Scenario::default();
    scenario.weeds.positions_m = Some(vec![[32.1, 20.0]]);
    scenario.mower.start = swath_core::config::Start::Pose([20.0, 20.0, 0.0]);
    let mut env = Env::new(&scenario.check().unwrap());
    env.reset(0);
    let mut drive = |distance_m: f64| {
        env.drive(Command { curvature_per_m: 0.0, distance_m }).unwrap();
        env.view().weeds_detected
    };
    assert_eq!(drive(0.15), 0);
    assert_eq!(drive(0.0), 0);
    assert_eq!(drive(0.04), 0);
    assert_eq!(drive(0.01), 1);
}
