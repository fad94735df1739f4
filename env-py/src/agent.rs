//! Agents in Python's hands.

use std::sync::Mutex;

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use swath_agents::agent::{Agent as Planner, Decision};
use swath_agents::learned::Network;
use swath_agents::registry::{self, AGENTS};
use swath_core::action::ActionError;
use swath_core::config::{ActionKind, ConfigError};
use swath_core::episode::{End, Outcome};

use crate::env::Env;
use crate::errors::Error;
use crate::seed::Seed;
use crate::table::table_from;

/// An agent's name and options, checked.
#[pyclass(frozen, module = "swath._native")]
pub(crate) struct AgentSpec {
    pub(crate) spec: registry::AgentSpec,
}

#[pymethods]
impl AgentSpec {
    /// Reads `name` with options, or without options the text `name:key=value:key=value`.
    #[new]
    #[pyo3(signature = (name, options=None))]
    fn new(name: &Bound<PyAny>, options: Option<&Bound<PyDict>>) -> Result<Self, Error> {
        let text: Result<String, _> = name.extract();
        let name = &*text.map_err(|_| {
            let got = name.repr().map_or_else(|_| "something else".to_owned(), |r| r.to_string());
            ConfigError::value("agent", "a name such as `snake` or `bcp:spacing=sensor`", got)
        })?;
        let spec = match options.filter(|options| !options.is_empty()) {
            None => name.parse()?,
            Some(_) if name.contains(':') => {
                let expected = "a name without options where options are given beside it";
                return Err(ConfigError::value("agent", expected, format!("`{name}`")).into());
            }
            Some(options) => {
                registry::AgentSpec::new(name, table_from(options.as_mapping(), name)?)?
            }
        };
        Ok(Self { spec })
    }

    /// The name and the options as result files write them.
    #[getter]
    fn label(&self) -> String {
        self.spec.to_string()
    }

    fn __getnewargs__(&self) -> (String,) {
        (self.label(),)
    }

    fn __repr__(&self) -> String {
        format!("<AgentSpec {}>", self.spec)
    }
}

/// An agent that acts in environments, one episode after another.
#[pyclass(module = "swath._native")]
pub(crate) struct Agent {
    spec: registry::AgentSpec,
    seed: u64,
    present: Option<Present>,
}

/// What the agent is doing now.
struct Present {
    kind: ActionKind,
    /// Number of the episode.
    episode: u64,
    /// Never locked: a planner can be sent to another thread, and the mutex makes that enough for Python.
    planner: Mutex<Box<dyn Planner>>,
    stop: Option<Outcome>,
}

#[pymethods]
impl Agent {
    #[new]
    pub(crate) fn new(spec: &AgentSpec, seed: Seed) -> Result<Self, Error> {
        Ok(Self { spec: spec.spec.online()?.clone(), seed: seed.0, present: None })
    }

    /// The agent's name and options.
    #[getter]
    fn label(&self) -> String {
        self.spec.to_string()
    }

    /// Why the agent stopped in the present episode: `done`, `capped`, or None while it drives.
    #[getter]
    fn outcome(&self) -> Option<&'static str> {
        self.present.as_ref().and_then(|present| present.stop).map(Outcome::name)
    }

    /// The next action, or None when the agent has stopped or the episode is over.
    fn act<'py>(
        &mut self,
        py: Python<'py>,
        env: &Env,
    ) -> Result<Option<Bound<'py, PyArray1<f32>>>, Error> {
        let action = py.detach(|| self.decide(env))?;
        Ok(action.map(|action| PyArray1::from_vec(py, action)))
    }
}

impl Agent {
    fn decide(&mut self, env: &Env) -> Result<Option<Vec<f32>>, Error> {
        let kind = env.core.decoder().kind();
        if !kind.is_continuous() {
            let expected = "`steer` or `drive` where a scripted agent acts";
            return Err(ConfigError::value("action.kind", expected, kind.name()).into());
        }
        let end = env.core.end().ok_or(ActionError::NotReset)?;
        let mut present = match self.present.take() {
            Some(present) if present.episode == env.episode => present,
            last => self.begin(last, env),
        };
        let is_over = end != End::Running || present.stop.is_some();
        let action = if is_over { None } else { present.act(env) };
        self.present = Some(present);
        Ok(action)
    }

    /// Starts afresh: with the planner of the `last` episode, unless the action kind has changed.
    fn begin(&self, last: Option<Present>, env: &Env) -> Present {
        let kind = env.core.decoder().kind();
        let planner = last.filter(|last| last.kind == kind).map(|last| last.planner);
        let mut planner = planner.unwrap_or_else(|| Mutex::new(self.build(kind)));
        planner.get_mut().expect("the mutex is never locked").reset(&env.core.view());
        Present { kind, episode: env.episode, planner, stop: None }
    }

    /// The planner itself where an action can end a step at the end of an arc; else a tracker that follows its path.
    pub(crate) fn build(&self, kind: ActionKind) -> Box<dyn Planner> {
        match kind {
            ActionKind::Drive => self.spec.build(self.seed),
            _ => self.spec.build_tracked(self.seed),
        }
    }
}

impl Present {
    fn act(&mut self, env: &Env) -> Option<Vec<f32>> {
        let planner = self.planner.get_mut().expect("the mutex is never locked");
        match planner.act(&env.core.view()) {
            Decision::Drive(command) => return env.core.decoder().encode(command),
            Decision::Done => self.stop = Some(Outcome::Done),
            Decision::Capped => self.stop = Some(Outcome::Capped),
        }
        None
    }
}

/// The places that the agent `learned` takes, each from a table of candidates: (n, K F) float32 to n places.
#[pyfunction]
pub(crate) fn learned_places(tables: &Bound<PyArray2<f32>>) -> Result<Vec<usize>, Error> {
    let tables = tables.readonly();
    let (network, tables) = (Network::shipped(), tables.as_array());
    if tables.ncols() % network.columns() != 0 {
        let expected = format!("(n, K {}) numbers", network.columns());
        return Err(ConfigError::value("tables", expected, tables.ncols()).into());
    }
    Ok(tables.outer_iter().map(|table| network.best(&table.to_vec())).collect())
}

/// Name of every agent, what it does, whether its own choices are random, and whether it is an online agent.
#[pyfunction]
pub(crate) fn agents() -> Vec<(&'static str, &'static str, bool, bool)> {
    AGENTS.iter().map(|entry| (entry.name, entry.about, entry.is_random, entry.is_online)).collect()
}
