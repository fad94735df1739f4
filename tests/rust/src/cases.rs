//! How many cases a property runs, where failing seeds are kept, and how long actions are.

use proptest::test_runner::{Config, FileFailurePersistence};
use swath_core::action::ActionSpec;
use swath_core::env::Env;

/// 64 cases, or `PROPTEST_CASES`; failing seeds go beside the test file.
#[must_use]
pub fn cases() -> Config {
    let default = Config::default();
    Config {
        cases: if std::env::var_os("PROPTEST_CASES").is_some() { default.cases } else { 64 },
        failure_persistence: Some(Box::new(FileFailurePersistence::WithSource(
            "proptest-regressions",
        ))),
        ..default
    }
}

/// How many numbers an action of this environment has.
///
/// # Panics
///
/// If its actions are choices.
#[must_use]
pub fn numbers(env: &Env) -> usize {
    match env.decoder().spec() {
        ActionSpec::Continuous(bounds) => bounds.len(),
        ActionSpec::Discrete(_) => panic!("an action of this environment is a choice"),
    }
}
