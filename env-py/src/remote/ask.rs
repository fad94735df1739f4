//! What the servers are asked.

use pyo3::prelude::*;
use swath_core::action::{Action, ActionError, ActionSpec};
use swath_core::batch::{Actions, Autoreset, BatchError, joined, split};
use swath_core::episode::End;
use swath_core::geometry::Point;
use swath_wire::header::Verb;
use swath_wire::hosted::ENV_ID;
use swath_wire::message::{AutoresetMode, Open, Reset, Restore, Seeds, Step};
use swath_wire::numbers::{bytes_in, bytes_of};

use super::part::settled;
use super::perception::Perception;
use super::{RemoteBatch, State};
use crate::action::read_action;
use crate::errors::Error;
use crate::weeds::field_of;

impl RemoteBatch {
    /// Asks for a session on every server, which tells what the mowers perceive if `percept` says so.
    pub(super) fn ask_to_open(
        &mut self,
        now_ms: u64,
        nonces: Vec<u128>,
        client: &str,
        percept: bool,
    ) -> Result<(), Error> {
        self.perception = percept.then(|| Perception::new(self.template(), self.rows));
        let config = self.scenario.get().scenario.to_toml();
        let autoreset = match self.autoreset {
            Autoreset::NextStep => AutoresetMode::NextStep,
            Autoreset::SameStep => AutoresetMode::SameStep,
            Autoreset::Disabled => AutoresetMode::Disabled,
        };
        for (part, nonce) in self.parts.iter_mut().zip(nonces) {
            (part.reply, part.was_asked) = (None, true);
            let open = Open {
                nonce,
                env_id: ENV_ID.to_owned(),
                config: config.clone(),
                num_envs: u32::try_from(part.rows).unwrap_or(u32::MAX),
                autoreset,
                hash_every: 0,
                infos: self.infos,
                snapshot: None,
                percept,
                client: client.to_owned(),
            };
            part.session.open(now_ms, &open)?;
        }
        Ok(())
    }

    /// Asks for episodes in the rows of `mask`, with their seeds and weeds if there are any.
    pub(super) fn ask_to_begin(
        &mut self,
        now_ms: u64,
        seeds: &[Option<u64>],
        mask: Vec<bool>,
        weeds: Vec<Option<Vec<Point>>>,
    ) -> Result<(), Error> {
        // How the rows stand that do not begin is not known where a step was not answered.
        if mask.contains(&false) {
            settled(&self.parts)?;
        }
        let bytes = |points: Vec<Point>| bytes_of(points.iter().flat_map(|at| [at.x, at.y]));
        // Refused here, so that no server has begun an episode when another refuses.
        if let Some(perception) = &self.perception {
            for (row, points) in weeds.iter().enumerate() {
                let count = points.as_ref().map_or(0, Vec::len);
                perception.check_weeds(&field_of(row, weeds.len()), count)?;
            }
        }
        let weeds: Vec<Option<Vec<u8>>> =
            weeds.into_iter().map(|points| points.map(bytes)).collect();
        let is_in_doubt = settled(&self.parts).is_err();
        for part in &mut self.parts {
            let rows = part.first..part.first + part.rows;
            let there = bytes_of(seeds[rows.clone()].iter().map(Option::is_some));
            let numbers = bytes_of(seeds[rows.clone()].iter().map(|seed| seed.unwrap_or_default()));
            let table = [there, numbers].concat();
            let of_part = if weeds.len() == self.rows { &weeds[rows.clone()] } else { &weeds[..] };
            let reset = Reset {
                seeds: Seeds::Some(&table),
                mask: &bytes_of(mask[rows].iter().copied()),
                weeds: of_part.iter().map(Option::as_deref).collect(),
            };
            (part.reply, part.was_asked) = (None, true);
            part.session.call(now_ms, Verb::Reset, &reset)?;
        }
        if let Some(perception) = &mut self.perception {
            let given = |row: usize| weeds.get(row).or(weeds.first()).and_then(Option::as_ref);
            let count = |row| given(row).map(|table| table.len() / (2 * size_of::<f64>()));
            perception.ask_to_begin(&mask, count, is_in_doubt);
        }
        self.begun = mask;
        Ok(())
    }

