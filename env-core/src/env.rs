//! The step, from action to observation.
//!
//! Read [`Env::step`]: one line a phase, in the order of the modules of this crate. Where a weed is mowed is the line of
//! the deck; who may see it, the line of the sensor; what it is worth, the line of the reward.

mod snapshot;
mod summary;

pub use snapshot::SnapshotError;
pub use summary::Summary;

use crate::action::{Action, ActionDecoder, ActionError, Command};
use crate::belief::Belief;
use crate::config::{NamedStart, Start, ValidScenario};
use crate::deck::Deck;
use crate::episode::{End, Episode, Limits};
use crate::geometry::{Point, Pose};
use crate::grid::Grid;
use crate::mower::Mower;
use crate::observation::{Encoder, ObservationMut, ObservationSpec};
use crate::reward::{RewardTerms, Tally};
use crate::rng::{self, Stream};
use crate::sensor::Sensor;
use crate::site::Site;
use crate::view::View;
use crate::weeds::{self, Weeds};

/// One pasture with one mower.
#[derive(Debug, Clone)]
pub struct Env {
    scenario: ValidScenario,
    scenario_hash: [u8; 32],
    site: Site,
    decoder: ActionDecoder,
    limits: Limits,
    encoder: Encoder,
    seed: u64,
    episodes: u64,
    weeds: Weeds,
    mower: Mower,
    deck: Deck,
    sensor: Sensor,
    belief: Belief,
    episode: Episode,
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

/// Where and among which weeds an episode begins, where that is not left to the scenario.
///
/// Fronts check what comes from outside: weeds off the pasture and a start off the headland are refused by a panic.
#[derive(Debug, Clone, Copy, Default)]
pub struct Beginning<'a> {
    /// The weeds, instead of drawing them; world frame, metres.
    pub weeds: Option<&'a [Point]>,
    /// The mower's pose, instead of the scenario's start.
    pub start: Option<Pose>,
}

impl Env {
    /// An environment that waits for its first reset.
    #[must_use]
    pub fn new(scenario: &ValidScenario) -> Self {
        let site = Site::new(scenario);
        let grid = Grid::new(site.length_m, site.width_m);
        let limits = Limits::new(scenario, &site, grid.cells());
        Self {
            scenario: scenario.clone(),
            scenario_hash: scenario.hash(),
            site,
            decoder: ActionDecoder::new(scenario),
            limits,
            encoder: Encoder::new(scenario, limits.budget_m()),
            seed: 0,
            episodes: 0,
            weeds: Weeds::none(grid),
            mower: Mower::at(start_pose(scenario)),
            deck: Deck::new(site.deck_width_m),
            sensor: Sensor::new(site.sensor_range_m, site.sensor_width_m),
            belief: Belief::new(grid),
            episode: Episode::unstarted(),
        }
    }

    /// Lets episodes run until the agent stops: no budget, no goal, no step limit. The headland still holds.
    pub fn lift_limits(&mut self) {
        self.limits.lift();
    }

    /// Begins episode 0 of `seed`.
    pub fn reset(&mut self, seed: u64) {
        self.reset_from(seed, Beginning::default());
    }

    /// Begins episode 0 of `seed` with weeds or a start pose of the caller's.
    ///
    /// # Panics
    ///
    /// If a weed of `beginning` is not on the pasture, or its start not on the pasture or its headland.
    pub fn reset_from(&mut self, seed: u64, beginning: Beginning) {
        self.seed = seed;
        self.episodes = 0;
        self.begin(beginning);
    }

    /// Begins the next episode of the present seed.
    ///
    /// # Panics
    ///
    /// As [`Env::reset_from`].
    pub fn reset_next(&mut self, beginning: Beginning) {
        self.begin(beginning);
    }

    fn begin(&mut self, beginning: Beginning) {
        let Beginning { weeds: given, start } = beginning;
        let site = &self.site;
        assert!(
            given.into_iter().flatten().all(|weed| site.holds(weed.x, weed.y)),
            "weeds stand on the pasture"
        );
        assert!(
            start.is_none_or(|start| site.allows(start)),
            "the mower starts on the pasture or its headland"
        );
        let seed = rng::episode_seed(self.seed, self.episodes);
        self.episodes += 1;
        let Self { scenario, weeds, .. } = self;
        weeds.plant(|planted| match given {
            Some(given) => planted.extend_from_slice(given),
            None => weeds::draw(
                &scenario.weeds,
                &scenario.pasture,
                planted,
                &mut rng::stream(seed, Stream::Weeds),
            ),
        });
        self.belief.clear();
        self.reserve();
        self.encoder.reset();
        self.episode = Episode::started();
        self.mower = Mower::at(start.unwrap_or_else(|| start_pose(&self.scenario)));
        let Self { sensor, mower, weeds, belief, .. } = self;
        let percept = sensor.look_around(mower.frame(), weeds, belief.ground());
        self.belief.absorb_percept(&percept, &self.weeds);
    }

