//! Every agent, as the contract tests run it.

use swath_agents::registry::AGENTS;

/// Every agent of the registry, with an effort that a test build can spend.
pub fn quick() -> impl Iterator<Item = &'static str> {
    AGENTS
        .iter()
        .map(|entry| if entry.name == "horizon" { "horizon:iterations=100" } else { entry.name })
}
