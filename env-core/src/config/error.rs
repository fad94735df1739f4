//! What can be wrong with a scenario.

use std::fmt::Display;

/// A scenario that cannot be used; the text names the field, the value and what was expected, in one line.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ConfigError {
    /// A value that is not allowed.
    #[error("{}", one_line(&format!("`{field}` must be {expected}, got {got}")))]
    Value {
        /// Dotted key, such as `mower.deck_width_m`.
        field: String,
        /// What would be allowed.
        expected: String,
        /// What was found.
        got: String,
    },
    /// A key that no scenario has.
    #[error("{}", one_line(&format!("`{key}` is not a known key{}", did_you_mean(nearest.as_deref()))))]
    UnknownKey {
        /// Dotted key as written.
        key: String,
        /// The known key that is spelt most like it, if one is close.
        nearest: Option<String>,
    },
    /// Text that is not TOML.
    #[error("{}", one_line(&format!("{name}, line {line}: {message}")))]
    Syntax {
        /// File or scenario name.
        name: String,
        /// Line number, from 1.
        line: usize,
        /// The parser's words.
        message: String,
    },
    /// A file that cannot be read.
    #[error("{}", one_line(&format!("cannot read {name}: {message}")))]
    File {
        /// Path as written.
        name: String,
        /// The system's words, or what else could have been meant.
        message: String,
    },
    /// A line of a weed file that is not a weed.
    #[error("{}", one_line(&format!("{name}, line {line}: {expected}, got {got}")))]
    WeedFile {
        /// Path as written.
        name: String,
        /// Line number, from 1.
        line: usize,
        /// What would be allowed.
        expected: String,
        /// What was found.
        got: String,
    },
    /// A file that sweeps over several scenarios, where one is needed.
    #[error("{}", one_line(&format!("{name} declares the sweep `{sweep}`: it is for `swath evaluate`, one environment needs a file without [[sweep]]")))]
    Sweep {
        /// File or scenario name.
        name: String,
        /// Name of the first sweep.
        sweep: String,
    },
    /// Whatever is wrong with a scenario that was read from a file.
    #[error("{}: {error}", one_line(file))]
    In {
        /// Path as written.
        file: String,
        /// What is wrong.
        error: Box<ConfigError>,
    },
}

impl ConfigError {
    /// A value that is not allowed in `field`.
    pub fn value(field: impl Into<String>, expected: impl Into<String>, got: impl Display) -> Self {
        Self::Value { field: field.into(), expected: expected.into(), got: got.to_string() }
    }

    /// The same error of a scenario that was read from this file, which its text names.
    #[must_use]
    pub fn in_file(self, file: &str) -> Self {
        let name = file.to_owned();
        match self {
            Self::Syntax { line, message, .. } => Self::Syntax { name, line, message },
            Self::Sweep { sweep, .. } => Self::Sweep { name, sweep },
            Self::File { name, message } if name == file => Self::File { name, message },
            other => Self::In { file: name, error: Box::new(other) },
        }
    }
}

/// What is quoted of a text that somebody wrote, characters.
const LONGEST_QUOTE: usize = 1000;

/// The same text with line breaks and other control characters written out, cut short where it is very long: it may quote
/// what somebody wrote.
fn one_line(text: &str) -> String {
    let breaks = |c: char| c.is_control() || matches!(c, '\u{2028}' | '\u{2029}');
    let mut line: String = text
        .chars()
        .take(LONGEST_QUOTE)
        .flat_map(|c| if breaks(c) { c.escape_default().collect() } else { vec![c] })
        .collect();
    if text.chars().nth(LONGEST_QUOTE).is_some() {
        line += "...";
    }
    line
}

/// The end of a message that knows a better spelling.
pub(super) fn did_you_mean(nearest: Option<&str>) -> String {
    nearest.map_or_else(String::new, |key| format!("; did you mean `{key}`?"))
}

/// `Ok` if a length or rate is finite and above zero.
pub(super) fn positive(field: &str, value: f64) -> Result<(), ConfigError> {
    expect(value.is_finite() && value > 0.0, field, "finite and > 0", value)
}

/// `Ok` for a length that a machine may have: a millimetre to a thousand kilometres.
pub(super) fn machine_length(field: &str, value: f64) -> Result<(), ConfigError> {
    positive(field, value)?;
    expect((1e-3..=1e6).contains(&value), field, "from 0.001 to 1000000 m", value)
}

/// `Ok` if `holds`; written as the positive test by every caller, so that NaN fails it.
pub(super) fn expect(
    holds: bool,
    field: &str,
    expected: &str,
    got: impl Display,
) -> Result<(), ConfigError> {
    if holds { Ok(()) } else { Err(ConfigError::value(field, expected, got)) }
}
