//! The mowing deck.

use crate::geometry::BarSweep;
use crate::mower::Stretch;
use crate::weeds::Weeds;

/// The implement: a bar across the heading whose middle is the mower's pose.
#[derive(Debug, Clone)]
pub struct Deck {
    width_m: f64,
    mowed: Vec<u32>,
}

/// What one stretch cut.
#[derive(Debug)]
pub struct Cut<'a> {
    /// The ground that the bar passed over.
    pub sweep: BarSweep,
    /// Numbers of the weeds mowed, ascending.
    pub mowed: &'a [u32],
}

impl Deck {
    /// A deck of `width_m`.
    #[must_use]
    pub fn new(width_m: f64) -> Self {
        Self { width_m, mowed: Vec::new() }
    }

    /// Mows what the bar passes over on `stretch`: swept, exact, its ends included.
    pub fn mow(&mut self, stretch: &Stretch, weeds: &mut Weeds) -> Cut<'_> {
        let Stretch { start, end, curvature_per_m, length_m, .. } = *stretch;
        let sweep = BarSweep::between(start, end, curvature_per_m, length_m, self.width_m);
        weeds.mow(&sweep, &mut self.mowed);
        Cut { sweep, mowed: &self.mowed }
    }
}
