//! What a server is, and how much it takes on.

use crate::message::{EnvInfo, Limits};

/// What a server is.
#[derive(Debug, Clone)]
pub struct ServerOptions {
    /// Its name, part of its keys.
    pub server: String,
    /// Its version of swath.
    pub build: String,
    /// Drawn when it started.
    pub boot_id: u128,
    /// How much it takes on.
    pub limits: Limits,
    /// Whether clients may have the state as bytes, in which weeds stand that nobody has seen.
    pub allow_snapshot: bool,
    /// What it simulates.
    pub envs: Vec<EnvInfo>,
    /// Most bytes of the replies that are kept for all sessions together.
    pub max_cached_bytes: u64,
}
