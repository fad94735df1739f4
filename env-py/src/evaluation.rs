//! Many episodes on several threads.

use std::sync::Mutex;
use std::sync::mpsc::{self, Receiver};
use std::thread::JoinHandle;
use std::time::Instant;

use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::iter::{ParallelBridge, ParallelIterator};
use swath_agents::registry::AgentSpec as CoreSpec;
use swath_agents::runner::run_summary;
use swath_core::config::{ConfigError, ValidScenario};
use swath_core::env::Summary;
use swath_core::episode::Outcome;

use crate::agent::AgentSpec;
use crate::errors::Error;
use crate::scenario::Scenario;
use crate::seed::Seed;
use crate::summary::write_summary;
use crate::waiting::{ended, receive};

/// An episode to run: the numbers of its scenario, its agent and its instance.
type Task = (usize, usize, u64);

/// A finished episode as Python gets it: the task, the numbers, the seconds.
type Finished<'py> = (usize, usize, u64, Bound<'py, PyDict>, f64);

struct Row {
    task: Task,
    summary: Summary,
    outcome: Outcome,
    wall_s: f64,
}

/// What every task draws on.
struct Study {
    scenarios: Vec<ValidScenario>,
    agents: Vec<CoreSpec>,
    seed: u64,
}

impl Study {
    #[expect(
        clippy::disallowed_methods,
        reason = "this is a front, and `wall_s` is its only clock"
    )]
    fn run(&self, task: Task) -> Row {
        let (scenario, agent, instance) = task;
        let start = Instant::now();
        let (summary, outcome) =
            run_summary(&self.scenarios[scenario], &self.agents[agent], self.seed + instance);
        Row { task, summary, outcome, wall_s: start.elapsed().as_secs_f64() }
    }
}

/// An iterator over finished episodes, in the order in which they finish.
///
/// The episodes run in threads of their own, ahead of the iteration. They stop when the iterator is dropped, each at the
/// end of its episode.
#[pyclass(frozen, module = "swath._native")]
pub(crate) struct EpisodeStream {
    rows: Mutex<Receiver<Row>>,
    runner: Mutex<Option<JoinHandle<()>>>,
}

#[pymethods]
impl EpisodeStream {
    /// Runs instance i of each task with the seed `seed + i`, on `jobs` threads.
    #[new]
    fn new(
        scenarios: Vec<Bound<Scenario>>,
        agents: Vec<Bound<AgentSpec>>,
        tasks: Vec<Task>,
        seed: Seed,
        jobs: usize,
    ) -> Result<Self, Error> {
        let study = Study {
            scenarios: scenarios
                .into_iter()
                .map(|scenario| scenario.get().scenario.clone())
                .collect(),
            agents: agents.into_iter().map(|agent| agent.get().spec.clone()).collect(),
            seed: seed.0,
        };
        check(&study, &tasks)?;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(jobs.clamp(1, tasks.len().max(1)))
            .build()
            .map_err(|_| too_many(jobs))?;
        let (sender, rows) = mpsc::channel();
        let run = move || {
            pool.install(|| {
                // An error means that nobody listens any more: the rest is left undone.
                let _ = tasks
                    .into_iter()
                    .par_bridge()
                    .try_for_each_with(sender, |sender, task| sender.send(study.run(task)));
            });
        };
        let runner = std::thread::Builder::new().spawn(run).map_err(|_| too_many(jobs))?;
        Ok(Self { rows: Mutex::new(rows), runner: Mutex::new(Some(runner)) })
    }

    fn __iter__(this: PyRef<'_, Self>) -> PyRef<'_, Self> {
        this
    }

    /// Scenario, agent and instance of the next finished episode, its numbers, and how long it ran, seconds.
    fn __next__<'py>(&self, py: Python<'py>) -> PyResult<Option<Finished<'py>>> {
        let Some(row) = receive(py, &self.rows)? else {
            let runner = self.runner.lock().expect("no holder of the lock panics").take();
            return runner.map_or(Ok(()), ended).map(|()| None);
        };
        let summary = PyDict::new(py);
        write_summary(&summary, &row.summary, row.outcome)?;
        let (scenario, agent, instance) = row.task;
        Ok(Some((scenario, agent, instance, summary, row.wall_s)))
    }
}

/// The error for more threads than there can be.
fn too_many(jobs: usize) -> ConfigError {
    ConfigError::value("jobs", "as many as the system can start", jobs)
}

/// Refuses tasks that name what is not there.
fn check(study: &Study, tasks: &[Task]) -> PyResult<()> {
    let is_there = |&(scenario, agent, instance): &Task| {
        scenario < study.scenarios.len()
            && agent < study.agents.len()
            && study.seed.checked_add(instance).is_some()
    };
    if tasks.iter().all(is_there) {
        Ok(())
    } else {
        Err(PyIndexError::new_err("a task names a scenario, an agent or a seed that is not there"))
    }
}
