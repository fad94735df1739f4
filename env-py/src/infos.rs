//! The infos of a batch, formed as Gymnasium's `SyncVectorEnv` forms them: an array for each key, and under the key with
//! an underscore in front the rows that have it.

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use swath_core::batch::Last;

/// What every step and every reset says of each row.
#[derive(Clone, Copy)]
pub(crate) struct Columns<'a> {
    /// The reward for weeds mowed.
    pub(crate) weed: &'a [f64],
    /// The reward for the way driven.
    pub(crate) path: &'a [f64],
    /// The reward for a failure.
    pub(crate) failure: &'a [f64],
    /// Whether the action was clipped.
    pub(crate) is_clipped: &'a [bool],
    /// For the action kind `target`: the way driven, metres, and which choices are open, row by row.
    pub(crate) decision: Option<(&'a [f64], &'a [bool])>,
}

/// The infos of running rows; `mask` says which rows have one.
pub(crate) fn infos<'py>(
    py: Python<'py>,
    columns: Columns,
    mask: &[bool],
) -> PyResult<Bound<'py, PyDict>> {
    let terms = PyDict::new(py);
    let put = Put { dict: &terms, mask };
    put.array(pyo3::intern!(py, "weed"), pyo3::intern!(py, "_weed"), columns.weed)?;
    put.array(pyo3::intern!(py, "path"), pyo3::intern!(py, "_path"), columns.path)?;
    put.array(pyo3::intern!(py, "failure"), pyo3::intern!(py, "_failure"), columns.failure)?;
    let infos = PyDict::new(py);
    let put = Put { dict: &infos, mask };
    let (key, mask_key) =
        (pyo3::intern!(py, "action_clipped"), pyo3::intern!(py, "_action_clipped"));
    put.array(key, mask_key, columns.is_clipped)?;
    let (key, mask_key) = (pyo3::intern!(py, "reward_terms"), pyo3::intern!(py, "_reward_terms"));
    put.object(key, mask_key, terms.as_any())?;
    if let Some((distances_m, masks)) = columns.decision {
        let (key, mask_key) = (pyo3::intern!(py, "elapsed_m"), pyo3::intern!(py, "_elapsed_m"));
        put.array(key, mask_key, distances_m)?;
        put_masks(&infos, masks, mask)?;
    }
    Ok(infos)
}

/// Which choices are open, row by row.
pub(crate) fn put_masks(infos: &Bound<PyDict>, masks: &[bool], mask: &[bool]) -> PyResult<()> {
    let py = infos.py();
    let (key, mask_key) = (pyo3::intern!(py, "action_mask"), pyo3::intern!(py, "_action_mask"));
    let put = Put { dict: infos, mask };
    put.object(key, mask_key, table(py, masks, mask.len())?.as_any())
}

/// A table with `rows` rows.
pub(crate) fn table<'py>(
    py: Python<'py>,
    flags: &[bool],
    rows: usize,
) -> PyResult<Bound<'py, PyArray2<bool>>> {
    PyArray1::from_slice(py, flags).reshape([rows, flags.len() / rows])
}

/// The numbers of the episodes that ended with this step; of the other rows there is no `Last`.
pub(crate) fn put_summaries(
    infos: &Bound<PyDict>,
    mask: &[bool],
    ended: &[Option<&Last>],
) -> PyResult<()> {
    let put = Put { dict: infos, mask };
    let floats = |number: fn(&Last) -> f64| column(ended, number);
    put.named("path_length_m", &floats(|last| last.summary.path_length_m))?;
    put.named("bcp_length_m", &floats(|last| last.summary.bcp_length_m))?;
    put.named("path_fraction", &floats(|last| last.summary.path_fraction()))?;
    put.named("seen_fraction", &floats(|last| last.summary.seen_fraction))?;
    let count = |weeds| i64::try_from(weeds).expect("a scenario holds at most ten million weeds");
    put.named("weeds_total", &column(ended, |last| count(last.summary.weeds_total)))?;
    put.named("weeds_detected", &column(ended, |last| count(last.summary.weeds_detected)))?;
    put.named("weeds_mowed", &column(ended, |last| count(last.summary.weeds_mowed)))?;
    let outcome = |last: Option<&Last>| match last {
        Some(last) => PyString::new(infos.py(), last.outcome.name()).into_any().unbind(),
        None => infos.py().None(),
    };
    put.named("outcome", &ended.iter().copied().map(outcome).collect::<Vec<_>>())
}

/// The infos of the episodes that ended with a step after which their rows began anew.
pub(crate) fn final_infos<'py>(
    py: Python<'py>,
    mask: &[bool],
    ended: &[Option<&Last>],
    masks: &[bool],
) -> PyResult<Bound<'py, PyDict>> {
    // Rows without an ended episode have zeros.
    let choices = masks.len() / ended.len();
    let masks: Vec<bool> =
        masks.iter().enumerate().map(|(at, &open)| open && ended[at / choices].is_some()).collect();
    let distances_m = column(ended, |last| last.distance_m);
    let columns = Columns {
        decision: (choices > 0).then_some((&distances_m, &masks)),
        weed: &column(ended, |last| last.terms.weed),
        path: &column(ended, |last| last.terms.path),
        failure: &column(ended, |last| last.terms.failure),
        is_clipped: &column(ended, |last| last.is_clipped),
    };
    let infos = infos(py, columns, mask)?;
    put_summaries(&infos, mask, ended)?;
    Ok(infos)
}

/// A value of every row; zero where there is no `Last`.
fn column<T: Default>(ended: &[Option<&Last>], value: impl Fn(&Last) -> T) -> Vec<T> {
    ended.iter().map(|last| last.map(&value).unwrap_or_default()).collect()
}

/// Puts a value into a dictionary, and beside it the rows that have it.
pub(crate) struct Put<'a, 'py> {
    /// Where to.
    pub(crate) dict: &'a Bound<'py, PyDict>,
    /// Which rows.
    pub(crate) mask: &'a [bool],
}

impl<'py> Put<'_, 'py> {
    /// A column under a key known by name.
    pub(crate) fn named<T: numpy::Element>(&self, key: &str, column: &[T]) -> PyResult<()> {
        let py = self.dict.py();
        self.array(&PyString::new(py, key), &PyString::new(py, &format!("_{key}")), column)
    }

    /// A dictionary under a key known by name.
    pub(crate) fn dict(&self, key: &str, dict: &Bound<'py, PyDict>) -> PyResult<()> {
        let py = self.dict.py();
        self.object(&PyString::new(py, key), &PyString::new(py, &format!("_{key}")), dict.as_any())
    }

    fn array<T: numpy::Element>(
        &self,
        key: &Bound<'py, PyString>,
        mask_key: &Bound<'py, PyString>,
        column: &[T],
    ) -> PyResult<()> {
        self.object(key, mask_key, PyArray1::from_slice(self.dict.py(), column).as_any())
    }

    fn object(
        &self,
        key: &Bound<'py, PyString>,
        mask_key: &Bound<'py, PyString>,
        value: &Bound<'py, PyAny>,
    ) -> PyResult<()> {
        self.dict.set_item(key, value)?;
        self.dict.set_item(mask_key, PyArray1::from_slice(self.dict.py(), self.mask))
    }
}
