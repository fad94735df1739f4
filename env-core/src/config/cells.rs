//! The cells of a sweep: every scenario that a document asks to be evaluated.

use toml::{Table, Value};

use super::document::SweepEntry;
use super::{ConfigError, Document, ValidScenario, keys};

/// What the keys of weeds begin with.
const WEEDS: &str = "weeds.";
/// The keys that give weeds, which are drawn without them.
const GIVERS: [&str; 2] = ["weeds.positions_m", "weeds.file"];

/// One scenario of a sweep, with the values that set it apart.
#[derive(Debug, Clone)]
pub struct Cell {
    /// `document` or `document/sweep`.
    pub name: String,
    /// Every swept key of the evaluation, in order, with its value in this cell.
    pub values: Vec<(String, Value)>,
    /// The scenario itself.
    pub scenario: ValidScenario,
}

impl Document {
    /// Every scenario of this document: the product of the values within a sweep, the union over sweeps, the document itself without sweeps.
    ///
    /// `only` picks the sweep of that name.
    ///
    /// # Errors
    ///
    /// [`ConfigError::Value`] if there is no sweep named `only`; else what is wrong with a scenario.
    pub fn cells(&self, only: Option<&str>) -> Result<Vec<Cell>, ConfigError> {
        let chosen: Vec<&SweepEntry> =
            self.sweeps.iter().filter(|sweep| only.is_none_or(|name| sweep.name == name)).collect();
        if let (Some(only), true) = (only, chosen.is_empty()) {
            let names: Vec<&str> = self.sweeps.iter().map(|sweep| sweep.name.as_str()).collect();
            let expected = if names.is_empty() {
                format!("left out, since {} declares no sweep", self.name())
            } else {
                format!("one of {}", names.join(", "))
            };
            return Err(ConfigError::value("only", expected, only));
        }
        if chosen.is_empty() {
            return Ok(vec![Cell {
                name: self.name().to_owned(),
                values: Vec::new(),
                scenario: self.resolve(self.table.clone())?,
            }]);
        }
        let mut columns: Vec<String> = Vec::new();
        for (key, _) in chosen.iter().flat_map(|sweep| &sweep.axes) {
            if !columns.contains(key) {
                columns.push(key.clone());
            }
        }
        let mut cells = Vec::new();
        for sweep in chosen {
            self.refuse_redrawing(sweep)?;
            for table in product(&self.table, &sweep.axes) {
                let scenario = self.resolve(table.clone())?;
                let values = columns
                    .iter()
                    .map(|key| Ok((key.clone(), value_of(&scenario, &table, key)?)))
                    .collect::<Result<_, _>>()?;
                cells.push(Cell {
                    name: format!("{}/{}", self.name(), sweep.name),
                    values,
                    scenario,
                });
            }
        }
        Ok(cells)
    }

    /// Weeds that are given, by the document or by the sweep itself, are not drawn: a sweep over their draw would run the
    /// same cell again and again.
    fn refuse_redrawing(&self, sweep: &SweepEntry) -> Result<(), ConfigError> {
        let is_axis = |giver: &str| sweep.axes.iter().any(|(key, _)| key == giver);
        let is_written = |giver: &str| {
            let name = giver.strip_prefix(WEEDS).unwrap_or(giver);
            self.table.get("weeds").and_then(|weeds| weeds.get(name)).is_some()
        };
        let Some(giver) = GIVERS.into_iter().find(|giver| is_axis(giver) || is_written(giver))
        else {
            return Ok(());
        };
        let draws = |key: &str| key.starts_with(WEEDS) && !GIVERS.contains(&key);
        match sweep.axes.iter().find(|(key, _)| draws(key)) {
            Some((key, _)) => Err(ConfigError::value(
                key,
                format!("left out of sweeps where {giver} gives the weeds, since none is drawn"),
                format!("it in `{}`", sweep.name),
            )),
            None => Ok(()),
        }
    }
}

/// `base` with every combination of the axes' values; the last axis runs fastest.
fn product(base: &Table, axes: &[(String, Vec<Value>)]) -> Vec<Table> {
    let mut tables = vec![base.clone()];
    for (key, values) in axes {
        tables = tables
            .into_iter()
            .flat_map(|table| values.iter().map(move |value| with(&table, key, value)))
            .collect();
    }
    tables
}

fn with(table: &Table, key: &str, value: &Value) -> Table {
    let mut table = table.clone();
    let mut inner = &mut table;
    let mut names = key.split('.').peekable();
    while let Some(name) = names.next() {
        if names.peek().is_none() {
            inner.insert(name.to_owned(), value.clone());
            // Weeds that a sweep gives are as many as they are, whatever the document counts for others.
            if GIVERS.contains(&key) {
                inner.remove("count");
            }
            break;
        }
        let entry = inner.entry(name).or_insert_with(|| Value::Table(Table::new()));
        if !entry.is_table() {
            *entry = Value::Table(Table::new());
        }
        inner = entry.as_table_mut().expect("it was made a table above");
    }
    table
}

/// The value that a scenario has under a dotted key, defaults included; a file that was read has the name it was `written` with.
fn value_of(scenario: &ValidScenario, written: &Table, key: &str) -> Result<Value, ConfigError> {
    keys::check_leaf(key)?;
    let resolved = Value::try_from(&**scenario).expect("every field of a scenario has a TOML form");
    let find = |value: &Value| {
        key.split('.').try_fold(value.clone(), |value, name| value.get(name).cloned())
    };
    let found = find(&resolved).or_else(|| find(&Value::Table(written.clone())));
    Ok(found.unwrap_or_else(|| Value::String(String::new())))
}
