//! What environments look like.

use numpy::{PyArray1, PyArray3, PyArrayMethods, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use swath_core::action::ActionError;
use swath_core::config::ConfigError;
use swath_core::env::Env;
use swath_render::{Painter, Picture, Size};

use crate::errors::Error;

/// A picture as an array, (height, width, 3).
pub(crate) type Image<'py> = Bound<'py, PyArray3<u8>>;

/// A painter for each environment of some: what a picture keeps for the next one is a few megabytes, from the first
/// picture on.
pub(crate) struct Gallery {
    size: Size,
    painters: Vec<Painter>,
}

impl Gallery {
    /// Pictures of so many environments, (width, height) in pixels.
    pub(crate) fn new(size: &Bound<PyAny>, rows: usize) -> Result<Self, Error> {
        let size = size_from("render_size", size)?;
        Ok(Self { size, painters: vec![Painter::new(size, ""); rows] })
    }

    /// Width and height in pixels.
    pub(crate) fn size(&self) -> (u32, u32) {
        (self.size.width(), self.size.height())
    }

    /// A picture of every environment; an error before the first reset.
    pub(crate) fn paint(&mut self, envs: &[Env]) -> Result<Vec<Picture>, Error> {
        if envs.iter().any(|env| env.end().is_none()) {
            return Err(ActionError::NotReset.into());
        }
        Ok(self.painters.iter_mut().zip(envs).map(|(painter, env)| painter.paint(env)).collect())
    }
}

/// Reads the size of a picture: width and height in pixels.
pub(crate) fn size_from(field: &str, size: &Bound<PyAny>) -> Result<Size, Error> {
    let read = size.extract::<(u32, u32)>().ok();
    read.and_then(|(width, height)| Size::new(width, height)).ok_or_else(|| {
        let (width, height) = Size::LEAST;
        let most = Size::MOST;
        let expected =
            format!("(width, height) in pixels, from ({width}, {height}) to ({most}, {most})");
        ConfigError::value(field, expected, size).into()
    })
}

/// The error that says that no pictures were asked for.
pub(crate) fn no_pictures() -> Error {
    ConfigError::value("render_mode", "`rgb_array` where pictures are asked for", "None").into()
}

/// A picture as a fresh array, (height, width, 3).
pub(crate) fn image(py: Python<'_>, picture: Picture) -> PyResult<Image<'_>> {
    let shape = [picture.height() as usize, picture.width() as usize, 3];
    PyArray1::from_vec(py, picture.into_rgb()).reshape(shape)
}

/// A picture (height, width, 3) as a PNG file.
#[pyfunction]
#[expect(clippy::needless_pass_by_value, reason = "the form in which PyO3 hands arguments over")]
pub(crate) fn png<'py>(
    py: Python<'py>,
    image: PyReadonlyArray3<'py, u8>,
) -> Result<Bound<'py, PyBytes>, Error> {
    let array = image.as_array();
    let wrong = || {
        let expected = "an array (height, width, 3) of bytes";
        ConfigError::value("image", expected, format!("the shape {:?}", array.shape()))
    };
    let (height, width, _) = array.dim();
    let side = |pixels: usize| u32::try_from(pixels).map_err(|_| wrong());
    let rgb = array.iter().copied().collect();
    let picture = Picture::from_rgb(side(width)?, side(height)?, rgb).ok_or_else(wrong)?;
    Ok(PyBytes::new(py, &py.detach(|| picture.png())))
}
