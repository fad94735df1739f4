//! A scenario: one struct, the same names in TOML, Python and on the wire, checked once.
//!
//! A [`Document`] is what somebody wrote (a file, a shipped name, keywords); [`Document::scenario`] turns it into a
//! [`ValidScenario`], and nobody checks again. `configs/default.toml` lists every key with its meaning.

mod cells;
mod document;
mod error;
mod keys;
mod scenario;
mod sections;
mod shipped;
mod weed_file;

pub use cells::Cell;
pub use document::Document;
pub use error::ConfigError;
pub use keys::{from_table, hint, schema};
pub use scenario::{Scenario, ValidScenario};
pub use sections::{
    ActionConfig, ActionKind, Distribution, EpisodeConfig, MowerConfig, NamedStart,
    ObservationConfig, ObservationKind, PastureConfig, RewardConfig, ScenarioId, SensorConfig,
    Start, WeedsConfig,
};
pub use shipped::{SHIPPED, shipped};
