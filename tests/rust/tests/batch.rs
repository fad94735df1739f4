//! A row of a batch is an environment like any other, for any number of rows and threads; and a step allocates nothing.

#![cfg(test)] // for helpers, too, an unwrap is a failing test
#![expect(clippy::float_cmp, reason = "the same bits are promised")]

use proptest::prelude::*;
use swath_core::action::{Action, ActionError};
use swath_core::batch::{Actions, Autoreset, BatchEnv, BatchError, BatchOptions};
use swath_core::config::{ActionKind, ObservationKind, Scenario, ValidScenario};
use swath_core::env::{Beginning, Env};
use swath_core::episode::{End, Outcome};
use swath_tests::cases::cases;
use swath_tests::columns::Columns;
use swath_tests::scene::scenarios;

const MODES: [Autoreset; 3] = [Autoreset::NextStep, Autoreset::SameStep, Autoreset::Disabled];

/// A pasture on which episodes last some ten steps and end in different ways.
fn short() -> ValidScenario {
    short_scenario().check().unwrap()
}

fn short_scenario() -> Scenario {
    let mut scenario = Scenario::default();
    scenario.pasture.headland_m = 2.0;
    scenario.episode.budget = 0.003;
    scenario.episode.control_period_s = 1.0;
    scenario
}

fn batch(scenario: &ValidScenario, rows: usize, autoreset: Autoreset, threads: usize) -> BatchEnv {
    BatchEnv::new(scenario, BatchOptions { rows, autoreset, threads }).unwrap()
}

/// Steering that differs between rows and steps and sometimes has to be clipped.
fn steering(step: usize, rows: usize) -> Vec<f32> {
    let angle = |row: usize| (step * 31 + row * 17) as f32;
    (0..rows).map(|row| 1.1 * angle(row).sin()).collect()
}

/// Steps environments one by one, as each mode promises, and holds a batch against them.
fn follow(scenario: &ValidScenario, rows: usize, autoreset: Autoreset, threads: usize, seed: u64) {
    let mut batch = batch(scenario, rows, autoreset, threads);
    batch.reset(seed);
    let mut alone: Vec<Env> = (0..rows).map(|_| Env::new(scenario)).collect();
    for (env, ahead) in alone.iter_mut().zip(0..) {
        env.reset(seed.wrapping_add(ahead));
    }
    let mut row = alone[0].observation_spec().rows(1);
    let size = row.features.len();
    let mut columns = Columns::of(&batch);
    batch.observe(columns.observation.as_mut());
    for (index, env) in alone.iter_mut().enumerate() {
        env.observe(row.as_mut());
        assert_eq!(row.features, columns.observation.features[index * size..(index + 1) * size]);
    }
    for step in 0..25 {
        let actions = steering(step, rows);
        columns = Columns::of(&batch);
        let ended = batch.step(Actions::Continuous(&actions), columns.as_mut()).unwrap();
        assert_eq!(ended, (0..rows).filter(|&row| columns.has_ended(row)).count());
        for (index, env) in alone.iter_mut().enumerate() {
            let terms = || [0, 1, 2].map(|term| columns.terms[term][index]);
            if matches!(env.end(), Some(End::Running)) {
                let one =
                    env.step(Action::Continuous(&actions[index..=index]), row.as_mut()).unwrap();
                let expected = [one.terms.weed, one.terms.path, one.terms.failure];
                assert_eq!(columns.reward[index], one.terms.total());
                assert_eq!(columns.terminated[index], matches!(one.end, End::Terminated(_)));
                assert_eq!(columns.truncated[index], matches!(one.end, End::Truncated(_)));
                if let End::Terminated(outcome) | End::Truncated(outcome) = one.end {
                    let last = batch.last(index).unwrap();
                    assert_eq!((last.summary, last.outcome), (env.summary(), outcome));
                    assert_eq!((last.terms, last.is_clipped), (one.terms, one.is_clipped));
                }
                if one.end != End::Running && autoreset == Autoreset::SameStep {
                    let last = &batch.last_observation().features[index * size..][..size];
                    assert_eq!(row.features, last);
                    env.reset_next(Beginning::default());
                    env.observe(row.as_mut());
                    assert_eq!((terms(), columns.is_clipped[index]), ([0.0; 3], false));
                } else {
                    assert_eq!((terms(), columns.is_clipped[index]), (expected, one.is_clipped));
                }
            } else {
                assert_eq!(autoreset, Autoreset::NextStep);
                env.reset_next(Beginning::default());
                env.observe(row.as_mut());
                assert_eq!((columns.reward[index], terms()), (0.0, [0.0; 3]));
                assert!(!columns.has_ended(index) && !columns.is_clipped[index]);
            }
            assert_eq!(
                row.features,
                columns.observation.features[index * size..(index + 1) * size]
            );
        }
        if autoreset == Autoreset::Disabled {
            for index in (0..rows).filter(|&row| columns.has_ended(row)) {
                batch.reset_row(index, None, Beginning::default());
                alone[index].reset_next(Beginning::default());
            }
        }
    }
    for (one, env) in batch.rows().iter().zip(&alone) {
        assert_eq!(one.snapshot(), env.snapshot());
    }
}

