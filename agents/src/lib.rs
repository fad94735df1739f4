//! Planners that turn what a mower may know into its next move.
//!
//! | module | what it is |
//! |---|---|
//! | [`agent`] | the trait of every agent: asked at every step, it sees a `View` and answers with a `Decision` |
//! | [`pass`], [`route`], [`tour`] | what planners are built from: a straight being held, a path being driven, an order of visits |
//! | [`routing`] | the planners of the mower routing problem, Maini, Gonultas & Isler (2022) |
//! | [`pursuit`], [`greedy`] | a choice among places to go to, and the simplest rule for it |
//! | [`learned`] | the same choice, made by a trained network |
//! | [`horizon`] | one plan over all that is known, made anew as more is known |
//! | [`registry`] | every agent by its name, with its options |
//! | [`tracker`] | a planner followed by a mower that is told one curvature a control period |
//! | [`runner`], [`trajectory`] | one episode from reset to the agent's own stop, and the path it took |
//!
//! ```
//! use swath_agents::{registry::AgentSpec, runner::run_episode};
//! use swath_core::{config::Document, episode::Outcome};
//!
//! let scenario = Document::open("cowbot-field")?.scenario()?;
//! let bcp: AgentSpec = "bcp".parse()?;
//! let episode = run_episode(&scenario, &bcp, 7, None);
//! assert_eq!(episode.outcome, Outcome::Done);
//! assert!((episode.summary.path_length_m - 897.519).abs() < 0.001); // the paper prints 897 m
//! # Ok::<(), swath_core::config::ConfigError>(())
//! ```

pub mod agent;
pub mod greedy;
pub mod horizon;
pub mod learned;
pub mod pass;
pub mod pursuit;
pub mod registry;
pub mod route;
pub mod routing;
pub mod runner;
pub mod tour;
pub mod tracker;
pub mod trajectory;
