//! What a step is worth.

use crate::config::RewardConfig;

/// The named terms of a reward; their sum is the reward.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RewardTerms {
    /// For the weeds mowed.
    pub weed: f64,
    /// For the way driven, at most 0.
    pub path: f64,
    /// For a failure: the path cost of the rest of the budget, so that quitting never pays; at most 0.
    pub failure: f64,
}

impl RewardTerms {
    /// The terms of a step that mowed `weeds` weeds on `path_m` metres; a failure is charged for `forfeit_m` more.
    #[must_use]
    pub fn score(weights: &RewardConfig, weeds: u32, path_m: f64, forfeit_m: f64) -> Self {
        let charge = |metres: f64| 0.0 - weights.path_per_m * metres;
        Self {
            weed: weights.weed * f64::from(weeds),
            path: charge(path_m),
            failure: charge(forfeit_m),
        }
    }

    /// The reward.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.weed + self.path + self.failure
    }
}
