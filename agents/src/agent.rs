//! What every agent is.

use swath_core::action::Command;
use swath_core::geometry::Pose;
use swath_core::site::Site;
use swath_core::view::View;

/// Longest piece that a planner drives before it looks at the world again, metres: the spacing of the sensor's looks.
pub const PIECE_M: f64 = swath_core::motion::LOOK_SPACING_M;

/// What an agent answers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Decision {
    /// Drive on.
    Drive(Command),
    /// The agent's own stop rule: it considers the job done.
    Done,
    /// The agent's safety cap: it would go on for ever.
    Capped,
}

/// A planner or policy: a state machine that is asked at every step and may be stopped at any.
///
/// It sees [`View`] and nothing else. A command may be cut short by the world (a control period, a budget), so an agent
/// goes by `view.path_m` and `view.pose`, never by what it asked for.
///
/// ```
/// use swath_agents::agent::{Agent, Decision, PIECE_M};
/// use swath_core::action::Command;
/// use swath_core::view::View;
///
/// /// Drives straight on until it has crossed the pasture.
/// struct Straight;
///
/// impl Agent for Straight {
///     fn reset(&mut self, _view: &View) {}
///
///     fn act(&mut self, view: &View) -> Decision {
///         if view.pose.x_m >= view.site.length_m {
///             return Decision::Done;
///         }
///         Decision::Drive(Command { curvature_per_m: 0.0, distance_m: PIECE_M })
///     }
/// }
/// ```
pub trait Agent: Send {
    /// Where the agent would like to start, if not where the scenario says. Only the native runner honours it.
    fn start(&self, _site: &Site) -> Option<Pose> {
        None
    }

    /// Forgets the last episode; `view` is the beginning of the next.
    fn reset(&mut self, view: &View);

    /// The next move. After anything but [`Decision::Drive`] the episode is over.
    fn act(&mut self, view: &View) -> Decision;
}

/// An agent that gives up when its path is 20 km long, or ten boustrophedon paths on a large pasture.
///
/// The paper names no cap; its planners end long before this one on every pasture tried (`make paper` counts).
pub struct Capped(pub Box<dyn Agent>);

impl Agent for Capped {
    fn start(&self, site: &Site) -> Option<Pose> {
        self.0.start(site)
    }

    fn reset(&mut self, view: &View) {
        self.0.reset(view);
    }

    fn act(&mut self, view: &View) -> Decision {
        let cap_m = (10.0 * view.site.bcp_length_m).max(20_000.0);
        if view.path_m > cap_m { Decision::Capped } else { self.0.act(view) }
    }
}
