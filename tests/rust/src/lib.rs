//! What the contract tests share: strategies for scenarios and drives, and the problem's rules written a second time.
//!
//! The tests stand in `tests/`, one file for each promise. Expected numbers come from closed forms, from pastures drawn by
//! hand or from [`oracle`], never from the code under test. Properties run 64 cases, or as many as the environment
//! variable `PROPTEST_CASES` says; seeds that failed once are kept beside the test, in `*.proptest-regressions`.

pub mod agents;
pub mod cases;
pub mod columns;
pub mod dice;
pub mod oracle;
pub mod scene;
pub mod sight;
pub mod simulator;
pub mod watch;
