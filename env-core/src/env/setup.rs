//! What all environments of a scenario share.

use crate::action::ActionDecoder;
use crate::config::{RewardConfig, ValidScenario};
use crate::observation::Encoder;
use crate::site::Site;

/// What never changes, kept in one place for all environments of a scenario: an environment of its own holds what does.
#[derive(Debug)]
pub(super) struct Setup {
    pub(super) scenario: ValidScenario,
    pub(super) scenario_hash: [u8; 32],
    pub(super) site: Site,
    pub(super) decoder: ActionDecoder,
    pub(super) reward: RewardConfig,
    pub(super) encoder: Encoder,
}

impl Setup {
    /// The setup of a scenario whose path may be `budget_m` long.
    pub(super) fn new(scenario: &ValidScenario, site: Site, budget_m: f64) -> Self {
        Self {
            scenario: scenario.clone(),
            scenario_hash: scenario.hash(),
            site,
            decoder: ActionDecoder::new(scenario),
            reward: scenario.reward.clone(),
            encoder: Encoder::new(scenario, budget_m),
        }
    }
}
