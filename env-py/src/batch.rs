//! Many environments in Python's hands.

use numpy::{PyArray1, PyArray2, PyReadonlyArray1};
use pyo3::exceptions::PyAttributeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};
use swath_core::action::ActionSpec;
use swath_core::batch::{Autoreset, BatchEnv, BatchOptions, StepMut};
use swath_core::config::ConfigError;
use swath_core::env::{Beginning, Env};
use swath_core::geometry::Point;
use swath_core::observation::ObservationMut;

use crate::action::ActionBuffer;
use crate::errors::Error;
use crate::flat_infos::FlatInfos;
use crate::infos::{Columns, Put, final_infos, infos, put_summaries, table};
use crate::observations::ObservationArrays;
use crate::scenario::Scenario;
use crate::seed::Seed;
use crate::spec::{self, ActionForm, PartTuple};
use crate::summary::write_summary;
use crate::weeds::points_from;

/// Fewer rows are stepped without letting other Python threads run meanwhile: it would take as long as the step.
const ROWS_TO_DETACH: usize = 32;

type Flags<'py> = Bound<'py, PyArray1<bool>>;
type Reset<'py> = (Bound<'py, PyAny>, Bound<'py, PyDict>);
type Step<'py> =
    (Bound<'py, PyAny>, Bound<'py, PyArray1<f64>>, Flags<'py>, Flags<'py>, Bound<'py, PyDict>);
type FlatStep<'py> =
    (Bound<'py, PyAny>, Bound<'py, PyArray1<f32>>, Flags<'py>, Bound<'py, PyList>, Vec<usize>);
type NewArguments<'py> = ((Py<Scenario>, usize, &'static str, usize), Bound<'py, PyDict>);
type Stored<'py> = (Bound<'py, PyBytes>, Vec<f64>, Vec<u64>);

/// Many pastures with one mower each.
#[pyclass(module = "swath._native")]
pub(crate) struct Batch {
    core: BatchEnv,
    scenario: Py<Scenario>,
    options: BatchOptions,
    /// The arrays to write observations into, where the same ones are handed out again and again.
    kept: Option<ObservationArrays>,
    is_copied: bool,
    actions: ActionBuffer,
    table: StepTable,
    /// Sum of the rewards and number of the steps of each row's present episode, for `step_flat`.
    returns: Vec<f64>,
    lengths: Vec<u64>,
    flat_infos: FlatInfos,
}

/// The columns of a step.
struct StepTable {
    reward: Vec<f64>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
    weed: Vec<f64>,
    path: Vec<f64>,
    failure: Vec<f64>,
    is_clipped: Vec<bool>,
    distance_m: Vec<f64>,
    /// Row by row; empty but for the action kind `target`.
    action_mask: Vec<bool>,
    /// Every row.
    all: Vec<bool>,
}

