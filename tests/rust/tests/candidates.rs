//! The candidates of the action kind `target`: what they promise holds, whatever the pasture and the mower.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use std::f64::consts::{PI, TAU};

use proptest::prelude::*;
use swath_core::action::{Action, ActionError};
use swath_core::candidates::{Candidate, Candidates, Purpose};
use swath_core::config::{ActionKind, ObservationKind, Scenario, ValidScenario};
use swath_core::env::{Beginning, Env, Step};
use swath_core::episode::{End, Outcome};
use swath_core::geometry::{Departure, Frame, Point, Pose, shortest};
use swath_core::observation::Observation;
use swath_tests::cases::cases;
use swath_tests::scene::{Scene, poses, scenarios, scenes};

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
            scenario.observation.kind = ObservationKind::Dict;
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
}
