//! Memory for the steps of a batch.

use swath_core::batch::{BatchEnv, StepMut};
use swath_core::observation::Observation;

/// All that a step of a batch writes, owned.
#[derive(Debug, Clone, PartialEq)]
pub struct Columns {
    /// The observations.
    pub observation: Observation,
    /// The rewards.
    pub reward: Vec<f64>,
    /// Which episodes ended by the rules.
    pub terminated: Vec<bool>,
    /// Which were cut off.
    pub truncated: Vec<bool>,
    /// The three terms of the rewards: weed, path, failure.
    pub terms: [Vec<f64>; 3],
    /// Which actions were clipped.
    pub is_clipped: Vec<bool>,
}

impl Columns {
    /// Columns filled with what no step writes, so that a number left out is seen.
    #[must_use]
    pub fn of(batch: &BatchEnv) -> Self {
        let rows = batch.rows().len();
        let mut observation = batch.observation_spec().rows(rows);
        observation.features.fill(f32::MAX);
        Self {
            observation,
            reward: vec![f64::MAX; rows],
            terminated: vec![true; rows],
            truncated: vec![true; rows],
            terms: [vec![f64::MAX; rows], vec![f64::MAX; rows], vec![f64::MAX; rows]],
            is_clipped: vec![true; rows],
        }
    }

    /// The same memory, lent for a step.
    #[must_use]
    pub fn as_mut(&mut self) -> StepMut<'_> {
        let [weed, path, failure] = &mut self.terms;
        StepMut {
            observation: self.observation.as_mut(),
            reward: &mut self.reward,
            terminated: &mut self.terminated,
            truncated: &mut self.truncated,
            weed,
            path,
            failure,
            is_clipped: &mut self.is_clipped,
        }
    }

    /// Whether the latest step ended a row's episode.
    #[must_use]
    pub fn has_ended(&self, row: usize) -> bool {
        self.terminated[row] || self.truncated[row]
    }
}
