//! Many environments of one scenario, stepped together.
//!
//! A row of a batch is an [`Env`] like any other: row i of a batch seeded s is the environment seeded s + i, whatever the
//! number of rows and of threads. A step writes into contiguous buffers of the caller's, and nothing moves unless every
//! action can be carried out.

mod buffers;
mod rows;
mod snapshot;

use rayon::{ThreadPool, ThreadPoolBuilder};

pub use buffers::{Actions, StepMut};
pub use snapshot::{joined, split};

use crate::action::{ActionDecoder, ActionError, ActionSpec};
use crate::config::{ActionKind, ConfigError, ValidScenario};
use crate::env::{Beginning, Env, Summary};
use crate::episode::{End, Outcome};
use crate::observation::{Observation, ObservationMut, ObservationSpec, Sizes};
use crate::reward::RewardTerms;
use rows::{Form, Rows};

/// When a row whose episode ended begins the next episode of its seed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Autoreset {
    /// In the step after, which ignores its action and has reward 0.
    NextStep,
    /// In the step that ends it; its last observation is kept apart.
    SameStep,
    /// When it is told to. A step before that is an error.
    Disabled,
}

/// What a batch is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BatchOptions {
    /// Number of environments, at least 1.
    pub rows: usize,
    /// When ended rows begin anew.
    pub autoreset: Autoreset,
    /// Most threads that a step may use; 0 counts as 1. With 1, for few rows, and in a process that was forked since, a step
    /// runs on the caller's thread.
    pub threads: usize,
}

/// The end of a row's episode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Last {
    /// Terms of the last reward.
    pub terms: RewardTerms,
    /// Whether the last action was clipped.
    pub is_clipped: bool,
    /// Way driven in the last step, metres.
    pub distance_m: f64,
    /// The numbers of the episode.
    pub summary: Summary,
    /// Why it ended.
    pub outcome: Outcome,
}

/// A step that cannot be taken; every row is as it was.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum BatchError {
    /// One row cannot take it.
    #[error("row {row}: {error}")]
    Row {
        /// Which row.
        row: usize,
        /// Why.
        error: ActionError,
    },
    /// Actions for another number of rows.
    #[error("`actions` must have {expected} number(s), got {got}")]
    Size {
        /// How many all rows take.
        expected: usize,
        /// How many were given.
        got: usize,
    },
}

/// Whether a row can be stepped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Unstarted,
    Running,
    Ended,
}

impl State {
    fn of(env: &Env) -> Self {
        match env.end() {
            None => Self::Unstarted,
            Some(End::Running) => Self::Running,
            Some(_) => Self::Ended,
        }
    }
}

/// Environments of one scenario, one a row.
#[derive(Debug)]
pub struct BatchEnv {
    envs: Vec<Env>,
    /// Kept apart from the environments, so that looking through all of them is cheap.
    states: Vec<State>,
    last: Vec<Option<Last>>,
    last_observation: Observation,
    last_mask: Vec<bool>,
    decoder: ActionDecoder,
    form: Form,
    pool: Option<Pool>,
}

/// Threads, and the process that has them: one forked from it has none.
#[derive(Debug)]
struct Pool {
    threads: ThreadPool,
    process: u32,
}

/// Rows that are worth a task of their own: to hand one to another thread takes as long as a few steps.
const ROWS_A_TASK: usize = 64;

/// The same where observations hold maps, which take most of a step.
const MAP_ROWS_A_TASK: usize = 4;

/// From so many rows on, the next ones are fetched while one is stepped. A step touches about 2 KiB of its row: fewer rows
/// stay in a second-level cache from one step to the next.
const FETCHED_ROWS: usize = 1024;

