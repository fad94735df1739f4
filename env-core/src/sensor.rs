//! The weed sensor.

use crate::geometry::{Frame, Triangle};
use crate::weeds::Weeds;

/// A camera that sees a triangle in front of the mower, without error and at once.
#[derive(Debug, Clone)]
pub struct Sensor {
    range_m: f64,
    width_m: f64,
    detected: Vec<u32>,
}

/// What one look showed.
#[derive(Debug)]
pub struct Percept<'a> {
    /// The ground that was seen.
    pub footprint: Triangle,
    /// Numbers of the weeds seen for the first time, ascending.
    pub detected: &'a [u32],
}

impl Sensor {
    /// A sensor of depth `range_m` and far width `width_m`.
    #[must_use]
    pub fn new(range_m: f64, width_m: f64) -> Self {
        Self { range_m, width_m, detected: Vec::new() }
    }

    /// Looks from a pose.
    pub fn look(&mut self, from: impl Into<Frame>, weeds: &mut Weeds) -> Percept<'_> {
        let footprint = Triangle::new(from, self.range_m, self.width_m);
        weeds.detect(&footprint, &mut self.detected);
        Percept { footprint, detected: &self.detected }
    }
}
