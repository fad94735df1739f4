//! What an agent that learns is shown: numbers made from a [`View`].
//!
//! An observation has one to four parts, each a table of its own with one row an environment. [`ObservationSpec`] says
//! which, [`Observation`] owns the memory, [`ObservationMut`] borrows it.

mod features;
mod nearest;
mod spec;

pub use features::FeatureEncoder;
pub use spec::{Bound, Dtype, Observation, ObservationMut, ObservationSpec, Part, Sizes};

use crate::config::{ObservationKind, ValidScenario};
use crate::view::View;

/// Writes observations of one kind.
#[derive(Debug, Clone)]
pub struct Encoder {
    spec: ObservationSpec,
    features: Option<FeatureEncoder>,
}

impl Encoder {
    /// The encoder of a scenario whose path may be `budget_m` long.
    #[must_use]
    pub fn new(scenario: &ValidScenario, budget_m: f64) -> Self {
        let features = match scenario.observation.kind {
            ObservationKind::Features => Some(FeatureEncoder::new(scenario, budget_m)),
        };
        let parts = features.iter().map(FeatureEncoder::part).collect();
        Self { spec: ObservationSpec::new(parts), features }
    }

    /// The parts of an observation.
    #[must_use]
    pub fn spec(&self) -> &ObservationSpec {
        &self.spec
    }

    /// Begins another episode, or goes on with another state: what was remembered of the last one does not hold.
    pub fn reset(&mut self) {
        if let Some(encoder) = &mut self.features {
            encoder.reset();
        }
    }

    /// Writes the observation of `view`.
    ///
    /// # Panics
    ///
    /// If `out` is not one row of [`Encoder::spec`].
    pub fn encode(&mut self, view: &View, out: ObservationMut) {
        out.check(self.spec.sizes());
        let ObservationMut { features, .. } = out;
        if let Some(encoder) = &mut self.features {
            encoder.encode(view, features);
        }
    }
}
