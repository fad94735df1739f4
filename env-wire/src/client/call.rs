//! One call: what is sent, how far it is, and which messages answer it.

use std::sync::Arc;

use crate::fault::Fault;
use crate::header::{Header, Kind, Verb};

/// What is sent.
#[derive(Debug, Clone)]
pub(super) struct Request {
    pub(super) verb: Verb,
    pub(super) header: Header,
    pub(super) message: Arc<[u8]>,
}

/// What was sent, and the call proper where that was to be settled before.
#[derive(Debug, Clone)]
pub(super) struct Doubt {
    pub(super) request: Request,
    pub(super) after: Option<(Verb, Vec<u8>)>,
}

/// A call in flight.
#[derive(Debug)]
pub(super) struct Call {
    pub(super) request: Request,
    /// The call proper, where another one has to be settled before.
    pub(super) after: Option<(Verb, Vec<u8>)>,
    pub(super) began_ms: u64,
    pub(super) attempts: u32,
    pub(super) pause_ms: u64,
    pub(super) progress: Progress,
}

#[derive(Debug, Clone, Copy)]
pub(super) enum Progress {
    ToSend,
    Sent { until_ms: u64 },
    Paused { until_ms: u64 },
}

/// The last call that was answered, and by whom.
#[derive(Debug, Clone, Copy)]
pub(super) struct Answered {
    pub(super) verb: Verb,
    pub(super) header: Header,
    pub(super) boot_id: Option<u128>,
    pub(super) attempts: u32,
}

impl Request {
    /// Whether a message with this header, and this fault if it is one, answers it.
    pub(super) fn is_answer(&self, header: &Header, fault: Option<&Fault>) -> bool {
        let asked = &self.header;
        let has_its_numbers = (header.sid, header.seq) == (asked.sid, asked.seq);
        match (header.kind, fault) {
            (Kind::Reply(verb), _) if verb == self.verb => {
                has_its_numbers || verb == Verb::Open && header.seq == 0
            }
            // Where the numbers of a request could not be read, there are none in the answer.
            (
                Kind::Fault,
                Some(
                    Fault::VersionMismatch { .. }
                    | Fault::Malformed { .. }
                    | Fault::TooLarge { .. },
                ),
            ) => has_its_numbers || (header.sid, header.seq) == (0, 0),
            (Kind::Fault, Some(_)) => has_its_numbers,
            _ => false,
        }
    }
}

impl Answered {
    /// Whether a message answers the same request.
    pub(super) fn request_is_of(&self, header: &Header) -> bool {
        let has_its_numbers = (header.sid, header.seq) == (self.header.sid, self.header.seq);
        match header.kind {
            Kind::Reply(verb) if verb == Verb::Open => self.verb == verb,
            Kind::Reply(verb) => self.verb == verb && has_its_numbers,
            Kind::Fault => has_its_numbers,
            Kind::Request(_) => false,
        }
    }
}
