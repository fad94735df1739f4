//! A session on the server: what is known of it, and when it ends.

use std::collections::BTreeMap;

use bytes::Bytes;
use sha2::{Digest, Sha256};

use super::answers::Asked;
use crate::fault::{Fault, Loss};
use crate::header::Verb;
use crate::message::{Limits, SessionStats};

/// A session from its open to its end.
#[derive(Debug)]
pub(super) struct Session {
    pub(super) nonce: u128,
    pub(super) lid: u128,
    pub(super) client: String,
    pub(super) envs: u32,
    pub(super) open: Digest32,
    /// The reply to its open; none as long as it is opened.
    pub(super) opened: Option<Bytes>,
    pub(super) opened_ms: u64,
    pub(super) max_reply: u32,
    pub(super) steps: u64,
    /// When it was last asked for something, or last answered.
    pub(super) active_ms: u64,
    pub(super) has_lease: bool,
    pub(super) lease_lost_ms: u64,
    /// The number of the last numbered request that was carried out.
    pub(super) seq: u64,
    pub(super) last: Option<(Digest32, Bytes)>,
    pub(super) run: Option<Run>,
    /// A close that waits for the run to end.
    pub(super) closing: Option<Asked>,
    /// Why its environments are gone.
    pub(super) fault: Option<Fault>,
}

/// A request that is being carried out.
#[derive(Debug)]
pub(super) struct Run {
    pub(super) verb: Verb,
    pub(super) request: Digest32,
    /// The newest query that asked for it.
    pub(super) asked: Asked,
}

/// What is left of a session.
#[derive(Debug)]
pub(super) struct Tombstone {
    pub(super) nonce: u128,
    pub(super) loss: Loss,
    pub(super) steps: u64,
}

/// SHA-256 of a request's kind and payload: two requests of one number are the same if theirs is.
pub(super) type Digest32 = [u8; 32];

impl Session {
    pub(super) fn stats(&self, now_ms: u64) -> SessionStats {
        SessionStats {
            lease: format!("{:032x}", self.lid)[..8].to_owned(),
            client: self.client.clone(),
            envs: self.envs,
            steps: self.steps,
            age_ms: now_ms.saturating_sub(self.opened_ms),
            idle_ms: now_ms.saturating_sub(self.active_ms),
        }
    }

    /// When it ends if nobody asks for anything any more, and why; not as long as it has a job.
    pub(super) fn end_ms(&self, limits: &Limits) -> Option<(u64, Loss)> {
        if self.run.is_some() {
            return None;
        }
        let idle = (self.active_ms + u64::from(limits.idle_ms), Loss::Idle);
        let alive_ms = self.active_ms.max(self.lease_lost_ms);
        let lease = (alive_ms + u64::from(limits.grace_ms), Loss::Lease);
        Some(if self.has_lease || idle.0 < lease.0 { idle } else { lease })
    }
}

/// The session that a request is for, which is alive by that.
pub(super) fn session_of<'a>(
    sessions: &'a mut BTreeMap<u128, Session>,
    tombstones: &BTreeMap<u128, Tombstone>,
    asked: &Asked,
) -> Result<&'a mut Session, Fault> {
    let sid = asked.header.sid;
    let Some(session) = sessions.get_mut(&sid) else {
        let loss = tombstones.get(&sid).map_or(Loss::Unknown, |tombstone| tombstone.loss);
        return Err(no_session(loss));
    };
    session.active_ms = asked.at_ms;
    match &session.fault {
        Some(fault) => Err(fault.clone()),
        None => Ok(session),
    }
}

/// How long a session lasts at least, from whatever happens to it.
pub(super) fn shortest_life_ms(limits: &Limits) -> u64 {
    limits.grace_ms.min(limits.idle_ms).into()
}

pub(super) fn digest(message: &[u8]) -> Digest32 {
    // From the kind on: the numbers before it are compared as numbers.
    Sha256::digest(&message[48..]).into()
}

pub(super) fn why_ended(loss: Loss) -> &'static str {
    match loss {
        Loss::Unknown => "unknown",
        Loss::Closed => "closed",
        Loss::Lease => "client gone",
        Loss::Idle => "client silent",
        Loss::Fault => "environments failed",
    }
}

pub(super) fn no_session(loss: Loss) -> Fault {
    let text = match loss {
        Loss::Unknown => "there is no such session",
        Loss::Closed => "the session was closed",
        Loss::Lease => "the session ended because its client was gone",
        Loss::Idle => "the session ended because its client asked for nothing",
        Loss::Fault => "the session ended because its environments failed",
    };
    Fault::NoSession { reason: loss as u64, text: text.to_owned() }
}
