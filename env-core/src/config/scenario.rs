//! The whole scenario, before and after its check.

use std::ops::Deref;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::{
    ActionConfig, ConfigError, EpisodeConfig, MowerConfig, ObservationConfig, PastureConfig,
    RewardConfig, ScenarioId, SensorConfig, WeedsConfig,
};

/// One experiment's configuration, not yet checked; every key is optional.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Scenario {
    /// Which problem is posed (default `swath/MowerRouting-v0`).
    pub id: ScenarioId,
    /// The rectangle to be mown.
    pub pasture: PastureConfig,
    /// Where weeds stand.
    pub weeds: WeedsConfig,
    /// The mower's geometry and limits.
    pub mower: MowerConfig,
    /// The detection triangle.
    pub sensor: SensorConfig,
    /// What a step is worth.
    pub reward: RewardConfig,
    /// How an episode is cut into steps, and when it ends.
    pub episode: EpisodeConfig,
    /// What an agent is shown.
    pub observation: ObservationConfig,
    /// How an agent speaks to the mower.
    pub action: ActionConfig,
}

impl Scenario {
    /// Checks every field once, and the rules across fields.
    ///
    /// # Errors
    ///
    /// [`ConfigError::Value`] for the first field that is not allowed.
    pub fn check(self) -> Result<ValidScenario, ConfigError> {
        self.pasture.check()?;
        self.weeds.check(&self.pasture)?;
        if let Some(file) = &self.weeds.file {
            let expected = "read by a scenario document (a file, a shipped name or keywords)";
            return Err(ConfigError::value("weeds.file", expected, file));
        }
        self.mower.check(&self.pasture)?;
        self.sensor.check()?;
        self.reward.check()?;
        self.episode.check(&self.mower)?;
        self.observation.check()?;
        self.action.check()?;
        Ok(ValidScenario(self))
    }
}

/// A [`Scenario`] that passed [`Scenario::check`].
#[derive(Debug, Clone, PartialEq)]
pub struct ValidScenario(Scenario);

impl ValidScenario {
    /// The scenario as TOML, every key written out.
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string(&self.0).expect("every field of a scenario has a TOML form")
    }

    /// SHA-256 of [`ValidScenario::to_toml`]: two scenarios with equal hashes pose the same problem.
    #[must_use]
    pub fn hash(&self) -> [u8; 32] {
        Sha256::digest(self.to_toml()).into()
    }
}

impl Deref for ValidScenario {
    type Target = Scenario;

    fn deref(&self) -> &Scenario {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(change: impl FnOnce(&mut Scenario)) -> String {
        let mut scenario = Scenario::default();
        change(&mut scenario);
        scenario.check().unwrap_err().to_string()
    }

    #[test]
    fn a_cut_of_zero_width_is_refused_by_name() {
        assert_eq!(
            refused(|s| s.mower.deck_width_m = 0.0),
            "`mower.deck_width_m` must be finite and > 0, got 0"
        );
    }

    #[test]
    fn nan_is_refused_everywhere() {
        assert_eq!(
            refused(|s| s.pasture.length_m = f64::NAN),
            "`pasture.length_m` must be finite and > 0, got NaN"
        );
        assert_eq!(
            refused(|s| s.pasture.headland_m = f64::NAN),
            "`pasture.headland_m` must be >= 0 or inf, got NaN"
        );
        assert_eq!(
            refused(|s| s.episode.budget = f64::NAN),
            "`episode.budget` must be > 0 or inf, got NaN"
        );
        assert_eq!(refused(|s| s.reward.weed = f64::NAN), "`reward.weed` must be finite, got NaN");
        assert!(refused(|s| s.weeds.sigma_m = f64::NAN).starts_with("`weeds.sigma_m` must be > 0"));
    }

    #[test]
    fn a_pasture_narrower_than_the_deck_is_refused() {
        let message = refused(|s| s.pasture.width_m = 1.5);
        assert_eq!(
            message,
            "`mower.deck_width_m` must be at most the pasture's smaller side, 1.5 m, got 2"
        );
    }

    #[test]
    fn a_weed_outside_the_pasture_is_refused_with_its_number() {
        let message = refused(|s| s.weeds.positions_m = Some(vec![[1.0, 1.0], [1.0, 40.5]]));
        assert_eq!(
            message,
            "`weeds.positions_m[1]` must be on the pasture, 0..=100 by 0..=40 m, got [1, 40.5]"
        );
    }

    #[test]
    fn what_is_written_out_reads_back_the_same() {
        let mut scenario = Scenario::default();
        scenario.pasture.headland_m = f64::INFINITY;
        let valid = scenario.clone().check().unwrap();
        assert_eq!(toml::from_str::<Scenario>(&valid.to_toml()).unwrap(), scenario);
    }
}
