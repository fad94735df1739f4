//! The candidates of the action kind `target`: what they promise holds, whatever the pasture and the mower.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use std::f64::consts::{PI, TAU};

use proptest::prelude::*;
use swath_core::action::{Action, ActionError};
use swath_core::candidates::{Candidate, Candidates, Purpose};
use swath_core::config::{ActionKind, ObservationKind, Scenario, Start, ValidScenario};
use swath_core::env::{Env, Step};
use swath_core::episode::{End, Outcome};
use swath_core::geometry::{Departure, Frame, Pose, shortest};
use swath_core::observation::Observation;
use swath_tests::cases::cases;
use swath_tests::scene::{poses, scenarios, scenes};

/// Lengths of a hundred metres worked out in two ways.
const TOLERANCE_M: f64 = 1e-9;

/// Scenarios of every geometry for the action kind `target`, with a budget and sometimes a narrow headland.
fn target_scenarios() -> impl Strategy<Value = ValidScenario> {
    let headland_m = prop_oneof![Just(f64::INFINITY), Just(10.0), 0.0..12.0];
    (scenarios(), headland_m, 1..=16_usize, 0..=8_usize, 0.5..3.0).prop_map(
        |(mut scenario, headland_m, weeds, views, budget)| {
            scenario.action.kind = ActionKind::Target;
            scenario.action.weeds = weeds;
            scenario.action.views = views;
            scenario.observation.kind = ObservationKind::Candidates;
            scenario.pasture.headland_m = headland_m;
            scenario.episode.budget = budget;
            scenario.weeds.count = scenario.weeds.count.min(60);
            scenario.check().unwrap()
        },
    )
}

/// An environment of the default pasture, changed, with these weeds.
fn pasture(weeds: &[[f64; 2]], change: impl FnOnce(&mut Scenario)) -> Env {
    let mut scenario = Scenario::default();
    scenario.action.kind = ActionKind::Target;
    scenario.weeds.positions_m = Some(weeds.to_vec());
    change(&mut scenario);
    let mut env = Env::new(&scenario.check().unwrap());
    env.reset(0);
    env
}

fn go(env: &mut Env, place: usize) -> Step {
    let mut observation = env.observation_spec().rows(1);
    let place = i64::try_from(place).unwrap();
    env.step(Action::Discrete(place), observation.as_mut()).unwrap()
}

/// The way back from there would take a look for each 0.2 m.
#[test]
fn a_decision_ends_after_20_km() {
    let mut env = pasture(&[[50.0, 20.0]], |scenario| {
        scenario.pasture.headland_m = f64::INFINITY;
        scenario.episode.budget = f64::INFINITY;
        scenario.mower.start = Start::Pose([1e7, 20.0, 0.0]);
    });
    let (place, candidate) = open(&mut env)[0];
    assert!(candidate.way.length_m() > 9.9e6);
    let step = go(&mut env, place);
    assert_eq!(step.end, End::Running);
    assert!((step.distance_m - 20_000.0).abs() < 0.3, "{} m", step.distance_m);
}

fn open(env: &mut Env) -> Vec<(usize, Candidate)> {
    let rows = env.candidates().rows().iter().enumerate();
    rows.filter_map(|(place, row)| row.map(|candidate| (place, candidate))).collect()
}

/// Plays until the end, or for `steps` decisions: an index among the open candidates is drawn from `draws`.
fn play(
    env: &mut Env,
    draws: &[prop::sample::Index],
    mut each: impl FnMut(&mut Env, usize, &Step),
) {
    for draw in draws {
        let open = open(env);
        let (place, _) = open[draw.index(open.len())];
        let step = go(env, place);
        each(env, place, &step);
        if step.end != End::Running {
            break;
        }
    }
}

