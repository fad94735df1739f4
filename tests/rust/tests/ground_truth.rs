//! A whole drive against the rules of the problem: which weeds it mows, which it detects and in what order, which ground it
//! sees, each found by going through everything there is.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::sync::Arc;

use proptest::prelude::*;
use swath_core::action::Command;
use swath_core::config::{Scenario, Start};
use swath_core::env::Env;
use swath_core::geometry::Point;
use swath_core::grid::Grid;
use swath_core::ground::SeenGround;
use swath_tests::cases::cases;
use swath_tests::oracle::{BAND_M, Course, Fate};
use swath_tests::scene::{Scene, scenes};

fn course_of(scene: &Scene) -> Course {
    Course::new(scene.start, &scene.drive, &scene.scenario.mower, &scene.scenario.sensor)
}

/// What the drive does to every weed.
fn fates_of(scene: &Scene) -> Vec<Fate> {
    let course = course_of(scene);
    scene.weeds.iter().map(|&weed| course.fate(weed)).collect()
}

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn a_drive_mows_every_weed_that_the_bar_passes_over_and_no_other(scene in scenes()) {
        let env = scene.driven();
        let fates = fates_of(&scene);
        for (number, fate) in fates.iter().enumerate().filter(|(_, fate)| !fate.is_close) {
            let is_mowed = env.weeds().is_mowed()[number];
            prop_assert_eq!(is_mowed, fate.swept_m.is_some(), "{} {:?}", scene.weeds[number], fate);
        }
        prop_assert!(fates.iter().filter(|fate| fate.is_close).count() < 4, "too close to borders");
    }

    #[test]
    fn a_drive_detects_every_weed_that_a_look_shows_before_it_is_mowed_and_no_other(
        scene in scenes(),
    ) {
        let env = scene.driven();
        let fates = fates_of(&scene);
        for (number, fate) in fates.iter().enumerate().filter(|(_, fate)| !fate.is_close_call()) {
            let is_detected = env.weeds().is_detected()[number];
            prop_assert_eq!(is_detected, fate.is_detected(), "{} {:?}", scene.weeds[number], fate);
        }
    }

    /// A cell is seen when its centre was in the triangle at a look, or under the bar.
    #[test]
    fn a_drive_sees_every_cell_whose_centre_was_shown_or_swept_and_no_other(scene in scenes()) {
        let (env, course) = (scene.driven(), course_of(&scene));
        let view = env.view();
        let grid = view.ground.grid();
        let (mut least, mut most) = (0, 0);
        for row in 0..grid.rows() {
            for column in 0..grid.columns() {
                let fate = course.fate(grid.centre(column, row));
                let is_surely_seen = fate.shown_m.is_some() || fate.swept_m.is_some();
                least += usize::from(is_surely_seen);
                most += usize::from(is_surely_seen || fate.is_close);
                if is_surely_seen || !fate.is_close {
                    let is_seen = view.ground.is_seen(column, row);
                    prop_assert_eq!(is_seen, is_surely_seen, "{}, {} {:?}", column, row, fate);
                }
            }
        }
        let seen = grid.cells() - view.ground.unseen_count();
        prop_assert!((least..=most).contains(&seen), "{seen} cells, not {least} to {most}");
        let fraction = seen as f64 / grid.cells() as f64;
        prop_assert!((view.ground.fraction() - fraction).abs() < 1e-12);
    }

    /// Known weeds are those detected and not mowed, by the look that showed them first, weeds of one look by their number.
    #[test]
    fn known_weeds_are_those_detected_and_not_mowed_in_the_order_of_detection(scene in scenes()) {
        let env = scene.driven();
        let fates = fates_of(&scene);
        prop_assume!(!fates.iter().any(Fate::is_close_call));
        let mut detected: Vec<usize> =
            (0..fates.len()).filter(|&number| fates[number].is_detected()).collect();
        // Weeds of one look are sorted by where they stand.
        let order = |weed: usize| {
            (fates[weed].shown_m.unwrap(), scene.weeds[weed].x, scene.weeds[weed].y)
        };
        detected.sort_by(|&a, &b| order(a).partial_cmp(&order(b)).unwrap());
        let expected: Vec<(u32, Point)> = (0..)
            .zip(&detected)
            .filter(|&(_, &weed)| fates[weed].swept_m.is_none())
            .map(|(number, &weed)| (number, scene.weeds[weed]))
            .collect();
        let view = env.view();
        let known: Vec<(u32, Point)> =
            view.known_weeds.iter().map(|weed| (weed.number, weed.position)).collect();
        prop_assert_eq!(known, expected);
        prop_assert_eq!(view.weeds_detected as usize, detected.len());
    }

    /// A ray ends where it first meets an unseen cell, wherever it starts; beside the pasture there is nothing to see.
    #[test]
    fn the_range_to_unseen_ground_is_where_the_first_unseen_cell_is_entered(
        scene in scenes(), beside in (-30.0..30.0, -30.0..30.0),
        bearing_rad in prop_oneof![(-4..4_i32).prop_map(|q| f64::from(q) * FRAC_PI_2), -7.0..7.0],
        cap_m in 0.5..90.0,
    ) {
        let env = scene.driven();
        let ground = env.view().ground;
        let grid = ground.grid();
        let end = env.view().pose.position();
        // On the nearest corner of cells, and of tiles of 8 by 8 cells, too.
        let corner = |cells: f64| {
            let (side_x_m, side_y_m) = grid.cell_m();
            let nearest = |at_m: f64, side_m: f64| (at_m / side_m).round() * side_m;
            Point::new(nearest(end.x, cells * side_x_m), nearest(end.y, cells * side_y_m))
        };
        let elsewhere = Point::new(end.x + beside.0, end.y + beside.1);
        let of_tile = corner(8.0);
        let origins = [
            end,
            elsewhere,
            corner(1.0),
            of_tile,
            Point::new(of_tile.x, end.y),
            Point::new(end.x, of_tile.y),
        ];
        for origin in origins {
            let (sin, cos) = bearing_rad.sin_cos();
            // Each unseen cell as a box, grown or shrunk by a hair, since a ray along a border may take either side.
            let expected_m = |grown_m: f64| {
                let (side_x_m, side_y_m) = grid.cell_m();
                let cells = (0..grid.rows()).flat_map(|r| (0..grid.columns()).map(move |c| (c, r)));
                let unseen = cells.filter(|&(column, row)| !ground.is_seen(column, row));
                let entries = unseen.filter_map(|(column, row)| {
                    let centre = grid.centre(column, row);
                    let strip = |from: f64, slope: f64, middle: f64, side_m: f64| {
                        let half_m = 0.5 * side_m + grown_m;
                        let (a, b) = (middle - half_m - from, middle + half_m - from);
                        if slope.abs() < 1e-15 {
                            let is_in = a <= 0.0 && b >= 0.0;
                            return if is_in { (0.0, f64::INFINITY) } else { (1.0, 0.0) };
                        }
                        ((a / slope).min(b / slope), (a / slope).max(b / slope))
                    };
                    let x = strip(origin.x, cos, centre.x, side_x_m);
                    let y = strip(origin.y, sin, centre.y, side_y_m);
                    let (enter_m, leave_m) = (x.0.max(y.0).max(0.0), x.1.min(y.1));
                    (enter_m <= leave_m).then_some(enter_m)
                });
                entries.fold(cap_m, f64::min)
            };
            let (lowest_m, highest_m) = (expected_m(1e-9), expected_m(-1e-9));
            // The same direction, from the heading and from another one.
            let turned = (0.8 * cos + 0.6 * sin, 0.8 * sin - 0.6 * cos);
            let mut ranges_m = Vec::new();
            for (heading, direction) in [((cos, sin), (1.0, 0.0)), ((0.8, 0.6), turned)] {
                ground.ranges_to_unseen(origin, heading, &[direction], cap_m, |range_m| {
                    ranges_m.push(range_m);
                });
            }
            prop_assert_eq!(ranges_m.len(), 2);
            for range_m in ranges_m {
                let is_right = lowest_m - 1e-6 <= range_m && range_m <= highest_m + 1e-6;
                prop_assert!(is_right, "{range_m} m, not {lowest_m} to {highest_m} m");
            }
        }
    }

    #[test]
    fn what_is_mowed_stays_mowed_and_what_is_seen_stays_seen(scene in scenes()) {
        let mut env = scene.env();
        let mut before = (env.summary(), env.weeds().clone());
        for &command in &scene.drive {
            env.drive(command).unwrap();
            let after = (env.summary(), env.weeds().clone());
            prop_assert!(after.0.seen_fraction >= before.0.seen_fraction);
            prop_assert!(after.0.path_length_m >= before.0.path_length_m);
            let is_kept = |now: &[bool], then: &[bool]| now.iter().zip(then).all(|(now, then)| *now || !then);
            prop_assert!(is_kept(after.1.is_mowed(), before.1.is_mowed()));
            prop_assert!(is_kept(after.1.is_detected(), before.1.is_detected()));
            prop_assert_eq!(after.1.positions(), before.1.positions());
            before = after;
        }
    }

    #[test]
    fn the_summary_counts_what_the_truth_says(scene in scenes()) {
        let env = scene.driven();
        let (summary, weeds) = (env.summary(), env.weeds());
        prop_assert_eq!(summary.weeds_total, scene.weeds.len());
        prop_assert_eq!(summary.weeds_mowed, weeds.is_mowed().iter().filter(|&&is| is).count());
        prop_assert_eq!(summary.weeds_detected, env.view().weeds_detected as usize);
        let driven_m: f64 = scene.drive.iter().map(|command| command.distance_m).sum();
        prop_assert!((summary.path_length_m - driven_m).abs() < 1e-9);
        prop_assert!((0.0..=1.0).contains(&summary.seen_fraction));
    }
}

