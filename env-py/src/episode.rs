//! One whole episode, with its path.

use std::sync::Mutex;
use std::sync::mpsc;

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use swath_agents::registry;
use swath_agents::runner::{self, EpisodeResult};
use swath_agents::timeline::Timeline;
use swath_core::config::ValidScenario;
use swath_core::env::{Beginning, Env};
use swath_core::geometry::Pose;
use swath_core::math::wrap_to_pi;
use swath_core::site::Site;

use crate::agent::AgentSpec;
use crate::errors::Error;
use crate::scenario::Scenario;
use crate::seed::Seed;
use crate::summary::write_summary;
use crate::waiting::{ended, receive};
use crate::weeds::points_from;

/// An episode that is over.
#[pyclass(frozen, module = "swath._native")]
pub(crate) struct Episode {
    result: EpisodeResult,
    start: Pose,
}

#[pymethods]
impl Episode {
    /// Its numbers and its outcome.
    #[getter]
    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        write_summary(&dict, &self.result.summary, self.result.outcome)?;
        Ok(dict)
    }

    /// Points of the path at most 0.1 m and 0.1 radians apart, (n, 4): the start alone where nothing was driven.
    #[getter]
    fn trajectory<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let mut points = py.detach(|| self.result.trajectory.sample());
        if points.is_empty() {
            let Pose { x_m, y_m, heading_rad } = self.start;
            points.push([x_m, y_m, wrap_to_pi(heading_rad), 0.0]);
        }
        matrix(py, &points)
    }

    /// The arcs of the path, (n, 5).
    #[getter]
    fn arcs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let arcs = self.result.trajectory.arcs().iter();
        let rows: Vec<[f64; 5]> = arcs
            .map(|arc| {
                let start = arc.start;
                [start.x_m, start.y_m, start.heading_rad, arc.curvature_per_m, arc.length_m]
            })
            .collect();
        matrix(py, &rows)
    }

    /// Where the weeds stand, (n, 2).
    #[getter]
    fn weeds_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let points: Vec<[f64; 2]> =
            self.result.weeds.positions().iter().map(|point| [point.x, point.y]).collect();
        matrix(py, &points)
    }

    /// Which weeds the sensor has seen, (n,).
    #[getter]
    fn weed_detected<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_slice(py, self.result.weeds.is_detected())
    }

    /// Which weeds were mowed, (n,).
    #[getter]
    fn weed_mowed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_slice(py, self.result.weeds.is_mowed())
    }

    /// How far the mower had come when the sensor saw each weed, (n,).
    #[getter]
    fn weed_detected_path_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.result.timeline.weed_detected_m)
    }

    /// How far it had come when each weed was mowed, (n,).
    #[getter]
    fn weed_mowed_path_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.result.timeline.weed_mowed_m)
    }

    /// How far it had come when each cell was seen, (rows, columns).
    #[getter]
    fn cell_seen_path_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let Timeline { cell_seen_m, columns, .. } = &self.result.timeline;
        PyArray1::from_slice(py, cell_seen_m).reshape([cell_seen_m.len() / columns, *columns])
    }
}

/// Rows as a two-dimensional array, also where there are none.
fn matrix<'py, const N: usize>(
    py: Python<'py>,
    rows: &[[f64; N]],
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    PyArray1::from_slice(py, rows.as_flattened()).reshape([rows.len(), N])
}

/// Runs an agent on an instance of a scenario until it stops. Ctrl-C is heard while it runs.
#[pyfunction]
#[pyo3(signature = (scenario, agent, seed, weeds=None))]
pub(crate) fn run_episode(
    py: Python,
    scenario: &Scenario,
    agent: &AgentSpec,
    seed: Seed,
    weeds: Option<&Bound<PyAny>>,
) -> Result<Episode, Error> {
    let site = Site::new(&scenario.scenario);
    let weeds = weeds.map(|weeds| points_from(weeds, "weeds", &site)).transpose()?;
    let (scenario, agent) = (scenario.scenario.clone(), agent.spec.clone());
    let (sender, receiver) = mpsc::channel();
    let runner = std::thread::spawn(move || {
        let result = runner::run_episode(&scenario, &agent, seed.0, weeds.as_deref());
        let start = start_of(&result, &scenario, &agent, seed.0);
        // Nobody listens after Ctrl-C.
        let _ = sender.send(Episode { result, start });
    });
    let episode = receive(py, &Mutex::new(receiver))?;
    if episode.is_none() {
        ended(runner)?;
    }
    Ok(episode.expect("a thread that ended well has sent its episode"))
}

/// Where an episode began, also one in which the mower did not move.
fn start_of(
    result: &EpisodeResult,
    scenario: &ValidScenario,
    agent: &registry::AgentSpec,
    seed: u64,
) -> Pose {
    if let Some(first) = result.trajectory.arcs().first() {
        return first.start;
    }
    let weeds = result.weeds.positions();
    let agent = if agent.is_online() { agent.build(seed) } else { agent.build_for(seed, weeds) };
    let mut env = Env::new(scenario);
    let start = agent.start(env.site());
    env.reset_from(seed, Beginning { weeds: Some(weeds), start });
    env.view().pose
}
