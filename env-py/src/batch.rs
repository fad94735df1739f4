//! Many environments in Python's hands.

use numpy::{PyArray2, PyReadonlyArray1};
use pyo3::exceptions::PyAttributeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use swath_core::action::ActionSpec;
use swath_core::batch::{Autoreset, BatchEnv, BatchOptions};
use swath_core::config::ConfigError;
use swath_core::env::{Beginning, Env};

use crate::action::ActionBuffer;
use crate::errors::Error;
use crate::face::{Ends, Face, FlatStep, Step};
use crate::infos::table;
use crate::pictures::{Gallery, Image, image, no_pictures};
use crate::scenario::Scenario;
use crate::seed::{Seed, seeds_of_rows};
use crate::spec::{self, ActionForm, PartTuple};
use crate::summary::write_numbers;
use crate::weeds::weeds_of_rows;

/// Fewer rows are stepped without letting other Python threads run meanwhile: it would take as long as the step.
const ROWS_TO_DETACH: usize = 32;

type Reset<'py> = (Bound<'py, PyAny>, Bound<'py, PyDict>);
type NewArguments<'py> = ((Py<Scenario>, usize, &'static str, usize), Bound<'py, PyDict>);
type Stored<'py> = (Bound<'py, PyBytes>, Vec<f64>, Vec<u64>);

/// Many pastures with one mower each.
#[pyclass(module = "swath._native")]
pub(crate) struct Batch {
    core: BatchEnv,
    scenario: Py<Scenario>,
    options: BatchOptions,
    actions: ActionBuffer,
    face: Face,
    gallery: Option<Gallery>,
}

#[pymethods]
impl Batch {
    #[new]
    #[pyo3(signature = (scenario, num_envs, autoreset_mode, num_threads, *, copy, infos=true, picture_size=None))]
    fn new(
        scenario: Bound<Scenario>,
        num_envs: usize,
        autoreset_mode: &str,
        num_threads: usize,
        copy: bool,
        // Whether every step tells its infos, or only those of episodes that end, and what may be chosen.
        infos: bool,
        // Width and height of pictures in pixels; `None` where there are none.
        picture_size: Option<&Bound<PyAny>>,
    ) -> Result<Self, Error> {
        let gallery = picture_size.map(|size| Gallery::new(size, num_envs)).transpose()?;
        let autoreset = autoreset_from(autoreset_mode)?;
        let options = BatchOptions { rows: num_envs, autoreset, threads: num_threads };
        let mut core = BatchEnv::new(&scenario.get().scenario, options)?;
        if gallery.is_some() {
            core.keep_traces();
        }
        let choices = core.mask_width();
        let face = Face::new(core.observation_spec(), num_envs, autoreset, choices, copy, infos);
        Ok(Self {
            core,
            scenario: scenario.unbind(),
            options,
            actions: ActionBuffer::default(),
            face,
            gallery,
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
        let mask =
            mask.map_or_else(|| vec![true; self.options.rows], |mask| mask.as_array().to_vec());
        let seeds = seeds_of_rows(seeds, &mask, first_seed, |row| self.core.has_begun(row))?;
        let weeds = weeds_of_rows(weeds, self.core.rows()[0].site())?;
        let Self { core, face, .. } = self;
        let (observation, ()) = face.write(py, |_, observation| {
            py.detach(|| {
                for row in (0..mask.len()).filter(|&row| mask[row]) {
                    let given = weeds.get(row).or(weeds.first()).and_then(Option::as_deref);
                    core.reset_row(row, seeds[row], Beginning { weeds: given, start: None });
                }
                core.observe(observation);
            });
            Ok(())
        })?;
        let table = self.face.begin(&mask);
        if self.core.mask_width() > 0 {
            self.core.action_masks(&mut table.action_mask);
        }
        Ok((observation, self.face.begun_infos(py, &mask)?))
    }

    /// One step of every row, as Gymnasium wants it.
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        actions: &Bound<'py, PyAny>,
    ) -> Result<Step<'py>, Error> {
        let (observation, ended) = self.advance(py, actions)?;
        self.face.step(py, observation, ended, &ends(&self.core))
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
        self.face.step_flat(py, observation, ended, &ends(&self.core), elapsed_s)
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

    /// The numbers of a row's present episode, as far as it has got, without an outcome.
    fn summary<'py>(&self, py: Python<'py>, row: usize) -> Result<Bound<'py, PyDict>, Error> {
        self.check_row(row)?;
        let numbers = PyDict::new(py);
        write_numbers(&numbers, &self.core.rows()[row].summary())?;
        Ok(numbers)
    }

    /// A picture of every row, (height, width, 3) each.
    fn render<'py>(&mut self, py: Python<'py>) -> Result<Vec<Image<'py>>, Error> {
        let Self { core, gallery, .. } = self;
        let gallery = gallery.as_mut().ok_or_else(no_pictures)?;
        let pictures = py.detach(|| gallery.paint(core.rows()))?;
        pictures.into_iter().map(|picture| Ok(image(py, picture)?)).collect()
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
            self.face.forget(row);
        } else {
            py.detach(|| self.core.restore(snapshot))?;
            (0..self.options.rows).for_each(|row| self.face.forget(row));
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
        keywords.set_item("copy", self.face.is_copied())?;
        keywords.set_item("infos", self.face.has_infos())?;
        keywords.set_item("picture_size", self.gallery.as_ref().map(Gallery::size))?;
        Ok(((self.scenario(py), rows, autoreset, threads), keywords))
    }

    fn __getstate__<'py>(&self, py: Python<'py>) -> Result<Stored<'py>, Error> {
        let (returns, lengths) = self.face.sums();
        Ok((self.snapshot(py, None)?, returns, lengths))
    }

    fn __setstate__(
        &mut self,
        py: Python,
        state: (Vec<u8>, Vec<f64>, Vec<u64>),
    ) -> Result<(), Error> {
        let (snapshot, returns, lengths) = state;
        self.restore(py, &snapshot, None)?;
        self.face.set_sums(returns, lengths);
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
        let Self { core, actions: buffer, face, .. } = self;
        let actions = buffer.read(actions, core.decoder().spec(), rows)?;
        face.write(py, |table, observation| {
            let out = table.out(observation);
            let ended = if rows < ROWS_TO_DETACH {
                core.step(actions, out)
            } else {
                py.detach(|| core.step(actions, out))
            };
            Ok(ended?)
        })
    }

    fn check_row(&self, row: usize) -> Result<(), Error> {
        if row < self.options.rows { Ok(()) } else { Err(no_row(row, self.options.rows).into()) }
    }
}

/// The error that says that a batch of so many rows has no such row.
pub(crate) fn no_row(row: usize, rows: usize) -> ConfigError {
    ConfigError::value("row", format!("from 0 to {}", rows - 1), row)
}

/// The mode of that name.
pub(crate) fn autoreset_from(name: &str) -> Result<Autoreset, Error> {
    match name {
        "NextStep" => Ok(Autoreset::NextStep),
        "SameStep" => Ok(Autoreset::SameStep),
        "Disabled" => Ok(Autoreset::Disabled),
        other => {
            let expected = "`NextStep`, `SameStep` or `Disabled`";
            Err(ConfigError::value("autoreset_mode", expected, other).into())
        }
    }
}

/// How the latest episodes of a batch ended.
fn ends(core: &BatchEnv) -> Ends<'_> {
    Ends {
        last: Box::new(|row| core.last(row)),
        observation: core.last_observation(),
        masks: core.last_masks(),
    }
}