fn draws(most: usize) -> impl Strategy<Value = Vec<prop::sample::Index>> {
    proptest::collection::vec(any::<prop::sample::Index>(), 0..most)
}

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn a_departure_finds_the_shortest_path_and_nothing_beyond_its_limit(
        start in poses(20.0), goal in poses(20.0), radius_m in 0.3..6.0, share in 0.5..1.5,
    ) {
        let heading_rad = goal.heading_rad.rem_euclid(TAU);
        let goal = Pose { heading_rad, ..goal };
        let length_m = shortest(start, goal, radius_m).unwrap().length_m();
        let departure = Departure::new(start, radius_m);
        let path = departure.shortest_below(&Frame::from(goal), f64::INFINITY).unwrap();
        prop_assert!((path.length_m() - length_m).abs() < TOLERANCE_M, "{} {}", path.length_m(), length_m);
        let end = path.at(path.length_m());
        prop_assert!(end.distance_to(&goal) < TOLERANCE_M, "{:?}", end);
        prop_assert!((end.heading_rad - heading_rad).sin().abs() < TOLERANCE_M);
        let below = departure.shortest_below(&Frame::from(goal), share * length_m);
        if share > 1.0 + 1e-9 {
            prop_assert!((below.unwrap().length_m() - length_m).abs() < TOLERANCE_M);
        } else if share < 1.0 - 1e-9 {
            prop_assert!(below.is_none());
        }
    }

    /// All 48 approaches worked out one by one; the mower may know a shorter one, on full lock or straight ahead.
    #[test]
    fn a_weed_is_approached_at_the_cheapest_of_16_headings_and_3_offsets(
        mut scene in scenes(), (weeds, views) in (1..=12_usize, 0..=6_usize),
    ) {
        scene.scenario.action.weeds = weeds;
        scene.scenario.action.views = views;
        let env = scene.driven();
        let view = env.view();
        let mut candidates = Candidates::new(&scene.scenario.action, env.site(), *view.ground.grid());
        candidates.refresh(&view);
        let radius_m = view.site.turning_radius_m;
        for row in &candidates.rows()[..weeds] {
            let Some(Candidate { purpose: Purpose::Weed(number), way, .. }) = row else { continue };
            let weed = view.known_weeds.iter().find(|weed| weed.number == *number).unwrap().position;
            let mut best_m = f64::INFINITY;
            for heading in 0..16 {
                let heading_rad = f64::from(heading) * PI / 8.0;
                let (sin, cos) = heading_rad.sin_cos();
                for left_m in [-0.9, 0.0, 0.9].map(|share| share * 0.5 * view.site.deck_width_m) {
                    let goal = Pose::new(weed.x + left_m * sin, weed.y - left_m * cos, heading_rad);
                    best_m = best_m.min(shortest(view.pose, goal, radius_m).unwrap().length_m());
                }
            }
            let length_m = way.length_m() - 1e-3;
            prop_assert!(length_m < best_m + TOLERANCE_M, "{} m, not {} m", length_m, best_m);
            let is_single_arc = way.segments().iter().filter(|segment| segment.length_m > 1e-2).count() <= 1;
            prop_assert!(is_single_arc || length_m > best_m - TOLERANCE_M, "{} m, not {} m", length_m, best_m);
        }
    }

    #[test]
    fn an_open_weed_is_mowed_unless_something_new_is_detected(
        scenario in target_scenarios(), seed in any::<u64>(), draws in draws(40),
    ) {
        let mut env = Env::new(&scenario);
        env.reset(seed);
        for draw in &draws {
            let open = open(&mut env);
            let (place, candidate) = open[draw.index(open.len())];
            let detected = env.view().weeds_detected;
            let step = go(&mut env, place);
            prop_assert!(!step.is_clipped);
            if let Purpose::Weed(number) = candidate.purpose
                && env.view().weeds_detected == detected
                && !matches!(step.end, End::Truncated(Outcome::Budget))
            {
                prop_assert!(step.weeds_mowed > 0, "{:?}", candidate);
                prop_assert!(env.view().known_weeds.iter().all(|weed| weed.number != number));
            }
            if step.end != End::Running {
                break;
            }
        }
    }

    #[test]
    fn a_view_shows_unseen_ground_unless_a_weed_is_detected(
        scenario in target_scenarios(), seed in any::<u64>(), draws in draws(40),
    ) {
        let mut env = Env::new(&scenario);
        env.reset(seed);
        for draw in &draws {
            let open = open(&mut env);
            let (place, candidate) = open[draw.index(open.len())];
            let (detected, unseen) = (env.view().weeds_detected, env.view().ground.unseen_count());
            let step = go(&mut env, place);
            if step.end != End::Running {
                break;
            }
            if candidate.purpose == Purpose::View && env.view().weeds_detected == detected {
                prop_assert!(env.view().ground.unseen_count() < unseen, "{:?}", candidate);
            }
        }
    }

    #[test]
    fn the_search_alone_sees_all_ground_and_wins(mut scenario in scenarios(), seed in any::<u64>()) {
        scenario.action.kind = ActionKind::Target;
        scenario.episode.budget = 100.0;
        scenario.weeds.count = scenario.weeds.count.min(40);
        let mut env = Env::new(&scenario.check().unwrap());
        env.reset(seed);
        let end = loop {
            let last = env.candidates().rows().len() - 1;
            let step = go(&mut env, last);
            if step.end != End::Running {
                break step.end;
            }
        };
        prop_assert_eq!(end, End::Terminated(Outcome::Goal));
        prop_assert_eq!(env.view().ground.unseen_count(), 0);
        prop_assert!(env.view().known_weeds.is_empty());
    }

    #[test]
    fn the_search_is_always_open_and_stands_for_what_is_closed(
        scenario in target_scenarios(), seed in any::<u64>(), draws in draws(30),
    ) {
        let mut env = Env::new(&scenario);
        env.reset(seed);
        let choices = scenario.action.candidates();
        for draw in &draws {
            let mut mask = vec![false; choices];
            env.action_mask(&mut mask);
            prop_assert!(mask[choices - 1]);
            let place = draw.index(choices);
            let mut twin = env.clone();
            let step = go(&mut env, place);
            prop_assert_eq!(step.is_clipped, !mask[place]);
            if !mask[place] {
                let last = go(&mut twin, choices - 1);
                prop_assert_eq!(Step { is_clipped: false, ..step }, last);
                prop_assert_eq!(env.snapshot(), twin.snapshot());
            }
            if step.end != End::Running {
                break;
            }
        }
    }

    #[test]
    fn every_decision_moves_and_sums_what_happened(
        scenario in target_scenarios(), seed in any::<u64>(), draws in draws(40),
    ) {
        let mut env = Env::new(&scenario);
        env.reset(seed);
        let mut before = env.summary();
        play(&mut env, &draws, |env, _, step| {
            let after = env.summary();
            assert!(step.distance_m > 0.0);
            assert!((after.path_length_m - before.path_length_m - step.distance_m).abs() < TOLERANCE_M);
            assert_eq!(after.weeds_mowed - before.weeds_mowed, step.weeds_mowed as usize);
            let worth = f64::from(step.weeds_mowed) - step.distance_m;
            assert!((step.terms.weed + step.terms.path - worth).abs() < TOLERANCE_M);
            before = after;
        });
    }

    /// The looks are 0.2 m apart; none before the last may have detected anything.
    #[test]
    fn a_decision_ends_at_the_look_that_detects_something(
        scenario in target_scenarios(), seed in any::<u64>(), draws in draws(30),
    ) {
        let mut env = Env::new(&scenario);
        env.reset(seed);
        for draw in &draws {
            let open = open(&mut env);
            let (place, candidate) = open[draw.index(open.len())];
            let (detected, path_m) = (env.view().weeds_detected, env.view().path_m);
            let mut twin = env.clone();
            let step = go(&mut env, place);
            if env.view().weeds_detected > detected {
                let looks = env.view().path_m / 0.2;
                prop_assert!((looks - looks.round()).abs() < 1e-6, "{} m", env.view().path_m);
                let mut left_m = (env.view().path_m - path_m - 0.1).max(0.0);
                for segment in candidate.way.segments() {
                    let distance_m = segment.length_m.min(left_m);
                    let curvature_per_m = segment.curvature_per_m;
                    twin.drive(swath_core::action::Command { curvature_per_m, distance_m }).unwrap();
                    left_m -= distance_m;
                }
                prop_assert_eq!(twin.view().weeds_detected, detected);
            }
            if step.end != End::Running {
                break;
            }
        }
    }

    /// The search may have to leave where there is no other way; weeds and views that ask for that are closed.
    #[test]
    fn the_way_to_a_weed_or_a_view_stays_within_the_headland(
        scenario in target_scenarios(), seed in any::<u64>(), draws in draws(30),
    ) {
        let mut env = Env::new(&scenario);
        env.reset(seed);
        let site = *env.site();
        for draw in &draws {
            let start = env.view().pose;
            for (_, candidate) in open(&mut env) {
                if candidate.purpose == Purpose::Search {
                    continue;
                }
                let mut pose = start;
                for segment in candidate.way.segments() {
                    for part in 1..=50 {
                        let distance_m = segment.length_m * f64::from(part) / 50.0;
                        let at = pose.advanced(segment.curvature_per_m, distance_m);
                        prop_assert!(site.allows(at), "{:?} on {:?}", at, candidate);
                    }
                    pose = pose.advanced(segment.curvature_per_m, segment.length_m);
                }
                prop_assert!(pose.distance_to(&candidate.way.end().pose) < TOLERANCE_M);
            }
            let open = open(&mut env);
            if go(&mut env, open[draw.index(open.len())].0).end != End::Running {
                break;
            }
        }
    }

    #[test]
    fn a_restored_environment_offers_the_same_and_decides_the_same(
        scenario in target_scenarios(), seed in any::<u64>(), (before, after) in (draws(12), draws(12)),
    ) {
        let transcript = |env: &mut Env| {
            let mut shown = vec![(env.candidates().rows().to_vec(), observation(env))];
            play(env, &after, |env, place, step| {
                shown.push((env.candidates().rows().to_vec(), observation(env)));
                assert!(!step.is_clipped, "{place}");
            });
            (shown, env.snapshot())
        };
        let mut env = Env::new(&scenario);
        env.reset(seed);
        play(&mut env, &before, |_, _, _| ());
        let snapshot = env.snapshot();
        if env.end() == Some(End::Running) {
            let first = transcript(&mut env);
            env.restore(&snapshot).unwrap();
            prop_assert_eq!(&transcript(&mut env), &first);
            let mut fresh = Env::new(&scenario);
            fresh.restore(&snapshot).unwrap();
            prop_assert_eq!(&transcript(&mut fresh), &first);
        }
    }

    #[test]
    fn every_part_of_an_observation_lies_within_its_bounds(
        scenario in target_scenarios(), seed in any::<u64>(), draws in draws(10), flat in any::<bool>(),
    ) {
        let mut scenario = (*scenario).clone();
        scenario.observation.kind = ObservationKind::Dict;
        scenario.observation.flat = flat;
        let mut env = Env::new(&scenario.check().unwrap());
        env.reset(seed);
        check_bounds(&mut env);
        play(&mut env, &draws, |env, _, _| check_bounds(env));
    }

    /// What a candidate is made of, worked out again from the poses.
    #[test]
    fn the_table_says_where_the_candidates_are(
        scenario in target_scenarios(), seed in any::<u64>(), draws in draws(20),
    ) {
        let mut env = Env::new(&scenario);
        env.reset(seed);
        play(&mut env, &draws, |_, _, _| ());
        let table = observation(&mut env).candidates;
        let rows = env.candidates().rows().to_vec();
        let (pose, range_m) = (env.view().pose, env.site().sensor_range_m);
        let budget_m = scenario.episode.budget * env.site().bcp_length_m;
        let soft = |value_m: f64| value_m / (value_m.abs() + range_m);
        let search = rows.last().copied().flatten().unwrap();
        let view = env.view();
        let known = view.known_weeds.len() as f64;
        for (row, numbers) in rows.iter().zip(table.chunks(18)) {
            let Some(candidate) = row else {
                prop_assert!(numbers.iter().all(|&number| number == 0.0));
                continue;
            };
            let goal = candidate.way.goal();
            let offset = pose.world_from_mower().inverse() * goal.position();
            let kind = match candidate.purpose {
                Purpose::Weed(_) => [1.0, 0.0, 0.0],
                Purpose::View => [0.0, 1.0, 0.0],
                Purpose::Search => [0.0, 0.0, 1.0],
            };
            let away_m = offset.x.hypot(offset.y);
            let way_m = candidate.way.length_m();
            let expected = [
                kind[0], kind[1], kind[2],
                soft(offset.x), soft(offset.y), soft(away_m),
                offset.x / away_m, offset.y / away_m,
                soft(way_m), candidate.unseen_share, (way_m / budget_m).min(1.0),
            ];
            for (number, value) in numbers.iter().zip(expected) {
                prop_assert!(away_m < 1e-6 || (f64::from(*number) - value).abs() < 1e-5, "{:?} {:?}", numbers, expected);
            }
            let end = candidate.way.end().pose;
            let turned_rad = end.heading_rad - pose.heading_rad;
            let onward = shortest(end, search.way.end().pose, view.site.turning_radius_m).unwrap();
            let straight_m = way_m - search.way.length_m();
            // Once no pass is left to search, the search is the nearest weed or a way to pass the time.
            let is_direct = candidate.purpose == Purpose::Search || view.ground.unseen_count() == 0;
            let detour_m = if is_direct { straight_m } else { straight_m + onward.length_m() };
            let grid = view.ground.grid();
            let mut unseen = 0;
            for (column, row) in (0..grid.columns()).flat_map(|column| (0..grid.rows()).map(move |row| (column, row))) {
                let from = grid.centre(column, row) - end.position();
                unseen += u32::from(from.x.abs() < range_m && from.y.abs() < range_m && !view.ground.is_seen(column, row));
            }
            let (side_x_m, side_y_m) = grid.cell_m();
            let around = f64::from(unseen) * side_x_m * side_y_m / (4.0 * range_m * range_m);
            let near = |number: f32, value: f64| (f64::from(number) - value).abs() < 1e-5;
            prop_assert!(near(numbers[11], turned_rad.cos()) && near(numbers[12], turned_rad.sin()), "{:?}", numbers);
            prop_assert!(near(numbers[13], soft(detour_m)) || near(numbers[13], soft(straight_m)), "{:?}, {} m", numbers, detour_m);
            // A cell whose centre lies on the square's border may count either way.
            let border = 2.0 * (range_m / side_x_m + range_m / side_y_m + 2.0) * side_x_m * side_y_m / (4.0 * range_m * range_m);
            prop_assert!((f64::from(numbers[14]) - around.min(1.0)).abs() < border, "{:?}, {}", numbers, around);
            prop_assert!(near(numbers[16], view.ground.fraction()) && near(numbers[17], known / (known + 10.0)), "{:?}", numbers);
        }
    }

    /// Counted cell by cell.
    #[test]
    fn the_unseen_share_is_that_of_the_triangle_at_the_end_of_the_way(
        scenario in target_scenarios(), seed in any::<u64>(), draws in draws(15),
    ) {
        let mut env = Env::new(&scenario);
        env.reset(seed);
        play(&mut env, &draws, |_, _, _| ());
        for (_, candidate) in open(&mut env) {
            let view = env.view();
            let (grid, site) = (view.ground.grid(), view.site);
            let from = candidate.way.end().pose.world_from_mower().inverse();
            let mut unseen = [0, 0];
            for row in 0..grid.rows() {
                for column in 0..grid.columns() {
                    let at = from * grid.centre(column, row);
                    let half_m = 0.5 * at.x * site.sensor_width_m / site.sensor_range_m;
                    // Cells on the border may be counted or not.
                    for (count, slack_m) in unseen.iter_mut().zip([-1e-5, 1e-5]) {
                        let is_shown = at.x <= site.sensor_range_m + slack_m && at.y.abs() <= half_m + slack_m;
                        *count += u32::from(is_shown && !view.ground.is_seen(column, row));
                    }
                }
            }
            let (length_m, width_m) = grid.size_m();
            let cell_m2 = length_m * width_m / grid.cells() as f64;
            let triangle_m2 = 0.5 * site.sensor_range_m * site.sensor_width_m;
            let [least, most] = unseen.map(|count| (f64::from(count) * cell_m2 / triangle_m2).min(1.0));
            let share = candidate.unseen_share;
            prop_assert!((least - 1e-9..=most + 1e-9).contains(&share), "{} not in {}..{}", share, least, most);
        }
    }
}

