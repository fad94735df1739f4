//! The ground under the bar is exact: what a bar moved in small steps passes over, straight or in a curve, also where the
//! bar reaches beyond its turning centre; and the same wherever the mower stands.

use std::f64::consts::PI;

use proptest::prelude::*;
use swath_core::action::Command;
use swath_core::geometry::{Arc, BarSweep, Point, Pose};
use swath_tests::cases::cases;
use swath_tests::oracle::{BAND_M, driven, first_under_the_bar, is_under_the_moving_bar, offsets};
use swath_tests::scene::{curvature_shares, poses};

/// Steps of the bar that is moved by hand.
const STEPS: u32 = 2000;
/// Points this close to the border are not judged there: a bar on an arc of up to half a circle leaves its chord by less
/// than (r + B/2) (pi / 2000)^2 / 8 = 6e-6 m between two of its steps, for r up to 8 and B up to 8 m.
const MOVED_BAND_M: f64 = 1e-4;

/// An arc of less than half a circle, a bar that may be wider than its circle, and a point near it.
fn sweeps() -> impl Strategy<Value = (Arc, f64, Point)> {
    let arc = (poses(50.0), 0.2..8.0_f64, curvature_shares(), 0.0..1.0).prop_map(
        |(start, radius_m, share, along)| {
            let curvature_per_m = share / radius_m;
            let longest_m = (3.1 / f64::max(curvature_per_m.abs(), 1e-9)).min(10.0);
            Arc { start, curvature_per_m, length_m: along * longest_m }
        },
    );
    (arc, 0.1..8.0, 0.0..1.0, -1.2..1.2, -0.5..0.5).prop_map(
        |(arc, width_m, along, across, ahead)| {
            // In the frame of some pose on the arc, so that most points are near a border or under the bar.
            let pose = arc.at(along * arc.length_m);
            let on_bar = pose.world_from_mower() * Point::new(ahead, 0.5 * across * width_m);
            (arc, width_m, on_bar)
        },
    )
}

