//! What goes into a step of a batch and what comes out: contiguous memory of the caller's, one row an environment.

use crate::action::{Action, ActionDecoder, ActionSpec};
use crate::env::Step;
use crate::episode::End;
use crate::observation::{ObservationMut, Sizes};

/// The actions of a batch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Actions<'a> {
    /// Numbers in [-1, 1], row by row, for the kinds `steer` and `drive`.
    Continuous(&'a [f32]),
    /// The number of a choice for each row, for the other kinds.
    Discrete(&'a [i64]),
}

impl<'a> Actions<'a> {
    /// How many numbers there are.
    pub(super) fn len(self) -> usize {
        match self {
            Self::Continuous(numbers) => numbers.len(),
            Self::Discrete(choices) => choices.len(),
        }
    }

    /// The action of one row; `width` is how many numbers a row has.
    ///
    /// # Panics
    ///
    /// If there is no such row.
    #[must_use]
    pub fn row(self, row: usize, width: usize) -> Action<'a> {
        match self {
            Self::Continuous(numbers) => {
                Action::Continuous(&numbers[row * width..(row + 1) * width])
            }
            Self::Discrete(choices) => Action::Discrete(choices[row]),
        }
    }

    /// The actions of the first `rows` rows, and the others.
    pub(super) fn split_at(self, rows: usize, width: usize) -> (Self, Self) {
        match self {
            Self::Continuous(numbers) => {
                let (first, rest) = numbers.split_at(rows * width);
                (Self::Continuous(first), Self::Continuous(rest))
            }
            Self::Discrete(choices) => {
                let (first, rest) = choices.split_at(rows);
                (Self::Discrete(first), Self::Discrete(rest))
            }
        }
    }
}

/// How many numbers an action has: one for a choice.
pub(super) fn width(decoder: &ActionDecoder) -> usize {
    match decoder.spec() {
        ActionSpec::Continuous(bounds) => bounds.len(),
        ActionSpec::Discrete(_) => 1,
    }
}

/// Where a step of a batch is written. Every number of every row is written at every step.
#[derive(Debug)]
pub struct StepMut<'a> {
    /// The observations: of a row that began anew, the first one of its new episode.
    pub observation: ObservationMut<'a>,
    /// The rewards, each the sum of the three terms.
    pub reward: &'a mut [f64],
    /// Which episodes ended by the rules of the problem.
    pub terminated: &'a mut [bool],
    /// Which were cut off.
    pub truncated: &'a mut [bool],
    /// The reward for weeds mowed; of a row that began anew, 0, as for the other terms.
    pub weed: &'a mut [f64],
    /// The reward for the way driven, at most 0.
    pub path: &'a mut [f64],
    /// The reward for a failure, at most 0.
    pub failure: &'a mut [f64],
    /// Which actions had to be clipped into their range.
    pub is_clipped: &'a mut [bool],
    /// The ways driven, metres.
    pub distance_m: &'a mut [f64],
    /// Which choices are open next, row by row; empty but for the action kind `target`.
    pub action_mask: &'a mut [bool],
}

impl StepMut<'_> {
    /// The first `rows` rows of every column; the observations as they are.
    pub(super) fn first(self, rows: usize) -> Self {
        Self {
            observation: self.observation,
            reward: &mut self.reward[..rows],
            terminated: &mut self.terminated[..rows],
            truncated: &mut self.truncated[..rows],
            weed: &mut self.weed[..rows],
            path: &mut self.path[..rows],
            failure: &mut self.failure[..rows],
            is_clipped: &mut self.is_clipped[..rows],
            distance_m: &mut self.distance_m[..rows],
            action_mask: self.action_mask,
        }
    }

    /// The first `rows` rows, and the others; an observation has these sizes and an action mask so many places.
    #[must_use]
    pub fn split_at(self, rows: usize, sizes: Sizes, choices: usize) -> (Self, Self) {
        let (observation, more_observations) = self.observation.split_at(rows, sizes);
        let (reward, more_rewards) = self.reward.split_at_mut(rows);
        let (terminated, more_terminated) = self.terminated.split_at_mut(rows);
        let (truncated, more_truncated) = self.truncated.split_at_mut(rows);
        let (weed, more_weed) = self.weed.split_at_mut(rows);
        let (path, more_path) = self.path.split_at_mut(rows);
        let (failure, more_failure) = self.failure.split_at_mut(rows);
        let (is_clipped, more_clipped) = self.is_clipped.split_at_mut(rows);
        let (distance_m, more_distances_m) = self.distance_m.split_at_mut(rows);
        let (action_mask, more_masks) = self.action_mask.split_at_mut(rows * choices);
        let rest = Self {
            observation: more_observations,
            reward: more_rewards,
            terminated: more_terminated,
            truncated: more_truncated,
            weed: more_weed,
            path: more_path,
            failure: more_failure,
            is_clipped: more_clipped,
            distance_m: more_distances_m,
            action_mask: more_masks,
        };
        let first = Self {
            observation,
            reward,
            terminated,
            truncated,
            weed,
            path,
            failure,
            is_clipped,
            distance_m,
            action_mask,
        };
        (first, rest)
    }

    /// Panics unless every column has `rows` rows, and every row of the masks `choices` places.
    pub(super) fn check(&self, rows: usize, choices: usize) {
        let lengths = [
            self.reward.len(),
            self.terminated.len(),
            self.truncated.len(),
            self.weed.len(),
            self.path.len(),
            self.failure.len(),
            self.is_clipped.len(),
            self.distance_m.len(),
        ];
        assert_eq!(lengths, [rows; 8], "a buffer of the step has the wrong length");
        assert_eq!(
            self.action_mask.len(),
            rows * choices,
            "the buffer of masks has the wrong length"
        );
    }

    /// Writes all of a row but the observation.
    pub(super) fn write(&mut self, row: usize, step: &Step) {
        self.reward[row] = step.terms.total();
        self.terminated[row] = matches!(step.end, End::Terminated(_));
        self.truncated[row] = matches!(step.end, End::Truncated(_));
        self.weed[row] = step.terms.weed;
        self.path[row] = step.terms.path;
        self.failure[row] = step.terms.failure;
        self.is_clipped[row] = step.is_clipped;
        self.distance_m[row] = step.distance_m;
    }

    /// Writes what a reset has to say: no term of a reward, no clipped action.
    pub(super) fn write_begun(&mut self, row: usize) {
        self.weed[row] = 0.0;
        self.path[row] = 0.0;
        self.failure[row] = 0.0;
        self.is_clipped[row] = false;
        self.distance_m[row] = 0.0;
    }
}