fn observation(env: &mut Env) -> Observation {
    let mut observation = env.observation_spec().rows(1);
    env.observe(observation.as_mut());
    observation
}

fn check_bounds(env: &mut Env) {
    let Observation { features, candidates, action_mask, maps } = observation(env);
    for part in env.observation_spec().parts() {
        let numbers: Vec<f32> = match part.name {
            "features" => features.clone(),
            "candidates" => candidates.clone(),
            "action_mask" => action_mask.iter().map(|&bit| f32::from(bit)).collect(),
            _ => maps.iter().map(|&value| f32::from(value)).collect(),
        };
        assert_eq!(numbers.len(), part.shape.iter().product::<usize>(), "{}", part.name);
        let last = part.bounds.len();
        assert!(last == 1 || last == part.shape[part.shape.len() - 1], "{}", part.name);
        for (i, number) in numbers.iter().enumerate() {
            let bound = &part.bounds[i % last];
            assert!((bound.low..=bound.high).contains(number), "{bound:?} is {number}");
        }
    }
}

#[test]
fn the_nearest_weeds_come_first_and_the_search_last() {
    let mut env = pasture(&[[6.0, 1.0], [3.0, 1.5], [11.0, 3.0]], |_| ());
    let rows = env.candidates().rows().to_vec();
    let purposes: Vec<Option<Purpose>> = rows.iter().map(|row| row.map(|c| c.purpose)).collect();
    let [first, second, third] = [0, 1, 2].map(|number| Some(Purpose::Weed(number)));
    assert_eq!(rows.len(), 16);
    assert_eq!(purposes[..4], [first, second, third, None]);
    assert_eq!(
        purposes[10..],
        [Some(Purpose::View); 5].into_iter().chain([Some(Purpose::Search)]).collect::<Vec<_>>()
    );
    let lengths: Vec<f64> = rows[10..15].iter().flatten().map(|c| c.way.length_m()).collect();
    assert!(lengths.is_sorted(), "{lengths:?}");
}

