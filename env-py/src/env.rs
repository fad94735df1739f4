//! One environment in Python's hands.

use std::sync::atomic::{AtomicU64, Ordering};

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use swath_core::action::{ActionError, ActionSpec};
use swath_core::config::{ActionKind, ConfigError};
use swath_core::env::{self, Beginning};
use swath_core::episode::End;
use swath_core::geometry::Point;
use swath_core::observation::Observation;
use swath_core::reward::RewardTerms;

use crate::action::read_action;
use crate::errors::Error;
use crate::pictures::{Gallery, Image, image, no_pictures};
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
    mask: Vec<bool>,
    gallery: Option<Gallery>,
}

#[pymethods]
impl Env {
    /// `picture_size`: width and height of pictures in pixels; `None` where there are none.
    #[new]
    #[pyo3(signature = (scenario, picture_size=None))]
    fn new(scenario: Bound<Scenario>, picture_size: Option<&Bound<PyAny>>) -> Result<Self, Error> {
        let gallery = picture_size.map(|size| Gallery::new(size, 1)).transpose()?;
        let mut core = env::Env::new(&scenario.get().scenario);
        if gallery.is_some() {
            core.keep_trace();
        }
        let observation = core.observation_spec().rows(1);
        let (action, mask) = (Vec::new(), Vec::new());
        let scenario = scenario.unbind();
        Ok(Self { core, episode: 0, scenario, action, observation, mask, gallery })
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
        let info = self.info(py, &step.terms, step.is_clipped, step.distance_m)?;
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

    /// Which choices of the action are open, (choices,).
    fn action_masks<'py>(&mut self, py: Python<'py>) -> Result<Bound<'py, PyArray1<bool>>, Error> {
        let ActionSpec::Discrete(choices) = self.core.decoder().spec() else {
            let expected = "`discrete` or `target` where actions are masked";
            let got = self.core.decoder().kind().name();
            return Err(ConfigError::value("action.kind", expected, got).into());
        };
        if self.core.end().is_none() {
            return Err(ActionError::NotReset.into());
        }
        self.mask.resize(choices, true);
        self.core.action_mask(&mut self.mask);
        Ok(PyArray1::from_slice(py, &self.mask))
    }

    /// A picture, (height, width, 3).
    fn render<'py>(&mut self, py: Python<'py>) -> Result<Image<'py>, Error> {
        let Self { core, gallery, .. } = self;
        let gallery = gallery.as_mut().ok_or_else(no_pictures)?;
        let pictures = py.detach(|| gallery.paint(std::slice::from_ref(core)))?;
        Ok(image(py, pictures.into_iter().next().expect("there is one environment"))?)
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

    fn __getnewargs__(&self, py: Python) -> (Py<Scenario>, Option<(u32, u32)>) {
        (self.scenario(py), self.gallery.as_ref().map(Gallery::size))
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

    /// The info of a step: what the reward consists of, and whether the action was clipped; with the action kind `target`
    /// also how far the mower came and what it may choose next.
    fn info<'py>(
        &mut self,
        py: Python<'py>,
        terms: &RewardTerms,
        is_clipped: bool,
        distance_m: f64,
    ) -> Result<Bound<'py, PyDict>, Error> {
        let info = PyDict::new(py);
        write_info(&info, terms, is_clipped)?;
        if self.core.decoder().kind() == ActionKind::Target {
            info.set_item(pyo3::intern!(py, "elapsed_m"), distance_m)?;
            info.set_item(pyo3::intern!(py, "action_mask"), self.action_masks(py)?)?;
        }
        Ok(info)
    }

    fn begun<'py>(&mut self, py: Python<'py>) -> Result<Reset<'py>, Error> {
        self.episode = NEXT_EPISODE.fetch_add(1, Ordering::Relaxed);
        self.core.observe(self.observation.as_mut());
        let info = self.info(py, &RewardTerms::default(), false, 0.0)?;
        Ok((self.observation(py)?, info))
    }
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
