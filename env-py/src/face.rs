//! What Python is given of a step of many environments, wherever they are.

use std::sync::Arc;

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use swath_core::batch::{Autoreset, Last, StepMut};
use swath_core::observation::{Observation, ObservationMut, ObservationSpec};

use crate::errors::Error;
use crate::flat_infos::FlatInfos;
use crate::infos::{Columns, Put, final_infos, infos, put_masks, put_summaries};
use crate::observations::ObservationArrays;
use crate::spec;
use crate::summary::write_summary;

type Flags<'py> = Bound<'py, PyArray1<bool>>;

/// Observations, rewards, two columns of flags, infos.
pub(crate) type Step<'py> =
    (Bound<'py, PyAny>, Bound<'py, PyArray1<f64>>, Flags<'py>, Flags<'py>, Bound<'py, PyDict>);

/// Observations, rewards, flags, infos, and the rows whose episode ended.
pub(crate) type FlatStep<'py> =
    (Bound<'py, PyAny>, Bound<'py, PyArray1<f32>>, Flags<'py>, Bound<'py, PyList>, Vec<usize>);

/// The columns of a step, and what is told of them.
pub(crate) struct Face {
    spec: Arc<ObservationSpec>,
    rows: usize,
    autoreset: Autoreset,
    /// Places of an action mask; 0 but for the action kind `target`.
    choices: usize,
    /// The arrays to write observations into, where the same ones are handed out again and again.
    kept: Option<ObservationArrays>,
    is_copied: bool,
    /// Whether every step tells its infos, or only those of episodes that end, and what may be chosen.
    has_infos: bool,
    table: StepTable,
    /// Sum of the rewards and number of the steps of each row's present episode, for `step_flat`.
    returns: Vec<f64>,
    lengths: Vec<u64>,
    flat_infos: FlatInfos,
}

/// How the latest episodes of rows ended.
pub(crate) struct Ends<'a> {
    pub(crate) last: Box<dyn Fn(usize) -> Option<&'a Last> + 'a>,
    /// Their last observations and action masks, kept in the mode `SameStep`.
    pub(crate) observation: &'a Observation,
    pub(crate) masks: &'a [bool],
}

/// The columns of a step.
pub(crate) struct StepTable {
    pub(crate) reward: Vec<f64>,
    pub(crate) terminated: Vec<bool>,
    pub(crate) truncated: Vec<bool>,
    pub(crate) weed: Vec<f64>,
    pub(crate) path: Vec<f64>,
    pub(crate) failure: Vec<f64>,
    pub(crate) is_clipped: Vec<bool>,
    pub(crate) distance_m: Vec<f64>,
    /// Row by row; empty but for the action kind `target`.
    pub(crate) action_mask: Vec<bool>,
    /// Every row.
    all: Vec<bool>,
}

impl Face {
    /// The face of so many rows.
    pub(crate) fn new(
        spec: &ObservationSpec,
        rows: usize,
        autoreset: Autoreset,
        choices: usize,
        copy: bool,
        has_infos: bool,
    ) -> Self {
        Self {
            spec: Arc::new(spec.clone()),
            rows,
            autoreset,
            choices,
            kept: None,
            is_copied: copy,
            has_infos,
            table: StepTable::new(rows, choices),
            returns: vec![0.0; rows],
            lengths: vec![0; rows],
            flat_infos: FlatInfos::default(),
        }
    }

    /// Whether every step returns fresh arrays.
    pub(crate) fn is_copied(&self) -> bool {
        self.is_copied
    }

    /// Whether every step tells its infos.
    pub(crate) fn has_infos(&self) -> bool {
        self.has_infos
    }

    /// Sum of the rewards and number of the steps of each row's present episode.
    pub(crate) fn sums(&self) -> (Vec<f64>, Vec<u64>) {
        (self.returns.clone(), self.lengths.clone())
    }

    /// Puts back what [`Face::sums`] returned.
    pub(crate) fn set_sums(&mut self, returns: Vec<f64>, lengths: Vec<u64>) {
        (self.returns, self.lengths) = (returns, lengths);
    }

