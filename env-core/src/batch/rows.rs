//! The rows of a batch on their way through one step, cut in two as often as threads want.

use super::buffers::{Actions, StepMut};
use super::{Autoreset, Last, State};
use crate::env::{Beginning, Env};
use crate::episode::End;
use crate::observation::{ObservationMut, Sizes};

/// What is the same for every row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Form {
    pub(super) autoreset: Autoreset,
    /// How many numbers an action has.
    pub(super) width: usize,
    /// Sizes of an observation.
    pub(super) sizes: Sizes,
    /// Sizes of a last observation: nothing where a row does not begin anew in the step that ends it.
    pub(super) last_sizes: Sizes,
    /// Places of a row's action mask: none but for the action kind `target`.
    pub(super) choices: usize,
    /// The same where rows that end keep their last one.
    pub(super) last_choices: usize,
    /// Fewer rows are not shared between threads.
    pub(super) rows_a_task: usize,
    /// Whether the next rows are fetched while one is stepped.
    pub(super) is_fetched: bool,
}

/// Some neighbouring rows: their environments, what goes in, and where it comes out.
pub(super) struct Rows<'a> {
    pub(super) envs: &'a mut [Env],
    pub(super) states: &'a mut [State],
    pub(super) last: &'a mut [Option<Last>],
    pub(super) last_observation: ObservationMut<'a>,
    pub(super) last_mask: &'a mut [bool],
    pub(super) actions: Actions<'a>,
    pub(super) out: StepMut<'a>,
}

impl Rows<'_> {
    /// Steps every row, sharing them with other threads of the present pool. Returns how many ended.
    pub(super) fn step_shared(self, form: Form) -> usize {
        let middle = self.envs.len() / 2;
        if middle < form.rows_a_task {
            return self.step(form);
        }
        let (first, rest) = self.split_at(middle, form);
        let (ended, more) = rayon::join(|| first.step_shared(form), || rest.step_shared(form));
        ended + more
    }

    /// Steps every row. Returns how many ended.
    pub(super) fn step(self, form: Form) -> usize {
        let Self { envs, states, last, mut last_observation, last_mask, actions, mut out } = self;
        let mut observations = std::mem::take(&mut out.observation);
        // Said here once, the lengths need no check at every row.
        let (last, mut out) = (&mut last[..envs.len()], out.first(envs.len()));
        let mut ended = 0;
        for row in 0..envs.len() {
            let (before, from_here) = envs.split_at_mut(row);
            if form.is_fetched {
                from_here.get(2).into_iter().for_each(Env::fetch);
                from_here.get(1).into_iter().for_each(Env::fetch_rest);
            }
            let (env, state) = (&mut from_here[0], &mut states[row]);
            if let Some(last) = before.last_mut() {
                last.hand_on(env);
            }
            let (mut observation, rest) = observations.split_at(1, form.sizes);
            observations = rest;
            if *state == State::Ended {
                env.reset_next(Beginning::default());
                env.observe(observation);
                *state = State::Running;
                (out.reward[row], out.terminated[row], out.truncated[row]) = (0.0, false, false);
                out.write_begun(row);
                write_mask(env, out.action_mask, row, form.choices);
                continue;
            }
            let step = env
                .step(actions.row(row, form.width), observation.reborrow())
                .expect("states and actions were checked before any row moved");
            out.write(row, &step);
            write_mask(env, out.action_mask, row, form.choices);
            let (End::Terminated(outcome) | End::Truncated(outcome)) = step.end else { continue };
            ended += 1;
            last[row] = Some(Last {
                terms: step.terms,
                is_clipped: step.is_clipped,
                distance_m: step.distance_m,
                summary: env.summary(),
                outcome,
            });
            if form.autoreset == Autoreset::SameStep {
                let (_, from_here) = last_observation.reborrow().split_at(row, form.last_sizes);
                env.observe(from_here.split_at(1, form.last_sizes).0);
                write_mask(env, last_mask, row, form.last_choices);
                env.reset_next(Beginning::default());
                env.observe(observation);
                out.write_begun(row);
                write_mask(env, out.action_mask, row, form.choices);
            } else {
                *state = State::Ended;
            }
        }
        ended
    }

    fn split_at(self, rows: usize, form: Form) -> (Self, Self) {
        let (envs, more_envs) = self.envs.split_at_mut(rows);
        let (states, more_states) = self.states.split_at_mut(rows);
        let (last, more_last) = self.last.split_at_mut(rows);
        let (last_observation, more_last_observations) =
            self.last_observation.split_at(rows, form.last_sizes);
        let (actions, more_actions) = self.actions.split_at(rows, form.width);
        let (last_mask, more_last_masks) = self.last_mask.split_at_mut(rows * form.last_choices);
        let (out, more_out) = self.out.split_at(rows, form.sizes, form.choices);
        let rest = Self {
            envs: more_envs,
            states: more_states,
            last: more_last,
            last_observation: more_last_observations,
            last_mask: more_last_masks,
            actions: more_actions,
            out: more_out,
        };
        (Self { envs, states, last, last_observation, last_mask, actions, out }, rest)
    }
}

/// Writes a row's action mask, where there are any.
fn write_mask(env: &mut Env, masks: &mut [bool], row: usize, choices: usize) {
    if choices > 0 {
        env.action_mask(&mut masks[row * choices..(row + 1) * choices]);
    }
}
