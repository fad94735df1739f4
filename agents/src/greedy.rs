//! `greedy`: the search, and whatever weed is near to its way.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use swath_core::candidates::Purpose;
use swath_core::config::{ActionConfig, ConfigError};
use swath_core::view::View;

use crate::agent::{Agent, Decision};
use crate::pursuit::Pursuit;

/// Options of `greedy`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GreedyOptions {
    /// The longest detour to a weed, metres. Longer ones leave fewer weeds behind and drive to and fro more.
    pub detour_m: f64,
}

impl Default for GreedyOptions {
    fn default() -> Self {
        Self { detour_m: 16.0 }
    }
}

impl GreedyOptions {
    /// The same options, if they can be used.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] naming the option, its value and what was expected.
    pub fn checked(self) -> Result<Self, ConfigError> {
        if self.detour_m.is_nan() || self.detour_m < 0.0 {
            return Err(ConfigError::value("greedy.detour_m", "at least 0", self.detour_m));
        }
        Ok(self)
    }
}

/// Looks one step ahead among the places of the action kind `target`: takes the weed with the shortest detour on the way of
/// the search, if that is short enough, and goes on with the search otherwise.
#[derive(Debug)]
pub struct Greedy {
    options: GreedyOptions,
    pursuit: Option<Pursuit>,
}

impl Greedy {
    /// The planner.
    #[must_use]
    pub fn new(options: GreedyOptions) -> Self {
        Self { options, pursuit: None }
    }

    /// The place of the weed to take, or of the search.
    fn choice(&self, pursuit: &mut Pursuit, view: &View) -> usize {
        let candidates = pursuit.candidates(view);
        let mut best = (self.options.detour_m, candidates.rows().len() - 1);
        for (place, row) in candidates.rows().iter().enumerate() {
            let Some(candidate) = row else { continue };
            if matches!(candidate.purpose, Purpose::Weed(_)) {
                let detour_m = candidates.detour_m(candidate, view.site);
                if detour_m < best.0 {
                    best = (detour_m, place);
                }
            }
        }
        best.1
    }
}

impl Agent for Greedy {
    fn reset(&mut self, view: &View) {
        self.pursuit = Some(Pursuit::new(&ActionConfig::default(), view));
    }

    fn act(&mut self, view: &View) -> Decision {
        if Pursuit::is_over(view) {
            return Decision::Done;
        }
        let mut pursuit = self.pursuit.take().expect("an episode has begun");
        let command = pursuit.next(view).unwrap_or_else(|| {
            let place = self.choice(&mut pursuit, view);
            pursuit.choose(place, view);
            pursuit.next(view).expect("every way is longer than nothing")
        });
        self.pursuit = Some(pursuit);
        Decision::Drive(command)
    }
}