#[test]
fn rows_go_the_way_of_single_environments_whatever_their_number_and_that_of_threads() {
    for autoreset in MODES {
        for (rows, threads) in [(1, 1), (3, 2), (64, 1), (300, 1), (300, 2), (301, 4)] {
            follow(&short(), rows, autoreset, threads, 5);
        }
    }
}

#[test]
fn seeds_go_around_at_the_end_of_their_range() {
    follow(&short(), 3, Autoreset::NextStep, 1, u64::MAX - 1);
}

#[test]
fn the_episodes_above_end_in_more_than_one_way() {
    let mut batch = batch(&short(), 64, Autoreset::SameStep, 1);
    batch.reset(5);
    let mut outcomes = Vec::new();
    for step in 0..25 {
        let mut columns = Columns::of(&batch);
        batch.step(Actions::Continuous(&steering(step, 64)), columns.as_mut()).unwrap();
        outcomes.extend((0..64).filter_map(|row| batch.last(row).map(|last| last.outcome)));
    }
    assert!(outcomes.contains(&Outcome::Budget) && outcomes.contains(&Outcome::LeftHeadland));
}

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn rows_of_any_scenario_go_the_way_of_single_environments(
        scenario in scenarios(), seed in any::<u64>(), mode in 0..3_usize, budget in 0.01..0.3,
    ) {
        let mut scenario = scenario;
        scenario.episode.budget = budget;
        follow(&scenario.check().unwrap(), 3, MODES[mode], 1, seed);
    }
}

/// From the first step on, over ends and new beginnings, whatever is sent and shown.
///
/// Counted on one thread: with more, it is the pool's queue that may grow.
#[test]
fn a_step_allocates_nothing() {
    use ObservationKind::{Candidates, Dict, Features, Maps};
    for autoreset in [Autoreset::NextStep, Autoreset::SameStep] {
        for (action, observation) in [
            (ActionKind::Steer, Features),
            (ActionKind::Steer, Dict),
            (ActionKind::Discrete, Maps),
            (ActionKind::Target, Candidates),
            (ActionKind::Target, Dict),
        ] {
            let mut scenario = short_scenario();
            scenario.action.kind = action;
            scenario.observation.kind = observation;
            let mut batch = batch(&scenario.check().unwrap(), 8, autoreset, 1);
            batch.reset(0);
            let mut columns = Columns::of(&batch);
            let steering: Vec<Vec<f32>> = (0..100).map(|step| steering(step, 8)).collect();
            let choices: Vec<Vec<i64>> =
                (0..100).map(|step| (0..8).map(|row| (step * 7 + row) % 5).collect()).collect();
            let mut ended = 0;
            let info = allocation_counter::measure(|| {
                for step in 0..100 {
                    let actions = if action == ActionKind::Steer {
                        Actions::Continuous(&steering[step])
                    } else {
                        Actions::Discrete(&choices[step])
                    };
                    ended += batch.step(actions, columns.as_mut()).unwrap();
                }
            });
            assert_eq!(info.count_total, 0, "{autoreset:?} {action:?} {observation:?}");
            assert!(ended > 8, "{ended} episodes ended");
        }
    }
}