#[pymethods]
impl Batch {
    #[new]
    #[pyo3(signature = (scenario, num_envs, autoreset_mode, num_threads, *, copy))]
    fn new(
        scenario: Bound<Scenario>,
        num_envs: usize,
        autoreset_mode: &str,
        num_threads: usize,
        copy: bool,
    ) -> Result<Self, Error> {
        let autoreset = match autoreset_mode {
            "NextStep" => Autoreset::NextStep,
            "SameStep" => Autoreset::SameStep,
            "Disabled" => Autoreset::Disabled,
            other => {
                let expected = "`NextStep`, `SameStep` or `Disabled`";
                return Err(ConfigError::value("autoreset_mode", expected, other).into());
            }
        };
        let options = BatchOptions { rows: num_envs, autoreset, threads: num_threads };
        let core = BatchEnv::new(&scenario.get().scenario, options)?;
        let table = StepTable::new(num_envs, core.mask_width());
        Ok(Self {
            core,
            scenario: scenario.unbind(),
            options,
            kept: None,
            is_copied: copy,
            actions: ActionBuffer::default(),
            table,
            returns: vec![0.0; num_envs],
            lengths: vec![0; num_envs],
            flat_infos: FlatInfos::default(),
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
        spec::parts(self.core.observation_spec())
    }

    /// Name, lowest and highest value of every number of an action, or the number of choices.
    #[getter]
    fn action_spec(&self) -> ActionForm {
        spec::action(self.core.decoder().spec())
    }

    /// Begins an episode in every row that `mask` names: episode 0 of the row's entry in `seeds`, or where that is None the
    /// next episode of its present seed; of `first_seed` + row if it has none. `weeds` is empty, or has one entry for all
    /// rows or one a row, None where they are drawn.
    #[pyo3(signature = (seeds, mask=None, weeds=Vec::new(), first_seed=None))]
    fn reset<'py>(
        &mut self,
        py: Python<'py>,
        seeds: Vec<Option<Seed>>,
        mask: Option<PyReadonlyArray1<'py, bool>>,
        weeds: Vec<Option<Bound<'py, PyAny>>>,
        first_seed: Option<u64>,
    ) -> Result<Reset<'py>, Error> {
        let mask = mask.map_or_else(|| self.table.all.clone(), |mask| mask.as_array().to_vec());
        let seeds = self.seeds(seeds, &mask, first_seed)?;
        let weeds = self.weeds(weeds)?;
        let (observation, ()) = self.write(py, |core, _, observation| {
            py.detach(|| {
                for row in (0..mask.len()).filter(|&row| mask[row]) {
                    let given = weeds.get(row).or(weeds.first()).and_then(Option::as_deref);
                    core.reset_row(row, seeds[row], Beginning { weeds: given, start: None });
                }
                core.observe(observation);
            });
            Ok(())
        })?;
        for row in (0..mask.len()).filter(|&row| mask[row]) {
            (self.returns[row], self.lengths[row]) = (0.0, 0);
        }
        self.table.clear();
        if self.core.mask_width() > 0 {
            self.core.action_masks(&mut self.table.action_mask);
            let choices = self.core.mask_width();
            for (of_row, &is_begun) in self.table.action_mask.chunks_exact_mut(choices).zip(&mask) {
                if !is_begun {
                    of_row.fill(false);
                }
            }
        }
        Ok((observation, infos(py, self.table.columns(), &mask)?))
    }

