//! Actions from Python: of one environment, and of a batch.

use numpy::ndarray::Dimension;
use numpy::{
    Element, PyArray, PyArray1, PyArray2, PyArrayDescrMethods, PyArrayDyn, PyArrayMethods,
    PyUntypedArray, PyUntypedArrayMethods, get_array_module,
};
use pyo3::prelude::*;
use swath_core::action::{Action, ActionSpec};
use swath_core::batch::Actions;

use crate::errors::{Error, shape_text, type_text};

/// Reads the action of one environment.
pub(crate) fn read_action<'a>(
    action: &Bound<PyAny>,
    spec: ActionSpec,
    numbers: &'a mut Vec<f32>,
) -> Result<Action<'a>, Error> {
    match spec {
        ActionSpec::Continuous(bounds) => {
            read_numbers(action, bounds.len(), numbers)?;
            Ok(Action::Continuous(numbers))
        }
        ActionSpec::Discrete(choices) => {
            let choice = action.extract().map_err(|_| {
                let got = type_text(action);
                Error::ActionForm(format!(
                    "`action` must be a whole number from 0 to {}, got {got}",
                    choices - 1
                ))
            })?;
            Ok(Action::Discrete(choice))
        }
    }
}

/// Writes an action to `numbers`: a float32 array, or anything that `numpy` turns into numbers.
fn read_numbers(action: &Bound<PyAny>, size: usize, numbers: &mut Vec<f32>) -> Result<(), Error> {
    numbers.clear();
    if action.is_none() {
        let text = "`action` must be numbers, got None, which an agent returns when it has stopped";
        return Err(Error::ActionForm(text.to_owned()));
    }
    if let Ok(array) = action.cast::<PyArray1<f32>>() {
        numbers.extend(array.readonly().as_array());
        return Ok(());
    }
    let wrong = |expected: &str, got: String| {
        Error::ActionForm(format!("`action` must have {expected}, got {got}"))
    };
    let array = float64_array(action).map_err(|got| wrong(&format!("{size} number(s)"), got))?;
    if array.ndim() != 1 {
        return Err(wrong(&format!("the shape ({size},)"), shape_text(array.shape())));
    }
    numbers.extend(array.readonly().as_array().iter().copied().map(narrow));
    Ok(())
}

/// Memory for the actions of a batch, used again at every step.
#[derive(Default)]
pub(crate) struct ActionBuffer {
    numbers: Vec<f32>,
    choices: Vec<i64>,
}

impl ActionBuffer {
    /// Reads the actions of a batch: one row an environment, or one choice.
    pub(crate) fn read(
        &mut self,
        actions: &Bound<PyAny>,
        spec: ActionSpec,
        rows: usize,
    ) -> Result<Actions<'_>, Error> {
        match spec {
            ActionSpec::Continuous(bounds) => {
                self.read_numbers(actions, [rows, bounds.len()])?;
                Ok(Actions::Continuous(&self.numbers))
            }
            ActionSpec::Discrete(choices) => {
                self.read_choices(actions, [rows], choices)?;
                Ok(Actions::Discrete(&self.choices))
            }
        }
    }

    fn read_numbers(&mut self, actions: &Bound<PyAny>, shape: [usize; 2]) -> Result<(), Error> {
        self.numbers.clear();
        if let Ok(array) = actions.cast::<PyArray2<f32>>() {
            check_shape(array.shape(), &shape)?;
            append(array, &mut self.numbers);
            return Ok(());
        }
        let array = float64_array(actions).map_err(|got| {
            Error::ActionForm(format!(
                "`actions` must be numbers of the shape {}, got {got}",
                shape_text(&shape)
            ))
        })?;
        check_shape(array.shape(), &shape)?;
        self.numbers.extend(array.readonly().as_array().iter().copied().map(narrow));
        Ok(())
    }

    fn read_choices(
        &mut self,
        actions: &Bound<PyAny>,
        shape: [usize; 1],
        choices: usize,
    ) -> Result<(), Error> {
        self.choices.clear();
        if let Ok(array) = actions.cast::<PyArray1<i64>>() {
            check_shape(array.shape(), &shape)?;
            append(array, &mut self.choices);
            return Ok(());
        }
        let wrong = |got: String| {
            Error::ActionForm(format!(
                "`actions` must be whole numbers from 0 to {}, got {got}",
                choices - 1
            ))
        };
        let numpy = get_array_module(actions.py())?;
        let array: Bound<PyUntypedArray> = numpy
            .call_method1("asarray", (actions,))
            .and_then(|array| Ok(array.cast_into()?))
            .map_err(|_| wrong(type_text(actions)))?;
        if !matches!(array.dtype().kind(), b'i' | b'u') {
            return Err(wrong(format!("an array of {}", array.dtype())));
        }
        let array: Bound<PyArrayDyn<i64>> =
            array.call_method1("astype", ("int64",))?.cast_into().map_err(PyErr::from)?;
        check_shape(array.shape(), &shape)?;
        self.choices.extend(array.readonly().as_array());
        Ok(())
    }
}

/// Puts the numbers of an array behind those that are there, row by row; at once where they lie side by side.
fn append<T: Element + Copy, D: Dimension>(array: &Bound<PyArray<T, D>>, numbers: &mut Vec<T>) {
    let array = array.readonly();
    match array.as_slice() {
        Ok(slice) => numbers.extend_from_slice(slice),
        Err(_) => numbers.extend(array.as_array()),
    }
}

fn check_shape(got: &[usize], expected: &[usize]) -> Result<(), Error> {
    if got == expected {
        return Ok(());
    }
    let (expected, got) = (shape_text(expected), shape_text(got));
    Err(Error::ActionForm(format!("`actions` must have the shape {expected}, got {got}")))
}

/// An array of real numbers as float64; or else what was found instead: text, flags and complex numbers are no actions.
fn float64_array<'py>(numbers: &Bound<'py, PyAny>) -> Result<Bound<'py, PyArrayDyn<f64>>, String> {
    let wrong = |_| type_text(numbers);
    let numpy = get_array_module(numbers.py()).map_err(wrong)?;
    let array = numpy.call_method1("asarray", (numbers,)).map_err(wrong)?;
    let array = array.cast::<PyUntypedArray>().map_err(|_| type_text(numbers))?;
    if !matches!(array.dtype().kind(), b'f' | b'i' | b'u') {
        let is_array = numbers.is_instance_of::<PyUntypedArray>();
        let got = format!("an array of {}", array.dtype());
        return Err(if is_array { got } else { type_text(numbers) });
    }
    let array = numpy.call_method1("asarray", (array, "float64")).map_err(wrong)?;
    array.cast_into().map_err(|_| type_text(numbers))
}

/// Large numbers are clipped later, like all that lie beyond the bounds; only infinity is infinite.
#[expect(clippy::cast_possible_truncation, reason = "actions are float32 by contract")]
fn narrow(value: f64) -> f32 {
    let most = f64::from(f32::MAX);
    if value.is_finite() { value.clamp(-most, most) as f32 } else { value as f32 }
}
