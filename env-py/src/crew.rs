//! One agent in every row of a batch.

use std::sync::Mutex;

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use swath_agents::agent::{Agent as Planner, Decision};
use swath_core::action::{ActionDecoder, ActionSpec};
use swath_core::config::ConfigError;
use swath_core::env::Env;
use swath_core::episode::Outcome;
use swath_core::mirror::Mirror;
use swath_core::view::View;

use crate::agent::{Agent, AgentSpec};
use crate::batch::Batch;
use crate::errors::Error;
use crate::remote::RemoteBatch;
use crate::seed::Seed;

/// One agent for each row of a batch, for one episode.
#[pyclass(module = "swath._native")]
pub(crate) struct Crew {
    members: Vec<Member>,
}

struct Member {
    agent: Agent,
    /// None before its first decision. Never locked: the mutex makes a planner enough for Python.
    planner: Option<Mutex<Box<dyn Planner>>>,
    stop: Option<Outcome>,
}

/// Actions, one row a member, and the outcome of each member that has stopped.
type Decisions<'py> = (Bound<'py, PyArray2<f32>>, Vec<Option<&'static str>>);

#[pymethods]
impl Crew {
    #[new]
    fn new(spec: &AgentSpec, seeds: Vec<Seed>) -> Result<Self, Error> {
        spec.spec.online()?;
        let member =
            |seed| Ok(Member { agent: Agent::new(spec, seed)?, planner: None, stop: None });
        Ok(Self { members: seeds.into_iter().map(member).collect::<Result<_, Error>>()? })
    }

    /// The next action of every row that `live` names, zeros elsewhere; and why each member has stopped, if it has.
    ///
    /// `batch` may be a `Batch`, a `RemoteBatch` that is told percepts, or anything whose `native` is one.
    #[expect(clippy::needless_pass_by_value, reason = "it is made for this call")]
    fn act<'py>(
        &mut self,
        py: Python<'py>,
        batch: AnyBatch<'py>,
        live: &Bound<'py, PyArray1<bool>>,
    ) -> Result<Decisions<'py>, Error> {
        let rows = batch.views()?;
        let live = live.readonly().as_array().to_vec();
        if rows.len() != self.members.len() || live.len() != rows.len() {
            let expected = format!("a batch of {} environments", self.members.len());
            return Err(ConfigError::value("batch", expected, rows.len()).into());
        }
        let decoder = batch.decoder();
        let ActionSpec::Continuous(numbers) = decoder.spec() else {
            let expected = "`steer` or `drive` for a scripted agent";
            return Err(ConfigError::value(
                "action.kind",
                expected,
                format!("`{:?}`", decoder.kind()).to_lowercase(),
            )
            .into());
        };
        let actions = py.detach(|| {
            let act = |((member, view), is_live): ((&mut Member, &View), bool)| {
                if is_live { member.act(view, &decoder) } else { None }
            };
            self.members.iter_mut().zip(&rows).zip(live).map(act).collect::<Vec<_>>()
        });
        let size = numbers.len();
        let flat = actions.into_iter().flat_map(|action| action.unwrap_or_else(|| vec![0.0; size]));
        let actions = PyArray1::from_iter(py, flat).reshape([rows.len(), size])?;
        Ok((actions, self.members.iter().map(|member| member.stop.map(Outcome::name)).collect()))
    }
}

/// Environments in this process or elsewhere.
enum AnyBatch<'py> {
    Here(PyRef<'py, Batch>),
    Elsewhere(PyRef<'py, RemoteBatch>),
}

impl<'py> FromPyObject<'_, 'py> for AnyBatch<'py> {
    type Error = PyErr;

    /// By hand, since a derived one tells a Ctrl-C that reaches `native`, a property, as a wrong type.
    fn extract(batch: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(here) = batch.cast::<Batch>() {
            return Ok(Self::Here(here.try_borrow()?));
        }
        let held = batch.getattr_opt("native")?.unwrap_or_else(|| batch.to_owned());
        let Ok(elsewhere) = held.cast_into::<RemoteBatch>() else {
            return Err(PyTypeError::new_err("`batch` must be a `Batch` or a `RemoteBatch`"));
        };
        Ok(Self::Elsewhere(elsewhere.try_borrow()?))
    }
}

impl AnyBatch<'_> {
    /// What the mowers know, row by row: nothing else reaches a planner.
    fn views(&self) -> Result<Vec<View<'_>>, ConfigError> {
        Ok(match self {
            Self::Here(batch) => batch.rows().iter().map(Env::view).collect(),
            Self::Elsewhere(batch) => batch.mirrors()?.iter().map(Mirror::view).collect(),
        })
    }

    /// How actions are read.
    fn decoder(&self) -> ActionDecoder {
        let env = match self {
            Self::Here(batch) => &batch.rows()[0],
            Self::Elsewhere(batch) => batch.template(),
        };
        *env.decoder()
    }
}

impl Member {
    fn act(&mut self, view: &View, decoder: &ActionDecoder) -> Option<Vec<f32>> {
        if self.stop.is_some() {
            return None;
        }
        let planner = self.planner.get_or_insert_with(|| {
            let mut planner = self.agent.build(decoder.kind());
            planner.reset(view);
            Mutex::new(planner)
        });
        match planner.get_mut().expect("the mutex is never locked").act(view) {
            Decision::Drive(command) => return decoder.encode(command),
            Decision::Done => self.stop = Some(Outcome::Done),
            Decision::Capped => self.stop = Some(Outcome::Capped),
        }
        None
    }
}
