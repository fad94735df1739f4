//! The reward is weeds mowed minus metres driven; an episode ends when the problem is solved, at the budget to the
//! millimetre, for standing still, or by a failure, which never pays.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use std::f64::consts::PI;

use proptest::prelude::*;
use swath_core::action::{Action, Command};
use swath_core::config::{ActionKind, Scenario, Start};
use swath_core::env::{Env, Step};
use swath_core::episode::{End, Outcome};
use swath_tests::cases::cases;
use swath_tests::scene::scenarios;

const AHEAD: f32 = 0.0;

fn env_of(scenario: &Scenario) -> Env {
    let mut env = Env::new(&scenario.clone().check().unwrap());
    env.reset(1);
    env
}

fn step(env: &mut Env, action: &[f32]) -> Step {
    let mut observation = env.observation_spec().rows(1);
    env.step(Action::Continuous(action), observation.as_mut()).unwrap()
}

fn seen_cells(env: &Env) -> usize {
    let view = env.view();
    view.ground.grid().cells() - view.ground.unseen_count()
}

fn straight(distance_m: f64) -> Command {
    Command { curvature_per_m: 0.0, distance_m }
}

/// One pass: bar and pasture 2 m wide, a triangle 2 m deep and wide, no weeds unless given.
fn strip(length_m: f64, weeds: &[[f64; 2]]) -> Scenario {
    let mut scenario = Scenario::default();
    scenario.pasture.length_m = length_m;
    scenario.pasture.width_m = 2.0;
    scenario.weeds.positions_m = Some(weeds.to_vec());
    scenario.sensor.range_m = 2.0;
    scenario.sensor.width_m = 2.0;
    scenario
}

/// Length of n passes of L at a spacing s: `n L + (n - 1) R (pi + 4 acos((2R + s) / 4R))`, or with straight pieces in the turns.
fn bcp_length_m(scenario: &Scenario) -> f64 {
    let (pasture, mower) = (&scenario.pasture, &scenario.mower);
    let passes = (pasture.width_m / mower.deck_width_m - 1e-9).ceil();
    let (r, s) = (mower.turning_radius_m, mower.deck_width_m);
    let turn_m = if s < 2.0 * r {
        r * (PI + 4.0 * ((2.0 * r + s) / (4.0 * r)).acos())
    } else {
        PI * r + s - 2.0 * r
    };
    passes * pasture.length_m + (passes - 1.0) * turn_m
}

/// Scenarios in which episodes end: a budget, a headland, a goal, weights.
fn ending_scenarios() -> impl Strategy<Value = Scenario> {
    (scenarios(), 0.02..1.0, 0.0..12.0, 0.1..3.0, 0.3..=1.0, (0.0..5.0, 0.1..3.0)).prop_map(
        |(mut scenario, budget, headland_m, control_period_s, seen_goal, (weed, path_per_m))| {
            scenario.episode.budget = budget;
            scenario.pasture.headland_m = headland_m;
            scenario.episode.control_period_s = control_period_s;
            scenario.episode.seen_goal = seen_goal;
            scenario.reward.weed = weed;
            scenario.reward.path_per_m = path_per_m;
            scenario
        },
    )
}

/// Plays until the episode ends, one steering after the other and again from the first.
fn play_to_the_end(env: &mut Env, steering: &[f32]) -> Vec<Step> {
    let mut steps = Vec::new();
    for action in steering.iter().cycle() {
        steps.push(step(env, &[*action]));
        if env.end() != Some(End::Running) {
            break;
        }
    }
    steps
}

