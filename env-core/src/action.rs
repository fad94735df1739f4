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

/// What an agent sends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Action<'a> {
    /// Numbers in [-1, 1], for the kinds `steer` and `drive`.
    Continuous(&'a [f32]),
    /// The number of a choice, for the other kinds.
    Discrete(i64),
}

/// What an agent may send.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ActionSpec {
    /// Name, lowest and highest value of every number.
    Continuous(&'static [(&'static str, f32, f32)]),
    /// Number of choices.
    Discrete(usize),
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
    /// Numbers where a choice is wanted, or the other way round.
    #[error("`action` must be {expected}")]
    Kind {
        /// What the action kind has.
        expected: &'static str,
    },
    /// A choice that there is not.
    #[error("`action` must be from 0 to {}, got {got}", .choices - 1)]
    Choice {
        /// How many there are.
        choices: usize,
        /// Which one was named.
        got: i64,
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

/// The choices of the kind `discrete`, from sharp right to sharp left, as shares of the largest curvature.
const CURVATURES: [f64; 5] = [-1.0, -0.5, 0.0, 0.5, 1.0];

/// What an action asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Order {
    /// To drive.
    Drive(Command),
    /// To go to the candidate at this place.
    Target(usize),
}

/// Longest way of one command, metres.
pub const MAX_DISTANCE_M: f64 = 1e6;

/// Reads actions of one kind for one mower.
#[derive(Debug, Clone, Copy)]
pub struct ActionDecoder {
    kind: ActionKind,
    max_curvature_per_m: f64,
    control_distance_m: f64,
    candidates: usize,
}

impl ActionDecoder {
    /// The decoder of a scenario.
    #[must_use]
    pub fn new(scenario: &ValidScenario) -> Self {
        Self {
            kind: scenario.action.kind,
            max_curvature_per_m: 1.0 / scenario.mower.turning_radius_m,
            control_distance_m: scenario.episode.control_period_s * scenario.mower.speed_mps,
            candidates: scenario.action.candidates(),
        }
    }

    /// The action kind.
    #[must_use]
    pub fn kind(&self) -> ActionKind {
        self.kind
    }

    /// What an agent may send.
    #[must_use]
    pub fn spec(&self) -> ActionSpec {
        match self.kind {
            ActionKind::Steer => ActionSpec::Continuous(&[("curvature", -1.0, 1.0)]),
            ActionKind::Drive => {
                ActionSpec::Continuous(&[("curvature", -1.0, 1.0), ("distance", -1.0, 1.0)])
            }
            ActionKind::Discrete => ActionSpec::Discrete(CURVATURES.len()),
            ActionKind::Target => ActionSpec::Discrete(self.candidates),
        }
    }

    /// What `action` asks for, and whether it had to be clipped into [-1, 1].
    ///
    /// # Errors
    ///
    /// [`ActionError::Kind`], [`ActionError::Shape`], [`ActionError::NotFinite`] or [`ActionError::Choice`].
    pub fn decode(&self, action: Action) -> Result<(Order, bool), ActionError> {
        match (self.spec(), action) {
            (ActionSpec::Continuous(bounds), Action::Continuous(values)) => {
                self.decode_continuous(values, bounds.len())
            }
            (ActionSpec::Discrete(choices), Action::Discrete(choice)) => {
                let wrong = ActionError::Choice { choices, got: choice };
                let index = usize::try_from(choice).map_err(|_| wrong)?;
                if index >= choices {
                    return Err(wrong);
                }
                let order = match self.kind {
                    ActionKind::Target => Order::Target(index),
                    _ => Order::Drive(self.command(CURVATURES[index], 1.0)),
                };
                Ok((order, false))
            }
            (ActionSpec::Continuous(_), _) => Err(ActionError::Kind { expected: "numbers" }),
            (ActionSpec::Discrete(_), _) => Err(ActionError::Kind { expected: "one whole number" }),
        }
    }

    fn decode_continuous(
        &self,
        action: &[f32],
        expected: usize,
    ) -> Result<(Order, bool), ActionError> {
        if action.len() != expected {
            return Err(ActionError::Shape { expected, got: action.len() });
        }
        if let Some(index) = action.iter().position(|value| !value.is_finite()) {
            return Err(ActionError::NotFinite { index, value: f64::from(action[index]) });
        }
        let is_clipped = action.iter().any(|value| value.abs() > 1.0);
        let value = |index: usize| f64::from(action[index].clamp(-1.0, 1.0));
        let share = if expected == 1 { 1.0 } else { 0.5 * (value(1) + 1.0) };
        Ok((Order::Drive(self.command(value(0), share)), is_clipped))
    }

    /// The command with these shares of the largest curvature and of the control period's distance.
    fn command(&self, curvature: f64, distance: f64) -> Command {
        Command {
            curvature_per_m: curvature * self.max_curvature_per_m,
            distance_m: distance * self.control_distance_m,
        }
    }

    /// The numbers that stand for `command`, cut to one control period; the counterpart of [`ActionDecoder::decode`].
    /// `None` where the action kind has no numbers.
    ///
    /// The distance is rounded up to float32: a planner ends its commands where the sensor looks, and a step that ended a
    /// hair before would leave it without the look.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "actions are float32 by contract")]
    pub fn encode(&self, command: Command) -> Option<Vec<f32>> {
        let curvature =
            (command.curvature_per_m / self.max_curvature_per_m).clamp(-1.0, 1.0) as f32;
        match self.kind {
            ActionKind::Discrete | ActionKind::Target => None,
            ActionKind::Steer => Some(vec![curvature]),
            ActionKind::Drive => {
                let share =
                    2.0 * (command.distance_m / self.control_distance_m).clamp(0.0, 1.0) - 1.0;
                let nearest = share as f32;
                let rounded_up =
                    if f64::from(nearest) < share { nearest.next_up() } else { nearest };
                Some(vec![curvature, rounded_up])
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
