//! One episode, from reset to the agent's own stop.

use swath_core::action::{Command, MAX_DISTANCE_M};
use swath_core::config::ValidScenario;
use swath_core::env::{Beginning, Env, Summary, Watch};
use swath_core::episode::{End, Outcome};
use swath_core::geometry::{Arc, Point};
use swath_core::trajectory::Trajectory;
use swath_core::weeds::Weeds;

use crate::agent::{Agent, Decision};
use crate::registry::AgentSpec;
use crate::timeline::{Log, Timeline};

/// Decisions in a row that move nothing after which an agent is broken.
const MOTIONLESS_DECISIONS: u32 = 10_000;

/// An episode that is over.
#[derive(Debug, Clone)]
pub struct EpisodeResult {
    /// Its numbers.
    pub summary: Summary,
    /// Why it ended.
    pub outcome: Outcome,
    /// The path that the mower took.
    pub trajectory: Trajectory,
    /// The weeds, and which of them were detected and mowed.
    pub weeds: Weeds,
    /// When they were, and when the ground was seen.
    pub timeline: Timeline,
}

/// Runs an agent on the instance `seed` of a scenario until it stops, whatever budget and goal the scenario has.
///
/// `weeds` replaces the instance's own weeds; world frame, metres.
#[must_use]
pub fn run_episode(
    scenario: &ValidScenario,
    agent: &AgentSpec,
    seed: u64,
    weeds: Option<&[Point]>,
) -> EpisodeResult {
    let mut env = Env::new(scenario);
    let mut agent = built(agent, &mut env, seed, weeds);
    let (mut trajectory, mut log) = (Trajectory::default(), Log::default());
    let record = |motion| trajectory.push(motion);
    let outcome = run_watched(&mut env, agent.as_mut(), seed, weeds, record, &mut log);
    let timeline = log.timeline(&env);
    let (summary, weeds) = (env.summary(), env.weeds().clone());
    EpisodeResult { summary, outcome, trajectory, weeds, timeline }
}

/// Runs an agent on the instance `seed` of a scenario and keeps its numbers only.
#[must_use]
pub fn run_summary(scenario: &ValidScenario, agent: &AgentSpec, seed: u64) -> (Summary, Outcome) {
    let mut env = Env::new(scenario);
    let mut agent = built(agent, &mut env, seed, None);
    let outcome = run_agent(&mut env, agent.as_mut(), seed, None, |_| ());
    (env.summary(), outcome)
}

/// The agent; a yardstick is told the weeds of the instance, which is drawn for that.
fn built(agent: &AgentSpec, env: &mut Env, seed: u64, weeds: Option<&[Point]>) -> Box<dyn Agent> {
    if agent.is_online() {
        return agent.build(seed);
    }
    env.reset_from(seed, Beginning { weeds, start: None });
    agent.build_for(seed, env.weeds().positions())
}

/// Runs an agent on the instance `seed` of a fresh environment until it stops; `record` is told every arc driven.
pub fn run_agent(
    env: &mut Env,
    agent: &mut dyn Agent,
    seed: u64,
    weeds: Option<&[Point]>,
    record: impl FnMut(Arc),
) -> Outcome {
    run_watched(env, agent, seed, weeds, record, &mut ())
}

/// The same, and tells `watch` what every stretch of the path brings.
pub fn run_watched(
    env: &mut Env,
    agent: &mut dyn Agent,
    seed: u64,
    weeds: Option<&[Point]>,
    mut record: impl FnMut(Arc),
    watch: &mut impl Watch,
) -> Outcome {
    env.lift_limits();
    env.reset_from(seed, Beginning { weeds, start: agent.start(env.site()) });
    agent.reset(&env.view());
    let mut motionless = 0;
    loop {
        let command = match agent.act(&env.view()) {
            Decision::Drive(command) => command,
            Decision::Done => return Outcome::Done,
            Decision::Capped => return Outcome::Capped,
        };
        // A planner notices that a command was cut, as it does where the mower is driven by control periods.
        let distance_m = command.distance_m.min(MAX_DISTANCE_M);
        let start = env.view().pose;
        let step = env
            .drive_watched(Command { distance_m, ..command }, watch)
            .expect("planners give commands that the mower can drive");
        record(Arc { start, curvature_per_m: command.curvature_per_m, length_m: step.distance_m });
        motionless = if step.distance_m > 0.0 { 0 } else { motionless + 1 };
        assert!(motionless < MOTIONLESS_DECISIONS, "an agent must move or stop");
        if let End::Terminated(outcome) | End::Truncated(outcome) = step.end {
            return outcome;
        }
    }
}
