//! What the benchmarks of swath measure: fixed environments, and fixed actions for them.

use swath_agents::agent::{Agent, Decision};
use swath_agents::registry::AgentSpec;
use swath_core::action::Action;
use swath_core::config::{Document, ValidScenario};
use swath_core::env::Env;
use swath_core::observation::Observation;

/// The seed of every fixed episode.
pub const SEED: u64 = 7;

/// Steps once round a circle of four times the smallest radius.
const WIDE_LAP_STEPS: usize = 101;
/// Steps on a circle that bring nothing new once the ground round it is known.
pub const KNOWN_STEPS: usize = 200;

/// The scenario with the defaults and the keys of `toml` over them.
#[must_use]
pub fn scenario(toml: &str) -> ValidScenario {
    let mut document = Document::empty("benchmark");
    document.overlay(toml.parse().expect("this is TOML"));
    document.scenario().expect("the scenario is valid")
}

/// An environment at the beginning of an episode, and memory for one observation.
#[must_use]
pub fn begun(toml: &str) -> (Env, Observation) {
    begun_with(SEED, toml)
}

/// The same for a seed.
fn begun_with(seed: u64, toml: &str) -> (Env, Observation) {
    let mut env = Env::new(&scenario(toml));
    env.reset(seed);
    let observation = env.observation_spec().rows(1);
    (env, observation)
}

/// An environment whose mower has looked round from two very wide circles, and has gone round another one, of so many times
/// the tightest circle's curvature, until nothing is left to mow there and all that can be seen from it is known: its next
/// [`KNOWN_STEPS`] steps on that circle bring nothing new.
#[must_use]
pub fn on_known_ground(seed: u64, toml: &str, curvature: f32) -> (Env, Observation) {
    let endless = "mower.start = 'centre'\nepisode.budget = inf\npasture.headland_m = inf";
    let (mut env, mut observation) = begun_with(seed, &format!("{endless}\n{toml}"));
    for very_wide in [0.25, -0.25] {
        for _ in 0..WIDE_LAP_STEPS {
            circle(&mut env, &mut observation, very_wide);
        }
    }
    loop {
        let known = news(&env);
        let mut ahead = env.clone();
        for _ in 0..KNOWN_STEPS {
            circle(&mut ahead, &mut observation, curvature);
        }
        if news(&ahead) == known {
            return (env, observation);
        }
        env = ahead;
    }
}

/// What only grows, or falls, when something new is met: weeds detected, weeds mowed and cells not seen.
fn news(env: &Env) -> (u32, usize, usize) {
    let view = env.view();
    (view.weeds_detected, view.known_weeds.removed().len(), view.ground.unseen_count())
}

/// One step on a circle, of so many times the tightest circle's curvature.
pub fn circle(env: &mut Env, observation: &mut Observation, curvature: f32) {
    env.step(Action::Continuous(&[curvature]), observation.as_mut()).expect("the episode runs");
}

/// The `steer` actions of one lap of `snake`, from the beginning of the episode until it stops or the episode ends.
#[must_use]
pub fn snake_lap(toml: &str) -> Vec<f32> {
    let (mut env, mut observation) = begun(toml);
    let snake: AgentSpec = "snake".parse().expect("the registry knows its names");
    let mut agent: Box<dyn Agent> = snake.build_tracked(SEED);
    agent.reset(&env.view());
    let mut lap = Vec::new();
    while let Decision::Drive(command) = agent.act(&env.view()) {
        let action = env.decoder().encode(command).expect("`steer` has numbers");
        let step = env.step(Action::Continuous(&action), observation.as_mut());
        lap.push(action[0]);
        if step.expect("the episode runs").end != swath_core::episode::End::Running {
            break;
        }
    }
    lap
}
