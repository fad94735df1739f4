//! Recorded episodes, painted at any time of them.

use numpy::{PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use swath_core::config::ConfigError;
use swath_core::geometry::Point;
use swath_core::site::Site;
use swath_render::{Painter, Picture, Replay, Window};

use crate::errors::Error;
use crate::pictures::{Image, image, size_from};
use crate::scenario::Scenario;
use crate::weeds::points_from;

/// Weeds detected so far and weeds mowed so far, (n,) each, and the share of the pasture seen.
type State<'py> = (Bound<'py, PyArray1<bool>>, Bound<'py, PyArray1<bool>>, f64);

/// Episodes on the same weeds, side by side.
#[pyclass(module = "swath._native")]
pub(crate) struct Film {
    cast: Vec<(Replay, Painter)>,
    columns: usize,
}

#[pymethods]
impl Film {
    /// `episodes`: a title and the points of a path, (n, 4), each. `size`: width and height of one episode, in pixels.
    #[new]
    #[expect(
        clippy::needless_pass_by_value,
        reason = "the form in which PyO3 hands arguments over"
    )]
    fn new(
        scenario: &Scenario,
        weeds: &Bound<PyAny>,
        episodes: Vec<(String, PyReadonlyArray2<f64>)>,
        size: &Bound<PyAny>,
        columns: usize,
    ) -> Result<Self, Error> {
        let site = Site::new(&scenario.scenario);
        let size = size_from("size", size)?;
        let weeds: Vec<Point> = points_from(weeds, "weeds_m", &site)?;
        let mut window = Window::around(&site);
        let mut replays = Vec::new();
        for (title, trajectory) in &episodes {
            let points = rows_of(trajectory)?;
            window = window.grown_along(&points, site.deck_width_m);
            replays.push((title, Replay::new(&scenario.scenario, &weeds, points)?));
        }
        let cast = replays
            .into_iter()
            .map(|(title, replay)| (replay, Painter::new(size, title.as_str()).showing(window)));
        Ok(Self { cast: cast.collect(), columns })
    }

    /// Path of the longest episode, metres.
    #[getter]
    fn length_m(&self) -> f64 {
        self.cast.iter().map(|(replay, _)| replay.length_m()).fold(0.0, f64::max)
    }

    /// Drives every episode on to a path, or to its end; never back.
    fn drive_to(&mut self, py: Python, path_m: f64) {
        py.detach(|| self.cast.iter_mut().for_each(|(replay, _)| replay.drive_to(path_m)));
    }

    /// A picture of all episodes as they stand, (height, width, 3).
    fn render<'py>(&mut self, py: Python<'py>) -> PyResult<Image<'py>> {
        let Self { cast, columns } = self;
        let picture = py.detach(|| {
            let pictures: Vec<Picture> =
                cast.iter_mut().map(|(replay, painter)| painter.paint(replay.env())).collect();
            Picture::tiled(&pictures, *columns)
        });
        image(py, picture)
    }

    /// How an episode stands.
    fn state<'py>(&self, py: Python<'py>, episode: usize) -> State<'py> {
        let env = self.cast[episode].0.env();
        let flags = |flags: &[bool]| PyArray1::from_slice(py, flags);
        let weeds = env.weeds();
        (flags(weeds.is_detected()), flags(weeds.is_mowed()), env.view().ground.fraction())
    }
}

/// The points of a path: `x_m`, `y_m`, `heading_rad`, `path_m`.
fn rows_of(trajectory: &PyReadonlyArray2<f64>) -> Result<Vec<[f64; 4]>, Error> {
    let array = trajectory.as_array();
    if array.ncols() != 4 {
        let got = format!("the shape {:?}", array.shape());
        return Err(ConfigError::value("trajectory", "an array (n, 4)", got).into());
    }
    Ok(array.rows().into_iter().map(|row| [row[0], row[1], row[2], row[3]]).collect())
}
