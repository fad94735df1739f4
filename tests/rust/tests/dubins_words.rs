//! Every Dubins word ends where it was asked to, turns no tighter than allowed, and the shortest of them is the shortest
//! path there is: as long as the one of the `dubins_paths` crate, and never longer than a drive that gets there too.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use std::f64::consts::{FRAC_PI_4, PI, TAU};

use proptest::prelude::*;
use swath_core::action::Command;
use swath_core::geometry::{Arc, DubinsPath, Pose, Word, boustrophedon_length, shortest, words};
use swath_tests::cases::cases;
use swath_tests::oracle::driven;
use swath_tests::scene::poses;

/// Between poses in general position only rounding is left: coordinates of 100 m carry 1e-14 m, a few dozen operations on them.
const GENERAL_M: f64 = 1e-9;
/// Where circles touch or coincide, a straight is the square root of a rounding error: sqrt(1e-16) radii of up to 8 m.
const DEGENERATE_M: f64 = 1e-6;

fn radii() -> impl Strategy<Value = f64> {
    0.3..8.0
}

/// Two poses on the corners of a grid of half radii, headings in eighths of a circle: circles touch and coincide here.
fn poses_on_a_lattice(radius_m: f64) -> impl Strategy<Value = (Pose, Pose)> {
    let corner = || {
        (-8..=8_i32, -8..=8_i32, 0..8_i32).prop_map(move |(i, j, eighths)| {
            let half_m = 0.5 * radius_m;
            Pose::new(f64::from(i) * half_m, f64::from(j) * half_m, f64::from(eighths) * FRAC_PI_4)
        })
    };
    (corner(), corner())
}

/// A radius and two poses, in general position or on the lattice.
fn queries() -> impl Strategy<Value = (Pose, Pose, f64)> {
    radii().prop_flat_map(|radius_m| {
        let pair = prop_oneof![(poses(50.0), poses(50.0)), poses_on_a_lattice(radius_m)];
        (pair, Just(radius_m)).prop_map(|((start, goal), radius_m)| (start, goal, radius_m))
    })
}

/// A drive of up to three arcs at full lock or straights; any of them may be very short.
fn sharp_drives(radius_m: f64) -> impl Strategy<Value = Vec<Command>> {
    let lengths_m =
        prop_oneof![4 => 0.0..6.0 * radius_m, 1 => (-12.0..0.0_f64).prop_map(|e| 10.0_f64.powf(e))];
    let piece = (prop_oneof![Just(-1.0), Just(0.0), Just(1.0)], lengths_m)
        .prop_map(move |(turn, s)| Command { curvature_per_m: turn / radius_m, distance_m: s });
    proptest::collection::vec(piece, 1..=3)
}

fn angle_between(a_rad: f64, b_rad: f64) -> f64 {
    let apart_rad = (a_rad - b_rad).rem_euclid(TAU);
    apart_rad.min(TAU - apart_rad)
}

/// Distance between two poses, a metre for each radian of their headings.
fn apart(a: Pose, b: Pose) -> f64 {
    a.distance_to(&b) + angle_between(a.heading_rad, b.heading_rad)
}

fn length_of(path: Option<DubinsPath>) -> Option<f64> {
    path.map(|path| path.length_m())
}

fn shortest_m(start: Pose, goal: Pose, radius_m: f64) -> f64 {
    shortest(start, goal, radius_m).unwrap().length_m()
}

/// The length that the `dubins_paths` crate finds, in its double precision module.
fn length_by_dubins_paths(start: Pose, goal: Pose, radius_m: f64) -> f64 {
    let pose = |p: Pose| [p.x_m, p.y_m, p.heading_rad].into();
    dubins_paths::f64::DubinsPath::shortest_from(pose(start), pose(goal), radius_m)
        .unwrap()
        .length()
}

fn turned_and_moved(pose: Pose, turn_rad: f64, dx_m: f64, dy_m: f64) -> Pose {
    let (sin, cos) = turn_rad.sin_cos();
    Pose::new(
        cos * pose.x_m - sin * pose.y_m + dx_m,
        sin * pose.x_m + cos * pose.y_m + dy_m,
        pose.heading_rad + turn_rad,
    )
}

fn mirrored(pose: Pose) -> Pose {
    Pose::new(pose.x_m, -pose.y_m, -pose.heading_rad)
}

