//! From an agent's numbers to a drive command.

use crate::config::{ActionKind, ValidScenario};

/// What the mower is told to do next: turn this sharply for this far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// Signed curvature, 1/m, left positive, at most 1/R either way.
    pub curvature_per_m: f64,
    /// How far to drive, metres.
    pub distance_m: f64,
}

/// An action that cannot be carried out; the state is as it was.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ActionError {
    /// The wrong number of numbers.
    #[error("`action` must have {expected} value(s), got {got}")]
    Shape {
        /// How many the action kind has.
        expected: usize,
        /// How many were given.
        got: usize,
    },
    /// Not a number, or infinite.
    #[error("`action[{index}]` must be finite, got {value}")]
    NotFinite {
        /// Which value.
        index: usize,
        /// What it was.
        value: f64,
    },
    /// A command that the mower cannot drive.
    #[error("`{field}` must be {expected}, got {value}")]
    Command {
        /// Field of the command.
        field: &'static str,
        /// What would be allowed.
        expected: &'static str,
        /// What it was.
        value: f64,
    },
    /// The environment has not been reset.
    #[error("`reset` must come before the first step")]
    NotReset,
    /// The episode is over.
    #[error("`reset` must come before the next step: the episode has ended")]
    EpisodeOver,
}

/// Longest way of one command, metres.
const MAX_DISTANCE_M: f64 = 1e6;

/// Reads actions of one kind for one mower.
#[derive(Debug, Clone, Copy)]
pub struct ActionDecoder {
    kind: ActionKind,
    max_curvature_per_m: f64,
    control_distance_m: f64,
}

impl ActionDecoder {
    /// The decoder of a scenario.
    #[must_use]
    pub fn new(scenario: &ValidScenario) -> Self {
        Self {
            kind: scenario.action.kind,
            max_curvature_per_m: 1.0 / scenario.mower.turning_radius_m,
            control_distance_m: scenario.episode.control_period_s * scenario.mower.speed_mps,
        }
    }

    /// Name, lowest and highest value of every number of an action.
    #[must_use]
    pub fn spec(&self) -> &'static [(&'static str, f32, f32)] {
        match self.kind {
            ActionKind::Steer => &[("curvature", -1.0, 1.0)],
            ActionKind::Drive => &[("curvature", -1.0, 1.0), ("distance", -1.0, 1.0)],
        }
    }

    /// How many numbers an action has, each in [-1, 1].
    #[must_use]
    pub fn len(&self) -> usize {
        self.spec().len()
    }

    /// Whether an action has no numbers; it always has some.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The command that `action` stands for, and whether it had to be clipped into [-1, 1].
    ///
    /// # Errors
    ///
    /// [`ActionError::Shape`] or [`ActionError::NotFinite`].
    pub fn decode(&self, action: &[f32]) -> Result<(Command, bool), ActionError> {
        if action.len() != self.len() {
            return Err(ActionError::Shape { expected: self.len(), got: action.len() });
        }
        if let Some(index) = action.iter().position(|value| !value.is_finite()) {
            return Err(ActionError::NotFinite { index, value: f64::from(action[index]) });
        }
        let is_clipped = action.iter().any(|value| value.abs() > 1.0);
        let value = |index: usize| f64::from(action[index].clamp(-1.0, 1.0));
        let share = match self.kind {
            ActionKind::Steer => 1.0,
            ActionKind::Drive => 0.5 * (value(1) + 1.0),
        };
        let command = Command {
            curvature_per_m: value(0) * self.max_curvature_per_m,
            distance_m: share * self.control_distance_m,
        };
        Ok((command, is_clipped))
    }

    /// The action that stands for `command`, cut to one control period; the counterpart of [`ActionDecoder::decode`].
    ///
    /// The distance is rounded up to float32: a planner ends its commands where the sensor looks, and a step that ended a
    /// hair before would leave it without the look.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "actions are float32 by contract")]
    pub fn encode(&self, command: Command) -> Vec<f32> {
        let curvature =
            (command.curvature_per_m / self.max_curvature_per_m).clamp(-1.0, 1.0) as f32;
        match self.kind {
            ActionKind::Steer => vec![curvature],
            ActionKind::Drive => {
                let share =
                    2.0 * (command.distance_m / self.control_distance_m).clamp(0.0, 1.0) - 1.0;
                let nearest = share as f32;
                let rounded_up =
                    if f64::from(nearest) < share { nearest.next_up() } else { nearest };
                vec![curvature, rounded_up]
            }
        }
    }

    /// The same command, if the mower can drive it.
    ///
    /// # Errors
    ///
    /// [`ActionError::Command`] naming the field.
    pub fn check(&self, command: Command) -> Result<Command, ActionError> {
        let Command { curvature_per_m, distance_m } = command;
        let is_drivable = curvature_per_m.abs() <= self.max_curvature_per_m * (1.0 + 1e-9);
        if !is_drivable {
            return Err(ActionError::Command {
                field: "curvature_per_m",
                expected: "within -1/R and 1/R",
                value: curvature_per_m,
            });
        }
        if !(0.0..=MAX_DISTANCE_M).contains(&distance_m) {
            return Err(ActionError::Command {
                field: "distance_m",
                expected: "from 0 to 1000000 m",
                value: distance_m,
            });
        }
        Ok(command)
    }
}
