//! What stable-baselines3 is told of every row after every step.

use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyList};

/// Lists of infos, a dictionary a row.
///
/// A list and a dictionary that nobody else holds any more are handed out again, as Python's own `zip` does with its
/// tuple: to make a dictionary a row is dear beside the step. Whoever keeps one keeps it as it is.
#[derive(Default)]
pub(crate) struct FlatInfos {
    /// Handed out last, and mostly still in the caller's hands.
    latest: Option<Py<PyList>>,
    before: Option<Py<PyList>>,
}

impl FlatInfos {
    /// A list for one step: each info says whether the row's episode was truncated, and nothing else.
    pub(crate) fn list<'py>(
        &mut self,
        py: Python<'py>,
        truncated: &[bool],
    ) -> PyResult<Bound<'py, PyList>> {
        let key = pyo3::intern!(py, "TimeLimit.truncated");
        let infos = match self.before.take().map(|list| list.into_bound(py)) {
            Some(list) if holders(&list) == 1 && list.len() == truncated.len() => list,
            _ => PyList::new(py, truncated.iter().map(|_| py.None()))?,
        };
        for (row, &is_truncated) in truncated.iter().enumerate() {
            let is_truncated = PyBool::new(py, is_truncated);
            let info = infos.get_item(row)?;
            let can_be_used_again = match info.cast_exact::<PyDict>() {
                // Its holders are the list and `info`.
                Ok(dict) if holders(dict) == 2 && dict.len() == 1 => {
                    dict.get_item(key)?.is_some_and(|value| value.is(is_truncated))
                }
                _ => false,
            };
            if !can_be_used_again {
                let dict = PyDict::new(py);
                dict.set_item(key, is_truncated)?;
                infos.set_item(row, dict)?;
            }
        }
        self.before = self.latest.replace(infos.clone().unbind());
        Ok(infos)
    }
}

#[expect(deprecated, reason = "what is to replace it is unsafe")]
fn holders<T>(object: &Bound<T>) -> isize {
    object.as_any().get_refcnt()
}
