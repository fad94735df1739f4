//! `jump`: passes that detour to weeds above and spring ahead where there are none.

use swath_core::geometry::{Point, Pose, Word};
use swath_core::view::View;

use crate::agent::{Agent, Decision, PIECE_M};
use crate::pass::Heading;
use crate::route::{ARRIVED_M, Route};

/// A weed this close outside the bar is under it, metres; the deck counts it as mowed too.
const UNDER_BAR_M: f64 = 1e-6;
/// Rounding in comparisons of lengths, metres.
const ROUNDING_M: f64 = 1e-9;

/// JUMP, algorithm 1 of the paper.
///
/// On each pass it leaves the line for weeds above it, by a tight LSR word up and a tight RSL word down (mirrored on the way
/// back), and returns to the line. The next pass lies at equation (1): half a sensor width higher, or lower if a known weed
/// needs it, and never above W - B/2. It stops at the end of a pass at W - B/2 with no known weed left, equation (2).
///
/// Readings of what the paper leaves open: no jump starts while a known weed lies under the rest of the pass; the target is
/// the nearest weed along the pass, from the last piece at which a jump with arcs of at most 90 degrees still starts and
/// lands within the pasture.
#[derive(Debug, Clone)]
pub struct Jump {
    pass: usize,
    pass_y_m: f64,
    /// A turn to the next pass, or a jump.
    detour: Option<Route>,
}

impl Jump {
    /// The planner.
    #[must_use]
    pub fn new() -> Self {
        Self { pass: 0, pass_y_m: 0.0, detour: None }
    }

    fn heading(&self) -> Heading {
        Heading::of_pass(self.pass)
    }

    /// The jump that has to start now, if there is one.
    fn jump(&self, view: &View) -> Option<Route> {
        let (heading, site) = (self.heading(), view.site);
        let along_m = heading.along(view.pose.x_m, site);
        let reach_m = 0.5 * site.deck_width_m + UNDER_BAR_M;
        let mut nearest: Option<(f64, f64, Point)> = None;
        for weed in view.known_weeds {
            let ahead_m = heading.along(weed.position.x, site) - along_m;
            let above_m = weed.position.y - self.pass_y_m;
            if ahead_m >= 0.0 && above_m.abs() <= reach_m {
                return None;
            }
            if ahead_m <= 0.0
                || above_m <= reach_m
                || nearest.is_some_and(|(nearest_m, ..)| nearest_m <= ahead_m)
            {
                continue;
            }
            let tight_m = tight_length(above_m, site.turning_radius_m);
            let gap_m = ahead_m - tight_m;
            let starts_now = (-ROUNDING_M..PIECE_M - ROUNDING_M).contains(&gap_m);
            if starts_now && along_m + ahead_m + tight_m <= site.length_m + ROUNDING_M {
                nearest = Some((ahead_m, tight_m, weed.position));
            }
        }
        let (ahead_m, tight_m, weed) = nearest?;
        let (up, down) = match heading {
            Heading::East => (Word::Lsr, Word::Rsl),
            Heading::West => (Word::Rsl, Word::Lsr),
        };
        let top = Pose::new(weed.x, weed.y, heading.rad());
        let landing = heading.pose(along_m + ahead_m + tight_m, self.pass_y_m, site);
        let up = up.path(view.pose, top, site.turning_radius_m)?;
        let down = down.path(top, landing, site.turning_radius_m)?;
        Some(Route::along(&up, view).followed_by(&down))
    }

    /// Equation (1): the height of the next pass.
    fn next_pass_y(&self, view: &View) -> f64 {
        let site = view.site;
        let highest_m = site.width_m - 0.5 * site.deck_width_m;
        let spring_m = self.pass_y_m + 0.5 * site.sensor_width_m;
        view.known_weeds
            .iter()
            .map(|weed| weed.position.y + 0.5 * site.deck_width_m)
            .fold(spring_m.min(highest_m), f64::min)
    }

    fn is_at_top(&self, view: &View) -> bool {
        (self.pass_y_m - (view.site.width_m - 0.5 * view.site.deck_width_m)).abs() < ROUNDING_M
    }
}

impl Default for Jump {
    fn default() -> Self {
        Self::new()
    }
}

/// The least way along the pass that a word with arcs of at most 90 degrees needs to move `across_m` to the side.
fn tight_length(across_m: f64, radius_m: f64) -> f64 {
    if across_m <= 2.0 * radius_m {
        (across_m * (4.0 * radius_m - across_m)).sqrt()
    } else {
        2.0 * radius_m
    }
}

impl Agent for Jump {
    fn reset(&mut self, view: &View) {
        self.pass = 0;
        self.pass_y_m = 0.5 * view.site.deck_width_m;
        self.detour = Heading::East.way_to_first_pass(self.pass_y_m, view);
    }

    fn act(&mut self, view: &View) -> Decision {
        loop {
            if let Some(command) = self.detour.as_mut().and_then(|detour| detour.next(view)) {
                return Decision::Drive(command);
            }
            self.detour = None;
            let left_m = view.site.length_m - self.heading().along(view.pose.x_m, view.site);
            if left_m > ARRIVED_M {
                self.detour = self.jump(view);
                if self.detour.is_none() {
                    return Decision::Drive(self.heading().hold(
                        self.pass_y_m,
                        left_m.min(PIECE_M),
                        view,
                    ));
                }
            } else {
                if self.is_at_top(view) && view.known_weeds.is_empty() {
                    return Decision::Done;
                }
                self.pass_y_m = self.next_pass_y(view);
                self.pass += 1;
                self.detour = Some(self.heading().way_to_pass(self.pass_y_m, view));
            }
        }
    }
}
