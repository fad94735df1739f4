//! Training configurations: the shipped ones, and TOML read as the scenarios are.

use std::path::Path;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use swath_core::config::Document;

use crate::errors::Error;
use crate::table::table_to;

/// Name and text of each training configuration that every build carries.
const TRAININGS: [(&str, &str); 5] = [
    ("quick", include_str!("../../configs/train/quick.toml")),
    ("ppo-features", include_str!("../../configs/train/ppo-features.toml")),
    ("sac-features", include_str!("../../configs/train/sac-features.toml")),
    ("maskable-routing", include_str!("../../configs/train/maskable-routing.toml")),
    ("ppo-maps", include_str!("../../configs/train/ppo-maps.toml")),
];

/// Name and text of each shipped training configuration.
#[pyfunction]
pub(crate) fn shipped_trainings() -> Vec<(&'static str, &'static str)> {
    TRAININGS.to_vec()
}

/// TOML as a dictionary; messages call the text `name`.
#[pyfunction]
pub(crate) fn parse_toml<'py>(
    py: Python<'py>,
    text: &str,
    name: &str,
) -> Result<Bound<'py, PyDict>, Error> {
    Ok(table_to(py, Document::parse(name, text, Path::new(""))?.written())?)
}
