//! Poses, arcs, Dubins words, and the two shapes that a mower puts on the ground: the swept bar and the detection triangle.

mod arc;
mod departure;
mod dubins;
mod footprint;
mod frame;
mod frames;
mod pose;
mod sight;
mod sweep;
mod triangle;

pub use arc::Arc;
pub use departure::Departure;
pub use dubins::{DubinsPath, PathError, Segment, Word, boustrophedon_length, shortest, words};
pub use footprint::{Footprint, SidePair};
pub use frame::Frame;
pub use frames::{FRAMES, Frames};
pub use pose::Pose;
pub use sight::Sight;
pub use sweep::BarSweep;
pub use triangle::Triangle;

/// A point of the ground, world frame, metres.
pub type Point = nalgebra::Point2<f64>;
