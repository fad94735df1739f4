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

/// The seed of every row that is to begin, once they all are known to be usable: the row's own, or where it has none and has
/// not begun an episode yet, `first_seed` + row.
pub(crate) fn seeds_of_rows(
    seeds: Vec<Option<Seed>>,
    mask: &[bool],
    first_seed: Option<u64>,
    has_begun: impl Fn(usize) -> bool,
) -> Result<Vec<Option<u64>>, Error> {
    let rows = mask.len();
    if seeds.len() != rows {
        let expected = format!("one seed for each of {rows} environments");
        return Err(ConfigError::value("seed", expected, seeds.len()).into());
    }
    let seed = |((row, ahead), given): ((usize, u64), Option<Seed>)| match given {
        Some(Seed(seed)) => Some(seed),
        None if has_begun(row) => None,
        None => first_seed.map(|seed| seed.wrapping_add(ahead)),
    };
    let seeds: Vec<Option<u64>> = (0..rows).zip(0..).zip(seeds).map(seed).collect();
    let is_lost = |&row: &usize| !has_begun(row) && (!mask[row] || seeds[row].is_none());
    match (0..rows).find(is_lost) {
        None => Ok(seeds),
        Some(row) => {
            let expected = "True for every environment that has not begun";
            let got = format!("False for environment {row}");
            Err(ConfigError::value("options[\"reset_mask\"]", expected, got).into())
        }
    }
}
