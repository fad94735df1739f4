//! Environments, fed with states.

use std::sync::LazyLock;

use sha2::{Digest as _, Sha256};
use swath_core::action::Command;
use swath_core::batch::{Autoreset, BatchEnv, BatchOptions, joined, split};
use swath_core::config::{Scenario, ValidScenario};
use swath_core::env::Env;
use swath_core::site::Site;

/// Rows of the batch.
pub const ROWS: usize = 2;

/// A pasture of 12 x 5 m with five weeds.
static SCENARIO: LazyLock<ValidScenario> = LazyLock::new(|| {
    let mut scenario = Scenario::default();
    scenario.pasture.length_m = 12.0;
    scenario.pasture.width_m = 5.0;
    scenario.weeds.count = 5;
    scenario.sensor.range_m = 4.0;
    scenario.sensor.width_m = 4.0;
    scenario.check().expect("a small pasture is a pasture")
});

/// After a drive that has detected and mowed some weeds.
static DRIVEN: LazyLock<Env> = LazyLock::new(|| {
    let mut env = Env::new(&SCENARIO);
    env.reset(7);
    env.drive(DRIVE).expect("the drive is within bounds");
    env
});

/// A batch whose episodes have begun.
fn begun() -> BatchEnv {
    let options = BatchOptions { rows: ROWS, autoreset: Autoreset::NextStep, threads: 1 };
    let mut batch = BatchEnv::new(&SCENARIO, options).expect("the options are within bounds");
    batch.reset(7);
    batch
}

const DRIVE: Command = Command { curvature_per_m: 0.1, distance_m: 5.5 };

/// Restores these bytes, and the same with the checksum that they should have: it would keep everything else out.
/// Returns whether one of them was restored.
///
/// # Panics
///
/// If what is refused changes the environment, or what is accepted cannot be written and restored again.
pub fn feed_env(data: &[u8]) -> bool {
    let mut is_restored = false;
    for bytes in [data.to_vec(), summed(data)] {
        let mut env = DRIVEN.clone();
        if env.restore(&bytes).is_ok() {
            go_on(&mut env);
            is_restored = true;
        } else {
            assert_eq!(env.snapshot(), DRIVEN.snapshot(), "a refusal changes nothing");
        }
    }
    is_restored
}

/// The same for a batch.
///
/// # Panics
///
/// As [`feed_env`].
pub fn feed_batch(data: &[u8]) -> bool {
    let mut is_restored = false;
    let with_sums = split(data, ROWS)
        .map(|rows| joined(&rows.iter().map(|row| summed(row)).collect::<Vec<_>>()));
    for bytes in [Some(data.to_vec()), with_sums.ok()].into_iter().flatten() {
        let mut batch = begun();
        let before = batch.snapshot();
        if batch.restore(&bytes).is_ok() {
            let written = batch.snapshot();
            batch.restore(&written).expect("its own snapshot can be restored");
            for env in batch.rows() {
                go_on(&mut env.clone());
            }
            is_restored = true;
        } else {
            assert_eq!(batch.snapshot(), before, "a refusal changes nothing");
        }
    }
    is_restored
}

fn go_on(env: &mut Env) {
    let written = env.snapshot();
    env.restore(&written).expect("its own snapshot can be restored");
    assert_eq!(env.snapshot(), written);
    // An episode that is over drives no further.
    let _ = env.drive(DRIVE);
    env.reset(1);
    env.drive(DRIVE).expect("the drive is within bounds");
}

fn summed(content: &[u8]) -> Vec<u8> {
    let sum: [u8; 32] = Sha256::digest(content).into();
    [content, &sum[..8]].concat()
}

/// The pasture that the environments stand on.
#[must_use]
pub fn site() -> &'static Site {
    DRIVEN.site()
}

/// Its scenario, as a client sends it.
#[must_use]
pub fn config() -> String {
    SCENARIO.to_toml()
}

/// States that are whole, without their checksums.
#[must_use]
pub fn seeds() -> [Vec<u8>; 2] {
    let without = |mut bytes: Vec<u8>| {
        bytes.truncate(bytes.len() - 8);
        bytes
    };
    let batch = begun();
    let rows: Vec<Vec<u8>> = batch.rows().iter().map(|env| without(env.snapshot())).collect();
    [without(DRIVEN.snapshot()), joined(&rows)]
}
