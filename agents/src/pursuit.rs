//! Going from place to place: how agents act that choose among the candidates of the action kind `target`.

use swath_core::action::Command;
use swath_core::candidates::{Candidates, Purpose};
use swath_core::config::ActionConfig;
use swath_core::view::View;

use crate::agent::PIECE_M;
use crate::route::Route;

/// What is left of the way to a look when it counts as driven, metres.
const AT_LOOK_M: f64 = 1e-6;

/// The places that the mower may go to, and the way to the one that was chosen.
///
/// A choice ends as a step of `target` does: the mower arrives, its weed is mowed, or something new is detected.
#[derive(Debug, Clone)]
pub struct Pursuit {
    candidates: Candidates,
    route: Route,
    purpose: Purpose,
    detected: u32,
}

impl Pursuit {
    /// The places of a pasture as `config` wants them, none of them chosen.
    #[must_use]
    pub fn new(config: &ActionConfig, view: &View) -> Self {
        let mut candidates = Candidates::new(config, view.site, *view.ground.grid());
        candidates.reset();
        Self { candidates, route: Route::empty(), purpose: Purpose::Search, detected: 0 }
    }

    /// Whether nothing is left to do: all ground is seen, and every known weed mowed.
    #[must_use]
    pub fn is_over(view: &View) -> bool {
        view.ground.unseen_count() == 0 && view.known_weeds.is_empty()
    }

    /// The places that there are now.
    pub fn candidates(&mut self, view: &View) -> &Candidates {
        self.candidates.expire();
        self.candidates.refresh(view);
        &self.candidates
    }

    /// Chooses one of the places that there are now.
    pub fn choose(&mut self, place: usize, view: &View) {
        let (candidate, _) = self.candidates.chosen(place);
        self.route = Route::through(candidate.way.segments(), view);
        self.purpose = candidate.purpose;
        self.detected = view.weeds_detected;
    }

    /// The next command, up to the next look; `None` when it is time to choose.
    pub fn next(&mut self, view: &View) -> Option<Command> {
        let is_mowed = match self.purpose {
            Purpose::Weed(number) => !view.known_weeds.holds(number),
            Purpose::View | Purpose::Search => false,
        };
        if is_mowed || view.weeds_detected > self.detected {
            return None;
        }
        let to_look_m = PIECE_M - view.path_m.rem_euclid(PIECE_M);
        let to_look_m = if to_look_m < AT_LOOK_M { PIECE_M } else { to_look_m };
        let command = self.route.next(view)?;
        Some(Command { distance_m: command.distance_m.min(to_look_m), ..command })
    }
}
