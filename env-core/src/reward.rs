//! What a step is worth.

use crate::config::RewardConfig;

/// What a step brought that is worth something.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tally {
    /// Weeds mowed.
    pub weeds_mowed: u32,
    /// Way driven, metres.
    pub distance_m: f64,
    /// Way charged for a failure, metres.
    pub forfeit_m: f64,
}

impl Tally {
    /// Takes note that `distance_m` are driven in all.
    pub fn has_come(&mut self, distance_m: f64) {
        self.distance_m = distance_m;
    }

    /// Takes note of so many weeds mowed more.
    pub fn has_mowed(&mut self, weeds: usize) {
        self.weeds_mowed +=
            u32::try_from(weeds).expect("a scenario holds at most ten million weeds");
    }
}

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
    /// The terms of a step.
    #[must_use]
    pub fn score(weights: &RewardConfig, tally: &Tally) -> Self {
        let charge = |metres: f64| 0.0 - weights.path_per_m * metres;
        Self {
            weed: weights.weed * f64::from(tally.weeds_mowed),
            path: charge(tally.distance_m),
            failure: charge(tally.forfeit_m),
        }
    }

    /// Adds the terms of what came next within the same step.
    pub fn add(&mut self, next: &Self) {
        self.weed += next.weed;
        self.path += next.path;
        self.failure += next.failure;
    }

    /// The reward.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.weed + self.path + self.failure
    }
}
