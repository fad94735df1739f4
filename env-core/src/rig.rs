//! What is mounted on the mower.

use crate::deck::Deck;
use crate::sensor::Sensor;
use crate::site::Site;
use crate::weeds::Weeds;

/// The deck and the sensor.
///
/// Between two steps they remember nothing; what they own is memory to work in. So mowers may hand it on from one to
/// the next.
#[derive(Debug, Clone)]
pub(crate) struct Rig {
    pub(crate) deck: Deck,
    pub(crate) sensor: Sensor,
}

impl Rig {
    /// What a scenario says is mounted.
    pub(crate) fn new(site: &Site) -> Self {
        Self {
            deck: Deck::new(site.deck_width_m),
            sensor: Sensor::new(site.sensor_range_m, site.sensor_width_m),
        }
    }

    /// Makes room for whatever an episode with these weeds may bring, so that its steps allocate nothing.
    pub(crate) fn reserve(&mut self, weeds: &Weeds) {
        self.deck.reserve(weeds);
        self.sensor.reserve(weeds);
    }
}