    /// One step of every row, as Gymnasium wants it.
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        actions: &Bound<'py, PyAny>,
    ) -> Result<Step<'py>, Error> {
        let (observation, ended) = self.advance(py, actions)?;
        let table = &self.table;
        let infos = infos(py, table.columns(), &table.all)?;
        if ended > 0 {
            self.put_last(&infos)?;
        }
        let reward = PyArray1::from_slice(py, &table.reward);
        let terminated = PyArray1::from_slice(py, &table.terminated);
        let truncated = PyArray1::from_slice(py, &table.truncated);
        Ok((observation, reward, terminated, truncated, infos))
    }

    /// One step of every row, as stable-baselines3 wants it, and the rows whose episode ended; `elapsed_s` is the time that
    /// their infos tell.
    fn step_flat<'py>(
        &mut self,
        py: Python<'py>,
        actions: &Bound<'py, PyAny>,
        elapsed_s: f64,
    ) -> Result<FlatStep<'py>, Error> {
        let (observation, ended) = self.advance(py, actions)?;
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
            self.write_last(row, &info, elapsed_s)?;
            (self.returns[row], self.lengths[row]) = (0.0, 0);
        }
        #[expect(clippy::cast_possible_truncation, reason = "stable-baselines3 keeps float32")]
        let reward: Vec<f32> = self.table.reward.iter().map(|&reward| reward as f32).collect();
        let reward = PyArray1::from_slice(py, &reward);
        let is_done = PyArray1::from_slice(py, &is_done);
        Ok((observation, reward, is_done, infos, ended_rows))
    }

    /// Which choices of the action are open, (rows, choices); an `AttributeError` where actions are no choices.
    #[getter]
    fn action_masks<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<bool>>> {
        let ActionSpec::Discrete(choices) = self.core.decoder().spec() else {
            return Err(PyAttributeError::new_err("actions of this kind are not masked"));
        };
        let mut masks = vec![true; self.options.rows * choices];
        self.core.action_masks(&mut masks);
        table(py, &masks, self.options.rows)
    }

    /// Whether every row has begun an episode.
    #[getter]
    fn has_begun(&self) -> bool {
        (0..self.options.rows).all(|row| self.core.has_begun(row))
    }

    /// The state as bytes: of all rows, or of one.
    #[pyo3(signature = (row=None))]
    fn snapshot<'py>(
        &self,
        py: Python<'py>,
        row: Option<usize>,
    ) -> Result<Bound<'py, PyBytes>, Error> {
        if let Some(row) = row {
            self.check_row(row)?;
        }
        let bytes = py.detach(|| {
            row.map_or_else(|| self.core.snapshot(), |row| self.core.rows()[row].snapshot())
        });
        Ok(PyBytes::new(py, &bytes))
    }

    /// Puts back what `snapshot` returned, all rows or one.
    #[pyo3(signature = (snapshot, row=None))]
    fn restore(&mut self, py: Python, snapshot: &[u8], row: Option<usize>) -> Result<(), Error> {
        if let Some(row) = row {
            self.check_row(row)?;
            py.detach(|| self.core.restore_row(row, snapshot))?;
            (self.returns[row], self.lengths[row]) = (0.0, 0);
        } else {
            py.detach(|| self.core.restore(snapshot))?;
            self.returns.fill(0.0);
            self.lengths.fill(0);
        }
        Ok(())
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<NewArguments<'py>> {
        let BatchOptions { rows, autoreset, threads } = self.options;
        let autoreset = match autoreset {
            Autoreset::NextStep => "NextStep",
            Autoreset::SameStep => "SameStep",
            Autoreset::Disabled => "Disabled",
        };
        let keywords = PyDict::new(py);
        keywords.set_item("copy", self.is_copied)?;
        Ok(((self.scenario(py), rows, autoreset, threads), keywords))
    }

    fn __getstate__<'py>(&self, py: Python<'py>) -> Result<Stored<'py>, Error> {
        Ok((self.snapshot(py, None)?, self.returns.clone(), self.lengths.clone()))
    }

    fn __setstate__(
        &mut self,
        py: Python,
        state: (Vec<u8>, Vec<f64>, Vec<u64>),
    ) -> Result<(), Error> {
        let (snapshot, returns, lengths) = state;
        self.restore(py, &snapshot, None)?;
        (self.returns, self.lengths) = (returns, lengths);
        Ok(())
    }
}

impl Batch {
    /// The environments, one a row.
    pub(crate) fn rows(&self) -> &[Env] {
        self.core.rows()
    }