fn facing_back(pose: Pose) -> Pose {
    Pose::new(pose.x_m, pose.y_m, pose.heading_rad + PI)
}

/// The word with left and right exchanged.
fn mirror_of(word: Word) -> Word {
    match word {
        Word::Lsl => Word::Rsr,
        Word::Rsr => Word::Lsl,
        Word::Lsr => Word::Rsl,
        Word::Rsl => Word::Lsr,
        Word::Rlr => Word::Lrl,
        Word::Lrl => Word::Rlr,
    }
}

/// The word that drives the same ground the other way: last piece first, left and right exchanged.
fn reverse_of(word: Word) -> Word {
    match word {
        Word::Lsl => Word::Rsr,
        Word::Rsr => Word::Lsl,
        Word::Lsr => Word::Lsr,
        Word::Rsl => Word::Rsl,
        Word::Rlr => Word::Lrl,
        Word::Lrl => Word::Rlr,
    }
}

/// Equal up to `tolerance_m`, and there or not there alike.
fn agree(a: Option<f64>, b: Option<f64>, tolerance_m: f64) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => (a - b).abs() < tolerance_m,
        (a, b) => a.is_none() && b.is_none(),
    }
}

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn every_word_ends_where_asked(
        (start, goal, radius_m) in radii().prop_flat_map(|r| (poses(50.0), poses(50.0), Just(r))),
    ) {
        for path in Word::ALL.into_iter().filter_map(|word| word.path(start, goal, radius_m)) {
            let driven_to = path.segments().iter().fold(start, |pose, piece| {
                driven(pose, Command { curvature_per_m: piece.curvature_per_m, distance_m: piece.length_m })
            });
            prop_assert!(apart(driven_to, goal) < GENERAL_M, "{path:?} ends at {driven_to:?}");
            prop_assert!(apart(path.at(path.length_m()), goal) < GENERAL_M);
        }
    }

    #[test]
    fn every_word_ends_where_asked_where_circles_touch_or_coincide(
        ((start, goal), radius_m) in radii().prop_flat_map(|r| (poses_on_a_lattice(r), Just(r))),
    ) {
        for path in Word::ALL.into_iter().filter_map(|word| word.path(start, goal, radius_m)) {
            let end = path.at(path.length_m());
            prop_assert!(apart(end, goal) < DEGENERATE_M, "{path:?} ends at {end:?}");
        }
    }

    #[test]
    fn every_word_spells_its_name_and_turns_at_the_radius((start, goal, radius_m) in queries()) {
        for word in Word::ALL {
            let Some(path) = word.path(start, goal, radius_m) else { continue };
            prop_assert_eq!(path.word(), word);
            let spelt: String = path.segments().iter().map(|piece| {
                let turn = piece.curvature_per_m * radius_m;
                if (turn - 1.0).abs() < 1e-12 { 'l' }
                else if (turn + 1.0).abs() < 1e-12 { 'r' }
                else if turn == 0.0 { 's' }
                else { '?' }
            }).collect();
            prop_assert_eq!(spelt, format!("{word:?}").to_lowercase());
            prop_assert!(path.segments().iter().all(|piece| piece.length_m >= 0.0));
        }
    }

    #[test]
    fn no_word_is_shorter_than_the_straight_line((start, goal, radius_m) in queries()) {
        for path in Word::ALL.into_iter().filter_map(|word| word.path(start, goal, radius_m)) {
            prop_assert!(path.length_m() >= start.distance_to(&goal) - DEGENERATE_M, "{path:?}");
        }
    }

    #[test]
    fn the_shortest_path_is_one_of_the_words_and_none_is_shorter(
        (start, goal, radius_m) in queries(),
    ) {
        let best_m = shortest_m(start, goal, radius_m);
        let words = Word::ALL.into_iter().filter_map(|word| length_of(word.path(start, goal, radius_m)));
        let least_m = words.fold(f64::INFINITY, f64::min);
        // Poses that are equal are joined by the empty path, which is no word's.
        let is_shortest = (best_m - least_m).abs() < 1e-12 || best_m == 0.0;
        prop_assert!(is_shortest, "{best_m} m, the words' least is {least_m} m");
    }

    #[test]
    fn the_shortest_path_is_as_long_as_that_of_dubins_paths(
        start in poses(50.0), goal in poses(50.0), radius_m in radii(),
    ) {
        let (ours_m, theirs_m) =
            (shortest_m(start, goal, radius_m), length_by_dubins_paths(start, goal, radius_m));
        prop_assert!((ours_m - theirs_m).abs() < GENERAL_M, "{ours_m} m, not {theirs_m} m");
    }

    /// That crate keeps full circles that rounding brings about, so it may be longer here, never shorter.
    #[test]
    fn the_shortest_path_is_at_most_that_of_dubins_paths_where_circles_touch_or_coincide(
        ((start, goal), radius_m) in radii().prop_flat_map(|r| (poses_on_a_lattice(r), Just(r))),
    ) {
        let (ours_m, theirs_m) =
            (shortest_m(start, goal, radius_m), length_by_dubins_paths(start, goal, radius_m));
        prop_assert!(ours_m < theirs_m + DEGENERATE_M, "{ours_m} m, not {theirs_m} m");
    }

    #[test]
    fn the_shortest_path_is_at_most_any_drive_that_ends_there(
        start in poses(50.0),
        (drive, radius_m) in radii().prop_flat_map(|r| (sharp_drives(r), Just(r))),
    ) {
        let goal = drive.iter().fold(start, |pose, &command| driven(pose, command));
        let driven_m: f64 = drive.iter().map(|command| command.distance_m).sum();
        let best = shortest(start, goal, radius_m).unwrap();
        prop_assert!(best.length_m() < driven_m + DEGENERATE_M, "{best:?} for {driven_m} m");
    }

    /// What a planner relies on that asks again from wherever the mower has come to.
    #[test]
    fn from_any_point_of_a_shortest_path_the_rest_is_the_shortest(
        (start, goal, radius_m) in queries(),
    ) {
        let path = shortest(start, goal, radius_m).unwrap();
        for share in [0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 0.99, 0.999, 0.999_999] {
            let driven_m = share * path.length_m();
            let rest_m = shortest_m(path.at(driven_m), goal, radius_m);
            let left_m = path.length_m() - driven_m;
            prop_assert!(
                (rest_m - left_m).abs() < DEGENERATE_M,
                "{rest_m} m from {share} of {path:?}, {left_m} m left"
            );
        }
    }

    #[test]
    fn lengths_stay_the_same_after_a_rigid_motion(
        (start, goal, radius_m) in queries(),
        turn_rad in -PI..PI, dx_m in -50.0..50.0, dy_m in -50.0..50.0,
    ) {
        let there = |pose| turned_and_moved(pose, turn_rad, dx_m, dy_m);
        let (here_m, there_m) =
            (shortest_m(start, goal, radius_m), shortest_m(there(start), there(goal), radius_m));
        prop_assert!((here_m - there_m).abs() < DEGENERATE_M, "{here_m} m, {there_m} m there");
    }

    #[test]
    fn lengths_grow_with_the_scale(
        start in poses(50.0), goal in poses(50.0), radius_m in radii(), scale in 0.1..10.0_f64,
    ) {
        let larger = |p: Pose| Pose::new(scale * p.x_m, scale * p.y_m, p.heading_rad);
        let here_m = shortest_m(start, goal, radius_m);
        let there_m = shortest_m(larger(start), larger(goal), scale * radius_m);
        prop_assert!((scale * here_m - there_m).abs() < 10.0 * GENERAL_M);
    }

    #[test]
    fn a_mirrored_query_has_the_mirrored_word_of_the_same_length(
        start in poses(50.0), goal in poses(50.0), radius_m in radii(),
    ) {
        for word in Word::ALL {
            let here = length_of(word.path(start, goal, radius_m));
            let there = length_of(mirror_of(word).path(mirrored(start), mirrored(goal), radius_m));
            prop_assert!(agree(here, there, GENERAL_M), "{word:?}: {here:?}, mirrored {there:?}");
        }
    }

    #[test]
    fn a_path_driven_backwards_is_as_long(
        start in poses(50.0), goal in poses(50.0), radius_m in radii(),
    ) {
        for word in Word::ALL {
            let there = length_of(word.path(start, goal, radius_m));
            let back = length_of(reverse_of(word).path(facing_back(goal), facing_back(start), radius_m));
            prop_assert!(agree(there, back, GENERAL_M), "{word:?}: {there:?}, back {back:?}");
        }
    }

    #[test]
    fn samples_run_from_start_to_end_and_stand_no_further_apart_than_asked(
        (start, goal, radius_m) in queries(), spacing_m in 0.05..5.0,
    ) {
        let path = shortest(start, goal, radius_m).unwrap();
        let samples = path.sample(spacing_m);
        prop_assert_eq!(samples[0], start);
        prop_assert!(apart(samples[samples.len() - 1], goal) < DEGENERATE_M);
        let steps = (samples.len() - 1) as f64;
        prop_assert!(path.length_m() / steps <= spacing_m + 1e-12);
        prop_assert!(samples.len() == 2 || path.length_m() / (steps - 1.0) > spacing_m - 1e-9,
            "{} samples for {} m", samples.len(), path.length_m());
        for pair in samples.windows(2) {
            prop_assert!(pair[0].distance_to(&pair[1]) <= spacing_m + 1e-9);
        }
        let chords_m: f64 = samples.windows(2).map(|pair| pair[0].distance_to(&pair[1])).sum();
        prop_assert!(chords_m <= path.length_m() + 1e-9);
        // A chord of s on a circle of radius R is short by at most s^3 / 24 R^2.
        let short_m = steps * spacing_m.powi(3) / (24.0 * radius_m * radius_m);
        let corners_m = if spacing_m < radius_m { short_m } else { f64::INFINITY };
        prop_assert!(chords_m >= path.length_m() - corners_m - 1e-9, "{chords_m} m of chords");
    }

    #[test]
    fn no_two_points_of_a_path_are_further_apart_than_the_way_between_them(
        (start, goal, radius_m) in queries(), from in 0.0..1.0, to in 0.0..1.0,
    ) {
        let path = shortest(start, goal, radius_m).unwrap();
        let (from_m, to_m) = (from * path.length_m(), to * path.length_m());
        let (a, b) = (path.at(from_m), path.at(to_m));
        let way_m = (from_m - to_m).abs();
        prop_assert!(a.distance_to(&b) <= way_m + 1e-9);
        prop_assert!(angle_between(a.heading_rad, b.heading_rad) <= way_m / radius_m + 1e-9);
    }
}

