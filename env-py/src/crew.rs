//! One agent in every row of a batch.

use std::sync::Mutex;

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use swath_agents::agent::{Agent as Planner, Decision};
use swath_core::action::ActionSpec;
use swath_core::config::ConfigError;
use swath_core::env::Env;
use swath_core::episode::Outcome;

use crate::agent::{Agent, AgentSpec};
use crate::batch::Batch;
use crate::errors::Error;
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
    fn new(spec: &AgentSpec, seeds: Vec<Seed>) -> Self {
        let member = |seed| Member { agent: Agent::new(spec, seed), planner: None, stop: None };
        Self { members: seeds.into_iter().map(member).collect() }
    }

    /// The next action of every row that `live` names, zeros elsewhere; and why each member has stopped, if it has.
    fn act<'py>(
        &mut self,
        py: Python<'py>,
        batch: &Batch,
        live: &Bound<'py, PyArray1<bool>>,
    ) -> Result<Decisions<'py>, Error> {
        let rows = batch.rows();
        let live = live.readonly().as_array().to_vec();
        if rows.len() != self.members.len() || live.len() != rows.len() {
            let expected = format!("a batch of {} environments", self.members.len());
            return Err(ConfigError::value("batch", expected, rows.len()).into());
        }
        let ActionSpec::Continuous(numbers) = rows[0].decoder().spec() else {
            let kind = rows[0].scenario().action.kind;
            let expected = "`steer` or `drive` for a scripted agent";
            return Err(ConfigError::value(
                "action.kind",
                expected,
                format!("`{kind:?}`").to_lowercase(),
            )
            .into());
        };
        let actions = py.detach(|| {
            let act = |((member, env), is_live): ((&mut Member, &Env), bool)| {
                if is_live { member.act(env) } else { None }
            };
            self.members.iter_mut().zip(rows).zip(live).map(act).collect::<Vec<_>>()
        });
        let size = numbers.len();
        let flat = actions.into_iter().flat_map(|action| action.unwrap_or_else(|| vec![0.0; size]));
        let actions = PyArray1::from_iter(py, flat).reshape([rows.len(), size])?;
        Ok((actions, self.members.iter().map(|member| member.stop.map(Outcome::name)).collect()))
    }
}

impl Member {
    fn act(&mut self, env: &Env) -> Option<Vec<f32>> {
        if self.stop.is_some() {
            return None;
        }
        let planner = self.planner.get_or_insert_with(|| {
            let mut planner = self.agent.build(env.scenario().action.kind);
            planner.reset(&env.view());
            Mutex::new(planner)
        });
        match planner.get_mut().expect("the mutex is never locked").act(&env.view()) {
            Decision::Drive(command) => return env.decoder().encode(command),
            Decision::Done => self.stop = Some(Outcome::Done),
            Decision::Capped => self.stop = Some(Outcome::Capped),
        }
        None
    }
}
