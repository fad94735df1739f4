//! Strategies: pastures of every size, mowers of every shape, drives of every kind.

use std::f64::consts::PI;

use proptest::prelude::*;
use swath_core::action::Command;
use swath_core::config::{Distribution, Scenario, Start, ValidScenario};
use swath_core::env::{Beginning, Env};
use swath_core::geometry::{Point, Pose};

/// A pasture with weeds drawn by the test, a mower somewhere on it, and a drive.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The scenario, without limits on the path.
    pub scenario: Scenario,
    /// The weeds.
    pub weeds: Vec<Point>,
    /// Where the mower starts.
    pub start: Pose,
    /// What it drives.
    pub drive: Vec<Command>,
}

impl Scene {
    /// The scenario, checked.
    #[must_use]
    pub fn valid(&self) -> ValidScenario {
        self.scenario.clone().check().expect("the strategy draws scenarios that are allowed")
    }

    /// The scene before the first step; episodes in it have no end.
    #[must_use]
    pub fn env(&self) -> Env {
        let mut env = Env::new(&self.valid());
        env.lift_limits();
        env.reset_from(0, Beginning { weeds: Some(&self.weeds), start: Some(self.start) });
        env
    }

    /// The scene after the whole drive.
    #[must_use]
    pub fn driven(&self) -> Env {
        let mut env = self.env();
        for &command in &self.drive {
            env.drive(command).expect("an unlimited scene does not end");
        }
        env
    }
}

/// A pose within `reach_m` of the origin, any heading.
pub fn poses(reach_m: f64) -> impl Strategy<Value = Pose> {
    (-reach_m..reach_m, -reach_m..reach_m, -3.0 * PI..3.0 * PI)
        .prop_map(|(x_m, y_m, heading_rad)| Pose::new(x_m, y_m, heading_rad))
}

/// A curvature as a share of the largest one: full lock, straight, or anything in steps of a thousandth.
pub fn curvature_shares() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(-1.0),
        Just(0.0),
        Just(1.0),
        (-1000..=1000_i32).prop_map(|share| f64::from(share) / 1000.0),
    ]
}

/// Commands for a mower that turns with `radius_m`: up to `pieces` pieces of up to `longest_m`.
pub fn drives(
    radius_m: f64,
    pieces: usize,
    longest_m: f64,
) -> impl Strategy<Value = Vec<Command>> + Clone {
    let share = (curvature_shares(), 0.0..longest_m);
    let command = share.prop_map(move |(share, distance_m)| Command {
        curvature_per_m: share / radius_m,
        distance_m,
    });
    proptest::collection::vec(command.boxed(), 1..=pieces).boxed()
}

/// A side of a pasture: whole metres or not, some around the 64 cells of a machine word.
fn sides() -> impl Strategy<Value = f64> {
    prop_oneof![3.0..40.0, (3..40_u32).prop_map(f64::from), 62.5..66.0]
}

/// Scenarios of every geometry, without limits on the path.
pub fn scenarios() -> impl Strategy<Value = Scenario> {
    let pasture = (sides(), sides());
    let mower = (0.4..5.0, 0.1..0.95);
    let sensor = (1.0..20.0, 0.5..20.0);
    (pasture, mower, sensor, any::<bool>(), 0..200_u32).prop_map(
        |((length_m, width_m), (radius_m, deck_share), (range_m, sensor_m), is_even, count)| {
            let mut scenario = Scenario::default();
            scenario.pasture.length_m = length_m;
            scenario.pasture.width_m = width_m;
            scenario.pasture.headland_m = f64::INFINITY;
            scenario.weeds.count = count;
            scenario.weeds.distribution =
                if is_even { Distribution::Uniform } else { Distribution::Gaussian };
            scenario.mower.turning_radius_m = radius_m;
            scenario.mower.deck_width_m = deck_share * length_m.min(width_m).min(6.0);
            scenario.sensor.range_m = range_m;
            scenario.sensor.width_m = sensor_m;
            scenario.episode.budget = f64::INFINITY;
            scenario
        },
    )
}

/// Scenes of every geometry: up to 60 weeds, up to 8 pieces of up to 12 m.
pub fn scenes() -> impl Strategy<Value = Scene> {
    scenarios().prop_flat_map(|scenario| {
        let (length_m, width_m) = (scenario.pasture.length_m, scenario.pasture.width_m);
        let point = (0.0..=length_m, 0.0..=width_m).prop_map(|(x, y)| Point::new(x, y));
        let start = (0.0..length_m, 0.0..width_m, -PI..PI).prop_map(|(x, y, t)| Pose::new(x, y, t));
        let weeds = proptest::collection::vec(point, 0..60);
        let drive = drives(scenario.mower.turning_radius_m, 8, 12.0);
        (Just(scenario), weeds, start, drive).prop_map(|(mut scenario, weeds, start, drive)| {
            scenario.mower.start = Start::Pose([start.x_m, start.y_m, start.heading_rad]);
            Scene { scenario, weeds, start, drive }
        })
    })
}