/// A weed 1 m ahead and 0.5 m to the left of a mower with R = 2: on full lock to the right, which swings the left end of the
/// bar forward, it is under the bar after a turn of atan(1 / 2.5), 0.69 m from its middle. All of the 48 poses take a loop.
#[test]
fn a_weed_too_near_for_any_of_the_headings_is_mowed_on_full_lock() {
    let mut env = pasture(&[[1.0, 1.5]], |_| ());
    let step = go(&mut env, 0);
    assert_eq!(step.weeds_mowed, 1);
    assert!((step.distance_m - 2.0 * 1.0_f64.atan2(2.5)).abs() < 1e-3, "{step:?}");
}

/// The triangle ends 12 m ahead: the weed at x = 20 is detected by the look at 8 m, on the way to the one at 11 m.
#[test]
fn a_detection_interrupts_the_way_to_a_weed() {
    let mut env = pasture(&[[11.0, 1.0], [20.0, 1.0]], |_| ());
    let step = go(&mut env, 0);
    assert!((step.distance_m - 8.0).abs() < 1e-9, "{step:?}");
    assert_eq!((step.weeds_mowed, env.view().weeds_detected), (0, 2));
    assert_eq!(go(&mut env, 0).weeds_mowed, 1);
}

#[test]
fn the_budget_cuts_a_decision() {
    let mut env = pasture(&[[11.0, 1.0]], |scenario| scenario.episode.budget = 0.003);
    let step = go(&mut env, 0);
    assert_eq!(step.end, End::Truncated(Outcome::Budget));
    assert!((step.distance_m - 0.003 * env.site().bcp_length_m).abs() < 1e-9, "{step:?}");
    assert!(!step.end.is_failure());
}