#[test]
fn beyond_its_ends_a_path_stands_still() {
    let (start, goal) = (Pose::new(1.0, 2.0, 0.5), Pose::new(9.0, -4.0, 3.0));
    let path = shortest(start, goal, 2.0).unwrap();
    assert_eq!(path.at(-1.0), start);
    assert_eq!(path.at(path.length_m() + 1.0), path.at(f64::INFINITY));
    assert!(apart(path.at(f64::INFINITY), goal) < GENERAL_M);
}

/// A left turn of 0.3 m on a circle of 3 m comes back as a full circle if its centre, which start and goal share, is
/// looked for as two points with a direction between them.
#[test]
fn an_arc_is_joined_by_itself_whatever_its_size_and_place() {
    let mut too_long = Vec::new();
    for radius_m in [0.7, 1.0, 2.0, 3.3] {
        for heading in 0..24 {
            for turn in 1..40 {
                for left in [1.0, -1.0] {
                    let turned_rad = 0.1 * f64::from(turn);
                    let start = Pose::new(12.3, -4.5, 0.26 * f64::from(heading));
                    let arc = Command {
                        curvature_per_m: left / radius_m,
                        distance_m: turned_rad * radius_m,
                    };
                    let length_m = shortest_m(start, driven(start, arc), radius_m);
                    if length_m > arc.distance_m + DEGENERATE_M {
                        too_long.push((radius_m, start.heading_rad, left * turned_rad, length_m));
                    }
                }
            }
        }
    }
    assert!(
        too_long.is_empty(),
        "{} of 7488 arcs, the first (radius, heading, turn, length): {:?}",
        too_long.len(),
        too_long[0]
    );
}