impl BatchEnv {
    /// A batch that waits for its first reset.
    ///
    /// # Errors
    ///
    /// [`ConfigError::Value`] if the system cannot start so many threads.
    pub fn new(scenario: &ValidScenario, options: BatchOptions) -> Result<Self, ConfigError> {
        let BatchOptions { rows, autoreset, threads } = options;
        let env = Env::new(scenario);
        let spec = env.observation_spec();
        let sizes = spec.sizes();
        let is_same_step = autoreset == Autoreset::SameStep;
        let last_observation = spec.rows(if is_same_step { rows } else { 0 });
        let decoder = *env.decoder();
        let choices = match decoder.spec() {
            ActionSpec::Discrete(choices) if decoder.kind() == ActionKind::Target => choices,
            _ => 0,
        };
        let last_choices = if is_same_step { choices } else { 0 };
        let form = Form {
            autoreset,
            width: buffers::width(&decoder),
            sizes,
            last_sizes: if is_same_step { sizes } else { Sizes::default() },
            choices,
            last_choices,
            rows_a_task: if sizes.maps > 0 { MAP_ROWS_A_TASK } else { ROWS_A_TASK },
            is_fetched: rows >= FETCHED_ROWS,
        };
        let threads = threads.min(rows / form.rows_a_task);
        let pool = (threads > 1).then(|| {
            ThreadPoolBuilder::new()
                .num_threads(threads)
                .thread_name(|thread| format!("swath-batch-{thread}"))
                .build()
        });
        let pool = pool.transpose().map_err(|_| {
            ConfigError::value("num_threads", "as many as the system can start", options.threads)
        })?;
        Ok(Self {
            envs: vec![env; rows],
            states: vec![State::Unstarted; rows],
            last: vec![None; rows],
            last_observation,
            last_mask: vec![false; rows * last_choices],
            decoder,
            form,
            pool: pool.map(|threads| Pool { threads, process: std::process::id() }),
        })
    }

    /// Keeps the path of every row from now on, for pictures: [`Env::trace`].
    pub fn keep_traces(&mut self) {
        self.envs.iter_mut().for_each(Env::keep_trace);
    }

    /// Begins episode 0 of `seed` + i in every row i. Seeds go around at the end of their range.
    pub fn reset(&mut self, seed: u64) {
        for (row, ahead) in (0..self.envs.len()).zip(0..) {
            self.reset_row(row, Some(seed.wrapping_add(ahead)), Beginning::default());
        }
    }

    /// Begins an episode in one row: episode 0 of `seed`, or the next one of the row's own seed.
    ///
    /// # Panics
    ///
    /// As [`Env::reset_from`]; if there is no such row; without a seed, if the row never had one.
    pub fn reset_row(&mut self, row: usize, seed: Option<u64>, beginning: Beginning) {
        if let Some(seed) = seed {
            self.envs[row].reset_from(seed, beginning);
        } else {
            assert!(self.has_begun(row), "the first reset of a row needs a seed");
            self.envs[row].reset_next(beginning);
        }
        self.states[row] = State::Running;
    }

    /// Steps every row. Returns how many episodes ended.
    ///
    /// It allocates nothing, unless a pool of threads does, or rows have episodes of very different numbers of weeds: then
    /// the memory that they hand on to each other may have to grow once.
    ///
    /// # Errors
    ///
    /// [`BatchError`]; no row has moved then.
    ///
    /// # Panics
    ///
    /// If a buffer of `out` has another number of rows; no row has moved then.
    pub fn step(&mut self, actions: Actions, out: StepMut) -> Result<usize, BatchError> {
        out.check(self.envs.len(), self.form.choices);
        self.check_observation(&out.observation);
        self.check(actions)?;
        let Self { envs, states, last, last_observation, last_mask, form, pool, .. } = self;
        let last_observation = last_observation.as_mut();
        let rows = Rows { envs, states, last, last_observation, last_mask, actions, out };
        Ok(match pool {
            Some(pool) if pool.process == std::process::id() => {
                pool.threads.install(|| rows.step_shared(*form))
            }
            _ => rows.step(*form),
        })
    }

