//! The detection triangle holds what lies between its three corners, borders included, wherever the mower stands.

use proptest::prelude::*;
use swath_core::geometry::{Frame, Point, Triangle};
use swath_tests::cases::cases;
use swath_tests::oracle::{Verdict, in_triangle};
use swath_tests::scene::poses;

/// Depth and far width of a triangle.
fn sizes() -> impl Strategy<Value = (f64, f64)> {
    (0.2..25.0, 0.2..40.0)
}

/// A point in the mower's frame near or in a triangle of that size, as shares of depth and half width.
fn shares() -> impl Strategy<Value = (f64, f64)> {
    (-0.3..1.3, -1.3..1.3)
}

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn what_lies_to_the_left_of_all_three_sides_is_inside(
        pose in poses(50.0), (range_m, width_m) in sizes(), (ahead, left) in shares(),
    ) {
        let point = pose.world_from_mower() * Point::new(ahead * range_m, 0.5 * left * width_m);
        let is_inside = Triangle::new(range_m, width_m).contains(&Frame::from(pose), point);
        match in_triangle(pose, range_m, width_m, point) {
            Verdict::Inside => prop_assert!(is_inside, "{point} is inside"),
            Verdict::Outside => prop_assert!(!is_inside, "{point} is outside"),
            Verdict::Border => {}
        }
    }

    #[test]
    fn points_on_its_sides_are_inside(
        pose in poses(50.0), (range_m, width_m) in sizes(), along in 0.0..=1.0_f64,
    ) {
        let (triangle, from) = (Triangle::new(range_m, width_m), Frame::from(pose));
        let half_m = 0.5 * width_m;
        for (ahead, left) in [
            (along * range_m, along * half_m),
            (along * range_m, -along * half_m),
            (range_m, (2.0 * along - 1.0) * half_m),
        ] {
            let point = pose.world_from_mower() * Point::new(ahead, left);
            prop_assert!(triangle.contains(&from, point), "{ahead} m ahead, {left} m to the left");
        }
    }

    #[test]
    fn detection_stays_the_same_after_a_rigid_motion(
        pose in poses(50.0), (range_m, width_m) in sizes(), (ahead, left) in shares(),
        to in poses(100.0),
    ) {
        let in_mower = Point::new(ahead * range_m, 0.5 * left * width_m);
        let here = pose.world_from_mower() * in_mower;
        prop_assume!(in_triangle(pose, range_m, width_m, here) != Verdict::Border);
        prop_assert_eq!(
            Triangle::new(range_m, width_m).contains(&Frame::from(pose), here),
            Triangle::new(range_m, width_m).contains(&Frame::from(to), to.world_from_mower() * in_mower)
        );
    }
}
