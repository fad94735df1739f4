//! What an agent that learns is shown: numbers made from a [`View`].
//!
//! An observation has one to four parts, each a table of its own with one row an environment. [`ObservationSpec`] says
//! which, [`Observation`] owns the memory, [`ObservationMut`] borrows it.

mod candidates;
mod features;
mod nearest;
mod maps;
mod ranked;
mod rough;
mod spec;

pub use candidates::CandidateEncoder;
pub use features::FeatureEncoder;
pub use maps::MapsEncoder;
pub use spec::{Bound, Dtype, Observation, ObservationMut, ObservationSpec, Part, Sizes};

use crate::candidates::Candidates;
use crate::config::{ObservationKind, ValidScenario};
use crate::view::View;
use nearest::NearestWeeds;

/// Writes observations of one kind. All environments of a scenario share it.
#[derive(Debug)]
pub struct Encoder {
    spec: ObservationSpec,
    features: Option<FeatureEncoder>,
    candidates: Option<CandidateEncoder>,
    maps: Option<MapsEncoder>,
    /// Whether the mask of the candidates is a part.
    has_mask: bool,
}

/// What an environment remembers from one observation to the next: it spares work and changes nothing.
#[derive(Debug, Clone)]
pub struct Memory {
    nearest: Option<NearestWeeds>,
}

impl Memory {
    /// Asks for what the next observation looks at.
    #[inline]
    pub(crate) fn fetch(&self) {
        self.nearest.iter().for_each(NearestWeeds::fetch);
    }

    /// Begins another episode, or goes on with another state: what was remembered of the last one does not hold.
    pub(crate) fn clear(&mut self) {
        if let Some(nearest) = &mut self.nearest {
            nearest.clear();
        }
    }
}

impl Encoder {
    /// The encoder of a scenario whose path may be `budget_m` long.
    #[must_use]
    pub fn new(scenario: &ValidScenario, budget_m: f64) -> Self {
        let kind = scenario.observation.kind;
        let has_mask = kind == ObservationKind::Dict;
        let has = |part: ObservationKind| kind == part || has_mask;
        let features =
            has(ObservationKind::Features).then(|| FeatureEncoder::new(scenario, budget_m));
        let candidates =
            has(ObservationKind::Candidates).then(|| CandidateEncoder::new(scenario, budget_m));
        let maps = has(ObservationKind::Maps).then(|| MapsEncoder::new(scenario));
        let mask = candidates.iter().filter(|_| has_mask).map(CandidateEncoder::mask_part);
        let parts = features
            .iter()
            .map(FeatureEncoder::part)
            .chain(candidates.iter().map(CandidateEncoder::part))
            .chain(mask)
            .chain(maps.iter().map(MapsEncoder::part))
            .collect();
        Self { spec: ObservationSpec::new(parts), features, candidates, maps, has_mask }
    }

    /// The parts of an observation.
    #[must_use]
    pub fn spec(&self) -> &ObservationSpec {
        &self.spec
    }

    /// What one environment remembers from one observation to the next.
    #[must_use]
    pub(crate) fn memory(&self) -> Memory {
        Memory { nearest: self.features.as_ref().map(FeatureEncoder::memory) }
    }

    /// Writes the observation of `view`, whose candidates are `candidates`.
    ///
    /// # Panics
    ///
    /// If `out` is not one row of [`Encoder::spec`], or the kind shows candidates and there are none.
    pub(crate) fn encode(
        &self,
        view: &View,
        candidates: Option<&Candidates>,
        memory: &mut Memory,
        out: ObservationMut,
    ) {
        out.check(self.spec.sizes());
        let ObservationMut { features, candidates: table, action_mask, maps } = out;
        if let (Some(encoder), Some(nearest)) = (&self.features, &mut memory.nearest) {
            encoder.encode(view, nearest, features);
        }
        if let Some(encoder) = &self.candidates {
            let candidates = candidates.expect("an environment that shows candidates has them");
            encoder.encode(view, candidates, table);
            if self.has_mask {
                encoder.encode_mask(candidates, action_mask);
            }
        }
        if let Some(encoder) = &self.maps {
            encoder.encode(view, maps);
        }
    }
}

/// A value clipped into [-1, 1], as float32.
#[expect(clippy::cast_possible_truncation, reason = "observations are float32 by contract")]
fn signed(value: f64) -> f32 {
    value.clamp(-1.0, 1.0) as f32
}