/// Rounding has the ray leave the pasture before it gets there; the cell that it begins in is met all the same.
#[test]
fn a_mower_less_than_rounding_beyond_the_border_stands_on_unseen_ground() {
    let grid = Arc::new(Grid::new(100.0, 40.0));
    let ground = SeenGround::none(Arc::clone(&grid));
    let directions: Vec<(f64, f64)> =
        (0..8).map(|i| (FRAC_PI_4 * f64::from(i)).sin_cos()).map(|(sin, cos)| (cos, sin)).collect();
    for x_m in [0.0, -1e-16, -4.5e-16, -1e-15] {
        let (origin, mut ranges_m) = (Point::new(x_m, 17.05), Vec::new());
        ground.ranges_to_unseen(origin, (1.0, 0.0), &directions, 36.0, |range_m| {
            ranges_m.push(range_m);
        });
        assert!(ranges_m.iter().all(|&range_m| range_m < 1e-9), "{x_m} m: {ranges_m:?}");
    }
}

/// Beside a tile's border the ray to the right passes ground of either tile that was not seen, 0.3 m ahead at most.
#[test]
fn a_ray_along_the_border_of_a_tile_ends_on_one_side_of_it() {
    for x_m in [8.0, 16.0, 40.0] {
        let mut scenario = Scenario::default();
        scenario.mower.start = Start::Pose([x_m, 2.3, 0.0]);
        let mut env = Env::new(&scenario.check().unwrap());
        env.reset(0);
        let (view, mut ranges_m) = (env.view(), Vec::new());
        let directions = [0.0, 1e-300, 1e-17, 1.8e-16, 1e-15, 1e-12].map(|cos| [-cos, cos]);
        let directions: Vec<(f64, f64)> =
            directions.as_flattened().iter().map(|&cos| (cos, -1.0)).collect();
        let origin = view.pose.position();
        view.ground.ranges_to_unseen(origin, (1.0, 0.0), &directions, 48.0, |range_m| {
            ranges_m.push(range_m);
        });
        assert!(ranges_m.iter().all(|&range_m| range_m < 0.3 + 1e-6), "{x_m} m: {ranges_m:?}");
    }
}

