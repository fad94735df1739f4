//! What a caller names as a scenario: nothing, a shipped name, a file, a dictionary or a `Scenario`.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use pyo3::types::PyMapping;
use swath_core::config::{Cell, ConfigError, Document, shipped};
use toml::{Table, Value};

use crate::errors::Error;
use crate::scenario::Scenario;
use crate::table::table_from;

/// A scenario as written, and where it was written.
pub(crate) struct Source {
    name: String,
    table: Table,
    folder: PathBuf,
    /// The file as the caller wrote it, for messages.
    file: Option<String>,
}

impl Source {
    /// Reads what the caller named.
    pub(crate) fn read(given: Option<&Bound<PyAny>>) -> Result<Self, Error> {
        let of = |name: &str, table: Table| {
            Ok(Self { name: name.to_owned(), table, folder: PathBuf::new(), file: None })
        };
        let Some(given) = given else {
            return of("default", Table::new());
        };
        if let Ok(scenario) = given.cast::<Scenario>() {
            let scenario = scenario.get();
            of(&scenario.name, scenario.table())
        } else if let Ok(mapping) = given.cast::<PyMapping>() {
            of("scenario", table_from(mapping, "")?)
        } else if let Ok(path) = given.extract::<PathBuf>() {
            Self::open(&path.to_string_lossy())
        } else {
            let expected = "a name, a path, a dictionary or a Scenario";
            Err(ConfigError::value("scenario", expected, given.repr()?).into())
        }
    }

    /// Opens a file or a shipped scenario.
    fn open(path: &str) -> Result<Self, Error> {
        let document = Document::open(path).map_err(|error| error.in_file(path))?;
        // Only files about trainings and their models have this key.
        if document.written().contains_key("algorithm") {
            let expected = "the file of a scenario";
            let got = format!("{path}, the file of a training, whose own is its block `scenario`");
            return Err(ConfigError::value("scenario", expected, got).into());
        }
        Ok(Self {
            name: document.name().to_owned(),
            table: document.written().clone(),
            folder: document.folder().to_owned(),
            file: shipped(path).is_none().then(|| path.to_owned()),
        })
    }

    /// The document, with keywords laid over it.
    ///
    /// A weed file among the keywords lies where Python runs, not beside the scenario's file.
    pub(crate) fn document(&self, mut blocks: Table) -> Result<Document, Error> {
        let mut document = Document::from_table(&self.name, self.table.clone(), &self.folder)?;
        if let Some(Value::Table(weeds)) = blocks.get_mut("weeds")
            && let Some(Value::String(file)) = weeds.get_mut("file")
            && self.folder != Path::new("")
        {
            let here = std::path::absolute(&*file).map_err(PyErr::from)?;
            *file = here.to_string_lossy().into_owned();
        }
        document.overlay(blocks);
        Ok(document)
    }

    /// What is wrong with the source itself, with the name of its file.
    pub(crate) fn blamed(&self, error: ConfigError) -> Error {
        match &self.file {
            Some(file) => error.in_file(file).into(),
            None => error.into(),
        }
    }

    /// Every scenario of the document's sweeps; `only` picks one sweep.
    pub(crate) fn cells(&self, only: Option<&str>) -> Result<Vec<Cell>, Error> {
        self.document(Table::new())?.cells(only).map_err(|error| self.blamed(error))
    }

    /// The document as TOML with every key written out and its sweeps (or the one named `only`) behind: to be run again.
    pub(crate) fn resolved(&self, only: Option<&str>) -> Result<String, Error> {
        let mut base = self.table.clone();
        let sweeps = base.remove("sweep");
        let document = Document::from_table(&self.name, base, &self.folder)?;
        let mut text = document.scenario().map_err(|error| self.blamed(error))?.to_toml();
        if let Some(Value::Array(mut sweeps)) = sweeps {
            let is_chosen = |sweep: &Value| {
                only.is_none_or(|only| sweep.get("name").and_then(Value::as_str) == Some(only))
            };
            sweeps.retain(is_chosen);
            let sweeps = Table::from_iter([("sweep".to_owned(), Value::Array(sweeps))]);
            text.push('\n');
            text.push_str(&toml::to_string(&sweeps).expect("it was read from TOML"));
        }
        Ok(text)
    }
}
