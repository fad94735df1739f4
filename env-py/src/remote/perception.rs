//! What mowers on servers perceive, and what their client counts itself.

use swath_core::config::ConfigError;
use swath_core::env::{Env, Summary};
use swath_core::math::floor_index;
use swath_core::mirror::Mirror;
use swath_wire::fault::Fault;
use swath_wire::message::Percept;
use swath_wire::percept::read_percept;

use super::part::Part;

/// The mowers of all rows.
pub(super) struct Perception {
    mirrors: Vec<Mirror>,
    tallies: Vec<Tally>,
    /// How many weeds an episode has that the scenario itself begins.
    drawn: usize,
    /// How many weeds the episodes have that the reset in flight begins.
    begun: Vec<usize>,
    /// What a mowed weed is worth.
    weight: f64,
}

/// The weeds of a row's present episode.
#[derive(Clone, Copy)]
struct Tally {
    weeds_total: usize,
    /// None where some may have been mowed that nobody has told of.
    weeds_mowed: Option<usize>,
}

impl Perception {
    /// Mowers that know nothing yet, in so many environments like this one.
    pub(super) fn new(env: &Env, rows: usize) -> Self {
        let scenario = env.scenario();
        let weeds = &scenario.weeds;
        let drawn = weeds.positions_m.as_ref().map_or(weeds.count as usize, Vec::len);
        Self {
            mirrors: vec![Mirror::new(env.site()); rows],
            tallies: vec![Tally { weeds_total: drawn, weeds_mowed: None }; rows],
            drawn,
            begun: vec![drawn; rows],
            weight: scenario.reward.weed,
        }
    }

    /// What every mower perceives.
    pub(super) fn mirrors(&self) -> &[Mirror] {
        &self.mirrors
    }

    /// Takes in what the mowers of a part perceive.
    pub(super) fn take_in(&mut self, part: &Part, percept: Option<&Percept>) -> Result<(), Fault> {
        read_percept(percept, &mut self.mirrors[part.first..part.first + part.rows])
    }

    /// Refuses an environment with more weeds than its scenario has: percepts have no more room, and every server would
    /// refuse it. `field` is what the caller knows the weeds by.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] if there are more.
    pub(super) fn check_weeds(&self, field: &str, weeds: usize) -> Result<(), ConfigError> {
        if weeds <= self.drawn {
            return Ok(());
        }
        let expected =
            format!("at most {} weeds, as the scenario has, where percepts are told", self.drawn);
        Err(ConfigError::value(field, expected, weeds))
    }

    /// A reset is asked for. `given` says how many weeds a row has that are not drawn. Where the last call `is_in_doubt`,
    /// what it brings to the rows that do not begin is told to nobody.
    pub(super) fn ask_to_begin(
        &mut self,
        mask: &[bool],
        given: impl Fn(usize) -> Option<usize>,
        is_in_doubt: bool,
    ) {
        for (row, &begins) in mask.iter().enumerate() {
            self.begun[row] = given(row).unwrap_or(self.drawn);
            if is_in_doubt && !begins {
                self.forget(row);
            }
        }
    }

    /// An episode has begun that was asked for.
    pub(super) fn begin(&mut self, row: usize) {
        self.tallies[row] = Tally { weeds_total: self.begun[row], weeds_mowed: Some(0) };
    }

    /// The next episode has begun by itself.
    pub(super) fn begin_next(&mut self, row: usize) {
        self.tallies[row] = Tally { weeds_total: self.drawn, weeds_mowed: Some(0) };
    }

    /// Counts the weeds that a step mowed, by what they were worth.
    pub(super) fn count(&mut self, row: usize, weed_term: f64) {
        let mowed = floor_index((weed_term / self.weight).round());
        let tally = &mut self.tallies[row];
        tally.weeds_mowed = tally.weeds_mowed.map(|count| count + mowed);
    }

    /// The row is in a state of which nobody has told what was mowed before it.
    pub(super) fn forget(&mut self, row: usize) {
        self.tallies[row].weeds_mowed = None;
    }

    /// The numbers of a row's present episode, as far as it has got.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] if mowed weeds are worth nothing, or the episode did not begin here: they cannot be counted then.
    pub(super) fn summary(&self, row: usize) -> Result<Summary, ConfigError> {
        if self.weight == 0.0 {
            let expected = "other than 0 where mowed weeds are counted by their reward";
            return Err(ConfigError::value("reward.weed", expected, 0));
        }
        let Tally { weeds_total, weeds_mowed: Some(weeds_mowed) } = self.tallies[row] else {
            let expected = "of an episode that began here, for its mowed weeds to be counted";
            return Err(ConfigError::value("row", expected, row));
        };
        let view = self.mirrors[row].view();
        Ok(Summary {
            path_length_m: view.path_m,
            bcp_length_m: view.site.bcp_length_m,
            weeds_total,
            weeds_detected: view.weeds_detected as usize,
            weeds_mowed,
            seen_fraction: view.ground.fraction(),
        })
    }
}
