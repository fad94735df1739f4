//! What somebody wrote: a file, a shipped name, or keywords, with or without sweeps.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use toml::{Table, Value};

use super::{ConfigError, Scenario, ValidScenario, keys, shipped, weed_file};

/// A scenario as written, before defaults and checks, and the sweeps over it.
#[derive(Debug, Clone)]
pub struct Document {
    name: String,
    /// All that was written, sweeps included.
    written: Table,
    pub(super) table: Table,
    pub(super) sweeps: Vec<SweepEntry>,
    folder: PathBuf,
}

/// One `[[sweep]]`: the product of the values of its keys.
#[derive(Debug, Clone)]
pub(super) struct SweepEntry {
    pub(super) name: String,
    pub(super) axes: Vec<(String, Vec<Value>)>,
}

impl Document {
    /// An empty document, which is the default scenario; messages call it `name`.
    #[must_use]
    pub fn empty(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            written: Table::new(),
            table: Table::new(),
            sweeps: Vec::new(),
            folder: PathBuf::new(),
        }
    }

    /// Opens a scenario file, or a shipped scenario by its name (`pasture`).
    ///
    /// # Errors
    ///
    /// [`ConfigError::File`] if there is neither, [`ConfigError::Syntax`] if the file is not TOML, and those of sweeps.
    pub fn open(source: &str) -> Result<Self, ConfigError> {
        if let Some(text) = shipped(source) {
            return Self::parse(source, text, Path::new(""));
        }
        let path = Path::new(source);
        let file_error = |message: String| ConfigError::File { name: source.to_owned(), message };
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                let names: Vec<&str> = super::SHIPPED.iter().map(|(name, _)| *name).collect();
                return Err(file_error(format!(
                    "no such file, and no shipped scenario ({}){}",
                    names.join(", "),
                    keys::hint(source, &names)
                )));
            }
            Err(error) => return Err(file_error(error.to_string())),
        };
        let name = path.file_stem().map_or(source.into(), |stem| stem.to_string_lossy());
        Self::parse(&name, &text, path.parent().unwrap_or(Path::new("")))
    }

    /// Reads TOML text; paths in it are relative to `folder`.
    ///
    /// # Errors
    ///
    /// [`ConfigError::Syntax`] if the text is not TOML, and those of sweeps.
    pub fn parse(name: &str, text: &str, folder: &Path) -> Result<Self, ConfigError> {
        let table: Table = text.parse().map_err(|error: toml::de::Error| {
            let before = error.span().map_or("", |span| &text[..span.start.min(text.len())]);
            let message = error.message().lines().next().unwrap_or_default().to_owned();
            ConfigError::Syntax {
                name: name.to_owned(),
                line: before.matches('\n').count() + 1,
                message,
            }
        })?;
        Self::from_table(name, table, folder)
    }

    /// Takes a table that was built elsewhere, such as a Python dictionary; paths in it are relative to `folder`.
    ///
    /// # Errors
    ///
    /// Those of sweeps.
    pub fn from_table(name: &str, mut table: Table, folder: &Path) -> Result<Self, ConfigError> {
        let written = table.clone();
        let sweeps: Vec<SweepEntry> = match table.remove("sweep") {
            None => Vec::new(),
            Some(Value::Array(entries)) => {
                entries.into_iter().map(sweep_entry).collect::<Result<_, _>>()?
            }
            Some(other) => {
                return Err(ConfigError::value("sweep", "one or more [[sweep]] tables", other));
            }
        };
        let mut names = BTreeSet::new();
        for sweep in &sweeps {
            if !names.insert(&sweep.name) {
                return Err(ConfigError::value(
                    "sweep.name",
                    "different for every sweep",
                    &sweep.name,
                ));
            }
        }
        Ok(Self { name: name.to_owned(), written, table, sweeps, folder: folder.to_owned() })
    }

    /// All that was written, sweeps included, keywords laid over it not.
    #[must_use]
    pub fn written(&self) -> &Table {
        &self.written
    }

    /// The folder that paths in the document are relative to.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// What messages and result files call this document.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Lays `table` over the document, key by key; what it gives wins.
    pub fn overlay(&mut self, table: Table) {
        // Weeds that are given in one way replace those that were given in another, and how many these were.
        if let Some(Value::Table(weeds)) = table.get("weeds") {
            let gives = |key: &str| weeds.contains_key(key);
            if (gives("positions_m") || gives("file") || gives("count"))
                && let Some(Value::Table(mine)) = self.table.get_mut("weeds")
            {
                for key in ["positions_m", "file", "count"] {
                    mine.remove(key);
                }
            }
        }
        merge(&mut self.table, table);
    }

    /// The one scenario of this document, checked.
    ///
    /// # Errors
    ///
    /// [`ConfigError::Sweep`] if the document sweeps over several; else what is wrong with the scenario.
    pub fn scenario(&self) -> Result<ValidScenario, ConfigError> {
        match self.sweeps.first() {
            Some(sweep) => {
                Err(ConfigError::Sweep { name: self.name.clone(), sweep: sweep.name.clone() })
            }
            None => self.resolve(self.table.clone()),
        }
    }

    /// Turns a table into a checked scenario, its weed file read.
    pub(super) fn resolve(&self, table: Table) -> Result<ValidScenario, ConfigError> {
        let weeds = table.get("weeds");
        let counted = weeds.and_then(|weeds| weeds.get("count")).and_then(Value::as_integer);
        let mut scenario: Scenario = keys::from_table(table, "")?;
        let mut giver = "weeds.positions_m";
        if let Some(file) = scenario.weeds.file.take() {
            giver = "weeds.file";
            if scenario.weeds.positions_m.is_some() {
                return Err(ConfigError::value(
                    "weeds.file",
                    "absent where weeds.positions_m is given",
                    file,
                ));
            }
            scenario.pasture.check()?;
            let path = self.folder.join(&file);
            let positions_m = weed_file::read(&path, &file, &scenario.pasture)?;
            scenario.weeds.positions_m = Some(positions_m);
        }
        if let Some(positions_m) = &scenario.weeds.positions_m {
            let given = u32::try_from(positions_m.len()).unwrap_or(u32::MAX);
            if let Some(counted) = counted.filter(|&counted| counted != i64::from(given)) {
                let expected = format!("left out or {given}, as many as {giver} gives");
                return Err(ConfigError::value("weeds.count", expected, counted));
            }
            scenario.weeds.count = given;
        }
        scenario.check()
    }
}