/// The state of a batch and what a refused step leaves of it.
fn assert_refused(batch: &mut BatchEnv, actions: Actions, expected: BatchError) {
    let before = batch.snapshot();
    let mut columns = Columns::of(batch);
    let untouched = columns.clone();
    assert_eq!(batch.step(actions, columns.as_mut()).unwrap_err(), expected);
    assert_eq!(batch.snapshot(), before);
    assert_eq!(columns, untouched);
}

#[test]
fn bad_actions_are_refused_by_row_before_any_row_moves() {
    for autoreset in MODES {
        let mut steered = batch(&short(), 4, autoreset, 1);
        let zeros = [0.0; 4];
        let error = ActionError::NotReset;
        assert_refused(
            &mut steered,
            Actions::Continuous(&zeros),
            BatchError::Row { row: 0, error },
        );
        steered.reset(0);
        for (bad, width) in [(f32::NAN, 4), (f32::INFINITY, 3)] {
            let mut actions = zeros;
            actions[width - 1] = bad;
            let mut columns = Columns::of(&steered);
            let before = steered.snapshot();
            let error = steered.step(Actions::Continuous(&actions), columns.as_mut()).unwrap_err();
            let expected = format!("row {}: `action[0]` must be finite, got {bad}", width - 1);
            assert_eq!(error.to_string(), expected);
            assert_eq!(steered.snapshot(), before);
        }
        let size = BatchError::Size { expected: 4, got: 3 };
        assert_refused(&mut steered, Actions::Continuous(&zeros[..3]), size);
        let error = ActionError::Kind { expected: "numbers" };
        assert_refused(&mut steered, Actions::Discrete(&[0; 4]), BatchError::Row { row: 0, error });
    }
    let mut scenario = Scenario::default();
    scenario.action.kind = ActionKind::Discrete;
    let mut choosing = batch(&scenario.check().unwrap(), 3, Autoreset::NextStep, 1);
    choosing.reset(0);
    let error = ActionError::Choice { choices: 5, got: 5 };
    let choices = Actions::Discrete(&[0, 4, 5]);
    assert_refused(&mut choosing, choices, BatchError::Row { row: 2, error });
}

#[test]
fn a_row_that_ended_waits_for_its_reset_where_nothing_begins_by_itself() {
    let mut batch = batch(&short(), 3, Autoreset::Disabled, 1);
    batch.reset(0);
    // From the lower left corner a turn to the right leaves the pasture.
    let actions = [0.0, -1.0, 0.0];
    let mut columns = Columns::of(&batch);
    while !columns.has_ended(1) || columns.reward[1] == f64::MAX {
        batch.step(Actions::Continuous(&actions), columns.as_mut()).unwrap();
    }
    assert!(!columns.has_ended(0), "the rows that drive on are still on the pasture");
    let error = ActionError::EpisodeOver;
    assert_refused(&mut batch, Actions::Continuous(&actions), BatchError::Row { row: 1, error });
    batch.reset_row(1, None, Beginning::default());
    batch.step(Actions::Continuous(&actions), columns.as_mut()).unwrap();
}

#[test]
fn a_batch_put_back_goes_on_as_before() {
    for autoreset in MODES {
        let mut first = batch(&short(), 5, autoreset, 1);
        first.reset(3);
        let mut columns = Columns::of(&first);
        for step in 0..4 {
            first.step(Actions::Continuous(&steering(step, 5)), columns.as_mut()).unwrap();
        }
        let snapshot = first.snapshot();
        let mut second = batch(&short(), 5, autoreset, 2);
        second.restore(&snapshot).unwrap();
        let mut third = batch(&short(), 5, autoreset, 1);
        for (row, env) in first.rows().iter().enumerate() {
            third.restore_row(row, &env.snapshot()).unwrap();
        }
        for batch in [&mut second, &mut third] {
            assert_eq!(batch.snapshot(), snapshot);
            first.restore(&snapshot).unwrap();
            for step in 4..30 {
                let actions = steering(step, 5);
                let mut other = Columns::of(batch);
                let result = first.step(Actions::Continuous(&actions), columns.as_mut());
                assert_eq!(batch.step(Actions::Continuous(&actions), other.as_mut()), result);
                if result.is_ok() {
                    assert_eq!(other, columns);
                }
            }
        }
    }
}
