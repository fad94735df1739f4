//! Seeds, checked by name.

use pyo3::Borrowed;
use pyo3::prelude::*;
use swath_core::config::ConfigError;

use crate::errors::Error;

/// A seed: any whole number that fits 64 bits.
#[derive(Clone, Copy)]
pub(crate) struct Seed(pub(crate) u64);

impl<'a, 'py> FromPyObject<'a, 'py> for Seed {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        given.extract().map(Self).map_err(|_| {
            let expected = format!("a whole number from 0 to {}", u64::MAX);
            let got = given.repr().map_or_else(|_| "something else".to_owned(), |r| r.to_string());
            Error::from(ConfigError::value("seed", expected, got)).into()
        })
    }
}
