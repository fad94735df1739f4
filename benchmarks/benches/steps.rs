//! How long a step takes, with `features` observation and `steer` action: it should not depend on the number of weeds or the
//! size of the pasture.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use swath_benchmarks::{SEED, circle, on_known_ground};

/// Round and round on the tightest circle, where next to nothing new is seen or mowed.
fn known_ground(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("step over known ground");
    for (weeds, length_m, width_m) in
        [(40, 100, 40), (640, 100, 40), (10_000, 100, 40), (160, 1000, 400)]
    {
        let pasture = format!("pasture.length_m = {length_m}\npasture.width_m = {width_m}");
        let (mut env, mut observation) =
            on_known_ground(SEED, &format!("weeds.count = {weeds}\n{pasture}"), 1.0);
        let label = BenchmarkId::from_parameter(format!("{weeds} weeds, {length_m} x {width_m} m"));
        group.bench_function(label, |bencher| {
            bencher.iter(|| circle(&mut env, &mut observation, 1.0));
        });
    }
    group.finish();
}

criterion_group!(benches, known_ground);
criterion_main!(benches);
