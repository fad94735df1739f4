//! The numbers of an episode that is over.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use swath_core::env::Summary;
use swath_core::episode::Outcome;

/// Writes the numbers of an episode and its outcome to a dictionary.
pub(crate) fn write_summary(
    dict: &Bound<PyDict>,
    summary: &Summary,
    outcome: Outcome,
) -> PyResult<()> {
    write_numbers(dict, summary)?;
    dict.set_item(pyo3::intern!(dict.py(), "outcome"), outcome.name())
}

/// Writes the numbers of an episode to a dictionary.
pub(crate) fn write_numbers(dict: &Bound<PyDict>, summary: &Summary) -> PyResult<()> {
    let py = dict.py();
    dict.set_item(pyo3::intern!(py, "path_length_m"), summary.path_length_m)?;
    dict.set_item(pyo3::intern!(py, "bcp_length_m"), summary.bcp_length_m)?;
    dict.set_item(pyo3::intern!(py, "path_fraction"), summary.path_fraction())?;
    dict.set_item(pyo3::intern!(py, "weeds_total"), summary.weeds_total)?;
    dict.set_item(pyo3::intern!(py, "weeds_detected"), summary.weeds_detected)?;
    dict.set_item(pyo3::intern!(py, "weeds_mowed"), summary.weeds_mowed)?;
    dict.set_item(pyo3::intern!(py, "seen_fraction"), summary.seen_fraction)
}