/// A pasture drawn by hand: 10 x 6 m, bar 2 m, triangle 4 m deep and 4 m wide, the mower at (1, 3) heading along x.
fn by_hand(weeds: &[[f64; 2]]) -> Env {
    let mut scenario = Scenario::default();
    scenario.pasture.length_m = 10.0;
    scenario.pasture.width_m = 6.0;
    scenario.weeds.positions_m = Some(weeds.to_vec());
    scenario.sensor.range_m = 4.0;
    scenario.sensor.width_m = 4.0;
    scenario.mower.start = Start::Pose([1.0, 3.0, 0.0]);
    let mut env = Env::new(&scenario.check().unwrap());
    env.lift_limits();
    env.reset(0);
    env
}

#[test]
fn three_weeds_drawn_by_hand_are_seen_and_mowed_where_they_should_be() {
    // On the path; on the bar's left end, 4 m ahead and never in the triangle before; beyond the bar but in the triangle.
    let mut env = by_hand(&[[3.0, 3.0], [1.5, 4.0], [6.0, 4.5]]);
    assert_eq!(env.weeds().is_detected(), [true, false, false]);
    let drive = |env: &mut Env, distance_m: f64| {
        env.drive(Command { curvature_per_m: 0.0, distance_m }).unwrap().weeds_mowed
    };
    // The bar's end is inclusive: the weed at 1 m to the left is mowed at x = 1.5, unseen.
    assert_eq!(drive(&mut env, 0.4), 0);
    assert_eq!(drive(&mut env, 0.1), 1);
    assert_eq!(env.weeds().is_mowed(), [false, true, false]);
    // The third comes into the triangle at the look from x = 2.0: ahead by 4 m, aside by 1.5 m.
    assert_eq!(drive(&mut env, 0.3), 0);
    assert_eq!(env.weeds().is_detected(), [true, false, false]);
    assert_eq!(drive(&mut env, 0.2), 0);
    assert_eq!(env.weeds().is_detected(), [true, false, true]);
    assert_eq!(drive(&mut env, 1.0 - BAND_M), 0);
    assert_eq!(drive(&mut env, BAND_M), 1);
    assert_eq!(env.weeds().is_mowed(), [true, true, false]);
    assert_eq!(drive(&mut env, 7.0), 0);
    assert_eq!(env.view().known_weeds.len(), 1);
    assert_eq!(env.summary().weeds_detected, 2);
}

