//! What the servers answer, taken in.

use pyo3::prelude::*;
use swath_core::batch::Autoreset;
use swath_core::observation::Sizes;
use swath_wire::codec;
use swath_wire::fault::Fault;
use swath_wire::header::Header;
use swath_wire::layout::Layout;
use swath_wire::message::{ResetReply, StepReply};
use swath_wire::received::{EndedMut, read_reset, read_step};

use super::part::replies;
use super::{RemoteBatch, State};
use crate::errors::Error;

impl RemoteBatch {
    /// Takes in what the servers say of a step. Returns the observations and how many episodes ended.
    pub(super) fn receive_step<'py>(
        &mut self,
        py: Python<'py>,
    ) -> Result<(Bound<'py, PyAny>, usize), Error> {
        let Self {
            face,
            parts,
            last,
            last_observation,
            last_mask,
            template,
            states,
            masks,
            layout,
            perception,
            ..
        } = self;
        let (sizes, choices) = (template.observation_spec().sizes(), template.mask_width());
        let is_same_step = self.autoreset == Autoreset::SameStep;
        let last_sizes = if is_same_step { sizes } else { Sizes::default() };
        // In the other modes nobody asks for the mask of an episode that ended.
        let mut unused = vec![false; if is_same_step { 0 } else { masks.len() }];
        let mut last_mask = if is_same_step { &mut last_mask[..] } else { &mut unused[..] };
        face.write(py, |table, observation| {
            // Taken only where they can be written.
            let replies = replies(parts)?;
            let mut out = table.out(observation);
            let (mut last, mut last_observation) = (&mut last[..], last_observation.as_mut());
            let mut ended = 0;
            for (part, reply) in parts.iter().zip(&replies) {
                let (_, payload) = Header::read(reply).map_err(Fault::from)?;
                let reply: StepReply = codec::read(payload)?;
                check_tables(&reply.info, layout)?;
                let (of_part, rest) = out.split_at(part.rows, sizes, choices);
                out = rest;
                let (last_of_part, rest) = last.split_at_mut(part.rows);
                last = rest;
                let (observation, rest) = last_observation.split_at(part.rows, last_sizes);
                last_observation = rest;
                let (mask, rest) = last_mask.split_at_mut(part.rows * choices);
                last_mask = rest;
                let into = EndedMut { last: last_of_part, observation, mask };
                ended += read_step(&reply, of_part, into)?;
                if let Some(perception) = perception {
                    perception.take_in(part, reply.percept.as_ref())?;
                }
            }
            let flags = table.terminated.iter().zip(&table.truncated);
            let ends = flags.map(|(&terminated, &truncated)| terminated | truncated);
            if let Some(perception) = perception {
                for (row, (state, has_ended)) in states.iter().zip(ends.clone()).enumerate() {
                    if *state == State::Ended || (has_ended && is_same_step) {
                        perception.begin_next(row);
                    } else {
                        perception.count(row, table.weed[row]);
                    }
                }
            }
            for (state, has_ended) in states.iter_mut().zip(ends) {
                *state = if has_ended && !is_same_step { State::Ended } else { State::Running };
            }
            masks.copy_from_slice(&table.action_mask);
            Ok(ended)
        })
    }

    /// Takes in the state of every row after those of `mask` have begun.
    pub(super) fn receive_present<'py>(
        &mut self,
        py: Python<'py>,
        mask: &[bool],
    ) -> Result<Bound<'py, PyAny>, Error> {
        let replies = replies(&mut self.parts)?;
        let Self { face, parts, template, states, masks, layout, perception, .. } = self;
        let (sizes, choices) = (template.observation_spec().sizes(), template.mask_width());
        face.begin(mask);
        let (observation, ()) = face.write(py, |table, observation| {
            let mut out = table.out(observation);
            for (part, reply) in parts.iter().zip(&replies) {
                let (_, payload) = Header::read(reply).map_err(Fault::from)?;
                let reply: ResetReply = codec::read(payload)?;
                check_tables(&reply.info, layout)?;
                let (of_part, rest) = out.split_at(part.rows, sizes, choices);
                out = rest;
                read_reset(&reply, of_part)?;
                if let Some(perception) = perception {
                    perception.take_in(part, reply.percept.as_ref())?;
                }
            }
            for row in (0..mask.len()).filter(|&row| mask[row]) {
                states[row] = State::Running;
                if let Some(perception) = perception {
                    perception.begin(row);
                }
                let places = row * choices..(row + 1) * choices;
                masks[places.clone()].copy_from_slice(&table.action_mask[places]);
            }
            Ok(())
        })?;
        Ok(observation)
    }
}

/// Infos that were asked for are there.
fn check_tables(info: &[&[u8]], layout: &Layout) -> Result<(), Fault> {
    if info.len() == layout.info.len() { Ok(()) } else { Err(Fault::Malformed { offset: 0 }) }
}
