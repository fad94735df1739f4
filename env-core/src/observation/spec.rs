//! The form of an observation, and memory for it.

/// What the numbers of a part are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dtype {
    /// 32-bit floats.
    Float32,
    /// Signed bytes that are 0 or 1.
    Int8,
    /// Unsigned bytes.
    Uint8,
}

/// One number: what it is and between which bounds it lies.
#[derive(Debug, Clone, PartialEq)]
pub struct Bound {
    /// Name, with its index where there are several.
    pub name: String,
    /// Lowest value.
    pub low: f32,
    /// Highest value.
    pub high: f32,
}

/// One table of an observation.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// `features`, `candidates`, `action_mask` or `maps`.
    pub name: &'static str,
    /// What its numbers are.
    pub dtype: Dtype,
    /// Its shape for one environment.
    pub shape: Vec<usize>,
    /// Its numbers along the last axis; a single one where all are alike.
    pub bounds: Vec<Bound>,
}

/// How many numbers each part has for one environment; 0 for a part that the kind does not have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Sizes {
    /// Of `features`.
    pub features: usize,
    /// Of `candidates`.
    pub candidates: usize,
    /// Of `action_mask`.
    pub action_mask: usize,
    /// Of `maps`.
    pub maps: usize,
}

/// The parts of an observation.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservationSpec {
    parts: Vec<Part>,
    sizes: Sizes,
}

impl ObservationSpec {
    pub(super) fn new(parts: Vec<Part>) -> Self {
        let size = |name: &str| {
            let part = parts.iter().find(|part| part.name == name);
            part.map_or(0, |part| part.shape.iter().product())
        };
        let sizes = Sizes {
            features: size("features"),
            candidates: size("candidates"),
            action_mask: size("action_mask"),
            maps: size("maps"),
        };
        Self { parts, sizes }
    }

    /// The parts, in order.
    #[must_use]
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// How many numbers each part has.
    #[must_use]
    pub fn sizes(&self) -> Sizes {
        self.sizes
    }

    /// Memory for the observations of `rows` environments, all zero.
    #[must_use]
    pub fn rows(&self, rows: usize) -> Observation {
        let Sizes { features, candidates, action_mask, maps } = self.sizes;
        Observation {
            features: vec![0.0; rows * features],
            candidates: vec![0.0; rows * candidates],
            action_mask: vec![0; rows * action_mask],
            maps: vec![0; rows * maps],
        }
    }
}

/// Observations of one or more environments, row by row; a part that the kind does not have is empty.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Observation {
    /// The flat vectors.
    pub features: Vec<f32>,
    /// The tables of candidates.
    pub candidates: Vec<f32>,
    /// Which candidates may be chosen, 0 or 1.
    pub action_mask: Vec<i8>,
    /// The egocentric maps.
    pub maps: Vec<u8>,
}

impl Observation {
    /// The same memory, lent for writing.
    #[must_use]
    pub fn as_mut(&mut self) -> ObservationMut<'_> {
        ObservationMut {
            features: &mut self.features,
            candidates: &mut self.candidates,
            action_mask: &mut self.action_mask,
            maps: &mut self.maps,
        }
    }
}

/// Where observations are written, row by row; a part that the kind does not have is empty.
#[derive(Debug, Default)]
pub struct ObservationMut<'a> {
    /// The flat vectors.
    pub features: &'a mut [f32],
    /// The tables of candidates.
    pub candidates: &'a mut [f32],
    /// Which candidates may be chosen, 0 or 1.
    pub action_mask: &'a mut [i8],
    /// The egocentric maps.
    pub maps: &'a mut [u8],
}

impl ObservationMut<'_> {
    /// The first `rows` rows, and the others.
    #[must_use]
    pub fn split_at(self, rows: usize, sizes: Sizes) -> (Self, Self) {
        let (features, more_features) = self.features.split_at_mut(rows * sizes.features);
        let (candidates, more_candidates) = self.candidates.split_at_mut(rows * sizes.candidates);
        let (action_mask, more_masks) = self.action_mask.split_at_mut(rows * sizes.action_mask);
        let (maps, more_maps) = self.maps.split_at_mut(rows * sizes.maps);
        let rest = Self {
            features: more_features,
            candidates: more_candidates,
            action_mask: more_masks,
            maps: more_maps,
        };
        (Self { features, candidates, action_mask, maps }, rest)
    }

    /// The same memory, lent for a shorter time.
    #[must_use]
    pub fn reborrow(&mut self) -> ObservationMut<'_> {
        ObservationMut {
            features: self.features,
            candidates: self.candidates,
            action_mask: self.action_mask,
            maps: self.maps,
        }
    }

    /// Panics unless this is memory for one row.
    pub(crate) fn check(&self, sizes: Sizes) {
        let got = Sizes {
            features: self.features.len(),
            candidates: self.candidates.len(),
            action_mask: self.action_mask.len(),
            maps: self.maps.len(),
        };
        assert_eq!(got, sizes, "the observation buffer has the wrong length");
    }
}
