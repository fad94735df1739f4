//! What observations and actions look like, for Python.

use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use swath_core::action::ActionSpec;
use swath_core::observation::{Dtype, Observation, ObservationSpec, Part};

/// Name, dtype, shape, and name, lowest and highest value along the last axis (one for all where they are alike).
pub(crate) type PartTuple = (&'static str, &'static str, Vec<usize>, Vec<(String, f32, f32)>);

/// The bounds of the numbers, or the number of choices.
#[derive(IntoPyObject)]
pub(crate) enum ActionForm {
    /// Name, lowest and highest value of every number.
    Continuous(Vec<(&'static str, f32, f32)>),
    /// Number of choices.
    Discrete(usize),
}

/// The parts of an observation as tuples.
pub(crate) fn parts(spec: &ObservationSpec) -> Vec<PartTuple> {
    let part = |part: &Part| {
        let dtype = match part.dtype {
            Dtype::Float32 => "float32",
            Dtype::Int8 => "int8",
            Dtype::Uint8 => "uint8",
        };
        let bounds = part.bounds.iter().map(|b| (b.name.clone(), b.low, b.high)).collect();
        (part.name, dtype, part.shape.clone(), bounds)
    };
    spec.parts().iter().map(part).collect()
}

/// The form of an action.
pub(crate) fn action(spec: ActionSpec) -> ActionForm {
    match spec {
        ActionSpec::Continuous(bounds) => ActionForm::Continuous(bounds.to_vec()),
        ActionSpec::Discrete(choices) => ActionForm::Discrete(choices),
    }
}

/// One row of observations as fresh arrays: an array where it has one part, else a dictionary of arrays.
pub(crate) fn observation<'py>(
    py: Python<'py>,
    spec: &ObservationSpec,
    observation: &Observation,
    row: usize,
) -> PyResult<Bound<'py, PyAny>> {
    if let [part] = spec.parts() {
        return array(py, part, observation, row);
    }
    let parts = PyDict::new(py);
    for part in spec.parts() {
        parts.set_item(part.name, array(py, part, observation, row)?)?;
    }
    Ok(parts.into_any())
}

fn array<'py>(
    py: Python<'py>,
    part: &Part,
    observation: &Observation,
    row: usize,
) -> PyResult<Bound<'py, PyAny>> {
    fn shaped<'py, T: numpy::Element>(
        py: Python<'py>,
        numbers: &[T],
        shape: &[usize],
        row: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let size: usize = shape.iter().product();
        let flat = PyArray1::from_slice(py, &numbers[row * size..(row + 1) * size]);
        if shape.len() == 1 { Ok(flat.into_any()) } else { Ok(flat.reshape(shape)?.into_any()) }
    }
    match part.name {
        "features" => shaped(py, &observation.features, &part.shape, row),
        "candidates" => shaped(py, &observation.candidates, &part.shape, row),
        "action_mask" => shaped(py, &observation.action_mask, &part.shape, row),
        _ => shaped(py, &observation.maps, &part.shape, row),
    }
}
