//! `snake` and `r-snake`: passes that wriggle from weed to weed.

use swath_core::geometry::{Pose, Word};
use swath_core::view::View;

use crate::agent::{Agent, Decision, PIECE_M};
use crate::pass::Heading;
use crate::route::{ARRIVED_M, Route};

/// A weed less far ahead than this is not ahead any more, metres.
const AHEAD_M: f64 = 1e-9;
/// Passes in a row without a newly mowed weed after which the planner gives up.
const FRUITLESS_PASSES: u32 = 40;

/// SNAKE and R-SNAKE, algorithm 2 of the paper.
///
/// On each pass it goes for the next known weed along the direction of motion, anywhere above or below, by an LSR or RSL word
/// that ends with the pass's heading; without one it drives straight on where it is. The next pass starts at equation (3).
/// SNAKE stops at the end of a pass at the top with no known weed left, equation (4). R-SNAKE ignores weeds further than
/// 1.5 sensor widths below the pass, equation (5), and stops at the top whatever is left, equation (6).
///
/// Readings of what the paper leaves open: the next weed is the one with the smallest distance along the pass; a word is valid
/// if it exists, whatever its arcs; a weed already under the bar still gets its word; there is no replanning inside a word.
#[derive(Debug, Clone)]
pub struct Snake {
    is_restricted: bool,
    pass: usize,
    pass_y_m: f64,
    /// Height of the straight that the mower is on.
    line_y_m: f64,
    /// A turn to the next pass, or a word to a weed.
    word: Option<Route>,
    /// Known weeds mowed when the pass began, and passes since that number last rose.
    mowed: usize,
    fruitless: u32,
}

impl Snake {
    /// SNAKE.
    #[must_use]
    pub fn new() -> Self {
        Self {
            is_restricted: false,
            pass: 0,
            pass_y_m: 0.0,
            line_y_m: 0.0,
            word: None,
            mowed: 0,
            fruitless: 0,
        }
    }

    /// R-SNAKE.
    #[must_use]
    pub fn restricted() -> Self {
        Self { is_restricted: true, ..Self::new() }
    }

    fn heading(&self) -> Heading {
        Heading::of_pass(self.pass)
    }

    /// The word to the next weed along the pass, if one can be reached.
    fn next_word(&self, view: &View) -> Option<Route> {
        let (heading, site) = (self.heading(), view.site);
        let radius_m = site.turning_radius_m;
        let along_m = heading.along(view.pose.x_m, site);
        let lowest_m = if self.is_restricted {
            self.pass_y_m - 1.5 * site.sensor_width_m
        } else {
            f64::NEG_INFINITY
        };
        let mut nearest: Option<(f64, Pose)> = None;
        for weed in view.known_weeds {
            let ahead_m = heading.along(weed.position.x, site) - along_m;
            if ahead_m <= AHEAD_M
                || weed.position.y < lowest_m
                || nearest.is_some_and(|(nearest_m, _)| nearest_m <= ahead_m)
            {
                continue;
            }
            let across_m = (weed.position.y - view.pose.y_m).abs();
            let is_reachable = across_m > 4.0 * radius_m
                || ahead_m >= (across_m * (4.0 * radius_m - across_m)).sqrt();
            if is_reachable {
                nearest =
                    Some((ahead_m, Pose::new(weed.position.x, weed.position.y, heading.rad())));
            }
        }
        let (_, goal) = nearest?;
        let left_m = heading.sign() * (goal.y_m - view.pose.y_m);
        let word = if left_m >= 0.0 { Word::Lsr } else { Word::Rsl };
        let from = Pose { heading_rad: heading.rad(), ..view.pose };
        word.path(from, goal, radius_m).map(|path| Route::along(&path, view))
    }

    fn is_finished(&self, view: &View) -> bool {
        let (width_m, deck_m) = (view.site.width_m, view.site.deck_width_m);
        let is_at_top = view.pose.y_m >= width_m - deck_m
            && (self.pass_y_m - (width_m - 0.5 * deck_m)).abs() < AHEAD_M;
        is_at_top && (self.is_restricted || view.known_weeds.is_empty())
    }

    /// Turns to the pass of equation (3); returns whether it is worth while.
    fn begin_next_pass(&mut self, view: &View) -> bool {
        let mowed = view.weeds_detected as usize - view.known_weeds.len();
        self.fruitless = if mowed > self.mowed { 0 } else { self.fruitless + 1 };
        self.mowed = mowed;
        let step_m = 0.5 * (view.site.sensor_width_m + view.site.deck_width_m);
        self.pass_y_m =
            (self.pass_y_m + step_m).min(view.site.width_m - 0.5 * view.site.deck_width_m);
        self.pass += 1;
        self.word = Some(self.heading().way_to_pass(self.pass_y_m, view));
        self.fruitless < FRUITLESS_PASSES
    }
}

impl Default for Snake {
    fn default() -> Self {
        Self::new()
    }
}

impl Agent for Snake {
    fn reset(&mut self, view: &View) {
        let is_restricted = self.is_restricted;
        *self = Self { is_restricted, pass_y_m: 0.5 * view.site.deck_width_m, ..Self::new() };
        self.line_y_m = self.pass_y_m;
        self.word = Heading::East.way_to_first_pass(self.pass_y_m, view);
    }

    fn act(&mut self, view: &View) -> Decision {
        loop {
            if let Some(word) = &mut self.word {
                if let Some(command) = word.next(view) {
                    return Decision::Drive(command);
                }
                self.word = None;
                self.line_y_m = view.pose.y_m;
            }
            let left_m = view.site.length_m - self.heading().along(view.pose.x_m, view.site);
            if left_m > ARRIVED_M {
                self.word = self.next_word(view);
                if self.word.is_none() {
                    return Decision::Drive(self.heading().hold(
                        self.line_y_m,
                        left_m.min(PIECE_M),
                        view,
                    ));
                }
            } else if self.is_finished(view) {
                return Decision::Done;
            } else if !self.begin_next_pass(view) {
                return Decision::Capped;
            }
        }
    }
}
