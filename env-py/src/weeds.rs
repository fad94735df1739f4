//! Weeds that the caller places.

use numpy::{PyReadonlyArrayDyn, get_array_module};
use pyo3::prelude::*;
use swath_core::config::ConfigError;
use swath_core::geometry::Point;
use swath_core::site::Site;

use crate::errors::{Error, shape_text, type_text};

/// Reads anything like an array (n, 2) of metres, world frame; every weed must stand on the pasture. `field` is what the
/// caller knows it by.
pub(crate) fn points_from(
    weeds: &Bound<PyAny>,
    field: &str,
    site: &Site,
) -> Result<Vec<Point>, Error> {
    let wrong = |got: String| ConfigError::value(field, "an array (n, 2) of numbers, metres", got);
    let array: PyReadonlyArrayDyn<f64> = get_array_module(weeds.py())?
        .call_method1("asarray", (weeds, "float64"))
        .and_then(|array| array.extract())
        .map_err(|_| wrong(type_text(weeds)))?;
    let array = array.as_array();
    match array.shape() {
        [_, 2] | [0] => {}
        shape => return Err(wrong(format!("the shape {}", shape_text(shape))).into()),
    }
    let points: Vec<Point> = array
        .rows()
        .into_iter()
        .filter(|row| row.len() == 2)
        .map(|row| Point::new(row[0], row[1]))
        .collect();
    for (index, point) in points.iter().enumerate() {
        if !site.holds(point.x, point.y) {
            return Err(ConfigError::value(
                format!("{field}[{index}]"),
                format!("on the pasture, 0..={} by 0..={} m", site.length_m, site.width_m),
                format!("[{}, {}]", point.x, point.y),
            )
            .into());
        }
    }
    Ok(points)
}

/// Reads one table for all rows, or one for each; `None` where weeds are drawn.
pub(crate) fn weeds_of_rows(
    weeds: Vec<Option<Bound<PyAny>>>,
    site: &Site,
) -> Result<Vec<Option<Vec<Point>>>, Error> {
    let tables = weeds.len();
    let read = |(row, given): (usize, Option<Bound<PyAny>>)| {
        let field = field_of(row, tables);
        given.map(|given| points_from(&given, &field, site)).transpose()
    };
    weeds.into_iter().enumerate().map(read).collect()
}

/// What the caller knows one of so many tables by: a single one is for all rows.
pub(crate) fn field_of(row: usize, tables: usize) -> String {
    if tables == 1 { "weeds".to_owned() } else { format!("weeds[{row}]") }
}
