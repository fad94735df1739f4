//! A checked scenario in Python's hands.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use swath_core::config::{self, ValidScenario};
use toml::Table;

use crate::errors::Error;
use crate::source::Source;
use crate::table::{table_from, table_to};

/// A checked scenario: every key has a value, and all values fit together.
///
/// `Scenario(source=None, *, name=None, **blocks)` reads a shipped name, a TOML file, a dictionary of blocks or another
/// scenario (None: the defaults), lays the blocks given as keywords over it, and checks the whole. `name` is what result
/// files call it. Scenarios are equal when they pose the same problem, whatever their names.
#[pyclass(frozen, eq, module = "swath._native")]
pub(crate) struct Scenario {
    pub(crate) name: String,
    pub(crate) scenario: ValidScenario,
}

impl PartialEq for Scenario {
    fn eq(&self, other: &Self) -> bool {
        self.scenario == other.scenario
    }
}

#[pymethods]
impl Scenario {
    /// Reads a source, and lays the keywords over it.
    #[new]
    #[pyo3(signature = (source=None, *, name=None, **blocks))]
    fn new(
        source: Option<&Bound<PyAny>>,
        name: Option<String>,
        blocks: Option<&Bound<PyDict>>,
    ) -> Result<Self, Error> {
        let blocks = blocks.map(given_blocks).transpose()?.unwrap_or_default();
        let is_alone = blocks.is_empty();
        let source = Source::read(source)?;
        let document = source.document(blocks)?;
        let name = name.unwrap_or_else(|| document.name().to_owned());
        let scenario = match document.scenario() {
            // A keyword may as well be to blame as the file it was laid over.
            Err(error) if is_alone => return Err(source.blamed(error)),
            other => other?,
        };
        Ok(Self { name, scenario })
    }

    /// What result files call it.
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// SHA-256 of the TOML text, in hexadecimal.
    #[getter]
    fn hash(&self) -> String {
        self.scenario.hash().iter().fold(String::new(), |text, byte| format!("{text}{byte:02x}"))
    }

    /// As TOML, every key written out.
    fn to_toml(&self) -> String {
        self.scenario.to_toml()
    }

    /// As a dictionary of blocks, every key written out.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        table_to(py, &self.table())
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<((Bound<'py, PyDict>,), Bound<'py, PyDict>)> {
        let keywords = PyDict::new(py);
        keywords.set_item("name", &self.name)?;
        Ok(((self.to_dict(py)?,), keywords))
    }

    fn __repr__(&self) -> String {
        format!("<Scenario {} {}>", self.name, &self.hash()[..12])
    }
}

impl Scenario {
    pub(crate) fn table(&self) -> Table {
        Table::try_from(&*self.scenario).expect("every field of a scenario has a TOML form")
    }
}

/// The keywords that are not None.
fn given_blocks(blocks: &Bound<PyDict>) -> Result<Table, Error> {
    let given = PyDict::new(blocks.py());
    for (name, block) in blocks {
        if !block.is_none() {
            given.set_item(name, block)?;
        }
    }
    table_from(given.as_mapping(), "")
}

/// Name, swept values and scenario of one cell of a sweep.
type Cell<'py> = (String, Bound<'py, PyDict>, Scenario);

/// Every scenario of a source: the product of the values within a sweep, the union over sweeps, the source itself without.
///
/// A cell is called like its source, with the sweep's name behind a slash.
#[pyfunction]
#[pyo3(signature = (source=None, *, only=None))]
pub(crate) fn cells<'py>(
    py: Python<'py>,
    source: Option<&Bound<'py, PyAny>>,
    only: Option<&str>,
) -> Result<Vec<Cell<'py>>, Error> {
    let cell = |config::Cell { name, values, scenario }| {
        let values = table_to(py, &values.into_iter().collect())?;
        Ok((name.clone(), values, Scenario { name, scenario }))
    };
    Source::read(source)?.cells(only)?.into_iter().map(cell).collect()
}

/// A source as TOML that can be run again: every key written out, its sweeps behind.
#[pyfunction]
#[pyo3(signature = (source=None, *, only=None))]
pub(crate) fn resolved(source: Option<&Bound<PyAny>>, only: Option<&str>) -> Result<String, Error> {
    Source::read(source)?.resolved(only)
}

/// JSON Schema of a scenario file.
#[pyfunction]
pub(crate) fn schema() -> String {
    let schema = config::schema();
    serde_json::to_string_pretty(&schema).expect("a schema is JSON")
}

/// Names of the shipped scenarios.
#[pyfunction]
pub(crate) fn shipped() -> Vec<&'static str> {
    config::SHIPPED.iter().map(|(name, _)| *name).collect()
}
