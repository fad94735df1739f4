//! Quantiles for confidence intervals.

use pyo3::prelude::*;
use statrs::distribution::{ContinuousCDF, StudentsT};
use swath_core::config::ConfigError;

use crate::errors::Error;

/// Quantile of Student's t distribution.
#[pyfunction]
pub(crate) fn student_t(probability: f64, degrees_of_freedom: f64) -> Result<f64, Error> {
    let wrong = |field: &str, expected: &str, got: f64| ConfigError::value(field, expected, got);
    if !(probability > 0.0 && probability < 1.0) {
        return Err(wrong("probability", "above 0 and below 1", probability).into());
    }
    let distribution = StudentsT::new(0.0, 1.0, degrees_of_freedom)
        .map_err(|_| wrong("degrees_of_freedom", "above 0", degrees_of_freedom))?;
    Ok(distribution.inverse_cdf(probability))
}
