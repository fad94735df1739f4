//! Programs whose instructions callgrind counts: `make bench-count` and `make profile` run them.
//!
//! `counted` lists them, and `counted NAME` runs one. Only what happens inside of [`swath_collects`] is counted.

use std::env::args;
use std::hint::black_box;

use swath_agents::registry::{AGENTS, AgentSpec};
use swath_agents::runner::run_summary;
use swath_benchmarks::{KNOWN_STEPS, SEED, begun, circle, on_known_ground, scenario, snake_lap};
use swath_core::action::{Action, ActionSpec, Order};
use swath_core::batch::{Actions, Autoreset, BatchEnv, BatchOptions, StepMut};
use swath_core::env::{Beginning, Env};
use swath_core::episode::End;
use swath_core::observation::Observation;
use swath_core::rng::{agent_rng, uniform};

/// What is counted, and how many times it is done.
type Work = (usize, Box<dyn FnMut()>);

/// Makes everything ready for the work.
type Prepare = Box<dyn Fn() -> Work>;

/// Every program: its name, what one unit of its work is, and how it is prepared.
fn programs() -> Vec<(String, &'static str, Prepare)> {
    let mut programs: Vec<(String, &'static str, Prepare)> = Vec::new();
    let mut add = |name: &str, unit: &'static str, prepare: Prepare| {
        programs.push((name.to_owned(), unit, prepare));
    };

    add("known/40-weeds", "step", Box::new(|| known_ground("weeds.count = 40", 1.0)));
    add("known/160-weeds", "step", Box::new(|| known_ground("weeds.count = 160", 1.0)));
    add("known/640-weeds", "step", Box::new(|| known_ground("weeds.count = 640", 1.0)));
    add("known/10000-weeds", "step", Box::new(|| known_ground("weeds.count = 10000", 1.0)));
    add("known/1000x400-m", "step", Box::new(|| known_ground(LARGE, 1.0)));
    add("wide/40-weeds", "step", Box::new(|| known_ground("weeds.count = 40", 0.5)));
    add("wide/10000-weeds", "step", Box::new(|| known_ground("weeds.count = 10000", 0.5)));
    add("drive/40-weeds", "step", Box::new(|| drive_known_ground("weeds.count = 40", 1.0)));
    add("drive/10000-weeds", "step", Box::new(|| drive_known_ground("weeds.count = 10000", 1.0)));
    add("drive-wide/40-weeds", "step", Box::new(|| drive_known_ground("weeds.count = 40", 0.5)));
    add(
        "drive-wide/10000-weeds",
        "step",
        Box::new(|| drive_known_ground("weeds.count = 10000", 0.5)),
    );
    add("known/16-nearest", "step", Box::new(|| known_ground(SIXTEEN, 1.0)));
    add("lap/features", "step", Box::new(|| lap("weeds.count = 160")));
    for kind in ["maps", "candidates", "dict"] {
        let toml = format!("weeds.count = 160\nobservation.kind = '{kind}'");
        add(&format!("lap/{kind}"), "step", Box::new(move || lap(&toml)));
    }
    add("wander/features", "step", Box::new(|| wander("weeds.count = 160")));
    add("batch/64", "step of 64", Box::new(|| batch("weeds.count = 160", 64)));
    add("choice/target", "step", Box::new(|| last_choice("action.kind = 'target'", 50)));
    add("choice/discrete", "step", Box::new(|| last_choice("action.kind = 'discrete'", 200)));
    add("reset/40-weeds", "reset", Box::new(|| reset("weeds.count = 40")));
    add("reset/160-weeds", "reset", Box::new(|| reset("weeds.count = 160")));
    add("snapshot/160-weeds", "round trip", Box::new(|| snapshot("weeds.count = 160")));
    // The planner that searches would take minutes.
    for entry in AGENTS.iter().filter(|entry| entry.name != "horizon" && entry.is_online) {
        add(
            &format!("episode/{}", entry.name),
            "episode",
            Box::new(|| episode(entry.name, "weeds.count = 40")),
        );
    }
    programs
}

/// A list of weeds that is longer than by default.
const SIXTEEN: &str = "weeds.count = 640\nobservation.nearest_weeds = 16";
/// A hundred times the ground, with as many weeds on a square metre as 160 are on the pasture by default.
const LARGE: &str = "weeds.count = 16000\npasture.length_m = 1000\npasture.width_m = 400";

/// Steps round a circle, of so many times the tightest circle's curvature, on which nothing new is seen or mowed, among the
/// weeds of one seed after another.
fn known_ground(toml: &str, curvature: f32) -> Work {
    on_pastures(toml, curvature, move |env, observation| circle(env, observation, curvature))
}

/// The same without an observation: the mower drives, mows, senses and is scored.
fn drive_known_ground(toml: &str, curvature: f32) -> Work {
    on_pastures(toml, curvature, move |env, _| {
        let (order, _) = env.decoder().decode(Action::Continuous(&[curvature])).expect("it is one");
        let Order::Drive(command) = order else { panic!("`steer` says what to drive") };
        black_box(env.drive(command)).expect("the episode runs");
    })
}

