//! `straight`: straight on across the pasture, the smallest agent there is.

use swath_core::action::Command;
use swath_core::view::View;

use crate::agent::{Agent, Decision, PIECE_M};

/// Drives straight on until it has crossed the pasture.
#[derive(Debug)]
pub struct Straight;

impl Agent for Straight {
    fn reset(&mut self, _view: &View) {}

    fn act(&mut self, view: &View) -> Decision {
        if view.pose.x_m >= view.site.length_m {
            return Decision::Done;
        }
        Decision::Drive(Command { curvature_per_m: 0.0, distance_m: PIECE_M })
    }
}
