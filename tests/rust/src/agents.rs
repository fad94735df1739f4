//! Every agent, as the contract tests run it.

use swath_agents::registry::AGENTS;

/// Every online agent of the registry, with an effort that a test build can spend.
pub fn quick() -> impl Iterator<Item = &'static str> {
    AGENTS
        .iter()
        .filter(|entry| entry.is_online)
        .map(|entry| if entry.name == "horizon" { "horizon:iterations=100" } else { entry.name })
}