/// LSR between parallel headings: two arcs of `atan2(dy - 2R, dx) + atan2(2R, p)` about a straight `p`.
#[test]
fn a_change_of_lane_has_the_length_of_its_closed_form() {
    let (radius_m, dx_m, dy_m) = (2.0_f64, 9.0_f64, 3.0_f64);
    let across_m = dy_m - 2.0 * radius_m;
    let straight_m = (dx_m * dx_m + across_m * across_m - 4.0 * radius_m * radius_m).sqrt();
    let turn_rad = across_m.atan2(dx_m) + (2.0 * radius_m).atan2(straight_m);
    let path =
        Word::Lsr.path(Pose::new(0.0, 0.0, 0.0), Pose::new(dx_m, dy_m, 0.0), radius_m).unwrap();
    assert!((path.length_m() - (2.0 * radius_m * turn_rad + straight_m)).abs() < 1e-12);
    assert!((path.segments()[1].length_m - straight_m).abs() < 1e-12);
}

/// The tightest change of lane by dy <= 2R takes sqrt(dy (4R - dy)) ahead, without a straight; a millimetre less ahead
/// and the word does not exist.
#[test]
fn a_change_of_lane_needs_its_room_ahead() {
    let (radius_m, dy_m) = (2.0_f64, 3.0_f64);
    let tight_m = (dy_m * (4.0 * radius_m - dy_m)).sqrt();
    let lane =
        |dx_m: f64| Word::Lsr.path(Pose::new(0.0, 0.0, 0.0), Pose::new(dx_m, dy_m, 0.0), radius_m);
    let path = lane(tight_m).unwrap();
    assert!(path.segments()[1].length_m < DEGENERATE_M);
    let turn_rad = (1.0 - dy_m / (2.0 * radius_m)).acos();
    assert!((path.length_m() - 2.0 * radius_m * turn_rad).abs() < DEGENERATE_M);
    assert!(lane(tight_m - 1e-3).is_none());
}

