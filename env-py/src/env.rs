//! One environment in Python's hands.

use std::sync::atomic::{AtomicU64, Ordering};

use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use swath_core::env::{self, Beginning};
use swath_core::episode::End;
use swath_core::geometry::Point;
use swath_core::observation::Observation;
use swath_core::reward::RewardTerms;

use crate::action::read_action;
use crate::errors::Error;
use crate::scenario::Scenario;
use crate::seed::Seed;
use crate::spec::{self, ActionForm, PartTuple};
use crate::summary::write_summary;
use crate::weeds::points_from;

/// Number of the next episode of this process: an agent tells by it whether it has seen the episode before.
static NEXT_EPISODE: AtomicU64 = AtomicU64::new(1);

type Reset<'py> = (Bound<'py, PyAny>, Bound<'py, PyDict>);
type Step<'py> = (Bound<'py, PyAny>, f64, bool, bool, Bound<'py, PyDict>);

/// One pasture with one mower.
#[pyclass(module = "swath._native")]
pub(crate) struct Env {
    pub(crate) core: env::Env,
    pub(crate) episode: u64,
    scenario: Py<Scenario>,
    action: Vec<f32>,
    observation: Observation,
}

#[pymethods]
impl Env {
    #[new]
    fn new(scenario: Bound<Scenario>) -> Self {
        let core = env::Env::new(&scenario.get().scenario);
        let observation = core.observation_spec().rows(1);
        Self { core, episode: 0, scenario: scenario.unbind(), action: Vec::new(), observation }
    }

    /// The scenario that the environment was made for.
    #[getter]
    fn scenario(&self, py: Python) -> Py<Scenario> {
        self.scenario.clone_ref(py)
    }

    /// The parts of an observation.
    #[getter]
    fn observation_spec(&self) -> Vec<PartTuple> {
        spec::parts(self.core.observation_spec())
    }

    /// Name, lowest and highest value of every number of an action, or the number of choices.
    #[getter]
    fn action_spec(&self) -> ActionForm {
        spec::action(self.core.decoder().spec())
    }

    /// Whether an episode has begun.
    #[getter]
    fn has_begun(&self) -> bool {
        self.core.end().is_some()
    }

    /// Begins episode 0 of a seed.
    #[pyo3(signature = (seed, weeds=None))]
    fn reset<'py>(
        &mut self,
        py: Python<'py>,
        seed: Seed,
        weeds: Option<&Bound<'py, PyAny>>,
    ) -> Result<Reset<'py>, Error> {
        let weeds = self.points(weeds)?;
        let beginning = Beginning { weeds: weeds.as_deref(), start: None };
        py.detach(|| self.core.reset_from(seed.0, beginning));
        self.begun(py)
    }

    /// Begins the next episode of the present seed.
    #[pyo3(signature = (weeds=None))]
    fn reset_next<'py>(
        &mut self,
        py: Python<'py>,
        weeds: Option<&Bound<'py, PyAny>>,
    ) -> Result<Reset<'py>, Error> {
        let weeds = self.points(weeds)?;
        let beginning = Beginning { weeds: weeds.as_deref(), start: None };
        py.detach(|| self.core.reset_next(beginning));
        self.begun(py)
    }

    /// One step. It stays attached to the interpreter, since it takes no longer than to detach and come back.
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        action: &Bound<'py, PyAny>,
    ) -> Result<Step<'py>, Error> {
        let action = read_action(action, self.core.decoder().spec(), &mut self.action)?;
        let step = self.core.step(action, self.observation.as_mut())?;
        let info = info(py, &step.terms, step.is_clipped)?;
        let (terminated, truncated) = match step.end {
            End::Running => (false, false),
            End::Terminated(_) => (true, false),
            End::Truncated(_) => (false, true),
        };
        if let End::Terminated(outcome) | End::Truncated(outcome) = step.end {
            write_summary(&info, &self.core.summary(), outcome)?;
        }
        let observation = self.observation(py)?;
        Ok((observation, step.terms.total(), terminated, truncated, info))
    }

    /// The whole state as bytes.
    fn snapshot<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &py.detach(|| self.core.snapshot()))
    }

    /// Puts back what `snapshot` returned.
    fn restore(&mut self, py: Python, snapshot: &[u8]) -> Result<(), Error> {
        py.detach(|| self.core.restore(snapshot))?;
        self.episode = NEXT_EPISODE.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }

    fn __getnewargs__(&self, py: Python) -> (Py<Scenario>,) {
        (self.scenario(py),)
    }

    fn __getstate__<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        self.snapshot(py)
    }

    fn __setstate__(&mut self, py: Python, snapshot: &[u8]) -> Result<(), Error> {
        self.restore(py, snapshot)
    }
}

impl Env {
    fn points(&self, weeds: Option<&Bound<PyAny>>) -> Result<Option<Vec<Point>>, Error> {
        weeds.map(|weeds| points_from(weeds, "weeds", self.core.site())).transpose()
    }

    /// The present observation as fresh arrays.
    fn observation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        spec::observation(py, self.core.observation_spec(), &self.observation, 0)
    }

    fn begun<'py>(&mut self, py: Python<'py>) -> Result<Reset<'py>, Error> {
        self.episode = NEXT_EPISODE.fetch_add(1, Ordering::Relaxed);
        self.core.observe(self.observation.as_mut());
        Ok((self.observation(py)?, info(py, &RewardTerms::default(), false)?))
    }
}

/// The info of a step: what the reward consists of, and whether the action was clipped.
fn info<'py>(
    py: Python<'py>,
    terms: &RewardTerms,
    is_clipped: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let info = PyDict::new(py);
    write_info(&info, terms, is_clipped)?;
    Ok(info)
}

/// Writes what the reward consists of, and whether the action was clipped.
pub(crate) fn write_info(
    info: &Bound<PyDict>,
    terms: &RewardTerms,
    is_clipped: bool,
) -> PyResult<()> {
    let py = info.py();
    let reward_terms = PyDict::new(py);
    reward_terms.set_item(pyo3::intern!(py, "weed"), terms.weed)?;
    reward_terms.set_item(pyo3::intern!(py, "path"), terms.path)?;
    reward_terms.set_item(pyo3::intern!(py, "failure"), terms.failure)?;
    info.set_item(pyo3::intern!(py, "reward_terms"), reward_terms)?;
    info.set_item(pyo3::intern!(py, "action_clipped"), is_clipped)
}