    fn check(&self, actions: Actions) -> Result<(), BatchError> {
        let (width, rows) = (self.form.width, self.envs.len());
        if actions.len() != rows * width {
            return Err(BatchError::Size { expected: rows * width, got: actions.len() });
        }
        // Where numbers are wanted, that is all they can have wrong, and it is seen at once.
        let (are_of_kind, are_fine) = match (self.decoder.spec(), actions) {
            (ActionSpec::Continuous(_), Actions::Continuous(numbers)) => {
                (true, numbers.iter().fold(true, |all, number| all & number.is_finite()))
            }
            (ActionSpec::Discrete(_), Actions::Discrete(_)) => (true, false),
            _ => (false, false),
        };
        for (row, state) in self.states.iter().enumerate() {
            let error = match state {
                State::Unstarted => Err(ActionError::NotReset),
                State::Ended if self.form.autoreset != Autoreset::NextStep => {
                    Err(ActionError::EpisodeOver)
                }
                // Its action is ignored, but it has to be of the right kind.
                State::Ended if are_of_kind => Ok(()),
                _ if are_fine => Ok(()),
                _ => self.decoder.decode(actions.row(row, width)).map(|_| ()),
            };
            error.map_err(|error| BatchError::Row { row, error })?;
        }
        Ok(())
    }

    /// Writes the present observation of every row.
    ///
    /// # Panics
    ///
    /// If `observation` has another number of rows.
    pub fn observe(&mut self, observation: ObservationMut) {
        self.check_observation(&observation);
        let mut observations = observation;
        for env in &mut self.envs {
            let (observation, rest) = observations.split_at(1, self.form.sizes);
            observations = rest;
            env.observe(observation);
        }
    }

    fn check_observation(&self, observation: &ObservationMut) {
        let (rows, Sizes { features, candidates, action_mask, maps }) =
            (self.envs.len(), self.form.sizes);
        let expected = [features, candidates, action_mask, maps].map(|size| rows * size);
        let got = [
            observation.features.len(),
            observation.candidates.len(),
            observation.action_mask.len(),
            observation.maps.len(),
        ];
        assert_eq!(got, expected, "the observation buffer has the wrong length");
    }

    /// Places of a row's action mask: as many as choices for the action kind `target`, none for the others.
    #[must_use]
    pub fn mask_width(&self) -> usize {
        self.form.choices
    }

    /// Writes which choices are open in every row that has begun an episode; nothing in the others.
    ///
    /// # Panics
    ///
    /// If `masks` does not have a place for each choice of each row; continuous kinds have none.
    pub fn action_masks(&mut self, masks: &mut [bool]) {
        let choices = match self.decoder.spec() {
            ActionSpec::Discrete(choices) => choices,
            ActionSpec::Continuous(_) => 0,
        };
        assert_eq!(masks.len(), self.envs.len() * choices, "the buffer has the wrong length");
        for ((env, state), mask) in
            self.envs.iter_mut().zip(&self.states).zip(masks.chunks_exact_mut(choices.max(1)))
        {
            if *state != State::Unstarted {
                env.action_mask(mask);
            }
        }
    }

    /// How a row's latest episode to end ended; `None` if none has.
    ///
    /// # Panics
    ///
    /// If there is no such row.
    #[must_use]
    pub fn last(&self, row: usize) -> Option<&Last> {
        self.last[row].as_ref()
    }

    /// The last observation of every row's latest episode to end; without rows where it is the one that the step wrote.
    #[must_use]
    pub fn last_observation(&self) -> &Observation {
        &self.last_observation
    }

    /// Whether an episode of this row has begun.
    ///
    /// # Panics
    ///
    /// If there is no such row.
    #[must_use]
    pub fn has_begun(&self, row: usize) -> bool {
        self.states[row] != State::Unstarted
    }

    /// The environments, one a row.
    #[must_use]
    pub fn rows(&self) -> &[Env] {
        &self.envs
    }

    /// The action mask at the end of every row's latest episode to end, kept as long as its last observation.
    #[must_use]
    pub fn last_masks(&self) -> &[bool] {
        &self.last_mask
    }

    /// The parts of an observation.
    ///
    /// # Panics
    ///
    /// If the batch has no rows.
    #[must_use]
    pub fn observation_spec(&self) -> &ObservationSpec {
        self.envs[0].observation_spec()
    }

    /// How actions are read.
    #[must_use]
    pub fn decoder(&self) -> &ActionDecoder {
        &self.decoder
    }
}
