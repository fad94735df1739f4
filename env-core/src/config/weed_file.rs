//! Weeds from a CSV file: columns `x_m` and `y_m` (or `x` and `y`) named in the first line, or two plain columns without names.

use std::path::Path;

use super::ConfigError;

/// Reads every weed of a file, metres; messages call it `name`.
///
/// # Errors
///
/// [`ConfigError::File`] if it cannot be read, [`ConfigError::WeedFile`] for the first line that is not a weed.
pub(super) fn read(path: &Path, name: &str) -> Result<Vec<[f64; 2]>, ConfigError> {
    let file_error =
        |message: String| ConfigError::File { name: format!("`weeds.file` {name}"), message };
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_path(path)
        .map_err(|error| file_error(error.to_string()))?;
    let mut columns = None;
    let mut weeds = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| file_error(error.to_string()))?;
        if columns.is_none() {
            let find = |names: [&str; 2]| record.iter().position(|cell| names.contains(&cell));
            if let (Some(x), Some(y)) = (find(["x_m", "x"]), find(["y_m", "y"])) {
                columns = Some((x, y));
                continue;
            }
        }
        let (x, y) = *columns.get_or_insert((0, 1));
        let number = |column: usize| {
            record
                .get(column)
                .and_then(|cell| cell.parse::<f64>().ok())
                .filter(|value| value.is_finite())
        };
        let (Some(x_m), Some(y_m)) = (number(x), number(y)) else {
            let line = record.position().map_or(0, csv::Position::line);
            let got = format!("`{}`", record.iter().collect::<Vec<_>>().join(","));
            return Err(ConfigError::WeedFile {
                name: format!("`weeds.file` {name}"),
                line,
                expected: "two finite numbers, x and y in metres".into(),
                got,
            });
        };
        weeds.push([x_m, y_m]);
    }
    Ok(weeds)
}
