//! What is asked and what is answered.
//!
//! Tables of numbers are borrowed bytes, little-endian and not aligned: they are copied to where they belong, never read
//! in place. A message never grows: another field is another version of the protocol.

use bincode::{BorrowDecode, Decode, Encode};

use crate::leaf::Leaf;

/// What a server can do for one scenario id.
#[derive(Debug, Clone, PartialEq, Eq, Encode, Decode)]
pub struct EnvInfo {
    /// Such as `swath/MowerRouting-v0`.
    pub id: String,
    /// The JSON Schema of its scenario.
    pub config_schema: String,
    /// The autoreset modes that it has: 1 next-step, 2 same-step, 4 disabled, summed.
    pub autoreset: u8,
}

/// How much a server takes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Encode, Decode)]
pub struct Limits {
    /// Largest message, bytes.
    pub max_msg: u32,
    /// Most sessions at a time.
    pub max_sessions: u32,
    /// Most environments of a session.
    pub max_envs: u32,
    /// How long clients take to notice that the server is frozen, milliseconds; a frozen client is noticed after the time
    /// that it announces itself.
    pub lease_ms: u32,
    /// How long a session outlives its client, milliseconds.
    pub grace_ms: u32,
    /// How long a session outlives its last request, milliseconds.
    pub idle_ms: u32,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_msg: 64 << 20,
            max_sessions: 64,
            max_envs: 16_384,
            lease_ms: 10_000,
            grace_ms: 30_000,
            idle_ms: 600_000,
        }
    }
}

/// What a server is: the reply to `spec`, whose request is empty.
#[derive(Debug, Clone, PartialEq, Eq, Encode, Decode)]
pub struct SpecReply {
    /// Oldest major version that it speaks.
    pub major_min: u16,
    /// Newest one.
    pub major_max: u16,
    /// Minor version of the newest one.
    pub minor: u16,
    /// Its name, part of its keys.
    pub server: String,
    /// Its version of swath.
    pub build: String,
    /// What it simulates.
    pub envs: Vec<EnvInfo>,
    /// How much it takes on.
    pub limits: Limits,
}

/// When an environment whose episode ended begins anew.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Encode, Decode)]
pub enum AutoresetMode {
    /// In the step after.
    NextStep,
    /// In the step that ends it.
    SameStep,
    /// When it is told to.
    Disabled,
}

/// A session, please. Sent again with the same nonce, it is the same session.
#[derive(Debug, Clone, PartialEq, Eq, Encode, BorrowDecode)]
pub struct Open<'a> {
    /// Drawn by the client.
    pub nonce: u128,
    /// Such as `swath/MowerRouting-v0`.
    pub env_id: String,
    /// The scenario as TOML, which has infinity; numbers in it are read to the last bit.
    pub config: String,
    /// Number of environments.
    pub num_envs: u32,
    /// When ended ones begin anew.
    pub autoreset: AutoresetMode,
    /// After every so many requests the reply holds a hash of the state; 0 for never.
    pub hash_every: u32,
    /// Whether every reply has the infos, or only what else a client could not go on without.
    pub infos: bool,
    /// Where to begin: what `snapshot` returned of as many environments of the same scenario.
    pub snapshot: Option<&'a [u8]>,
    /// Whether every reply tells what the mowers perceive, as a scripted agent needs it.
    pub percept: bool,
    /// Who asks, for the logs.
    pub client: String,
}

/// A session.
#[derive(Debug, Clone, PartialEq, Eq, Encode, Decode)]
pub struct OpenReply {
    /// The session, a secret.
    pub sid: u128,
    /// The name of the session's lease, which opens nothing.
    pub lid: u128,
    /// Tables of an observation.
    pub observation: Vec<Leaf>,
    /// Tables of an action.
    pub action: Vec<Leaf>,
    /// Tables of every info; without infos, the action mask alone where there is one.
    pub info: Vec<Leaf>,
    /// What is said of an episode that ended.
    pub ended: Vec<Leaf>,
    /// The names of the outcomes, by the number that `ended` has.
    pub outcomes: Vec<String>,
    /// SHA-256 of the scenario.
    pub config_hash: [u8; 32],
    /// Longest reply that a step can have, bytes.
    pub max_reply: u32,
    /// How much the server takes on.
    pub limits: Limits,
}

/// Seeds of a reset.
#[derive(Debug, Clone, PartialEq, Eq, Encode, BorrowDecode)]
pub enum Seeds<'a> {
    /// The next episode of every environment.
    None,
    /// Environment i begins with this + i.
    One(u64),
    /// A seed for each environment, u64.
    Each(&'a [u8]),
    /// A seed for each environment, u64, and before them a byte for each: whether there is one.
    Some(&'a [u8]),
}

/// Episodes to begin.
#[derive(Debug, Clone, PartialEq, Eq, Encode, BorrowDecode)]
pub struct Reset<'a> {
    /// Their seeds.
    pub seeds: Seeds<'a>,
    /// Which environments begin, a byte each; empty for all.
    pub mask: &'a [u8],
    /// For each environment, or once for all, where its weeds stand: x and y in f64, metres; `None` where they are drawn.
    /// Empty where they are drawn in all.
    pub weeds: Vec<Option<&'a [u8]>>,
}

