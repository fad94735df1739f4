//! Why a call brought nothing.

use crate::fault::Fault;
use crate::header::Verb;

/// Why a call brought nothing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ClientError {
    /// The server's answer.
    #[error(transparent)]
    Fault(#[from] Fault),
    /// There was no answer. The request may have been carried out: [`ClientSession::retry`](super::ClientSession::retry) asks again.
    #[error("no answer within {waited_ms} ms, in {attempts} attempts")]
    Timeout {
        /// How long the call took, milliseconds.
        waited_ms: u64,
        /// How often it was sent.
        attempts: u32,
    },
    /// Another call is in flight.
    #[error("another call is in flight")]
    Busy,
    /// Nobody knows whether the last call was carried out.
    #[error("the last call was not answered: retry it, reset or close")]
    InDoubt,
    /// There is no session.
    #[error("no session is open")]
    NotOpen,
    /// There is a session already.
    #[error("a session is open already")]
    IsOpen,
    /// Nothing can be tried again.
    #[error("every call that was sent was answered")]
    NothingToRetry,
    /// Two servers answer to one name.
    #[error("two servers have the same name")]
    TwoServers,
    /// A session that was lost and cannot be resumed.
    #[error("the session cannot be resumed: {0}")]
    NotResumable(Fault),
    /// The next server does not take a session that was lost: another one may, with a retry.
    #[error("the next server does not take the session: {0}; `retry` asks once more")]
    NotTaken(Fault),
    /// The server that a session was resumed at does not do what the one before did.
    #[error(
        "the session cannot be resumed: the server replies otherwise to request {request} since its last snapshot \
         than the one before did"
    )]
    Differs {
        /// The request, from 1; 0 for the open itself.
        request: u64,
    },
    /// An answer that cannot be read.
    #[error("the reply to `{verb}` cannot be read", verb = .0.name())]
    Unexpected(Verb),
}