    /// Makes room for whatever an episode may bring, so that its steps allocate nothing.
    fn reserve(&mut self) {
        self.belief.reserve(self.weeds.positions().len());
        self.deck.reserve(&self.weeds);
        self.sensor.reserve(&self.weeds);
    }

    /// One step of the Gymnasium environment: drives as `action` says, for at most one control period.
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
        observation.check(self.encoder.spec().sizes());
        let (command, is_clipped) = self.decoder.decode(action)?; // action
        let step = self.drive(command)?;
        self.observe(observation); // observation
        Ok(Step { is_clipped, ..step })
    }

    /// Carries out one command of any length: the phases of a step between action and observation.
    ///
    /// # Errors
    ///
    /// [`ActionError`]; the state is then as it was.
    pub fn drive(&mut self, command: Command) -> Result<Step, ActionError> {
        self.episode.check_running()?;
        let command = self.limits.cut(self.decoder.check(command)?, self.mower.path_m());
        let (mut tally, mut is_off_site) = (Tally::default(), false);
        let mut motion = self.mower.motion(command);
        'motion: while let Some(piece) = motion.next_piece() {
            self.deck.prepare(piece, &self.weeds, self.belief.ground());
            self.sensor.prepare(piece, &self.weeds, self.belief.ground());
            for stretch in piece.stretches() {
                self.mower.follow(&stretch); // mower
                let cut = self.deck.mow(&stretch, &mut self.weeds); // deck
                tally.add(stretch.length_m, cut.mowed.len());
                self.belief.absorb_cut(&cut);
                if stretch.ends_at_look {
                    let percept = self.sensor.look(&stretch.end, &mut self.weeds); // sensor
                    self.belief.absorb_percept(&percept, &self.weeds); // belief
                    is_off_site = !self.site.allows(stretch.end.pose);
                }
                if is_off_site {
                    break 'motion;
                }
            }
        }
        self.mower.rest();
        let view = View::new(&self.site, &self.mower, &self.belief);
        let end = self.episode.judge(&view, &self.limits, is_off_site); // end
        tally.forfeit_m = self.limits.forfeit_m(end, view.path_m);
        let terms = RewardTerms::score(&self.scenario.reward, &tally); // reward
        let Tally { weeds_mowed, distance_m, .. } = tally;
        Ok(Step { terms, end, weeds_mowed, distance_m, is_clipped: false })
    }

    /// Writes the present observation.
    ///
    /// # Panics
    ///
    /// If `observation` is not one row of [`Env::observation_spec`].
    pub fn observe(&mut self, observation: ObservationMut) {
        let view = View::new(&self.site, &self.mower, &self.belief);
        self.encoder.encode(&view, observation);
    }

    /// All that an agent may know.
    #[must_use]
    pub fn view(&self) -> View<'_> {
        View::new(&self.site, &self.mower, &self.belief)
    }

    /// The scenario that the environment was made for.
    #[must_use]
    pub fn scenario(&self) -> &ValidScenario {
        &self.scenario
    }

    /// The scenario's public numbers.
    #[must_use]
    pub fn site(&self) -> &Site {
        &self.site
    }

    /// How actions are read, and how commands become actions.
    #[must_use]
    pub fn decoder(&self) -> &ActionDecoder {
        &self.decoder
    }

    /// The parts of an observation.
    #[must_use]
    pub fn observation_spec(&self) -> &ObservationSpec {
        self.encoder.spec()
    }

    /// How the episode stands; `None` before the first reset.
    #[must_use]
    pub fn end(&self) -> Option<End> {
        self.episode.end()
    }

    /// The truth about the weeds. Agents never see it.
    #[must_use]
    pub fn weeds(&self) -> &Weeds {
        &self.weeds
    }
}

fn start_pose(scenario: &ValidScenario) -> Pose {
    match scenario.mower.start {
        Start::Named(NamedStart::Corner) => Pose::new(0.0, 0.5 * scenario.mower.deck_width_m, 0.0),
        Start::Named(NamedStart::Centre) => {
            Pose::new(0.5 * scenario.pasture.length_m, 0.5 * scenario.pasture.width_m, 0.0)
        }
        Start::Pose([x_m, y_m, heading_rad]) => Pose::new(x_m, y_m, heading_rad),
    }
}
