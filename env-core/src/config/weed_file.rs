//! Weeds from a CSV file: columns `x_m` and `y_m` (or `x` and `y`) named in the first line, or two plain columns without names.

use std::path::Path;

use super::{ConfigError, PastureConfig};

/// Reads every weed of a file, metres; messages call it `name`. Lines that are empty or begin with `#` are passed over.
///
/// # Errors
///
/// [`ConfigError::File`] if it cannot be read, [`ConfigError::WeedFile`] for the first line that is not a weed of this pasture.
pub(super) fn read(
    path: &Path,
    name: &str,
    pasture: &PastureConfig,
) -> Result<Vec<[f64; 2]>, ConfigError> {
    let name = format!("`weeds.file` {name}");
    let bytes = std::fs::read(path)
        .map_err(|error| ConfigError::File { name: name.clone(), message: error.to_string() })?;
    let refuse = |line: usize, expected: String, got: String| ConfigError::WeedFile {
        name: name.clone(),
        line,
        expected,
        got,
    };
    let text = std::str::from_utf8(&bytes).map_err(|error| {
        let readable = String::from_utf8_lossy(&bytes[..error.valid_up_to()]);
        let line = 1 + readable.matches('\n').count();
        refuse(line, "expected text in UTF-8".to_owned(), "other bytes".to_owned())
    })?;
    let mut columns = None;
    let mut weeds = Vec::new();
    for (index, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let cells: Vec<&str> = line.split(',').map(|cell| cell.trim().trim_matches('"')).collect();
        if line.trim().is_empty() || line.starts_with('#') {
            continue;
        }
        if columns.is_none() {
            let find = |names: [&str; 2]| cells.iter().position(|cell| names.contains(cell));
            if let (Some(x), Some(y)) = (find(["x_m", "x"]), find(["y_m", "y"])) {
                columns = Some((x, y));
                continue;
            }
        }
        let (x, y) = *columns.get_or_insert((0, 1));
        let number = |column: usize| {
            cells.get(column)?.parse::<f64>().ok().filter(|value| value.is_finite())
        };
        let (Some(x_m), Some(y_m)) = (number(x), number(y)) else {
            let expected = "expected two finite numbers, x and y in metres".to_owned();
            return Err(refuse(index + 1, expected, format!("`{line}`")));
        };
        if !pasture.holds([x_m, y_m]) {
            return Err(refuse(
                index + 1,
                format!("must be {}", pasture.place()),
                format!("[{x_m}, {y_m}]"),
            ));
        }
        weeds.push([x_m, y_m]);
    }
    Ok(weeds)
}