    /// Asks for a step of every row.
    pub(super) fn ask_to_step(&mut self, now_ms: u64, actions: &Bound<PyAny>) -> Result<(), Error> {
        let decoder = *self.template.decoder();
        let actions = self.actions.read(actions, decoder.spec(), self.rows)?;
        let width = match decoder.spec() {
            ActionSpec::Continuous(bounds) => bounds.len(),
            ActionSpec::Discrete(_) => 1,
        };
        // Numbers are refused only where they are not finite, which is seen of all of them at once.
        let are_finite = match actions {
            Actions::Continuous(numbers) => {
                numbers.iter().fold(true, |all, number| all & number.is_finite())
            }
            Actions::Discrete(_) => false,
        };
        // Refused here, so that no server has moved when another refuses.
        for (row, &state) in self.states.iter().enumerate() {
            let error = match state {
                State::Unstarted => Err(ActionError::NotReset),
                State::Ended if self.autoreset != Autoreset::NextStep => {
                    Err(ActionError::EpisodeOver)
                }
                State::Ended => Ok(()),
                State::Running if are_finite => {
                    debug_assert!(decoder.decode(actions.row(row, width)).is_ok(), "row {row}");
                    Ok(())
                }
                State::Running => decoder.decode(actions.row(row, width)).map(|_| ()),
            };
            error.map_err(|error| BatchError::Row { row, error })?;
        }
        settled(&self.parts)?;
        for part in &mut self.parts {
            let (start, end) = (part.first * width, (part.first + part.rows) * width);
            let table = match actions {
                Actions::Continuous(numbers) => bytes_in(&numbers[start..end]),
                Actions::Discrete(choices) => bytes_in(&choices[start..end]),
            };
            (part.reply, part.was_asked) = (None, true);
            part.session.call(now_ms, Verb::Step, &Step { actions: vec![&table] })?;
        }
        Ok(())
    }

    /// Asks for a step of the only row, and refuses what an environment here would refuse, in its words.
    pub(super) fn ask_to_step_alone(
        &mut self,
        now_ms: u64,
        action: &Bound<PyAny>,
    ) -> Result<(), Error> {
        let decoder = *self.template.decoder();
        let action = read_action(action, decoder.spec(), &mut self.action)?;
        decoder.decode(action)?;
        match self.states[0] {
            State::Unstarted => return Err(ActionError::NotReset.into()),
            State::Ended => return Err(ActionError::EpisodeOver.into()),
            State::Running => settled(&self.parts)?,
        }
        let table = match action {
            Action::Continuous(numbers) => bytes_in(numbers),
            Action::Discrete(choice) => bytes_of([choice]).into(),
        };
        let part = &mut self.parts[0];
        (part.reply, part.was_asked) = (None, true);
        part.session.call(now_ms, Verb::Step, &Step { actions: vec![&table] })?;
        Ok(())
    }

    /// Asks to put back what a snapshot holds, all rows or one.
    pub(super) fn ask_to_restore(
        &mut self,
        now_ms: u64,
        snapshot: &[u8],
        row: Option<usize>,
    ) -> Result<(), Error> {
        settled(&self.parts)?;
        // Looked through here, so that no server has changed when another refuses.
        let rows = match row {
            Some(_) => vec![snapshot.to_vec()],
            None => split(snapshot, self.rows)?,
        };
        let mut ended = Vec::with_capacity(rows.len());
        for (place, snapshot) in rows.iter().enumerate() {
            self.template.restore_row(0, snapshot)?;
            let env = &self.template.rows()[0];
            if let Some(perception) = &self.perception {
                let field = format!("snapshot[{}]", row.unwrap_or(place));
                perception.check_weeds(&field, env.weeds().positions().len())?;
            }
            ended.push(env.end());
        }
        let state = |end| match end {
            None => State::Unstarted,
            Some(End::Running) => State::Running,
            Some(_) => State::Ended,
        };
        self.restored =
            (0..).zip(ended).map(|(place, end)| (row.unwrap_or(place), state(end))).collect();
        for part in &mut self.parts {
            (part.reply, part.was_asked) = (None, false);
            let Some(env) = part.place(row) else { continue };
            part.was_asked = true;
            let data = match row {
                Some(_) => snapshot.to_vec(),
                None => joined(&rows[part.first..part.first + part.rows]),
            };
            part.session.call(now_ms, Verb::Restore, &Restore { env, data: &data })?;
        }
        Ok(())
    }
}
