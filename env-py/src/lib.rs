//! The module `swath._native`: scenarios, environments, agents and their evaluation for the Python package `swath`.
//!
//! Every function borrows its arguments, detaches from the interpreter where the work takes longer than that, calls the
//! core, and converts what comes back.
//!
//! | module | what it is |
//! |---|---|
//! | `errors` | one tree of errors, with the text of the Rust errors |
//! | `table`, `seed`, `weeds`, `summary` | conversions between Python and the core |
//! | `spec`, `action`, `observations`, `infos`, `flat_infos`, `face` | what observations and actions look like, and arrays of many of them |
//! | `source`, `scenario` | what a caller names as a scenario, and the checked scenario |
//! | `pictures` | what environments look like |
//! | `env`, `batch`, `remote` | one environment, many, and many on servers |
//! | `agent`, `crew` | agents that act in one or in many |
//! | `waiting`, `episode`, `evaluation` | whole episodes, one or many, in threads of their own |
//! | `film` | recorded episodes, painted at any time of them |
//! | `statistics` | quantiles for confidence intervals |
//! | `stats` | what a server says of itself |
//! | `training` | the shipped training configurations |

mod errors;
mod table;
mod seed;
mod weeds;
mod summary;
mod source;
mod spec;
mod action;
mod observations;
mod infos;
mod flat_infos;
mod face;
mod scenario;
mod pictures;
mod env;
mod batch;
mod remote;
mod agent;
mod crew;
mod waiting;
mod episode;
mod film;
mod evaluation;
mod statistics;
mod stats;
mod training;

/// The compiled part of swath.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use crate::agent::{Agent, AgentSpec, agents, learned_places};
    #[pymodule_export]
    use crate::batch::Batch;
    #[pymodule_export]
    use crate::crew::Crew;
    #[pymodule_export]
    use crate::env::Env;
    #[pymodule_export]
    use crate::episode::{Episode, run_episode};
    #[pymodule_export]
    use crate::evaluation::EpisodeStream;
    #[pymodule_export]
    use crate::film::Film;
    #[pymodule_export]
    use crate::pictures::png;
    #[pymodule_export]
    use crate::remote::RemoteBatch;
    #[pymodule_export]
    use crate::scenario::{Scenario, cells, resolved, schema, shipped};
    #[pymodule_export]
    use crate::statistics::student_t;
    #[pymodule_export]
    use crate::stats::{knows_no_session, read_stats, stats_request};
    #[pymodule_export]
    use crate::training::{parse_toml, shipped_trainings};
    #[pymodule_export]
    use crate::waiting::give_way;

    /// Version of swath.
    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}
