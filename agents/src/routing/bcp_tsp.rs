//! `bcp-tsp`: look first, then tour.

use swath_core::geometry::{Point, Pose};
use swath_core::known::KnownWeed;
use swath_core::site::Site;
use swath_core::view::View;

use super::{Bcp, BcpOptions, Spacing};
use crate::agent::{Agent, Decision};
use crate::route::Route;
use crate::tour::open_tour;

/// The search sweep, then a tour through what it found; section VII of the paper.
///
/// Readings of what the paper leaves open: the tour is the shortest open one by straight distances from where the sweep ends;
/// the heading at a weed is the bearing to the next one (at the last, from the one before); each leg is the shortest Dubins
/// path; a weed mowed on the way to another is skipped; weeds first seen on the tour are left alone.
///
/// Deviation: the paper's tours come from the LKH heuristic; ours are exact up to 12 weeds and a local optimum of 2-opt and
/// Or-opt beyond.
#[derive(Debug, Clone)]
pub struct BcpTsp {
    sweep: Bcp,
    tour: Option<Tour>,
}

#[derive(Debug, Clone)]
struct Tour {
    stops: Vec<(KnownWeed, f64)>,
    next: usize,
    leg: Option<Route>,
}

impl BcpTsp {
    /// The planner.
    #[must_use]
    pub fn new() -> Self {
        Self { sweep: Bcp::new(BcpOptions { spacing: Spacing::Sensor }), tour: None }
    }
}

impl Default for BcpTsp {
    fn default() -> Self {
        Self::new()
    }
}

impl Tour {
    fn plan(view: &View) -> Self {
        let weeds: Vec<KnownWeed> = view.known_weeds.iter().collect();
        let positions: Vec<Point> = weeds.iter().map(|weed| weed.position).collect();
        let order = open_tour(view.pose.position(), &positions);
        let heading_at = |place: usize| {
            let at = |place: usize| positions[order[place]];
            let (from, to) = match place {
                _ if place + 1 < order.len() => (at(place), at(place + 1)),
                0 => (view.pose.position(), at(0)),
                _ => (at(place - 1), at(place)),
            };
            Pose::new(from.x, from.y, 0.0).bearing_to(to)
        };
        let stops = order
            .iter()
            .enumerate()
            .map(|(place, &index)| (weeds[index], heading_at(place)))
            .collect();
        Self { stops, next: 0, leg: None }
    }

    fn act(&mut self, view: &View) -> Decision {
        loop {
            if let Some(command) = self.leg.as_mut().and_then(|leg| leg.next(view)) {
                return Decision::Drive(command);
            }
            self.leg = None;
            let Some((weed, heading_rad)) = self.stops.get(self.next) else {
                return Decision::Done;
            };
            self.next += 1;
            if view.known_weeds.holds(weed.number) {
                let goal = Pose::new(weed.position.x, weed.position.y, *heading_rad);
                self.leg = Some(Route::shortest_to(goal, view));
            }
        }
    }
}

impl Agent for BcpTsp {
    fn start(&self, site: &Site) -> Option<Pose> {
        self.sweep.start(site)
    }

    fn reset(&mut self, view: &View) {
        self.sweep.reset(view);
        self.tour = None;
    }

    fn act(&mut self, view: &View) -> Decision {
        if self.tour.is_none() {
            match self.sweep.act(view) {
                Decision::Done => {}
                decision => return decision,
            }
        }
        self.tour.get_or_insert_with(|| Tour::plan(view)).act(view)
    }
}