/// Steps on the known ground of several seeds, one after another.
fn on_pastures(
    toml: &str,
    curvature: f32,
    take: impl Fn(&mut Env, &mut Observation) + 'static,
) -> Work {
    const SEEDS: u64 = 5;
    let mut pastures: Vec<_> =
        (SEED..SEED + SEEDS).map(|seed| on_known_ground(seed, toml, curvature)).collect();
    let (steps, mut taken) = (KNOWN_STEPS * pastures.len(), 0);
    let step = move || {
        let (env, observation) = &mut pastures[taken / KNOWN_STEPS];
        taken += 1;
        take(env, observation);
    };
    (steps, Box::new(step))
}

/// Steps along a lap of `snake`, from the first to the last.
fn lap(toml: &str) -> Work {
    let lap = snake_lap(toml);
    let (mut env, mut observation) = begun(toml);
    let mut actions = lap.clone().into_iter();
    let step = move || {
        let action = [actions.next().expect("the lap is as long as the work")];
        env.step(Action::Continuous(&action), observation.as_mut()).expect("the episode runs");
    };
    (lap.len(), Box::new(step))
}

/// Steps of an untrained policy, which turns at random, from reset to reset: much is seen for the first time.
fn wander(toml: &str) -> Work {
    let (mut env, mut observation) = begun(toml);
    let mut rng = agent_rng(SEED);
    let step = move || {
        #[expect(clippy::cast_possible_truncation, reason = "actions are float32")]
        let action = [2.0 * uniform(&mut rng) as f32 - 1.0];
        let step = env.step(Action::Continuous(&action), observation.as_mut());
        if step.expect("the episode runs").end != End::Running {
            env.reset_next(Beginning::default());
        }
    };
    (2000, Box::new(step))
}

/// Steps of a batch, in which every row drives the lap of the first.
fn batch(toml: &str, rows: usize) -> Work {
    let options = BatchOptions { rows, autoreset: Autoreset::NextStep, threads: 1 };
    let mut batch = BatchEnv::new(&scenario(toml), options).expect("one thread is there");
    batch.reset(SEED);
    let mut observation = begun(toml).0.observation_spec().rows(rows);
    let (mut rewards, mut flags) = (vec![0.0; 5 * rows], vec![false; 3 * rows]);
    let mut actions = snake_lap(toml).into_iter();
    let step = move || {
        let actions = vec![actions.next().expect("the lap is long enough"); rows];
        let [reward, weed, path, failure, distance_m] = columns(&mut rewards);
        let [terminated, truncated, is_clipped] = columns(&mut flags);
        let observation = observation.as_mut();
        let action_mask = &mut [];
        let out = StepMut {
            observation,
            reward,
            terminated,
            truncated,
            weed,
            path,
            failure,
            is_clipped,
            distance_m,
            action_mask,
        };
        batch.step(Actions::Continuous(&actions), out).expect("the episodes run");
    };
    (500, Box::new(step))
}

/// A buffer cut into columns of the same length.
fn columns<T, const N: usize>(buffer: &mut [T]) -> [&mut [T]; N] {
    let mut columns = buffer.chunks_exact_mut(buffer.len() / N);
    std::array::from_fn(|_| columns.next().expect("there are N of them"))
}

/// Steps that always take the last choice of the action kind.
fn last_choice(toml: &str, steps: usize) -> Work {
    let (mut env, mut observation) = begun(&format!("episode.budget = inf\n{toml}"));
    let ActionSpec::Discrete(choices) = env.decoder().spec() else {
        panic!("the action kind has choices");
    };
    let last = i64::try_from(choices - 1).expect("choices are few");
    let step = move || {
        env.step(Action::Discrete(last), observation.as_mut()).expect("the episode runs");
    };
    (steps, Box::new(step))
}

/// Resets to one seed after another.
fn reset(toml: &str) -> Work {
    let mut env = Env::new(&scenario(toml));
    let mut seeds = 0..;
    env.reset(SEED);
    (100, Box::new(move || env.reset(seeds.next().expect("seeds do not end"))))
}

/// Snapshots in the middle of a lap, each put back.
fn snapshot(toml: &str) -> Work {
    let lap = snake_lap(toml);
    let (mut env, mut observation) = begun(toml);
    for action in &lap[..lap.len() / 2] {
        env.step(Action::Continuous(&[*action]), observation.as_mut()).expect("the episode runs");
    }
    (20, Box::new(move || env.restore(black_box(&env.snapshot())).expect("it is its own snapshot")))
}

/// An episode of an agent, run natively from reset to its own stop.
fn episode(agent: &str, toml: &str) -> Work {
    let scenario = scenario(&format!("pasture.headland_m = inf\n{toml}"));
    let agent: AgentSpec = agent.parse().expect("the registry knows its names");
    let run = move || {
        black_box(run_summary(&scenario, &agent, SEED));
    };
    (1, Box::new(run))
}

/// The function in which callgrind counts, and nowhere else: nothing that it calls may bear its name.
#[inline(never)]
fn swath_collects(times: usize, work: &mut dyn FnMut()) {
    for _ in 0..times {
        work();
    }
}

#[expect(clippy::print_stdout, reason = "this is a program")]
fn main() {
    let programs = programs();
    let Some(wanted) = args().nth(1) else {
        for (name, ..) in programs {
            println!("{name}");
        }
        return;
    };
    let (_, unit, prepare) = programs
        .into_iter()
        .find(|(name, ..)| *name == wanted)
        .expect("the name is one of those that are listed");
    let (times, mut work) = prepare();
    swath_collects(times, work.as_mut());
    println!("{times}\t{unit}");
}
