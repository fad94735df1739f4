//! The observations of a batch, in arrays that the core writes into.

use numpy::{
    PyArrayDescr, PyArrayDyn, PyArrayMethods, PyReadwriteArrayDyn, dtype, get_array_module,
};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyTuple};
use swath_core::observation::{ObservationMut, ObservationSpec, Part};

use crate::errors::Error;

/// One array a part, of shape (rows, ...); `None` for a part that the kind does not have.
#[derive(Default)]
pub(crate) struct ObservationArrays {
    features: Option<Py<PyArrayDyn<f32>>>,
    candidates: Option<Py<PyArrayDyn<f32>>>,
    action_mask: Option<Py<PyArrayDyn<i8>>>,
    maps: Option<Py<PyArrayDyn<u8>>>,
}

impl ObservationArrays {
    /// Arrays that nothing was written to yet.
    pub(crate) fn empty(py: Python, spec: &ObservationSpec, rows: usize) -> PyResult<Self> {
        let mut arrays = Self::default();
        for part in spec.parts() {
            match part.name {
                "features" => arrays.features = Some(empty(py, part, rows)?),
                "candidates" => arrays.candidates = Some(empty(py, part, rows)?),
                "action_mask" => arrays.action_mask = Some(empty(py, part, rows)?),
                _ => arrays.maps = Some(empty(py, part, rows)?),
            }
        }
        Ok(arrays)
    }

    /// Lends the memory of the arrays for writing.
    ///
    /// # Errors
    ///
    /// `ValueError` if somebody has made an array read-only or reads it at this moment.
    pub(crate) fn write<R>(
        &self,
        py: Python,
        write: impl FnOnce(ObservationMut) -> Result<R, Error>,
    ) -> Result<R, Error> {
        let mut features = borrow(py, self.features.as_ref())?;
        let mut candidates = borrow(py, self.candidates.as_ref())?;
        let mut action_mask = borrow(py, self.action_mask.as_ref())?;
        let mut maps = borrow(py, self.maps.as_ref())?;
        write(ObservationMut {
            features: numbers(features.as_mut())?,
            candidates: numbers(candidates.as_mut())?,
            action_mask: numbers(action_mask.as_mut())?,
            maps: numbers(maps.as_mut())?,
        })
    }

    /// The array of the only part, or a dictionary of arrays.
    pub(crate) fn object<'py>(
        &self,
        py: Python<'py>,
        spec: &ObservationSpec,
    ) -> PyResult<Bound<'py, PyAny>> {
        if let [part] = spec.parts() {
            return Ok(self.array(py, part));
        }
        let parts = PyDict::new(py);
        for part in spec.parts() {
            parts.set_item(part.name, self.array(py, part))?;
        }
        Ok(parts.into_any())
    }

    fn array<'py>(&self, py: Python<'py>, part: &Part) -> Bound<'py, PyAny> {
        fn any<'py, T>(py: Python<'py>, array: Option<&Py<T>>) -> Bound<'py, PyAny> {
            let array = array.expect("there is an array for every part");
            array.clone_ref(py).into_any().into_bound(py)
        }
        match part.name {
            "features" => any(py, self.features.as_ref()),
            "candidates" => any(py, self.candidates.as_ref()),
            "action_mask" => any(py, self.action_mask.as_ref()),
            _ => any(py, self.maps.as_ref()),
        }
    }
}

/// An array that is not cleared first: the core writes every number.
fn empty<T: numpy::Element>(py: Python, part: &Part, rows: usize) -> PyResult<Py<PyArrayDyn<T>>> {
    static EMPTY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let empty = EMPTY
        .get_or_try_init(py, || Ok::<_, PyErr>(get_array_module(py)?.getattr("empty")?.unbind()))?;
    let shape = PyTuple::new(
        py,
        std::iter::once(rows).chain(part.shape.iter().copied()).collect::<Vec<_>>(),
    )?;
    let dtype: Bound<PyArrayDescr> = dtype::<T>(py);
    Ok(empty.bind(py).call1((shape, dtype))?.cast_into::<PyArrayDyn<T>>()?.unbind())
}

fn borrow<'py, T: numpy::Element>(
    py: Python<'py>,
    array: Option<&Py<PyArrayDyn<T>>>,
) -> PyResult<Option<PyReadwriteArrayDyn<'py, T>>> {
    Ok(array.map(|array| array.bind(py).try_readwrite()).transpose()?)
}

fn numbers<'a, T: numpy::Element>(
    array: Option<&'a mut PyReadwriteArrayDyn<'_, T>>,
) -> PyResult<&'a mut [T]> {
    match array {
        Some(array) => Ok(array.as_slice_mut()?),
        None => Ok(&mut []),
    }
}
