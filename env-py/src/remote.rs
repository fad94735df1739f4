//! Many environments on servers: what is asked of them, and what Python is given of their answers.
//!
//! Bytes go in and out; Python moves them. The rows of a batch may lie on several servers, some neighbouring ones on each.

mod ask;
mod part;
mod perception;
mod receive;

use bytes::Bytes;
use numpy::{PyArray2, PyReadonlyArray1};
use pyo3::exceptions::PyAttributeError;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::{PyBytes, PyDict};
use swath_core::action::ActionSpec;
use swath_core::batch::{Autoreset, BatchEnv, BatchOptions, Last, joined, split};
use swath_core::config::ConfigError;
use swath_core::env::Env;
use swath_core::mirror::Mirror;
use swath_core::observation::Observation;
use swath_wire::client::{ClientError, ClientOptions, ClientOutput};
use swath_wire::codec;
use swath_wire::fault::Fault;
use swath_wire::header::{Header, Verb};
use swath_wire::layout::Layout;
use swath_wire::message::{OpenReply, ResetReply, Snapshot, SnapshotReply, SpecReply};
use swath_wire::numbers::read_into;
use swath_wire::peer::{check_build, check_opened};
use swath_wire::resume::{ResumeOptions, ResumingSession};

use crate::action::ActionBuffer;
use crate::batch::{autoreset_from, no_row};
use crate::errors::Error;
use crate::face::{Ends, Face, FlatStep, Step as FaceStep};
use crate::infos::table;
use crate::scenario::Scenario;
use crate::seed::{Seed, seeds_of_rows};
use crate::spec::{self, ActionForm, PartTuple};
use crate::summary::write_numbers;
use crate::weeds::weeds_of_rows;
use part::{Part, replies, settled};
use perception::Perception;

type ResetTuple<'py> = (Bound<'py, PyAny>, Bound<'py, PyDict>);

/// What Python has to do next for one server: `("send", verb, message, timeout_ms)`, `("wait", until_ms)`, `("done",)` or
/// `("idle",)`.
type Poll<'py> = (&'static str, Option<&'static str>, Option<Bound<'py, PyBytes>>, u64);

/// Many pastures with one mower each, on one server or several.
///
/// A call begins with `begin_...`, goes on with `poll` and `on_...` for every server until each is done, and ends with
/// `finish_...`, which raises what went wrong. Nothing here waits or knows what time it is.
#[pyclass(module = "swath._native")]
pub(crate) struct RemoteBatch {
    scenario: Py<Scenario>,
    /// One environment of the scenario, which knows all that needs no server.
    template: BatchEnv,
    layout: Layout,
    /// Whether the servers tell the infos of every step.
    infos: bool,
    autoreset: Autoreset,
    rows: usize,
    parts: Vec<Part>,
    states: Vec<State>,
    /// What the mowers perceive, where it was asked for.
    perception: Option<Perception>,
    actions: ActionBuffer,
    /// The numbers of the action of one environment.
    action: Vec<f32>,
    face: Face,
    last: Vec<Option<Last>>,
    last_observation: Observation,
    last_mask: Vec<bool>,
    /// Which choices are open in every row.
    masks: Vec<bool>,
    /// The rows that the reset in flight begins.
    begun: Vec<bool>,
    /// How the rows stand that the restore in flight puts back.
    restored: Vec<(usize, State)>,
}

#[derive(Clone, Copy, PartialEq)]
enum State {
    Unstarted,
    Running,
    Ended,
}

#[pymethods]
impl RemoteBatch {
    #[new]
    #[expect(clippy::too_many_arguments, reason = "Python gives most of them by name")]
    #[pyo3(signature = (scenario, rows_of_parts, autoreset_mode, *, copy, infos, patience_ms, jitter_seed, hash_every=None))]
    fn new(
        scenario: Bound<Scenario>,
        rows_of_parts: Vec<usize>,
        autoreset_mode: &str,
        copy: bool,
        infos: bool,
        // How long an attempt may take, and a call with all its attempts.
        patience_ms: (u64, u64),
        jitter_seed: u64,
        hash_every: Option<u32>,
    ) -> Result<Self, Error> {
        let autoreset = autoreset_from(autoreset_mode)?;
        let options = BatchOptions { rows: 1, autoreset, threads: 1 };
        let template = BatchEnv::new(&scenario.get().scenario, options)?;
        let resume =
            hash_every.map(|hash_every| ResumeOptions { hash_every, ..ResumeOptions::default() });
        let mut rows = 0;
        let mut parts = Vec::new();
        for (of_part, ahead) in rows_of_parts.into_iter().zip(0..) {
            let options = ClientOptions {
                attempt_ms: patience_ms.0,
                deadline_ms: patience_ms.1,
                jitter_seed: jitter_seed.wrapping_add(ahead),
                ..ClientOptions::default()
            };
            let session = ResumingSession::new(options, resume);
            parts.push(Part::new(session, rows, of_part));
            rows += of_part;
        }
        let choices = template.mask_width();
        let is_same_step = autoreset == Autoreset::SameStep;
        let (last_rows, last_choices) = if is_same_step { (rows, choices) } else { (0, 0) };
        Ok(Self {
            layout: Layout::of(&template, infos),
            face: Face::new(template.observation_spec(), rows, autoreset, choices, copy, infos),
            infos,
            last_observation: template.observation_spec().rows(last_rows),
            last_mask: vec![false; rows * last_choices],
            masks: vec![true; rows * choices],
            perception: None,
            scenario: scenario.unbind(),
            template,
            autoreset,
            rows,
            parts,
            states: vec![State::Unstarted; rows],
            actions: ActionBuffer::default(),
            action: Vec::new(),
            last: vec![None; rows],
            begun: vec![false; rows],
            restored: Vec::new(),
        })
    }