    /// Begins the sums of a row anew.
    pub(crate) fn forget(&mut self, row: usize) {
        (self.returns[row], self.lengths[row]) = (0.0, 0);
    }

    /// Has observations written, to fresh arrays or the kept ones.
    pub(crate) fn write<'py, R>(
        &mut self,
        py: Python<'py>,
        write: impl FnOnce(&mut StepTable, ObservationMut) -> Result<R, Error>,
    ) -> Result<(Bound<'py, PyAny>, R), Error> {
        let Self { spec, rows, kept, table, .. } = self;
        let arrays = match kept.take() {
            Some(arrays) => arrays,
            None => ObservationArrays::empty(py, spec, *rows)?,
        };
        let result = arrays.write(py, |observation| write(table, observation));
        let object = arrays.object(py, spec)?;
        if !self.is_copied {
            self.kept = Some(arrays);
        }
        Ok((object, result?))
    }

    /// Begins episodes in the rows of `mask`; returns the columns, whose action masks are still to be written.
    pub(crate) fn begin(&mut self, mask: &[bool]) -> &mut StepTable {
        (0..mask.len()).filter(|&row| mask[row]).for_each(|row| self.forget(row));
        self.table.clear();
        &mut self.table
    }

    /// The infos of the rows of `mask`, which have just begun.
    pub(crate) fn begun_infos<'py>(
        &mut self,
        py: Python<'py>,
        mask: &[bool],
    ) -> PyResult<Bound<'py, PyDict>> {
        if self.choices > 0 {
            let masks = self.table.action_mask.chunks_exact_mut(self.choices);
            for (of_row, &is_begun) in masks.zip(mask) {
                if !is_begun {
                    of_row.fill(false);
                }
            }
        }
        self.infos(py, mask)
    }

    fn infos<'py>(&self, py: Python<'py>, mask: &[bool]) -> PyResult<Bound<'py, PyDict>> {
        if self.has_infos {
            return infos(py, self.table.columns(), mask);
        }
        let infos = PyDict::new(py);
        if self.choices > 0 {
            put_masks(&infos, &self.table.action_mask, mask)?;
        }
        Ok(infos)
    }

    /// A step as Gymnasium wants it, of which so many episodes ended.
    pub(crate) fn step<'py>(
        &self,
        py: Python<'py>,
        observation: Bound<'py, PyAny>,
        ended: usize,
        ends: &Ends,
    ) -> Result<Step<'py>, Error> {
        let table = &self.table;
        let infos = self.infos(py, &table.all)?;
        if ended > 0 {
            self.put_last(&infos, ends)?;
        }
        let reward = PyArray1::from_slice(py, &table.reward);
        let terminated = PyArray1::from_slice(py, &table.terminated);
        let truncated = PyArray1::from_slice(py, &table.truncated);
        Ok((observation, reward, terminated, truncated, infos))
    }

    /// A step as stable-baselines3 wants it; `elapsed_s` is the time that the infos of ended episodes tell.
    pub(crate) fn step_flat<'py>(
        &mut self,
        py: Python<'py>,
        observation: Bound<'py, PyAny>,
        ended: usize,
        ends: &Ends,
        elapsed_s: f64,
    ) -> Result<FlatStep<'py>, Error> {
        let table = &self.table;
        for (row, &reward) in table.reward.iter().enumerate() {
            self.returns[row] += reward;
            self.lengths[row] += 1;
        }
        let infos = self.flat_infos.list(py, &table.truncated)?;
        let is_done = table.ended();
        let mut ended_rows = Vec::new();
        if ended > 0 {
            ended_rows.extend((0..is_done.len()).filter(|&row| is_done[row]));
        }
        for &row in &ended_rows {
            let info = infos.get_item(row)?.cast_into().map_err(PyErr::from)?;
            self.write_last(row, &info, ends, elapsed_s)?;
            (self.returns[row], self.lengths[row]) = (0.0, 0);
        }
        #[expect(clippy::cast_possible_truncation, reason = "stable-baselines3 keeps float32")]
        let reward: Vec<f32> = self.table.reward.iter().map(|&reward| reward as f32).collect();
        let reward = PyArray1::from_slice(py, &reward);
        let is_done = PyArray1::from_slice(py, &is_done);
        Ok((observation, reward, is_done, infos, ended_rows))
    }

    /// Adds what only the last info of an episode says, of the rows that ended with this step.
    fn put_last(&self, infos: &Bound<PyDict>, ends: &Ends) -> PyResult<()> {
        let py = infos.py();
        let mask = &self.table.ended();
        let last = |(row, &has_ended)| if has_ended { (ends.last)(row) } else { None };
        let ended: Vec<_> = mask.iter().enumerate().map(last).collect();
        if self.autoreset != Autoreset::SameStep {
            return put_summaries(infos, mask, &ended);
        }
        let final_obs = |(row, &has_ended): (usize, &bool)| {
            if !has_ended {
                return Ok(py.None());
            }
            spec::observation(py, &self.spec, ends.observation, row).map(Bound::unbind)
        };
        let final_obs: Vec<_> = mask.iter().enumerate().map(final_obs).collect::<PyResult<_>>()?;
        let put = Put { dict: infos, mask };
        put.named("final_obs", &final_obs)?;
        put.dict("final_info", &final_infos(py, mask, &ended, ends.masks)?)
    }

    /// The last info of an episode for stable-baselines3.
    fn write_last(
        &self,
        row: usize,
        info: &Bound<PyDict>,
        ends: &Ends,
        elapsed_s: f64,
    ) -> PyResult<()> {
        let py = info.py();
        let last = (ends.last)(row).expect("the row's episode has just ended");
        let observation = spec::observation(py, &self.spec, ends.observation, row)?;
        info.set_item("terminal_observation", observation)?;
        crate::env::write_info(info, &last.terms, last.is_clipped)?;
        if self.choices > 0 {
            let mask = &ends.masks[row * self.choices..(row + 1) * self.choices];
            info.set_item("elapsed_m", last.distance_m)?;
            info.set_item("action_mask", PyArray1::from_slice(py, mask))?;
        }
        write_summary(info, &last.summary, last.outcome)?;
        let episode = PyDict::new(py);
        episode.set_item("r", self.returns[row])?;
        episode.set_item("l", self.lengths[row])?;
        episode.set_item("t", elapsed_s)?;
        info.set_item("episode", episode)
    }
}

