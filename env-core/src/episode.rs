//! When an episode ends, and how.

use serde::{Deserialize, Serialize};

use crate::action::{ActionError, Command};
use crate::config::{ActionKind, ValidScenario};
use crate::motion::LOOK_SPACING_M;
use crate::site::Site;
use crate::view::View;

/// Why an episode ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Outcome {
    /// The agent's own stop.
    Done,
    /// Enough ground was seen and every detected weed is mowed.
    Goal,
    /// The path reached the budget.
    Budget,
    /// Too many steps.
    StepLimit,
    /// The agent's safety cap.
    Capped,
    /// The mower left the headland: a failure.
    LeftHeadland,
}

impl Outcome {
    /// The name in result files and infos.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Done => "done",
            Self::Goal => "goal",
            Self::Budget => "budget",
            Self::StepLimit => "step_limit",
            Self::Capped => "capped",
            Self::LeftHeadland => "left_headland",
        }
    }
}

/// How an episode stands after a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum End {
    /// It goes on.
    Running,
    /// It ended by the rules of the problem.
    Terminated(Outcome),
    /// It was cut off.
    Truncated(Outcome),
}

impl End {
    /// Whether the episode ended by a failure, which charges the rest of the budget: the mower left, or stood about.
    #[must_use]
    pub fn is_failure(self) -> bool {
        matches!(
            self,
            Self::Terminated(Outcome::LeftHeadland) | Self::Truncated(Outcome::StepLimit)
        )
    }
}

/// The limits of an episode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    budget_m: f64,
    bcp_length_m: f64,
    unseen_goal: f64,
    steps: f64,
}

impl Limits {
    /// The limits of a scenario.
    ///
    /// Standing still ends too: an episode has at most four times the steps that the budget takes at full speed. A step of
    /// the action kind `target` counts as the way between two looks: it goes somewhere, unless a look cuts it short.
    #[must_use]
    pub fn new(scenario: &ValidScenario, site: &Site, cells: usize) -> Self {
        let budget_m = scenario.episode.budget * site.bcp_length_m;
        let step_m = match scenario.action.kind {
            ActionKind::Target => LOOK_SPACING_M,
            _ => site.control_distance_m,
        };
        let unseen_goal = (1.0 - scenario.episode.seen_goal) * cells as f64 + 1e-9;
        Self {
            budget_m,
            bcp_length_m: site.bcp_length_m,
            unseen_goal,
            steps: 4.0 * budget_m / step_m,
        }
    }

    /// Takes all limits but the headland away: the agent's own stop rule decides.
    pub fn lift(&mut self) {
        self.budget_m = f64::INFINITY;
        self.unseen_goal = -1.0;
        self.steps = f64::INFINITY;
    }

    /// Whether they were lifted.
    #[must_use]
    pub fn are_lifted(&self) -> bool {
        self.unseen_goal < 0.0
    }

    /// `command` cut so that the path ends at the budget; `path_m` is driven already.
    #[must_use]
    pub fn cut(&self, command: Command, path_m: f64) -> Command {
        Command { distance_m: command.distance_m.min(self.budget_m - path_m).max(0.0), ..command }
    }

    /// The way that a failure after `path_m` is charged for, metres: the rest of the budget, or one boustrophedon path
    /// where the budget has no end; 0 if `end` is no failure.
    #[must_use]
    pub fn forfeit_m(&self, end: End, path_m: f64) -> f64 {
        if !end.is_failure() {
            return 0.0;
        }
        if self.budget_m.is_finite() { self.budget_m - path_m } else { self.bcp_length_m }
    }

    /// Longest path, metres.
    #[must_use]
    pub fn budget_m(&self) -> f64 {
        self.budget_m
    }
}

/// The state of an episode between steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Episode {
    end: Option<End>,
    steps: u64,
}

impl Episode {
    /// Before the first reset.
    #[must_use]
    pub fn unstarted() -> Self {
        Self { end: None, steps: 0 }
    }

    /// Just reset.
    #[must_use]
    pub fn started() -> Self {
        Self { end: Some(End::Running), steps: 0 }
    }

    /// How the episode stands; `None` before the first reset.
    #[must_use]
    pub fn end(&self) -> Option<End> {
        self.end
    }

    /// `Ok` while steps may be taken.
    ///
    /// # Errors
    ///
    /// [`ActionError::NotReset`] or [`ActionError::EpisodeOver`].
    pub fn check_running(&self) -> Result<(), ActionError> {
        match self.end {
            Some(End::Running) => Ok(()),
            Some(_) => Err(ActionError::EpisodeOver),
            None => Err(ActionError::NotReset),
        }
    }

    /// Takes back the last count of a step: it goes on with another command.
    pub fn resume_step(&mut self) {
        self.steps = self.steps.saturating_sub(1);
    }

    /// Judges the step just taken; `is_off_site` says that a look in it found the mower beyond the headland.
    ///
    /// Only looks tell, so that leaving, too, does not depend on how the way is cut into steps.
    pub fn judge(&mut self, view: &View, limits: &Limits, is_off_site: bool) -> End {
        self.steps += 1;
        let end = if is_off_site {
            End::Terminated(Outcome::LeftHeadland)
        } else if view.ground.unseen_count() as f64 <= limits.unseen_goal
            && view.known_weeds.is_empty()
        {
            End::Terminated(Outcome::Goal)
        } else if view.path_m >= limits.budget_m - 1e-9 {
            End::Truncated(Outcome::Budget)
        } else if self.steps as f64 >= limits.steps {
            End::Truncated(Outcome::StepLimit)
        } else {
            End::Running
        };
        self.end = Some(end);
        end
    }
}