fn steering() -> impl Strategy<Value = Vec<f32>> {
    proptest::collection::vec(prop_oneof![Just(0.0_f32), -1.0..=1.0_f32], 1..30)
}

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn the_reward_is_weeds_mowed_minus_metres_driven(
        scenario in ending_scenarios(), steering in steering(),
    ) {
        let mut env = env_of(&scenario);
        let weights = &scenario.reward;
        for step in play_to_the_end(&mut env, &steering) {
            let weed = weights.weed * f64::from(step.weeds_mowed);
            prop_assert!((step.terms.weed - weed).abs() < 1e-9);
            prop_assert!((step.terms.path + weights.path_per_m * step.distance_m).abs() < 1e-9);
            let total = step.terms.weed + step.terms.path + step.terms.failure;
            prop_assert!((step.terms.total() - total).abs() < 1e-9);
            prop_assert!(step.terms.failure == 0.0 || step.end.is_failure());
        }
    }

    #[test]
    fn rewards_add_up_to_the_episodes_weeds_and_path(
        scenario in ending_scenarios(), steering in steering(),
    ) {
        let mut env = env_of(&scenario);
        let steps = play_to_the_end(&mut env, &steering);
        let sum = |term: fn(&Step) -> f64| steps.iter().map(term).sum::<f64>();
        let summary = env.summary();
        let weeds = scenario.reward.weed * summary.weeds_mowed as f64;
        let path = scenario.reward.path_per_m * summary.path_length_m;
        prop_assert!((sum(|step| step.terms.weed) - weeds).abs() < 1e-6);
        prop_assert!((sum(|step| step.terms.path) + path).abs() < 1e-6);
    }

    /// Whatever an episode ended by, it cost at most its budget; if it ended by a failure or at the budget, exactly that.
    #[test]
    fn leaving_the_headland_costs_the_whole_budget_and_nothing_costs_more(
        scenario in ending_scenarios(), steering in steering(),
    ) {
        let mut env = env_of(&scenario);
        let steps = play_to_the_end(&mut env, &steering);
        let budget_m = scenario.episode.budget * bcp_length_m(&scenario);
        let cost = -steps.iter().map(|step| step.terms.path + step.terms.failure).sum::<f64>();
        let full_cost = scenario.reward.path_per_m * budget_m;
        prop_assert!(cost <= full_cost + 1e-6);
        let is_full = matches!(
            env.end(),
            Some(End::Terminated(Outcome::LeftHeadland) | End::Truncated(Outcome::Budget))
        );
        prop_assert!(!is_full || (cost - full_cost).abs() < 1e-6, "{cost}, not {full_cost}");
    }

    #[test]
    fn an_episode_at_its_budget_ends_there_exactly(
        scenario in ending_scenarios(), steering in steering(),
    ) {
        let mut env = env_of(&scenario);
        play_to_the_end(&mut env, &steering);
        let budget_m = scenario.episode.budget * bcp_length_m(&scenario);
        let path_m = env.view().path_m;
        prop_assert!(path_m <= budget_m + 1e-9, "{path_m} m of {budget_m} m");
        if env.end() == Some(End::Truncated(Outcome::Budget)) {
            prop_assert!((path_m - budget_m).abs() < 1e-9, "{path_m} m of {budget_m} m");
        }
    }

    /// The headland is watched at every look, so the mower is stopped within 0.2 m of leaving it.
    #[test]
    fn a_mower_that_left_is_just_outside_and_one_that_did_not_is_not_further(
        scenario in ending_scenarios(), steering in steering(),
    ) {
        let mut env = env_of(&scenario);
        for action in steering.iter().cycle() {
            let end = step(&mut env, &[*action]).end;
            let (pose, pasture) = (env.view().pose, &scenario.pasture);
            let outside_m = [
                -pose.x_m, pose.x_m - pasture.length_m, -pose.y_m, pose.y_m - pasture.width_m,
            ].into_iter().fold(f64::NEG_INFINITY, f64::max) - pasture.headland_m;
            if end == End::Terminated(Outcome::LeftHeadland) {
                prop_assert!(outside_m > 0.0 && outside_m < 0.2 + 1e-9, "{outside_m} m outside");
            } else {
                // Between looks nobody watches, so that leaving does not depend on how the way is cut into steps.
                prop_assert!(outside_m < 0.2 + 1e-9, "{outside_m} m outside");
            }
            if end != End::Running {
                break;
            }
        }
    }

    /// The goal is what it says: enough cells seen, every detected weed mowed; and no running episode fulfils it.
    #[test]
    fn an_episode_ends_by_its_goal_exactly_when_the_goal_is_reached(
        scenario in ending_scenarios(), steering in steering(),
    ) {
        let mut env = env_of(&scenario);
        for action in steering.iter().cycle() {
            let end = step(&mut env, &[*action]).end;
            let summary = env.summary();
            let is_mowed = env.weeds().is_mowed();
            let is_open = |number: usize| env.weeds().is_detected()[number] && !is_mowed[number];
            let is_all_mowed = !(0..is_mowed.len()).any(is_open);
            let is_reached = is_all_mowed && summary.seen_fraction >= scenario.episode.seen_goal - 1e-9;
            match end {
                End::Terminated(Outcome::Goal) => prop_assert!(is_reached),
                End::Terminated(_) => {}
                End::Truncated(_) | End::Running => prop_assert!(!is_reached),
            }
            if end != End::Running {
                break;
            }
        }
    }
}