fn command(arc: &Arc) -> Command {
    Command { curvature_per_m: arc.curvature_per_m, distance_m: arc.length_m }
}

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn the_bar_mows_what_it_passes_over_in_small_steps((arc, width_m, point) in sweeps()) {
        let moved = |wider_m: f64| {
            let Arc { start, curvature_per_m: k, length_m } = arc;
            // Longer at both ends by what the widest point of the bar needs to come as far as the band.
            let inner_m = (1.0 - 0.5 * k.abs() * width_m).abs().clamp(0.01, 1.0);
            let longer_m = wider_m / inner_m;
            let from = driven(start, Command { curvature_per_m: k, distance_m: -longer_m });
            let distance_m = (length_m + 2.0 * longer_m).max(0.0);
            let longer = Command { curvature_per_m: k, distance_m };
            is_under_the_moving_bar(from, longer, width_m + 2.0 * wider_m, point, STEPS)
        };
        let (narrow, wide) = (moved(-MOVED_BAND_M), moved(MOVED_BAND_M));
        if narrow == wide {
            let is_mowed = BarSweep::new(&arc, width_m).contains(point);
            prop_assert_eq!(is_mowed, wide, "{:?} in the frame of the start", offsets(arc.start, point));
        }
    }

    /// The oracle of the other tests, which is quicker, is held to the same.
    #[test]
    fn the_bar_mows_what_lies_between_its_angles_about_the_turning_centre(
        (arc, width_m, point) in sweeps(),
    ) {
        let under = |wider_m: f64| {
            first_under_the_bar(arc.start, command(&arc), width_m, point, wider_m).is_some()
        };
        let (narrow, wide) = (under(-BAND_M), under(BAND_M));
        if narrow == wide {
            prop_assert_eq!(BarSweep::new(&arc, width_m).contains(point), wide);
        }
    }

    #[test]
    fn mowing_stays_the_same_after_a_rigid_motion(
        (arc, width_m, point) in sweeps(), to in poses(100.0),
    ) {
        let under = |wider_m: f64| {
            first_under_the_bar(arc.start, command(&arc), width_m, point, wider_m).is_some()
        };
        prop_assume!(under(-BAND_M) == under(BAND_M));
        let there = to.world_from_mower();
        let start = Pose::new(0.0, 0.0, arc.start.heading_rad + to.heading_rad);
        let position = there * arc.start.position();
        let moved = Arc { start: Pose::new(position.x, position.y, start.heading_rad), ..arc };
        prop_assert_eq!(
            BarSweep::new(&arc, width_m).contains(point),
            BarSweep::new(&moved, width_m).contains(there * point)
        );
    }

    /// A planner puts the bar's end exactly on a weed; it must be mowed wherever on the arc that is.
    #[test]
    fn the_ends_of_the_bar_and_of_the_motion_are_inclusive(
        (arc, width_m, _) in sweeps(), along in 0.0..=1.0, is_left in any::<bool>(),
    ) {
        let sweep = BarSweep::new(&arc, width_m);
        let end = if is_left { 0.5 } else { -0.5 };
        for share in [0.0, along, 1.0] {
            let pose = driven(arc.start, Command { distance_m: share * arc.length_m, ..command(&arc) });
            let tip = pose.world_from_mower() * Point::new(0.0, end * width_m);
            prop_assert!(sweep.contains(tip), "{tip} at {share} of {arc:?}");
            prop_assert!(sweep.contains(pose.position()), "{pose:?} at {share} of {arc:?}");
        }
    }

    /// How a motion is cut changes nothing on the ground: two halves mow what the whole mows.
    #[test]
    fn two_pieces_of_an_arc_mow_what_the_whole_mows(
        (arc, width_m, point) in sweeps(), cut in 0.0..=1.0,
    ) {
        let under = |wider_m: f64| {
            first_under_the_bar(arc.start, command(&arc), width_m, point, wider_m).is_some()
        };
        prop_assume!(under(-BAND_M) == under(BAND_M));
        let first = Arc { length_m: cut * arc.length_m, ..arc };
        let second = Arc { start: first.end(), length_m: arc.length_m - first.length_m, ..arc };
        let is_mowed = |arc: &Arc| BarSweep::new(arc, width_m).contains(point);
        prop_assert_eq!(is_mowed(&arc), is_mowed(&first) || is_mowed(&second));
    }
}

/// Half a turn with the bar's inner end on the turning centre covers half a disc of twice the radius.
#[test]
fn half_a_turn_about_the_bars_own_end_mows_half_a_disc() {
    let (radius_m, almost) = (2.0, 1.0 - 1e-9);
    let arc = Arc {
        start: Pose::new(0.0, -radius_m, 0.0),
        curvature_per_m: 1.0 / radius_m,
        length_m: PI * radius_m * almost,
    };
    let sweep = BarSweep::new(&arc, 2.0 * radius_m);
    for i in -50..=50 {
        for j in -50..=50 {
            let point = Point::new(0.1 * f64::from(i) + 0.003, 0.1 * f64::from(j) + 0.007);
            let is_in_half_disc = point.x > 0.0 && point.coords.norm() < 2.0 * radius_m;
            assert_eq!(sweep.contains(point), is_in_half_disc, "{point}");
        }
    }
}

/// A mower that turns about a point 0.5 m away with a bar of 4 m mows a wedge on the far side too: a whole disc of 1.5 m
/// after half a turn, and half a ring of 1.5 to 2.5 m on the near side.
#[test]
fn half_a_turn_of_a_bar_that_reaches_beyond_its_centre_mows_a_disc_and_half_a_ring() {
    let arc = Arc {
        start: Pose::new(0.0, -0.5, 0.0),
        curvature_per_m: 2.0,
        length_m: 0.5 * PI * (1.0 - 1e-9),
    };
    let sweep = BarSweep::new(&arc, 4.0);
    for i in -30..=30 {
        for j in -30..=30 {
            let point = Point::new(0.1 * f64::from(i) + 0.003, 0.1 * f64::from(j) + 0.007);
            let distance_m = point.coords.norm();
            let is_mowed = distance_m < 1.5 || (distance_m < 2.5 && point.x > 0.0);
            assert_eq!(sweep.contains(point), is_mowed, "{point}");
        }
    }
}
