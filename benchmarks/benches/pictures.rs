//! How long a picture takes: one every half metre of the way of `snake`, 640 x 360 pixels. Those of a whole episode are
//! painted again and again; the first one of each, which lays out what stays, is among them.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use swath_agents::registry::AgentSpec;
use swath_agents::runner::run_episode;
use swath_benchmarks::{SEED, scenario};
use swath_render::{Painter, Replay, Size};

/// Way between two pictures, metres.
const STEP_M: f64 = 0.5;

fn pictures(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("picture");
    let snake: AgentSpec = "snake".parse().expect("the registry knows its names");
    let size = Size::new(640, 360).expect("a picture may have this size");
    for weeds in [40, 640] {
        let scenario = scenario(&format!("weeds.count = {weeds}"));
        let episode = run_episode(&scenario, &snake, SEED, None);
        let begin = || {
            let points = episode.trajectory.sample();
            let replay = Replay::new(&scenario, episode.weeds.positions(), points);
            (replay.expect("it was driven so"), Painter::new(size, "snake"), 0.0)
        };
        let (mut replay, mut painter, mut path_m) = begin();
        let label = BenchmarkId::from_parameter(format!("640 x 360, {weeds} weeds"));
        group.bench_function(label, |bencher| {
            bencher.iter(|| {
                if path_m > replay.length_m() {
                    (replay, painter, path_m) = begin();
                }
                path_m += STEP_M;
                replay.drive_to(path_m);
                painter.paint(replay.env())
            });
        });
    }
    group.finish();
}

criterion_group!(benches, pictures);
criterion_main!(benches);
