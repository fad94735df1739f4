//! The step, from action to observation.
//!
//! Read [`Env::step`] and, just below it, [`Env::drive_watched`]: one line a phase, in the order of the modules of this crate;
//! deck and sensor look ahead first, and where nothing but ground is to be met the mower drives on at once. Where a weed is
//! mowed is the line of the deck; who may see it, the line of the sensor; what it is worth, the line of the reward.

mod beginning;
mod pursue;
mod setup;
mod snapshot;
mod summary;
mod watch;

pub use beginning::Beginning;
pub(crate) use snapshot::damaged;
pub use snapshot::{SnapshotError, weeds_in};
pub use summary::Summary;
pub use watch::Watch;

use std::slice;
use std::sync::Arc;

use crate::action::{Action, ActionDecoder, ActionError, ActionSpec, Command, Order};
use crate::belief::Belief;
use crate::candidates::Candidates;
use crate::config::{ActionKind, ObservationKind, ValidScenario};
use crate::episode::{End, Episode, Limits};
use crate::fetch::fetch;
use crate::grid::Grid;
use crate::mower::Mower;
use crate::observation::{Memory, ObservationMut, ObservationSpec};
use crate::reward::{RewardTerms, Tally};
use crate::rig::Rig;
use crate::site::Site;
use crate::trajectory::Trace;
use crate::view::View;
use crate::weeds::Weeds;
use beginning::start_pose;
use setup::Setup;

/// One pasture with one mower.
#[derive(Debug, Clone)]
pub struct Env {
    setup: Arc<Setup>,
    limits: Limits,
    mower: Mower,
    episode: Episode,
    belief: Belief,
    weeds: Weeds,
    rig: Box<Rig>,
    memory: Memory,
    seed: u64,
    episodes: u64,
    /// Where the action kind or the observation needs them; apart, since few scenarios do.
    candidates: Option<Box<Candidates>>,
    /// Where pictures are asked for.
    trace: Option<Box<Trace>>,
}

/// What a step brought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// The reward, by its terms.
    pub terms: RewardTerms,
    /// How the episode stands.
    pub end: End,
    /// Weeds mowed in this step.
    pub weeds_mowed: u32,
    /// Way driven in this step, metres.
    pub distance_m: f64,
    /// Whether the action had to be clipped into its range.
    pub is_clipped: bool,
}

impl Env {
    /// An environment that waits for its first reset.
    #[must_use]
    pub fn new(scenario: &ValidScenario) -> Self {
        let site = Site::new(scenario);
        let grid = Grid::new(site.length_m, site.width_m);
        let limits = Limits::new(scenario, &site, grid.cells());
        let candidates = needs_candidates(scenario)
            .then(|| Box::new(Candidates::new(&scenario.action, &site, grid)));
        let grid = Arc::new(grid);
        let setup = Setup::new(scenario, site, limits.budget_m());
        Self {
            limits,
            mower: Mower::at(start_pose(scenario)),
            episode: Episode::unstarted(),
            belief: Belief::new(Arc::clone(&grid)),
            weeds: Weeds::none(grid),
            rig: Box::new(Rig::new(&setup.site)),
            memory: setup.encoder.memory(),
            seed: 0,
            episodes: 0,
            candidates,
            trace: None,
            setup: Arc::new(setup),
        }
    }

    /// Lets episodes run until the agent stops: no budget, no goal, no step limit. The headland still holds.
    pub fn lift_limits(&mut self) {
        self.limits.lift();
    }

    /// Keeps the path from now on, for pictures: [`Env::trace`].
    pub fn keep_trace(&mut self) {
        self.trace = Some(Box::new(Trace::at(self.mower.pose())));
    }

    /// One step of the Gymnasium environment: drives as `action` says, for at most one control period; with the action
    /// kind `target` until the mower arrives or detects something.
    ///
    /// # Errors
    ///
    /// [`ActionError`]; the state is then as it was.
    ///
    /// # Panics
    ///
    /// If `observation` is not one row of [`Env::observation_spec`]; nothing has moved then.
    pub fn step(
        &mut self,
        action: Action,
        observation: ObservationMut,
    ) -> Result<Step, ActionError> {
        observation.check(self.setup.encoder.spec().sizes());
        let (order, is_clipped) = self.setup.decoder.decode(action)?; // action
        let step = match order {
            Order::Drive(command) => Step { is_clipped, ..self.drive(command)? },
            Order::Target(place) => self.pursue(place)?,
        };
        self.observe(observation); // observation
        Ok(step)
    }

    /// Carries out one command, be it a millimetre or a thousand kilometres: the phases of a step between action and observation.
    ///
    /// # Errors
    ///
    /// [`ActionError`]; the state is then as it was.
    pub fn drive(&mut self, command: Command) -> Result<Step, ActionError> {
        self.drive_watched(command, &mut ())
    }