fn merge(base: &mut Table, overlay: Table) {
    for (key, value) in overlay {
        match (base.get_mut(&key), value) {
            (Some(Value::Table(inner)), Value::Table(value)) => merge(inner, value),
            (_, value) => {
                base.insert(key, value);
            }
        }
    }
}

fn sweep_entry(entry: Value) -> Result<SweepEntry, ConfigError> {
    let Value::Table(entry) = entry else {
        return Err(ConfigError::value("sweep", "one or more [[sweep]] tables", entry));
    };
    let mut name = None;
    let mut axes: Vec<(String, Vec<Value>)> = Vec::new();
    for (key, value) in entry {
        match (key.as_str(), value) {
            ("name", Value::String(text)) => name = Some(text),
            ("name", other) => return Err(ConfigError::value("sweep.name", "a string", other)),
            (_, Value::Array(values)) if !values.is_empty() => {
                keys::check_leaf(&key)?;
                axes.push((key, values));
            }
            (_, other) => {
                return Err(ConfigError::value(
                    format!("sweep.\"{key}\""),
                    "a list of one or more values (write the key in quotes)",
                    other,
                ));
            }
        }
    }
    let name = name.ok_or_else(|| ConfigError::value("sweep.name", "a string", "none"))?;
    if axes.is_empty() {
        let expected = "a name and lists of values, such as \"weeds.count\" = [20, 40]";
        return Err(ConfigError::value("sweep", expected, format!("`{name}` without any list")));
    }
    Ok(SweepEntry { name, axes })
}
