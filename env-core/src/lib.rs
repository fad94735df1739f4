//! The mower routing problem as a step function.
//!
//! A mower that cannot turn tighter than a radius drives over a pasture whose weeds it does not know. It detects weeds
//! inside a triangle in front of it and mows what its deck passes over. The reward is *weeds mowed minus path length*
//! (Maini, Gonultas & Isler, 2022, "Online Coverage Planning for an Autonomous Weed Mowing Robot with Curvature Constraints").
//!
//! The modules stand in the order of the flow, and each uses only those above it:
//!
//! | module | what it is |
//! |---|---|
//! | [`math`], [`geometry`] | exact arcs, Dubins words, the swept bar and the triangle |
//! | [`config`], [`rng`] | a scenario, checked once; random numbers, one stream per purpose |
//! | [`site`], [`grid`], [`known`], [`ground`], [`weeds`] | the pasture: its public numbers, its cells, what is known to grow on it and was seen, what does |
//! | [`action`], [`motion`], [`mower`], [`trajectory`] | from an agent's numbers to a motion, and the path that motions add up to |
//! | [`deck`] | **where a weed is mowed** |
//! | [`sensor`], [`belief`], [`view`] | **who may see it**: what a look shows, what the mower remembers, what an agent gets |
//! | [`mirror`] | that told piece by piece, for an agent in another process |
//! | [`candidates`] | the places that the action kind `target` chooses from |
//! | [`episode`], [`reward`] | when it ends, and **what it is worth** |
//! | [`observation`], [`mod@env`] | numbers for learners, and the step that joins all of this |
//! | [`batch`] | many environments, stepped together |
//!
//! ```
//! use swath_core::{action::Command, config::Document, env::Env};
//!
//! let scenario = Document::open("pasture")?.scenario()?;
//! let mut env = Env::new(&scenario);
//! env.reset(7);
//! let step = env.drive(Command { curvature_per_m: 0.0, distance_m: 100.0 })?;
//! assert_eq!(step.terms.total(), f64::from(step.weeds_mowed) - 100.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod math;
mod fetch;
pub mod geometry;
pub mod config;
pub mod rng;
pub mod site;
pub mod grid;
pub mod known;
pub mod ground;
pub mod weeds;
pub mod action;
pub mod motion;
pub mod mower;
pub mod trajectory;
pub mod deck;
pub mod sensor;
mod rig;
pub mod belief;
pub mod view;
pub mod mirror;
pub mod candidates;
pub mod episode;
pub mod reward;
pub mod observation;
pub mod env;
pub mod batch;
