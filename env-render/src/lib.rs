//! Pictures of a pasture being mowed.
//!
//! A picture shows the truth, undetected weeds too: it is for who owns an environment. Agents get a `View`, and this crate
//! stands beside them, not below.
//!
//! | module | what it is |
//! |---|---|
//! | `colours`, `text`, `draw` | colours, letters, lines and shapes |
//! | [`layout`] | sizes of pictures, and the part of the world that they show |
//! | `track` | the path as points, cut into parts that are drawn once |
//! | `marks`, `mower`, `chrome` | weeds, the mower and its sensor, and what surrounds the plot |
//! | [`picture`], [`painter`] | the finished picture, and who paints it |
//! | [`replay`] | an episode driven once more, to be painted at any time of it |
//!
//! ```
//! use swath_core::{action::Command, config::Document, env::Env};
//! use swath_render::{Painter, Size};
//!
//! let scenario = Document::open("pasture")?.scenario()?;
//! let mut env = Env::new(&scenario);
//! env.keep_trace();
//! env.reset(7);
//! env.drive(Command { curvature_per_m: 0.0, distance_m: 100.0 })?;
//! let picture = Painter::new(Size::new(640, 360).unwrap(), "straight ahead").paint(&env);
//! assert_eq!(picture.rgb().len(), 360 * 640 * 3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod colours;
mod text;
pub mod layout;
mod draw;
mod track;
mod marks;
mod mower;
mod chrome;
pub mod picture;
pub mod painter;
pub mod replay;

pub use layout::{Size, Window};
pub use painter::Painter;
pub use picture::Picture;
pub use replay::Replay;