    /// The same, and tells `watch` what every stretch brings.
    ///
    /// # Errors
    ///
    /// As [`Env::drive`].
    pub fn drive_watched<W: Watch>(
        &mut self,
        command: Command,
        watch: &mut W,
    ) -> Result<Step, ActionError> {
        self.episode.check_running()?;
        if let Some(candidates) = &mut self.candidates {
            candidates.expire();
        }
        let command = self.limits.cut(self.setup.decoder.check(command)?, self.mower.path_m());
        let (mut tally, mut is_off_site) = (Tally::default(), false);
        let Rig { deck, sensor } = self.rig.as_mut();
        let mut motion = self.mower.motion(command);
        'motion: while let Some(piece) = motion.next_piece() {
            deck.prepare(&piece, &self.weeds, self.belief.ground());
            sensor.prepare(&piece, &self.weeds, self.belief.ground());
            // Most pieces bring nothing new, or ground alone, of which nobody asks where it was seen: the mower drives on.
            let tells_nothing = sensor.is_idle() || (W::IS_NOBODY && sensor.meets_no_weed());
            if deck.is_idle() && tells_nothing && piece.is_within(&self.setup.site) {
                self.mower.follow_all(&piece);
                tally.has_come(piece.driven_m());
                self.belief.absorb_ground(sensor.seen_ahead());
                continue;
            }
            for stretch in piece.stretches() {
                self.mower.follow(&stretch); // mower
                let cut = deck.mow(&stretch, &mut self.weeds); // deck
                tally.has_come(stretch.driven_m);
                tally.has_mowed(cut.mowed.len());
                watch.on_cut(stretch.path_m, &cut);
                self.belief.absorb_cut(&cut);
                if stretch.ends_at_look {
                    let percept = sensor.look(stretch.index, &mut self.weeds); // sensor
                    watch.on_look(stretch.path_m, &percept);
                    self.belief.absorb_percept(&percept, &self.weeds); // belief
                    is_off_site = !self.setup.site.allows(stretch.end.pose);
                }
                if is_off_site {
                    break 'motion;
                }
            }
        }
        self.mower.rest();
        if let Some(trace) = &mut self.trace {
            trace.follow(command.curvature_per_m, tally.distance_m, self.mower.pose());
        }
        let view = View::new(&self.setup.site, &self.mower, &self.belief);
        let end = self.episode.judge(&view, &self.limits, is_off_site); // end
        tally.forfeit_m = self.limits.forfeit_m(end, view.path_m);
        let terms = RewardTerms::score(&self.setup.reward, &tally); // reward
        let Tally { weeds_mowed, distance_m, .. } = tally;
        Ok(Step { terms, end, weeds_mowed, distance_m, is_clipped: false })
    }

    /// Writes the present observation.
    ///
    /// # Panics
    ///
    /// If `observation` is not one row of [`Env::observation_spec`].
    pub fn observe(&mut self, observation: ObservationMut) {
        let view = View::new(&self.setup.site, &self.mower, &self.belief);
        if let Some(candidates) = &mut self.candidates {
            candidates.refresh(&view);
        }
        let candidates = self.candidates.as_deref();
        self.setup.encoder.encode(&view, candidates, &mut self.memory, observation);
    }

    /// The places that the action kind `target` chooses from now.
    ///
    /// # Panics
    ///
    /// If neither the action kind nor the observation has candidates.
    pub fn candidates(&mut self) -> &Candidates {
        let view = View::new(&self.setup.site, &self.mower, &self.belief);
        let candidates = self.candidates.as_mut().expect("this scenario has candidates");
        candidates.refresh(&view);
        candidates
    }

    /// Writes which of the action's choices are open to `mask`: all of them, but for the action kind `target`.
    ///
    /// # Panics
    ///
    /// If `mask` does not have one place for each choice; continuous kinds have none.
    pub fn action_mask(&mut self, mask: &mut [bool]) {
        let choices = match self.setup.decoder.spec() {
            ActionSpec::Discrete(choices) => choices,
            ActionSpec::Continuous(_) => 0,
        };
        assert_eq!(mask.len(), choices, "the mask has one place for each choice");
        mask.fill(true);
        if self.setup.decoder.kind() == ActionKind::Target {
            for (is_open, row) in mask.iter_mut().zip(self.candidates().rows()) {
                *is_open = row.is_some();
            }
        }
    }

    /// Hands the memory that steps work in to another environment of the same scenario, and takes its own.
    ///
    /// Environments that are stepped in turn hand it on, so that it stays in the cache.
    pub(crate) fn hand_on(&mut self, next: &mut Self) {
        std::mem::swap(&mut self.rig, &mut next.rig);
    }

    /// Asks for what lies within, since a step is to come before long.
    #[inline]
    pub(crate) fn fetch(&self) {
        fetch(slice::from_ref(self));
    }

    /// The same for what lies elsewhere, once [`Env::fetch`] has brought where that is.
    #[inline]
    pub(crate) fn fetch_rest(&self) {
        self.memory.fetch();
    }

    /// All that an agent may know.
    #[must_use]
    pub fn view(&self) -> View<'_> {
        View::new(&self.setup.site, &self.mower, &self.belief)
    }

    /// The scenario that the environment was made for.
    #[must_use]
    pub fn scenario(&self) -> &ValidScenario {
        &self.setup.scenario
    }

    /// The scenario's public numbers.
    #[must_use]
    pub fn site(&self) -> &Site {
        &self.setup.site
    }

    /// How actions are read, and how commands become actions.
    #[must_use]
    pub fn decoder(&self) -> &ActionDecoder {
        &self.setup.decoder
    }

    /// The parts of an observation.
    #[must_use]
    pub fn observation_spec(&self) -> &ObservationSpec {
        self.setup.encoder.spec()
    }

    /// How the episode stands; `None` before the first reset.
    #[must_use]
    pub fn end(&self) -> Option<End> {
        self.episode.end()
    }

    /// The path driven since the episode began or was restored; `None` unless it is kept.
    #[must_use]
    pub fn trace(&self) -> Option<&Trace> {
        self.trace.as_deref()
    }

    /// The truth about the weeds. Agents never see it.
    #[must_use]
    pub fn weeds(&self) -> &Weeds {
        &self.weeds
    }
}

fn needs_candidates(scenario: &ValidScenario) -> bool {
    scenario.action.kind == ActionKind::Target
        || matches!(scenario.observation.kind, ObservationKind::Candidates | ObservationKind::Dict)
}
