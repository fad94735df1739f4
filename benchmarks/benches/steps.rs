//! How long a step takes, with `features` observation and `steer` action: it should not depend on the number of weeds or the
//! size of the pasture.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use swath_core::action::Action;
use swath_core::config::Document;
use swath_core::env::Env;
use swath_core::observation::Observation;

/// Steps on a circle after which there is nothing new to see.
const LAP: usize = 60;

fn env(weeds: u32, length_m: u32, width_m: u32) -> (Env, Observation) {
    let mut document = Document::empty("benchmark");
    let text = format!(
        "weeds.count = {weeds}\npasture.length_m = {length_m}\npasture.width_m = {width_m}\n\
         mower.start = 'centre'\nepisode.budget = inf\npasture.headland_m = inf"
    );
    document.overlay(text.parse().expect("this is TOML"));
    let mut env = Env::new(&document.scenario().expect("the scenario is valid"));
    env.reset(7);
    let observation = env.observation_spec().rows(1);
    (env, observation)
}

/// Round and round on a circle: nothing new is seen or mowed.
fn known_ground(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("step over known ground");
    for (weeds, length_m, width_m) in
        [(40, 100, 40), (640, 100, 40), (10_000, 100, 40), (160, 1000, 400)]
    {
        let (mut env, mut observation) = env(weeds, length_m, width_m);
        for _ in 0..LAP {
            env.step(Action::Continuous(&[1.0]), observation.as_mut()).expect("the episode runs");
        }
        let label = BenchmarkId::from_parameter(format!("{weeds} weeds, {length_m} x {width_m} m"));
        group.bench_function(label, |bencher| {
            bencher.iter(|| {
                env.step(Action::Continuous(&[1.0]), observation.as_mut())
                    .expect("the episode runs")
            });
        });
    }
    group.finish();
}

criterion_group!(benches, known_ground);
criterion_main!(benches);
