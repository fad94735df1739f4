//! `react`: random search, first come first served.

use swath_core::action::Command;
use swath_core::geometry::{Point, Pose};
use swath_core::rng::{self, StreamRng};
use swath_core::view::View;

use crate::agent::{Agent, Decision, PIECE_M};
use crate::route::{ARRIVED_M, Route};

/// Drives to random points until it sees a weed, then to the weeds in the order of their detection; section VII of the paper.
///
/// It ends when its path is as long as the boustrophedon path.
/// Reading of what the paper leaves open: the heading at a target is the bearing from where the target was chosen.
#[derive(Debug, Clone)]
pub struct React {
    seed: u64,
    rng: StreamRng,
    target: Option<Target>,
}

#[derive(Debug, Clone)]
struct Target {
    /// The weed driven to, by its number; `None` for a random point.
    weed: Option<u32>,
    route: Route,
}

impl React {
    /// The planner, drawing its points from `seed`.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { seed, rng: rng::agent_rng(seed), target: None }
    }

    fn choose(&mut self, view: &View) -> Target {
        let random_point = || {
            let x_m = rng::uniform(&mut self.rng) * view.site.length_m;
            Point::new(x_m, rng::uniform(&mut self.rng) * view.site.width_m)
        };
        let weed = view.known_weeds.iter().next();
        let point = weed.map_or_else(random_point, |weed| weed.position);
        let goal = Pose::new(point.x, point.y, view.pose.bearing_to(point));
        Target { weed: weed.map(|weed| weed.number), route: Route::shortest_to(goal, view) }
    }
}

impl Target {
    /// Whether it still makes sense to go there.
    fn is_wanted(&self, view: &View) -> bool {
        match self.weed {
            Some(number) => view.known_weeds.holds(number),
            None => view.known_weeds.is_empty(),
        }
    }
}

impl Agent for React {
    fn reset(&mut self, _view: &View) {
        *self = Self::new(self.seed);
    }

    fn act(&mut self, view: &View) -> Decision {
        let left_m = view.site.bcp_length_m - view.path_m;
        if left_m <= ARRIVED_M {
            return Decision::Done;
        }
        let mut target = self
            .target
            .take()
            .filter(|target| target.is_wanted(view))
            .unwrap_or_else(|| self.choose(view));
        if target.route.is_driven(view) {
            target = self.choose(view);
        }
        // A target where the mower stands has no route: one piece straight on, and the deck has passed over it.
        let ahead = Command { curvature_per_m: 0.0, distance_m: PIECE_M };
        let command = target.route.next(view).unwrap_or(ahead);
        self.target = Some(target);
        Decision::Drive(Command {
            distance_m: command.distance_m.min(PIECE_M).min(left_m),
            ..command
        })
    }
}
