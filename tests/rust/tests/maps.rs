//! What the maps show, point by point, on pastures where it can be worked out by hand.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use std::f64::consts::FRAC_PI_2;

use swath_core::config::{ObservationKind, Scenario, Start};
use swath_core::env::Env;

/// The default pasture, 100 x 40 m with B = 2, from this pose.
fn maps(start: [f64; 3], weeds: &[[f64; 2]]) -> (Vec<u8>, Env) {
    let mut scenario = Scenario::default();
    scenario.observation.kind = ObservationKind::Maps;
    scenario.mower.start = Start::Pose(start);
    scenario.weeds.positions_m = Some(weeds.to_vec());
    let mut env = Env::new(&scenario.check().unwrap());
    env.reset(0);
    let mut observation = env.observation_spec().rows(1);
    env.observe(observation.as_mut());
    (observation.maps, env)
}

/// The value at a scale, channel (0 unseen, 1 weeds, 2 outside), row and column.
fn at(maps: &[u8], scale: usize, channel: usize, row: usize, column: usize) -> u8 {
    maps[((3 * scale + channel) * 32 + row) * 32 + column]
}

/// Points of 0.25 m: row 15 is 0 to 0.25 m ahead, column 15 as far to the left.
#[test]
fn the_finest_scale_shows_where_the_pasture_ends() {
    // Heading +x at (0, 1): what lies behind is outside, and what lies more than 1 m, or four points, to the right.
    let (maps, _) = maps([0.0, 1.0, 0.0], &[]);
    for row in 0..32 {
        for column in 0..32 {
            let is_outside = row >= 16 || column >= 20;
            assert_eq!(
                at(&maps, 0, 2, row, column),
                if is_outside { 255 } else { 0 },
                "{row} {column}"
            );
        }
    }
}

/// At a heading of +y, ahead is up and x runs to the right.
#[test]
fn the_mower_looks_up_and_unseen_ground_is_what_it_has_not_seen() {
    let (maps, env) = maps([50.0, 20.0, FRAC_PI_2], &[]);
    let view = env.view();
    // Points of 0.75 m: 8 points are 6 m. All is on the pasture, and none straddles what is sampled at its middle.
    for row in 0..32 {
        for column in 0..32 {
            let ahead_m = (15.5 - f64::from(row)) * 0.75;
            let left_m = (15.5 - f64::from(column)) * 0.75;
            let place = swath_core::geometry::Point::new(50.0 - left_m, 20.0 + ahead_m);
            let (x, y) = view.ground.grid().cell_of(place);
            let expected = if view.ground.is_seen(x, y) { 0 } else { 255 };
            let (row, column) = (usize::try_from(row).unwrap(), usize::try_from(column).unwrap());
            assert_eq!(at(&maps, 1, 0, row, column), expected, "{row} {column}");
            assert_eq!(at(&maps, 1, 2, row, column), 0);
        }
    }
    // The triangle is 12 m deep and opens by half a metre a metre: 6 m ahead it is 3 m to either side.
    assert_eq!(at(&maps, 1, 0, 7, 15), 0);
    assert_eq!(at(&maps, 1, 0, 7, 10), 255);
    assert_eq!(at(&maps, 1, 0, 20, 15), 255);
}

/// A weed 5 m ahead and 1 m to the left: at scale s its point is 16 - 5 / r from the top and 16 - 1 / r from the left.
#[test]
fn a_known_weed_lights_one_point_at_each_scale_that_reaches_it() {
    let (maps, env) = maps([20.0, 10.0, 0.0], &[[25.0, 11.0], [5.0, 5.0]]);
    assert_eq!(env.view().known_weeds.len(), 1);
    let lit = |scale: usize| -> Vec<(usize, usize)> {
        let points = (0..32).flat_map(|row| (0..32).map(move |column| (row, column)));
        points.filter(|&(row, column)| at(&maps, scale, 1, row, column) == 255).collect()
    };
    // 8 m across: 4 m ahead at most. 24 m: 16 - 6.67 and 16 - 1.33. 72 m: 16 - 2.22, 16 - 0.44. 216 m: 16 - 0.74, 16 - 0.15.
    assert_eq!(
        [lit(0), lit(1), lit(2), lit(3)],
        [vec![], vec![(9, 14)], vec![(13, 15)], vec![(15, 15)]]
    );
}

/// The coarsest picture is 216 m wide and high: the pasture is 4000 m2 of it, and 100 x 40 m less what is seen is unseen.
#[test]
fn the_coarsest_scale_holds_the_whole_pasture() {
    let (maps, env) = maps([50.0, 20.0, 0.0], &[]);
    let area_m2 = |channel: usize| -> f64 {
        let start = (9 + channel) * 1024;
        maps[start..start + 1024].iter().map(|&value| f64::from(value) / 255.0 * 6.75 * 6.75).sum()
    };
    let unseen_m2 = env.view().ground.unseen_count() as f64;
    assert!((area_m2(2) - (216.0 * 216.0 - 4000.0)).abs() < 200.0, "{}", area_m2(2));
    assert!((area_m2(0) - unseen_m2).abs() < 200.0, "{} of {unseen_m2}", area_m2(0));
}

/// Single precision tells places on it apart by half a metre only.
#[test]
fn the_end_of_the_longest_pasture_is_shown() {
    let mut scenario = Scenario::default();
    scenario.observation.kind = ObservationKind::Maps;
    scenario.pasture.length_m = 8e6;
    scenario.pasture.width_m = 1.0;
    scenario.mower.deck_width_m = 1.0;
    scenario.mower.start = Start::Pose([8e6 - 5.0, 0.5, 0.0]);
    scenario.weeds.count = 1;
    let mut env = Env::new(&scenario.check().unwrap());
    env.reset(0);
    let mut observation = env.observation_spec().rows(1);
    env.observe(observation.as_mut());
    let outside = at(&observation.maps, 1, 2, 0, 15);
    assert_eq!(outside, 255, "11 m ahead");
}
