//! What a client counts itself of an episode that runs on a server.

use swath_core::config::{ConfigError, ValidScenario};
use swath_core::env::Summary;
use swath_core::mirror::Mirror;

/// The weeds of a row's present episode.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tally {
    weeds_total: usize,
    /// None after a restore: what was mowed before is not told.
    weeds_mowed: Option<usize>,
}

impl Tally {
    /// An episode that begins with so many weeds.
    pub(super) fn begun(weeds_total: usize) -> Self {
        Self { weeds_total, weeds_mowed: Some(0) }
    }

    /// An episode that was put back.
    pub(super) fn forget(&mut self) {
        self.weeds_mowed = None;
    }

    /// Takes in what a step was worth for the weeds that it mowed, each of which is worth `weight`.
    pub(super) fn add(&mut self, weed_term: f64, weight: f64) {
        let mowed = if weight == 0.0 { 0.0 } else { (weed_term / weight).round() };
        self.weeds_mowed =
            self.weeds_mowed.map(|count| count + swath_core::math::floor_index(mowed));
    }

    /// The numbers of the episode.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] if mowed weeds are worth nothing, or the episode did not begin here: they cannot be counted then.
    pub(super) fn summary(
        &self,
        mirror: &Mirror,
        scenario: &ValidScenario,
    ) -> Result<Summary, ConfigError> {
        if scenario.reward.weed == 0.0 {
            let expected = "other than 0 where mowed weeds are counted by their reward";
            return Err(ConfigError::value("reward.weed", expected, 0));
        }
        let Some(weeds_mowed) = self.weeds_mowed else {
            let expected = "of an episode that began here, for its mowed weeds to be counted";
            return Err(ConfigError::value("row", expected, "one that was put back"));
        };
        let view = mirror.view();
        Ok(Summary {
            path_length_m: view.path_m,
            bcp_length_m: view.site.bcp_length_m,
            weeds_total: self.weeds_total,
            weeds_detected: view.weeds_detected as usize,
            weeds_mowed,
            seen_fraction: view.ground.fraction(),
        })
    }
}

/// How many weeds an episode has that the scenario itself begins.
pub(super) fn weeds_of(scenario: &ValidScenario) -> usize {
    let weeds = &scenario.weeds;
    weeds.positions_m.as_ref().map_or(weeds.count as usize, Vec::len)
}