/// What the mowers perceive: for every environment the lists of what is new, one after the other.
///
/// It holds what an agent may know and nothing more: no weed that was not detected, nor how many there are.
#[derive(Debug, Clone, PartialEq, Eq, Encode, BorrowDecode)]
pub struct Percept<'a> {
    /// Which environments are told of as a whole, a byte each; nothing that was told of them before counts any more.
    pub whole: &'a [u8],
    /// For each environment x and y, metres, heading, radians, its cosine and sine, and the way driven since reset, metres; f64.
    pub mowers: &'a [u8],
    /// For each environment the number of weeds ever detected, then how many entries the lists below have: `known`, `mowed`
    /// and `tiles`; u32.
    pub counts: &'a [u8],
    /// The weeds that became known and still are, by their number in the order of detection; u32.
    pub known: &'a [u8],
    /// Where they stand: x and y in f64, metres.
    pub known_m: &'a [u8],
    /// The numbers of the detected weeds that were mowed, ascending; u32.
    pub mowed: &'a [u8],
    /// The tiles of 8 by 8 cells of which some ground came into sight, ascending; u32.
    pub tiles: &'a [u8],
    /// Which of their cells, row by row, lowest bit first; u64.
    pub seen: &'a [u8],
}

/// The state of every environment after a reset or a restore.
#[derive(Debug, Clone, PartialEq, Eq, Encode, BorrowDecode)]
pub struct ResetReply<'a> {
    /// The present observations.
    pub observation: Vec<&'a [u8]>,
    /// The infos.
    pub info: Vec<&'a [u8]>,
    /// First half of the SHA-256 of the snapshot, where it was asked for.
    pub state_hash: Option<[u8; 16]>,
    /// What every mower perceives, as a whole, where it was asked for.
    pub percept: Option<Percept<'a>>,
}

/// A step of every environment.
#[derive(Debug, Clone, PartialEq, Eq, Encode, BorrowDecode)]
pub struct Step<'a> {
    /// The actions, table by table.
    pub actions: Vec<&'a [u8]>,
}

/// What a step brought.
#[derive(Debug, Clone, PartialEq, Eq, Encode, BorrowDecode)]
pub struct StepReply<'a> {
    /// The observations; of an environment that began anew, the first one of its new episode.
    pub observation: Vec<&'a [u8]>,
    /// The rewards, f64.
    pub reward: &'a [u8],
    /// Which episodes ended by the rules of the problem, a byte each.
    pub terminated: &'a [u8],
    /// Which were cut off, a byte each.
    pub truncated: &'a [u8],
    /// The infos.
    pub info: Vec<&'a [u8]>,
    /// The environments whose episode ended, ascending, u32; the tables below have a row for each.
    pub done_index: &'a [u8],
    /// Their last observations, in the mode `SameStep` only.
    pub final_observation: Vec<&'a [u8]>,
    /// What is said of their episodes.
    pub ended: Vec<&'a [u8]>,
    /// First half of the SHA-256 of the snapshot, where it was asked for.
    pub state_hash: Option<[u8; 16]>,
    /// What every mower perceives, where it was asked for; as a whole where another episode has begun, else what is new.
    pub percept: Option<Percept<'a>>,
}

/// The state as bytes, please.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Encode, Decode)]
pub struct Snapshot {
    /// Of one environment, or of all.
    pub env: Option<u32>,
}

/// The state as bytes.
#[derive(Debug, Clone, PartialEq, Eq, Encode, BorrowDecode)]
pub struct SnapshotReply<'a> {
    /// SHA-256 of the scenario that it belongs to.
    pub config_hash: [u8; 32],
    /// The bytes.
    pub data: &'a [u8],
}

/// A state to put back; answered as a reset is.
#[derive(Debug, Clone, PartialEq, Eq, Encode, BorrowDecode)]
pub struct Restore<'a> {
    /// Into one environment, or into all.
    pub env: Option<u32>,
    /// What `snapshot` returned.
    pub data: &'a [u8],
}

/// The end of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Encode, Decode)]
pub struct CloseReply {
    /// How many steps all its environments have made together.
    pub steps: u64,
}

/// What a server does at present: the reply to `stats`, whose request is empty.
#[derive(Debug, Clone, PartialEq, Eq, Encode, Decode)]
pub struct StatsReply {
    /// Since the server started, milliseconds.
    pub uptime_ms: u64,
    /// Sessions that are open.
    pub sessions: u32,
    /// Their environments.
    pub envs: u32,
    /// Sessions opened since the start.
    pub opened: u64,
    /// Sessions that were freed because their client was gone, silent, or failed.
    pub lost: u64,
    /// Requests answered since the start.
    pub requests: u64,
    /// Faults among the answers.
    pub faults: u64,
    /// Environment steps since the start.
    pub steps: u64,
    /// How many requests took up to 2^i microseconds from their arrival to their answer, for i from 0; not more than 2^(i - 1).
    pub latency_us: Vec<u64>,
    /// Each session that is open.
    pub open: Vec<SessionStats>,
}

/// What a session does.
#[derive(Debug, Clone, PartialEq, Eq, Encode, Decode)]
pub struct SessionStats {
    /// The first 8 hexadecimal digits of its lease.
    pub lease: String,
    /// Who opened it.
    pub client: String,
    /// Number of environments.
    pub envs: u32,
    /// Environment steps so far.
    pub steps: u64,
    /// Since it was opened, milliseconds.
    pub age_ms: u64,
    /// Since its last request, milliseconds.
    pub idle_ms: u64,
}
