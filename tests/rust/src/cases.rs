//! How many cases a property runs, and where failing seeds are kept.

use proptest::test_runner::{Config, FileFailurePersistence};

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
