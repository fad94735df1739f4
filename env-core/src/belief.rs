//! What the mower knows: the ground it has seen and the weeds it has still to mow.

use std::sync::Arc;

use crate::deck::Cut;
use crate::grid::{Cell, CellSet, Grid};
use crate::ground::SeenGround;
use crate::known::{KnownWeed, KnownWeeds};
use crate::sensor::Percept;
use crate::weeds::Weeds;

/// What the mower has learnt since reset.
#[derive(Debug, Clone)]
pub struct Belief {
    ground: SeenGround,
    known: KnownWeeds,
    /// For each detection the weed's number in the pasture, and the other way round: the link that only the environment
    /// follows.
    weed_of: Vec<u32>,
    number_of: Vec<Option<u32>>,
}

impl Belief {
    /// A mower that knows nothing yet.
    #[must_use]
    pub fn new(grid: Arc<Grid>) -> Self {
        let (length_m, width_m) = grid.size_m();
        Self {
            ground: SeenGround::none(grid),
            known: KnownWeeds::none(length_m, width_m),
            weed_of: Vec::new(),
            number_of: Vec::new(),
        }
    }

    /// Makes room for all weeds of an episode, so that no step has to.
    pub(crate) fn reserve(&mut self, weeds: usize) {
        self.known.reserve(weeds);
        self.weed_of.reserve(weeds.saturating_sub(self.weed_of.len()));
        self.number_of.resize(weeds, None);
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.ground.clear();
        self.known.clear();
        self.weed_of.clear();
        self.number_of.clear();
    }

    /// Puts a belief back; `weed_of` lists the weeds in the order of their detection.
    pub(crate) fn restore(&mut self, unseen: CellSet, weed_of: Vec<u32>, weeds: &Weeds) {
        self.ground.restore(unseen);
        self.known.clear();
        self.weed_of.clear();
        self.number_of.clear();
        self.reserve(weeds.positions().len());
        for weed in weed_of {
            self.note(weed, weeds);
            if weeds.is_mowed()[weed as usize] {
                self.strike_out(weed);
            }
        }
    }

    /// Adds a weed just detected.
    fn note(&mut self, weed: u32, weeds: &Weeds) {
        let number = self.detected();
        self.known.add(KnownWeed { number, position: weeds.positions()[weed as usize] });
        self.weed_of.push(weed);
        self.number_of[weed as usize] = Some(number);
    }

    /// Removes a weed just mowed, if it was known.
    fn strike_out(&mut self, weed: u32) {
        if let Some(number) = self.number_of[weed as usize] {
            self.known.remove(number);
        }
    }

    /// Strikes out mowed weeds; the ground under the bar counts as seen.
    pub fn absorb_cut(&mut self, cut: &Cut) {
        self.ground.absorb(cut.seen);
        for &weed in cut.mowed {
            self.strike_out(weed);
        }
    }

    /// Notes ground seen.
    #[inline]
    pub fn absorb_ground<'a>(&mut self, seen: impl IntoIterator<Item = &'a Cell>) {
        self.ground.absorb(seen);
    }

    /// Notes new weeds, in the order of the percept, and the ground seen.
    pub fn absorb_percept(&mut self, percept: &Percept, weeds: &Weeds) {
        self.ground.absorb(percept.seen);
        for &weed in percept.detected {
            self.note(weed, weeds);
        }
    }

    /// The ground seen so far.
    #[must_use]
    pub fn ground(&self) -> &SeenGround {
        &self.ground
    }

    /// Weeds detected and not yet mowed, in the order of detection.
    #[must_use]
    pub fn known(&self) -> &KnownWeeds {
        &self.known
    }

    /// Number of weeds ever detected.
    #[must_use]
    pub fn detected(&self) -> u32 {
        u32::try_from(self.weed_of.len()).expect("a scenario holds at most ten million weeds")
    }

    pub(crate) fn weed_of(&self) -> &[u32] {
        &self.weed_of
    }
}