#[test]
fn a_choice_that_there_is_not_is_refused_and_changes_nothing() {
    let mut env = pasture(&[[3.0, 1.5]], |_| ());
    let before = env.snapshot();
    let mut observation = env.observation_spec().rows(1);
    for got in [-1, 16, i64::MAX] {
        let error = env.step(Action::Discrete(got), observation.as_mut()).unwrap_err();
        assert_eq!(error, ActionError::Choice { choices: 16, got });
        assert_eq!(error.to_string(), format!("`action` must be from 0 to 15, got {got}"));
    }
    let error = env.step(Action::Continuous(&[0.0]), observation.as_mut()).unwrap_err();
    assert_eq!(error.to_string(), "`action` must be one whole number");
    assert_eq!(env.snapshot(), before);
}

/// Without limits the episode goes on when all is seen and mowed; the mower turns on the spot, within the headland.
#[test]
fn when_nothing_is_left_the_search_turns_circles() {
    let mut env = pasture(&[], |scenario| {
        scenario.pasture.length_m = 10.0;
        scenario.pasture.width_m = 10.0;
    });
    env.lift_limits();
    for _ in 0..100 {
        assert_eq!(go(&mut env, 15).end, End::Running);
    }
    assert_eq!(env.view().ground.unseen_count(), 0);
    let step = go(&mut env, 15);
    assert!((step.distance_m - TAU * 2.0).abs() < 1e-9, "{step:?}");
}

/// Four passes 12 m apart, turns included, are a boustrophedon path of 442.85 m, by its closed form. The search may cut the
/// ends of its passes, which lie 10 m apart, and has the corners to look into.
#[test]
fn the_search_of_the_default_pasture_is_about_as_long_as_four_passes() {
    let mut env = pasture(&[], |_| ());
    while go(&mut env, 15).end == End::Running {}
    let path_m = env.view().path_m;
    assert!((0.8 * 442.85..1.1 * 442.85).contains(&path_m), "{path_m} m");
}