    /// Steps every row. Returns the observations and how many episodes ended.
    fn advance<'py>(
        &mut self,
        py: Python<'py>,
        actions: &Bound<'py, PyAny>,
    ) -> Result<(Bound<'py, PyAny>, usize), Error> {
        let rows = self.options.rows;
        let mut buffer = std::mem::take(&mut self.actions);
        let spec = self.core.decoder().spec();
        let result = buffer.read(actions, spec, rows).and_then(|actions| {
            self.write(py, |core, table, observation| {
                let out = table.out(observation);
                let ended = if rows < ROWS_TO_DETACH {
                    core.step(actions, out)
                } else {
                    py.detach(|| core.step(actions, out))
                };
                Ok(ended?)
            })
        });
        self.actions = buffer;
        result
    }

    /// Has observations written, to fresh arrays or the kept ones.
    fn write<'py, R>(
        &mut self,
        py: Python<'py>,
        write: impl FnOnce(&mut BatchEnv, &mut StepTable, ObservationMut) -> Result<R, Error>,
    ) -> Result<(Bound<'py, PyAny>, R), Error> {
        let rows = self.options.rows;
        let arrays = match self.kept.take() {
            Some(arrays) => arrays,
            None => ObservationArrays::empty(py, self.core.observation_spec(), rows)?,
        };
        let Self { core, table, .. } = self;
        let result = arrays.write(py, |observation| write(core, table, observation));
        let object = arrays.object(py, self.core.observation_spec())?;
        if !self.is_copied {
            self.kept = Some(arrays);
        }
        Ok((object, result?))
    }

    /// Adds what only the last info of an episode says, of the rows that ended with this step.
    fn put_last(&self, infos: &Bound<PyDict>) -> PyResult<()> {
        let py = infos.py();
        let mask = &self.table.ended();
        let last = |(row, &has_ended)| if has_ended { self.core.last(row) } else { None };
        let ended: Vec<_> = mask.iter().enumerate().map(last).collect();
        if self.options.autoreset != Autoreset::SameStep {
            return put_summaries(infos, mask, &ended);
        }
        let (spec, observation) = (self.core.observation_spec(), self.core.last_observation());
        let final_obs = |(row, &has_ended): (usize, &bool)| {
            if !has_ended {
                return Ok(py.None());
            }
            spec::observation(py, spec, observation, row).map(Bound::unbind)
        };
        let final_obs: Vec<_> = mask.iter().enumerate().map(final_obs).collect::<PyResult<_>>()?;
        let put = Put { dict: infos, mask };
        put.named("final_obs", &final_obs)?;
        put.dict("final_info", &final_infos(py, mask, &ended, self.core.last_masks())?)
    }

    /// The last info of an episode for stable-baselines3.
    fn write_last(&self, row: usize, info: &Bound<PyDict>, elapsed_s: f64) -> PyResult<()> {
        let py = info.py();
        let last = self.core.last(row).expect("the row's episode has just ended");
        let observation =
            spec::observation(py, self.core.observation_spec(), self.core.last_observation(), row)?;
        info.set_item("terminal_observation", observation)?;
        crate::env::write_info(info, &last.terms, last.is_clipped)?;
        let choices = self.core.mask_width();
        if choices > 0 {
            let mask = &self.core.last_masks()[row * choices..(row + 1) * choices];
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

    /// The seed of every row that is to begin, once they all are known to be usable.
    fn seeds(
        &self,
        seeds: Vec<Option<Seed>>,
        mask: &[bool],
        first_seed: Option<u64>,
    ) -> Result<Vec<Option<u64>>, Error> {
        let rows = self.options.rows;
        if seeds.len() != rows {
            let expected = format!("one seed for each of {rows} environments");
            return Err(ConfigError::value("seed", expected, seeds.len()).into());
        }
        let seed = |((row, ahead), given): ((usize, u64), Option<Seed>)| match given {
            Some(Seed(seed)) => Some(seed),
            None if self.core.has_begun(row) => None,
            None => first_seed.map(|seed| seed.wrapping_add(ahead)),
        };
        let seeds: Vec<Option<u64>> = (0..rows).zip(0..).zip(seeds).map(seed).collect();
        let is_lost =
            |&row: &usize| !self.core.has_begun(row) && (!mask[row] || seeds[row].is_none());
        match (0..rows).find(is_lost) {
            None => Ok(seeds),
            Some(row) => {
                let expected = "True for every environment that has not begun";
                let got = format!("False for environment {row}");
                Err(ConfigError::value("options[\"reset_mask\"]", expected, got).into())
            }
        }
    }

    fn weeds(&self, weeds: Vec<Option<Bound<PyAny>>>) -> Result<Vec<Option<Vec<Point>>>, Error> {
        let site = self.core.rows()[0].site();
        let is_for_all = weeds.len() == 1;
        let read = |(row, given): (usize, Option<Bound<PyAny>>)| {
            let field = if is_for_all { "weeds".to_owned() } else { format!("weeds[{row}]") };
            given.map(|given| points_from(&given, &field, site)).transpose()
        };
        weeds.into_iter().enumerate().map(read).collect()
    }

    fn check_row(&self, row: usize) -> Result<(), Error> {
        if row < self.options.rows {
            return Ok(());
        }
        let expected = format!("from 0 to {}", self.options.rows - 1);
        Err(ConfigError::value("row", expected, row).into())
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
    fn out<'a>(&'a mut self, observation: ObservationMut<'a>) -> StepMut<'a> {
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
