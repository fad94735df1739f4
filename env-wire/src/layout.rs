//! Which tables the messages of a batch hold.

use swath_core::action::{ActionDecoder, ActionSpec};
use swath_core::batch::BatchEnv;
use swath_core::config::ActionKind;
use swath_core::episode::Outcome;
use swath_core::observation::{self, ObservationSpec};

use crate::header::HEADER_BYTES;
use crate::leaf::{Dtype, Leaf};

/// Every outcome, in the order of the numbers that stand for them.
pub const OUTCOMES: [Outcome; 6] = [
    Outcome::Done,
    Outcome::Goal,
    Outcome::Budget,
    Outcome::StepLimit,
    Outcome::Capped,
    Outcome::LeftHeadland,
];

const ACTION_MASK: &str = "action_mask";

/// The tables of a batch of `swath/MowerRouting-v0`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    /// The parts of an observation.
    pub observation: Vec<Leaf>,
    /// The one table of an action.
    pub action: Vec<Leaf>,
    /// Every info: the terms of the reward, whether the action was clipped, and with the action kind `target` the way driven
    /// and the action mask. Without infos, the action mask alone: what is not open cannot be chosen.
    pub info: Vec<Leaf>,
    /// What is said of an episode that ended: its last info, then its numbers.
    pub ended: Vec<Leaf>,
}

impl Layout {
    /// The tables of a batch, with infos or without.
    #[must_use]
    pub fn of(batch: &BatchEnv, infos: bool) -> Self {
        let mut info = info(batch.decoder());
        let summary = [
            ("path_length_m", Dtype::F64),
            ("bcp_length_m", Dtype::F64),
            ("seen_fraction", Dtype::F64),
            ("weeds_total", Dtype::I64),
            ("weeds_detected", Dtype::I64),
            ("weeds_mowed", Dtype::I64),
            ("outcome", Dtype::U8),
        ];
        let summary = summary.map(|(name, dtype)| Leaf::new(name, dtype, &[]));
        let ended = info.iter().cloned().chain(summary).collect();
        if !infos {
            info.retain(|leaf| leaf.name == ACTION_MASK);
        }
        Self {
            observation: observation(batch.observation_spec()),
            action: vec![action(batch.decoder())],
            info,
            ended,
        }
    }

    /// Longest reply to a step of so many environments, without a percept, bytes: header, lengths, and what every row may have
    /// twice.
    #[must_use]
    pub fn longest_reply(&self, num_envs: usize) -> usize {
        let row = |leaves: &[Leaf]| -> usize {
            leaves.iter().map(|leaf| leaf.row_bytes().unwrap_or(usize::MAX / 8)).sum()
        };
        let (observation, info, ended) =
            (row(&self.observation), row(&self.info), row(&self.ended));
        // Reward, two flags and the place of an episode that ended.
        let in_row = 2 * observation + info + ended + 8 + 2 + 4;
        let tables = 2 * self.observation.len() + self.info.len() + self.ended.len() + 8;
        in_row.saturating_mul(num_envs).saturating_add(HEADER_BYTES + 8 * tables + 18)
    }
}

fn shape(shape: &[usize]) -> Vec<u32> {
    shape.iter().map(|&side| u32::try_from(side).expect("observations are small")).collect()
}

fn observation(spec: &ObservationSpec) -> Vec<Leaf> {
    let leaf = |part: &observation::Part| {
        let dtype = match part.dtype {
            observation::Dtype::Float32 => Dtype::F32,
            observation::Dtype::Int8 => Dtype::I8,
            observation::Dtype::Uint8 => Dtype::U8,
        };
        Leaf::new(part.name, dtype, &shape(&part.shape))
    };
    spec.parts().iter().map(leaf).collect()
}

fn action(decoder: &ActionDecoder) -> Leaf {
    match decoder.spec() {
        ActionSpec::Continuous(bounds) => Leaf::new("action", Dtype::F32, &shape(&[bounds.len()])),
        ActionSpec::Discrete(_) => Leaf::new("action", Dtype::I64, &[]),
    }
}

fn info(decoder: &ActionDecoder) -> Vec<Leaf> {
    let mut info = vec![
        Leaf::new("reward_terms/weed", Dtype::F64, &[]),
        Leaf::new("reward_terms/path", Dtype::F64, &[]),
        Leaf::new("reward_terms/failure", Dtype::F64, &[]),
        Leaf::new("action_clipped", Dtype::Bool, &[]),
    ];
    if decoder.kind() == ActionKind::Target
        && let ActionSpec::Discrete(choices) = decoder.spec()
    {
        info.push(Leaf::new("elapsed_m", Dtype::F64, &[]));
        info.push(Leaf::new(ACTION_MASK, Dtype::Bool, &shape(&[choices])));
    }
    info
}
