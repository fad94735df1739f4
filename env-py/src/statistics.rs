//! Quantiles for confidence intervals.

use pyo3::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};
use swath_core::config::ConfigError;

use crate::errors::Error;

/// From here on the expansion about the normal distribution is exact to 1e-9, and statrs loses digits.
const MANY_DEGREES: f64 = 1000.0;

/// Quantile of Student's t distribution.
#[pyfunction]
pub(crate) fn student_t(probability: f64, degrees_of_freedom: f64) -> Result<f64, Error> {
    let wrong = |field: &str, expected: &str, got: f64| ConfigError::value(field, expected, got);
    if !(probability > 0.0 && probability < 1.0) {
        return Err(wrong("probability", "above 0 and below 1", probability).into());
    }
    if degrees_of_freedom > MANY_DEGREES {
        return Ok(near_normal(probability, degrees_of_freedom));
    }
    let distribution = StudentsT::new(0.0, 1.0, degrees_of_freedom)
        .map_err(|_| wrong("degrees_of_freedom", "above 0", degrees_of_freedom))?;
    Ok(distribution.inverse_cdf(probability))
}

/// The expansion in 1/n about the normal quantile; Abramowitz & Stegun (1964), 26.7.5.
fn near_normal(probability: f64, degrees_of_freedom: f64) -> f64 {
    let z = Normal::standard().inverse_cdf(probability);
    let (z3, z5) = (z.powi(3), z.powi(5));
    let first = (z3 + z) / 4.0;
    let second = (5.0 * z5 + 16.0 * z3 + 3.0 * z) / 96.0;
    z + first / degrees_of_freedom + second / (degrees_of_freedom * degrees_of_freedom)
}