proptest! {
    #![proptest_config(cases())]

    /// The closed form of the paper's upper bound, against the path driven: passes, and shortest paths between them.
    #[test]
    fn a_boustrophedon_path_is_its_passes_and_the_shortest_turns_between_them(
        passes in 1..30_usize, length_m in 1.0..200.0, spacing_m in 0.1..20.0, radius_m in radii(),
    ) {
        let turn_m = shortest_m(
            Pose::new(length_m, 0.0, 0.0), Pose::new(length_m, spacing_m, PI), radius_m,
        );
        let driven_m = passes as f64 * length_m + (passes - 1) as f64 * turn_m;
        let closed_m = boustrophedon_length(passes, length_m, spacing_m, radius_m);
        prop_assert!((driven_m - closed_m).abs() < 1e-6, "{driven_m} m, not {closed_m} m");
    }
}

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn the_bounds_of_a_piece_are_those_of_the_points_on_it(
        start in poses(20.0), curvature_per_m in prop_oneof![Just(0.0), -2.0..2.0],
        length_m in 0.0..12.0,
    ) {
        let arc = Arc { start, curvature_per_m, length_m };
        let (least, most) = arc.bounds();
        let (mut low, mut high) = (start.position(), start.position());
        for piece in 0..=3000 {
            let at = arc.at(length_m * f64::from(piece) / 3000.0).position();
            (low, high) = (low.inf(&at), high.sup(&at));
        }
        // Of points 4 mm apart on a circle of half a metre, one is within 2 mm of the outermost one: 4 um lower at most.
        prop_assert!((least - low).norm() < 1e-5 && (most - high).norm() < 1e-5);
    }

    #[test]
    fn the_shortest_of_all_words_is_the_shortest_path((start, goal, radius_m) in queries()) {
        let all: Vec<DubinsPath> = words(start, goal, radius_m).collect();
        let least_m = all.iter().map(DubinsPath::length_m).fold(f64::INFINITY, f64::min);
        let shortest_m = shortest_m(start, goal, radius_m);
        // Poses that coincide are joined by nothing at all.
        prop_assert!(shortest_m <= least_m && (shortest_m >= least_m || shortest_m <= 0.0));
        for path in all {
            let end = path.arcs().last().unwrap().end();
            prop_assert!(end.distance_to(&path.at(path.length_m())) < GENERAL_M);
        }
    }
}

#[test]
fn a_radius_that_is_no_length_is_refused_by_name() {
    let pose = Pose::new(0.0, 0.0, 0.0);
    for (radius_m, got) in [(0.0, "0"), (-2.0, "-2"), (f64::NAN, "NaN"), (f64::INFINITY, "inf")] {
        let error = shortest(pose, pose, radius_m).unwrap_err();
        assert_eq!(error.to_string(), format!("`radius_m` must be finite and > 0, got {got}"));
    }
}