impl StepTable {
    fn new(rows: usize, choices: usize) -> Self {
        let (zeros, flags) = (vec![0.0; rows], vec![false; rows]);
        Self {
            reward: zeros.clone(),
            terminated: flags.clone(),
            truncated: flags.clone(),
            weed: zeros.clone(),
            path: zeros.clone(),
            failure: zeros.clone(),
            is_clipped: flags,
            distance_m: zeros,
            action_mask: vec![false; rows * choices],
            all: vec![true; rows],
        }
    }

    /// Nothing has happened in any row.
    fn clear(&mut self) {
        let rows = self.all.len();
        *self = Self::new(rows, self.action_mask.len() / rows);
    }

    /// The columns, and `observation`, to be written by a step.
    pub(crate) fn out<'a>(&'a mut self, observation: ObservationMut<'a>) -> StepMut<'a> {
        StepMut {
            observation,
            reward: &mut self.reward,
            terminated: &mut self.terminated,
            truncated: &mut self.truncated,
            weed: &mut self.weed,
            path: &mut self.path,
            failure: &mut self.failure,
            is_clipped: &mut self.is_clipped,
            distance_m: &mut self.distance_m,
            action_mask: &mut self.action_mask,
        }
    }

    fn columns(&self) -> Columns<'_> {
        let Self { weed, path, failure, is_clipped, distance_m, action_mask, .. } = self;
        let decision = (!action_mask.is_empty()).then_some((&distance_m[..], &action_mask[..]));
        Columns { weed, path, failure, is_clipped, decision }
    }

    /// Which rows ended with the latest step.
    fn ended(&self) -> Vec<bool> {
        self.terminated.iter().zip(&self.truncated).map(|(a, b)| a | b).collect()
    }
}
