//! How long an episode of each planner takes: pasture of 100 x 40 m, 80 weeds, 20 instances one after another.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use swath_agents::registry::{AGENTS, AgentSpec};
use swath_agents::runner::run_summary;
use swath_benchmarks::scenario;

/// Instances that an iteration cycles through.
const INSTANCES: u64 = 20;

fn episodes(criterion: &mut Criterion) {
    let scenario = scenario("pasture.headland_m = inf\nweeds.count = 80");
    let mut group = criterion.benchmark_group("episode of 80 weeds");
    group.sample_size(20);
    for entry in AGENTS {
        let agent: AgentSpec = entry.name.parse().expect("the registry knows its names");
        let mut instance = 0;
        group.bench_function(entry.name, |bencher| {
            bencher.iter(|| {
                instance = (instance + 1) % INSTANCES;
                run_summary(black_box(&scenario), &agent, instance)
            });
        });
    }
    group.finish();
}

criterion_group!(benches, episodes);
criterion_main!(benches);