/// At the first look from (1, 3) the triangle |y - 3| <= (x - 1) / 2, x <= 5 holds the centres of the cells below, `#`;
/// after 2 m the bar has passed over those of columns 1 and 2 in the rows 2 and 3, and the last look reaches x = 7.
#[test]
fn the_ground_seen_on_a_pasture_drawn_by_hand_is_as_drawn() {
    let drawn = |env: &Env| {
        let view = env.view();
        let line = |row| {
            (0..10).map(|column| if view.ground.is_seen(column, row) { '#' } else { '.' }).collect()
        };
        (0..6).rev().map(line).collect::<Vec<String>>()
    };
    let mut env = by_hand(&[]);
    assert_eq!(
        drawn(&env),
        ["..........", "....#.....", "..###.....", "..###.....", "....#.....", ".........."]
    );
    env.drive(Command { curvature_per_m: 0.0, distance_m: 2.0 }).unwrap();
    assert_eq!(
        drawn(&env),
        ["..........", "....###...", ".######...", ".######...", "....###...", ".........."]
    );
}

/// Without weeds there is nothing to mow, and without a way nothing is driven.
#[test]
fn standing_still_changes_nothing() {
    let mut env = by_hand(&[[3.0, 3.0], [1.0, 3.5], [6.0, 4.5]]);
    let before = (env.summary(), env.view().pose);
    for _ in 0..10 {
        let step = env.drive(Command { curvature_per_m: 0.5, distance_m: 0.0 }).unwrap();
        assert_eq!((step.weeds_mowed, step.terms.total()), (0, 0.0));
    }
    assert_eq!((env.summary(), env.view().pose), before);
}