    /// The scenario that the environments were made for.
    #[getter]
    fn scenario(&self, py: Python) -> Py<Scenario> {
        self.scenario.clone_ref(py)
    }

    /// The parts of an observation of one environment.
    #[getter]
    fn observation_spec(&self) -> Vec<PartTuple> {
        spec::parts(self.template.observation_spec())
    }

    /// Name, lowest and highest value of every number of an action, or the number of choices.
    #[getter]
    fn action_spec(&self) -> ActionForm {
        spec::action(self.template.decoder().spec())
    }

    /// Whether every row has begun an episode.
    #[getter]
    fn has_begun(&self) -> bool {
        self.states.iter().all(|&state| state != State::Unstarted)
    }

    /// Which choices of the action are open, (rows, choices); an `AttributeError` where actions are no choices.
    #[getter]
    fn action_masks<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<bool>>> {
        let ActionSpec::Discrete(choices) = self.template.decoder().spec() else {
            return Err(PyAttributeError::new_err("actions of this kind are not masked"));
        };
        if self.masks.is_empty() {
            return table(py, &vec![true; self.rows * choices], self.rows);
        }
        table(py, &self.masks, self.rows)
    }

    /// The numbers of a row's present episode, as far as it has got, without an outcome. Percepts have to be told for it.
    fn summary<'py>(&self, py: Python<'py>, row: usize) -> Result<Bound<'py, PyDict>, Error> {
        if row >= self.rows {
            return Err(no_row(row, self.rows).into());
        }
        let summary = self.perception()?.summary(row)?;
        let numbers = PyDict::new(py);
        write_numbers(&numbers, &summary)?;
        Ok(numbers)
    }

    /// The name of the lease of one server's session; none if there is none.
    fn lease(&self, part: usize) -> Option<String> {
        self.parts[part].session.lid().map(|lid| format!("{lid:032x}"))
    }

    /// Longest reply that a step can have from one server, bytes; 0 until its session is open.
    fn max_reply(&self, part: usize) -> u32 {
        self.parts[part].max_reply
    }

    /// The first server whose answer to the last call was an error; none if there is none.
    fn failed(&self) -> Option<usize> {
        self.parts.iter().position(|part| matches!(part.reply, Some(Err(_))))
    }

    /// What to do next for one server.
    fn poll<'py>(&mut self, py: Python<'py>, part: usize, now_ms: u64) -> Poll<'py> {
        let part = &mut self.parts[part];
        match part.session.poll(now_ms) {
            ClientOutput::Send { verb, message, timeout_ms } => {
                ("send", Some(verb.name()), Some(PyBytes::new(py, &message)), timeout_ms)
            }
            ClientOutput::Wait { until_ms } => ("wait", None, None, until_ms),
            ClientOutput::Done(reply) => {
                part.reply = Some(reply);
                ("done", None, None, 0)
            }
            ClientOutput::Idle => ("idle", None, None, 0),
        }
    }

    /// A server has answered. Returns whether the call is over, so that nothing more has to be waited for.
    fn on_reply(&mut self, part: usize, now_ms: u64, message: PyBackedBytes) -> bool {
        let session = &mut self.parts[part].session;
        // Python's bytes are kept, not copied.
        session.on_reply(now_ms, Bytes::from_owner(message));
        session.is_done()
    }

    /// Nobody has answered, and nobody will.
    fn on_nothing(&mut self, part: usize, now_ms: u64) {
        self.parts[part].session.on_nothing(now_ms);
    }

    /// Nobody has answered in time.
    fn on_timeout(&mut self, part: usize, now_ms: u64) {
        self.parts[part].session.on_timeout(now_ms);
    }

    /// Waits for nothing any more: whoever waited was interrupted.
    fn abandon(&mut self, now_ms: u64) {
        for part in &mut self.parts {
            // An answer that has arrived is kept: a retry asks the others only.
            if let Some(reply) = part.session.abandon(now_ms) {
                part.reply = Some(reply);
            }
        }
    }

    /// Asks every server that has not answered the last call the same once more.
    fn retry(&mut self, now_ms: u64) -> Result<(), Error> {
        if self.parts.iter().all(|part| !part.session.is_in_doubt() && part.reply.is_none()) {
            return Err(ClientError::NothingToRetry.into());
        }
        for part in &mut self.parts {
            if part.session.is_in_doubt() {
                part.reply = None;
                part.session.retry(now_ms)?;
            }
        }
        Ok(())
    }

    /// How often sessions were resumed at servers that were started anew.
    #[getter]
    fn resumed(&self) -> u64 {
        self.parts.iter().map(|part| part.session.resumed()).sum()
    }

    /// Why a session, which goes on, can no longer be resumed; none if each can.
    #[getter]
    fn gap(&self) -> Option<String> {
        self.parts.iter().find_map(|part| part.session.gap()).map(ToString::to_string)
    }

    /// Asks every server what it is.
    fn begin_spec(&mut self, now_ms: u64) -> Result<(), Error> {
        for part in &mut self.parts {
            (part.reply, part.was_asked) = (None, true);
            part.session.call_empty(now_ms, Verb::Spec)?;
        }
        Ok(())
    }

    /// The servers are of the same version of swath.
    fn finish_spec(&mut self) -> Result<(), Error> {
        for reply in replies(&mut self.parts)? {
            let (_, payload) = Header::read(&reply).map_err(Fault::from)?;
            check_build(&codec::read::<SpecReply>(payload)?, env!("CARGO_PKG_VERSION"))?;
        }
        Ok(())
    }

    /// Asks for a session on every server, which tells what the mowers perceive if `percept` says so.
    fn begin_open(
        &mut self,
        now_ms: u64,
        nonces: Vec<u128>,
        client: &str,
        percept: bool,
    ) -> Result<(), Error> {
        self.ask_to_open(now_ms, nonces, client, percept)
    }

    /// The sessions are there.
    fn finish_open(&mut self) -> Result<(), Error> {
        let replies = replies(&mut self.parts)?;
        for (part, reply) in self.parts.iter_mut().zip(replies) {
            let (_, payload) = Header::read(&reply).map_err(Fault::from)?;
            let reply: OpenReply = codec::read(payload)?;
            check_opened(&reply, &self.layout, &self.scenario.get().scenario.hash())?;
            part.max_reply = reply.max_reply;
        }
        Ok(())
    }

    /// Asks for episodes; see `Batch.reset`.
    #[pyo3(signature = (now_ms, seeds, mask=None, weeds=Vec::new(), first_seed=None))]
    fn begin_reset<'py>(
        &mut self,
        now_ms: u64,
        seeds: Vec<Option<Seed>>,
        mask: Option<PyReadonlyArray1<'py, bool>>,
        weeds: Vec<Option<Bound<'py, PyAny>>>,
        first_seed: Option<u64>,
    ) -> Result<(), Error> {
        let mask = mask.map_or_else(|| vec![true; self.rows], |mask| mask.as_array().to_vec());
        let has_begun = |row: usize| self.states[row] != State::Unstarted;
        let seeds = seeds_of_rows(seeds, &mask, first_seed, has_begun)?;
        let weeds = weeds_of_rows(weeds, self.template().site())?;
        self.ask_to_begin(now_ms, &seeds, mask, weeds)
    }

    /// The episodes have begun.
    fn finish_reset<'py>(&mut self, py: Python<'py>) -> Result<ResetTuple<'py>, Error> {
        // Kept until it has succeeded: a retry comes here again.
        let mask = self.begun.clone();
        let observation = self.receive_present(py, &mask)?;
        Ok((observation, self.face.begun_infos(py, &mask)?))
    }

    /// Asks for a step of every row; see `Batch.step`.
    fn begin_step(&mut self, now_ms: u64, actions: &Bound<PyAny>) -> Result<(), Error> {
        self.ask_to_step(now_ms, actions)
    }

    /// Asks for a step of the only row; see `Env.step`.
    fn begin_step_alone(&mut self, now_ms: u64, action: &Bound<PyAny>) -> Result<(), Error> {
        self.ask_to_step_alone(now_ms, action)
    }

    /// The step is made, as Gymnasium wants it.
    fn finish_step<'py>(&mut self, py: Python<'py>) -> Result<FaceStep<'py>, Error> {
        let (observation, ended) = self.receive_step(py)?;
        self.face.step(py, observation, ended, &self.ends())
    }

    /// The step is made, as stable-baselines3 wants it.
    fn finish_step_flat<'py>(
        &mut self,
        py: Python<'py>,
        elapsed_s: f64,
    ) -> Result<FlatStep<'py>, Error> {
        let (observation, ended) = self.receive_step(py)?;
        let Self { face, last, last_observation, last_mask, .. } = self;
        let ends = Ends {
            last: Box::new(|row: usize| last[row].as_ref()),
            observation: last_observation,
            masks: last_mask,
        };
        face.step_flat(py, observation, ended, &ends, elapsed_s)
    }

    /// Asks for the state as bytes: of all rows, or of one.
    #[pyo3(signature = (now_ms, row=None))]
    fn begin_snapshot(&mut self, now_ms: u64, row: Option<usize>) -> Result<(), Error> {
        settled(&self.parts)?;
        for part in &mut self.parts {
            (part.reply, part.was_asked) = (None, false);
            let Some(env) = part.place(row) else { continue };
            part.was_asked = true;
            part.session.call(now_ms, Verb::Snapshot, &Snapshot { env })?;
        }
        Ok(())
    }

    /// The state as bytes.
    #[pyo3(signature = (row=None))]
    fn finish_snapshot<'py>(
        &mut self,
        py: Python<'py>,
        row: Option<usize>,
    ) -> Result<Bound<'py, PyBytes>, Error> {
        let sizes: Vec<usize> = self.parts.iter().map(|part| part.rows).collect();
        let mut rows: Vec<Vec<u8>> = Vec::new();
        for (reply, size) in replies(&mut self.parts)?.iter().zip(sizes) {
            let (_, payload) = Header::read(reply).map_err(Fault::from)?;
            let reply: SnapshotReply = codec::read(payload)?;
            if row.is_some() {
                return Ok(PyBytes::new(py, reply.data));
            }
            rows.extend(split(reply.data, size)?);
        }
        Ok(PyBytes::new(py, &joined(&rows)))
    }

    /// Asks to put back what `snapshot` returned, all rows or one.
    #[pyo3(signature = (now_ms, snapshot, row=None))]
    fn begin_restore(
        &mut self,
        now_ms: u64,
        snapshot: &[u8],
        row: Option<usize>,
    ) -> Result<(), Error> {
        self.ask_to_restore(now_ms, snapshot, row)
    }

    /// The state is put back.
    fn finish_restore(&mut self) -> Result<(), Error> {
        let replies = replies(&mut self.parts)?;
        let choices = self.template.mask_width();
        for (row, state) in std::mem::take(&mut self.restored) {
            self.states[row] = state;
            self.face.forget(row);
            if let Some(perception) = &mut self.perception {
                perception.forget(row);
            }
        }
        // What is perceived and may be chosen now, of all rows on the servers that were asked.
        let parts = self.parts.iter().filter(|part| part.was_asked);
        for (part, reply) in parts.zip(&replies) {
            let (_, payload) = Header::read(reply).map_err(Fault::from)?;
            let reply: ResetReply = codec::read(payload)?;
            if let Some(perception) = &mut self.perception {
                perception.take_in(part, reply.percept.as_ref())?;
            }
            if choices == 0 {
                continue;
            }
            let table = reply.info.last().ok_or(Fault::Malformed { offset: 0 })?;
            let places = part.first * choices..(part.first + part.rows) * choices;
            read_into(table, &mut self.masks[places])?;
        }
        // Of a row that has not begun nothing is known, here as in a batch of this process.
        for (row, state) in self.states.iter().enumerate() {
            if *state == State::Unstarted {
                self.masks[row * choices..(row + 1) * choices].fill(true);
            }
        }
        Ok(())
    }

    /// Ends every session.
    fn begin_close(&mut self, now_ms: u64) {
        for part in &mut self.parts {
            part.reply = None;
            // One that is lost already needs no end.
            part.was_asked = part.session.call_empty(now_ms, Verb::Close).is_ok();
        }
    }

    /// The sessions are over.
    fn finish_close(&mut self) -> Result<(), Error> {
        replies(&mut self.parts)?;
        Ok(())
    }
}

impl RemoteBatch {
    /// What every mower perceives.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] if the sessions were opened without percepts.
    pub(crate) fn mirrors(&self) -> Result<&[Mirror], ConfigError> {
        self.perception().map(Perception::mirrors)
    }

    fn perception(&self) -> Result<&Perception, ConfigError> {
        self.perception.as_ref().ok_or_else(|| {
            ConfigError::value("percept", "true where a scripted agent acts", "false")
        })
    }

    /// One environment of the scenario, which has begun no episode.
    pub(crate) fn template(&self) -> &Env {
        &self.template.rows()[0]
    }

    fn ends(&self) -> Ends<'_> {
        Ends {
            last: Box::new(|row: usize| self.last[row].as_ref()),
            observation: &self.last_observation,
            masks: &self.last_mask,
        }
    }
}
