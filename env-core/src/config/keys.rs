//! Which keys a scenario has, taken from its JSON Schema, and what to say about others.

use schemars::{JsonSchema, Schema, generate::SchemaSettings};
use serde::de::DeserializeOwned;
use serde_json::Value;
use toml::Table;

use super::error::did_you_mean;
use super::{ConfigError, Scenario};

/// JSON Schema of a scenario.
#[must_use]
pub fn schema() -> Schema {
    schema_of::<Scenario>()
}

fn schema_of<T: JsonSchema>() -> Schema {
    SchemaSettings::draft2020_12().into_generator().into_root_schema_for::<T>()
}

/// Reads any configuration struct from a table, naming what does not fit; `prefix` stands before the key in messages.
///
/// # Errors
///
/// [`ConfigError::UnknownKey`] with the nearest known key, or [`ConfigError::Value`] for a value of the wrong type.
pub fn from_table<T: JsonSchema + DeserializeOwned>(
    table: Table,
    prefix: &str,
) -> Result<T, ConfigError> {
    let known = leaves(&schema_of::<T>());
    refuse_unknown(&table, &known, "", prefix)?;
    let written = table.clone();
    serde_path_to_error::deserialize(toml::Value::Table(table)).map_err(|error| {
        let path = error.path().to_string();
        let got = path
            .split('.')
            .try_fold(&toml::Value::Table(written), |value, name| value.get(name))
            .map(ToString::to_string);
        wrong_type(&format!("{prefix}{path}"), error.inner().message(), got)
    })
}

/// Dotted names of every leaf of a schema, in its order.
fn leaves(schema: &Schema) -> Vec<String> {
    let root = schema.as_value();
    let mut names = Vec::new();
    collect(root, root, "", &mut names);
    names
}

fn collect(root: &Value, node: &Value, path: &str, names: &mut Vec<String>) {
    let node = node
        .get("$ref")
        .and_then(Value::as_str)
        .and_then(|target| root.pointer(target.trim_start_matches('#')))
        .unwrap_or(node);
    match node.get("properties").and_then(Value::as_object) {
        Some(properties) => {
            for (name, child) in properties {
                let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
                collect(root, child, &path, names);
            }
        }
        None => names.push(path.to_owned()),
    }
}

fn refuse_unknown(
    table: &Table,
    known: &[String],
    path: &str,
    prefix: &str,
) -> Result<(), ConfigError> {
    for (name, value) in table {
        let key = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
        if known.contains(&key) {
            continue;
        }
        let is_block =
            known.iter().any(|k| k.strip_prefix(&key).is_some_and(|rest| rest.starts_with('.')));
        match value {
            toml::Value::Table(inner) if is_block => refuse_unknown(inner, known, &key, prefix)?,
            other if is_block => {
                return Err(ConfigError::value(format!("{prefix}{key}"), "a block of keys", other));
            }
            other => return Err(unknown(&key, other.is_table(), known, prefix)),
        }
    }
    Ok(())
}

/// The error for `key`, with the nearest known key, or the nearest block if a block was written.
fn unknown(key: &str, is_block: bool, known: &[String], prefix: &str) -> ConfigError {
    let blocks = known.iter().filter_map(|k| k.split_once('.').map(|(block, _)| block));
    let nearest = if is_block {
        nearest(key, blocks)
    } else {
        nearest(key, known.iter().map(String::as_str).chain(blocks))
    };
    ConfigError::UnknownKey {
        key: format!("{prefix}{key}"),
        nearest: nearest.map(|candidate| format!("{prefix}{candidate}")),
    }
}

/// No key or name that a longer word could be meant for is nearly as long, bytes.
const LONGEST_WORD: usize = 200;

/// The candidate that is spelt most like `word`, if one is close enough to be meant.
fn nearest<'a>(word: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    // Nothing is spelt like that, and comparing would take long.
    if word.len() > LONGEST_WORD {
        return None;
    }
    candidates
        .map(|candidate| (likeness(word, candidate), candidate))
        .filter(|&(likeness, _)| likeness > 0.6)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

/// `; did you mean ...?`, to stand at the end of a message, if one of the candidates is close enough to be meant.
#[must_use]
pub fn hint(word: &str, candidates: &[&str]) -> String {
    did_you_mean(nearest(word, candidates.iter().copied()))
}

/// How alike two dotted keys are, 0 to 1: their spelling as a whole, or that of their last names when a block was mistaken.
fn likeness(key: &str, candidate: &str) -> f64 {
    fn last(dotted: &str) -> &str {
        dotted.rsplit('.').next().unwrap_or(dotted)
    }
    let whole = strsim::normalized_damerau_levenshtein(key, candidate);
    whole.max(0.95 * strsim::normalized_damerau_levenshtein(last(key), last(candidate)))
}

/// Refuses a dotted key that is no leaf of a scenario.
pub(super) fn check_leaf(key: &str) -> Result<(), ConfigError> {
    let known = leaves(&schema());
    if known.iter().any(|k| k == key) { Ok(()) } else { Err(unknown(key, false, &known, "")) }
}

/// Puts serde's "invalid type: A, expected B" into our form; where it says B only, `written` is what was found.
fn wrong_type(field: &str, message: &str, written: Option<String>) -> ConfigError {
    let message = message.trim_end();
    let (got, expected) = match message.split_once(", expected ") {
        Some((got, expected)) => {
            let got = got.split_once(": ").map_or(got, |(_, got)| got);
            (got.trim_start_matches("unknown variant ").to_owned(), expected)
        }
        None => (written.unwrap_or_else(|| "something else".to_owned()), message),
    };
    let expected = match expected {
        "u32" | "u64" | "usize" => "a whole number >= 0",
        "f64" | "a float" => "a number",
        other => other,
    };
    ConfigError::value(field, expected, got)
}
