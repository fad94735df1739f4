//! A decision of the action kind `target`: the way to a candidate.

use super::{Env, Step};
use crate::action::{ActionError, Command};
use crate::candidates::Purpose;
use crate::episode::End;

/// After so many looks a decision is over, wherever it leads: no step takes long.
const MOST_LOOKS: usize = 100_000;

impl Env {
    /// Goes to a candidate, look by look: until the mower arrives, its weed is mowed, or something new is detected, and for
    /// 20 km at most. The place of no candidate stands for the search, and is reported as clipped.
    pub(super) fn pursue(&mut self, place: usize) -> Result<Step, ActionError> {
        self.episode.check_running()?;
        let (candidate, is_asked_for) = self.candidates().chosen(place);
        let detected = self.belief.detected();
        let mut whole: Option<Step> = None;
        let mut looks = 0;
        for segment in candidate.way.segments() {
            let mut left_m = segment.length_m;
            while left_m > 0.0 {
                let distance_m = left_m.min(self.mower.to_next_look_m());
                left_m -= distance_m;
                if whole.is_some() {
                    self.episode.resume_step();
                }
                let part =
                    self.drive(Command { curvature_per_m: segment.curvature_per_m, distance_m })?;
                let step = whole.map_or(part, |step| step.followed_by(&part));
                whole = Some(step);
                let is_mowed = match candidate.purpose {
                    Purpose::Weed(number) => !self.belief.known().holds(number),
                    _ => false,
                };
                looks += 1;
                let is_over = step.end != End::Running || looks == MOST_LOOKS;
                if is_over || self.belief.detected() > detected || is_mowed {
                    return Ok(Step { is_clipped: !is_asked_for, ..step });
                }
            }
        }
        let step = whole.expect("every way is longer than nothing");
        Ok(Step { is_clipped: !is_asked_for, ..step })
    }
}

impl Step {
    /// This and what came next within the same step.
    fn followed_by(mut self, next: &Self) -> Self {
        self.terms.add(&next.terms);
        self.end = next.end;
        self.weeds_mowed += next.weeds_mowed;
        self.distance_m += next.distance_m;
        self
    }
}