/// 6 x 2 m with a triangle of 12 x 12 m: at the start only the two cells beside the mower are unseen, and the bar sees them
/// half a metre on. The weed at 2.9 m is mowed in the sixth step of 0.5 m: 1 - 3 in all.
#[test]
fn a_small_pasture_fully_seen_with_its_weed_mowed_is_won() {
    let mut scenario = strip(6.0, &[[2.9, 1.5]]);
    scenario.sensor.range_m = 12.0;
    scenario.sensor.width_m = 12.0;
    let mut env = env_of(&scenario);
    assert_eq!(seen_cells(&env), 10);
    let steps: Vec<Step> = (0..6).map(|_| step(&mut env, &[AHEAD])).collect();
    assert!(steps[..5].iter().all(|step| step.end == End::Running && step.weeds_mowed == 0));
    assert_eq!(steps[5].end, End::Terminated(Outcome::Goal));
    assert!(!steps[5].end.is_failure());
    assert_eq!(env.end(), Some(End::Terminated(Outcome::Goal)));
    assert_eq!(Outcome::Goal.name(), "goal");
    assert_eq!(steps[5].weeds_mowed, 1);
    let total: f64 = steps.iter().map(|step| step.terms.total()).sum();
    assert!((total - (1.0 - 3.0)).abs() < 1e-12, "{total}");
    assert_eq!(seen_cells(&env), 12);
}

/// On a strip of ten columns the look at 2.6 m is the first that shows column 4 (its middle at 4.5 m), so half the ground
/// is seen there and not before.
#[test]
fn half_the_ground_is_enough_where_the_goal_says_so() {
    let mut scenario = strip(10.0, &[]);
    scenario.episode.seen_goal = 0.5;
    let mut env = env_of(&scenario);
    assert_eq!(env.drive(straight(2.59)).unwrap().end, End::Running);
    assert_eq!(seen_cells(&env), 8);
    assert_eq!(env.drive(straight(0.01)).unwrap().end, End::Terminated(Outcome::Goal));
    assert_eq!(seen_cells(&env), 10);
}

/// A weed at 4.2 m is detected at 2.2 m, before half the ground is seen: it must be mowed first. One at 9 m, which nobody
/// has detected, need not.
#[test]
fn a_detected_weed_must_be_mowed_before_the_goal_and_an_undetected_one_need_not() {
    let mut scenario = strip(10.0, &[[4.2, 1.0], [9.0, 1.0]]);
    scenario.episode.seen_goal = 0.5;
    let mut env = env_of(&scenario);
    assert_eq!(env.drive(straight(4.1)).unwrap().end, End::Running);
    assert_eq!(env.view().weeds_detected, 1);
    let step = env.drive(straight(0.1)).unwrap();
    assert_eq!((step.end, step.weeds_mowed), (End::Terminated(Outcome::Goal), 1));
}

/// One pass of 10 m and a control period of 0.5 m: four budgets are 80 steps.
#[test]
fn standing_still_ends_after_four_budgets_of_steps() {
    let mut scenario = strip(10.0, &[[9.9, 0.1]]);
    scenario.action.kind = ActionKind::Drive;
    let mut env = env_of(&scenario);
    for _ in 0..79 {
        let step = step(&mut env, &[0.5, -1.0]);
        assert_eq!((step.end, step.distance_m, step.terms.total()), (End::Running, 0.0, 0.0));
    }
    let last = step(&mut env, &[0.5, -1.0]);
    // It is charged what driving the budget of one pass would have cost: standing still does not pay.
    assert_eq!((last.end, last.terms.total()), (End::Truncated(Outcome::StepLimit), -10.0));
    assert_eq!(Outcome::StepLimit.name(), "step_limit");
    assert!(env.summary().path_length_m.abs() < 1e-12);
}

/// The budget of a strip of 10.3 m is 10.3 m; with half of it the last step of 0.5 m is cut to 0.15 m.
#[test]
fn the_last_step_is_cut_to_end_at_the_budget() {
    let mut scenario = strip(10.3, &[[10.2, 0.1]]);
    scenario.episode.budget = 0.5;
    let mut env = env_of(&scenario);
    for _ in 0..10 {
        assert_eq!(step(&mut env, &[AHEAD]).end, End::Running);
    }
    let last = step(&mut env, &[AHEAD]);
    assert_eq!(last.end, End::Truncated(Outcome::Budget));
    assert_eq!(Outcome::Budget.name(), "budget");
    assert!((last.distance_m - 0.15).abs() < 1e-12 && (last.terms.total() + 0.15).abs() < 1e-12);
    assert!((env.summary().path_length_m - 5.15).abs() < 1e-12);
}

/// Straight on from the corner of the default pasture the headland ends at 110 m. The rest of the budget of 2229.236 m is
/// charged, so an agent that quits has paid as much as one that drove it all.
#[test]
fn quitting_over_the_headland_costs_what_driving_on_would_have_cost() {
    let mut scenario = Scenario::default();
    scenario.weeds.positions_m = Some(vec![[50.0, 1.0], [60.0, 30.0]]);
    let mut env = env_of(&scenario);
    let first = env.drive(straight(110.0)).unwrap();
    assert_eq!((first.end, first.terms.total()), (End::Running, 1.0 - 110.0));
    let last = env.drive(straight(5.0)).unwrap();
    assert_eq!(last.end, End::Terminated(Outcome::LeftHeadland));
    assert!(last.end.is_failure());
    assert_eq!(Outcome::LeftHeadland.name(), "left_headland");
    assert!((last.distance_m - 0.2).abs() < 1e-9, "stopped at the next look: {last:?}");
    let total = first.terms.total() + last.terms.total();
    assert!((total - (1.0 - 2229.236)).abs() < 1e-3, "{total}");
}

/// A weight of zero charges nothing, not even the rest of an endless budget.
#[test]
fn nothing_is_charged_for_the_way_where_it_has_no_weight() {
    let mut scenario = Scenario::default();
    scenario.reward.path_per_m = 0.0;
    scenario.episode.budget = f64::INFINITY;
    let mut env = env_of(&scenario);
    let step = env.drive(straight(200.0)).unwrap();
    assert_eq!(step.end, End::Terminated(Outcome::LeftHeadland));
    assert_eq!((step.terms.path, step.terms.failure), (0.0, 0.0));
}

/// A learner cannot use a reward of minus infinity.
#[test]
fn every_reward_is_finite_even_where_the_budget_is_not() {
    let mut scenario = Scenario::default();
    scenario.episode.budget = f64::INFINITY;
    let mut env = env_of(&scenario);
    let step = env.drive(straight(200.0)).unwrap();
    assert_eq!(step.end, End::Terminated(Outcome::LeftHeadland));
    assert!(step.terms.total().is_finite(), "{:?}", step.terms);
}

#[test]
fn without_limits_only_the_headland_ends_an_episode() {
    let mut scenario = strip(4.0, &[]);
    scenario.episode.seen_goal = 0.1;
    scenario.mower.start = Start::Pose([2.0, 1.0, 0.0]);
    let mut env = Env::new(&scenario.check().unwrap());
    env.lift_limits();
    env.reset(0);
    let circle = Command { curvature_per_m: 0.5, distance_m: 1000.0 };
    assert_eq!(env.drive(circle).unwrap().end, End::Running);
    for _ in 0..100 {
        assert_eq!(env.drive(straight(0.0)).unwrap().end, End::Running);
    }
    let end = env.drive(straight(100.0)).unwrap().end;
    assert_eq!(end, End::Terminated(Outcome::LeftHeadland));
}

/// A mower that grazes the end of the headland between two looks, cut into ever more steps: it stays, or it goes, in all.
#[test]
fn leaving_the_headland_does_not_depend_on_how_the_way_is_cut() {
    for start_y_m in [49.4143, 49.9] {
        let mut ends = Vec::new();
        for steps in [1, 3, 7, 20, 50, 400] {
            let mut scenario = Scenario::default();
            scenario.mower.start = Start::Pose([50.0, start_y_m, std::f64::consts::FRAC_PI_4]);
            let mut env = env_of(&scenario);
            let command = Command { curvature_per_m: -0.5, distance_m: 3.2 / f64::from(steps) };
            let end = (0..steps).map_while(|_| env.drive(command).ok()).last().unwrap().end;
            ends.push((end, (env.view().path_m * 1e6).round()));
        }
        assert!(ends.windows(2).all(|pair| pair[0] == pair[1]), "{ends:?}");
    }
}
