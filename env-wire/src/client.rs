//! The client's end of one session: one call at a time, sent again and again until it is answered.
//!
//! The transport asks [`ClientSession::poll`] what to do, sends what it says, and reports what came back. It hands over
//! replies to the queries of the present call; those to earlier calls it may drop. A call that is sent again is the same
//! bytes, so that the server knows it, carries it out once, and gives every copy the one answer.

mod call;
mod error;
#[cfg(test)]
mod tests;

use std::fmt;
use std::sync::Arc;

use bincode::Encode;
use bytes::Bytes;

use crate::codec;
use crate::fault::Fault;
use crate::header::{HEADER_BYTES, Header, HeaderError, Kind, Verb};
use crate::message::{Limits, Open, OpenReply};
use call::{Answered, Call, Doubt, Progress, Request};
pub use error::ClientError;

/// How patient a client is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClientOptions {
    /// How long the transport waits for the answer to one query, milliseconds.
    pub attempt_ms: u64,
    /// How long a call may take with all its attempts, milliseconds.
    pub deadline_ms: u64,
    /// First pause between two attempts, milliseconds; it doubles from one to the next.
    pub pause_ms: u64,
    /// Longest pause between two attempts, milliseconds.
    pub longest_pause_ms: u64,
    /// Seed of what makes pauses up to a quarter shorter or longer, so that clients do not come back all at once.
    pub jitter_seed: u64,
}

impl Default for ClientOptions {
    fn default() -> Self {
        Self {
            attempt_ms: 2_000,
            deadline_ms: 60_000,
            pause_ms: 10,
            longest_pause_ms: 1_000,
            jitter_seed: 0,
        }
    }
}

/// What the transport has to do next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ClientOutput {
    /// Send a query, and report a reply, none, or that there was none in time.
    Send {
        /// The key to send it to.
        verb: Verb,
        /// All of its bytes.
        message: Arc<[u8]>,
        /// How long to wait for a reply, milliseconds.
        timeout_ms: u64,
    },
    /// Nothing before then, unless something comes back.
    Wait {
        /// When to ask again.
        until_ms: u64,
    },
    /// The call has ended: with all bytes of the reply, or without.
    Done(Result<Bytes, ClientError>),
    /// There is no call.
    Idle,
}

/// One session, from the client's side.
pub struct ClientSession {
    options: ClientOptions,
    jitter: u64,
    session: Option<Session>,
    /// The number of the last numbered call that was carried out.
    seq: u64,
    /// Why the session is over.
    lost: Option<Fault>,
    call: Option<Call>,
    done: Option<Result<Bytes, ClientError>>,
    /// A call that was not answered in time.
    doubt: Option<Doubt>,
    answered: Option<Answered>,
    has_two_servers: bool,
    ignored: u64,
}

#[derive(Debug, Clone, Copy)]
struct Session {
    boot_id: u128,
    sid: u128,
    lid: u128,
    /// Largest message that the server takes in, bytes.
    max_msg: u32,
}

impl ClientSession {
    /// A client without a session.
    #[must_use]
    pub fn new(options: ClientOptions) -> Self {
        Self {
            options,
            jitter: options.jitter_seed,
            session: None,
            seq: 0,
            lost: None,
            call: None,
            done: None,
            doubt: None,
            answered: None,
            has_two_servers: false,
            ignored: 0,
        }
    }

    /// Asks for a session; the nonce has to be new.
    ///
    /// # Errors
    ///
    /// [`ClientError::IsOpen`] if there is one, [`ClientError::InDoubt`] if there may be one, the fault of
    /// [`Open::check_client`], and those of [`Self::call`].
    pub fn open(&mut self, now_ms: u64, open: &Open) -> Result<(), ClientError> {
        open.check_client()?;
        self.call(now_ms, Verb::Open, open)
    }

    /// Begins a call.
    ///
    /// After a call that was not answered in time, `reset` first settles that one, as [`Self::retry`] would, and `close`
    /// ends the session whatever became of it; a step would be one on a state that nobody knows.
    ///
    /// # Errors
    ///
    /// [`ClientError::Busy`] if a call is in flight, [`ClientError::InDoubt`] if the last one was not answered,
    /// [`ClientError::NotOpen`] if there is no session, the [`Fault`] that ended the session, or [`Fault::TooLarge`].
    pub fn call(
        &mut self,
        now_ms: u64,
        verb: Verb,
        payload: &impl Encode,
    ) -> Result<(), ClientError> {
        self.begin(now_ms, verb, |header| codec::write(header, payload))
    }

    /// Begins a call without a payload, as [`Self::call`] does.
    ///
    /// # Errors
    ///
    /// Those of [`Self::call`].
    pub fn call_empty(&mut self, now_ms: u64, verb: Verb) -> Result<(), ClientError> {
        self.begin(now_ms, verb, |header| Ok(codec::write_empty(header)))
    }

    /// Begins a call whose payload is bytes already, as [`Self::call`] does.
    ///
    /// # Errors
    ///
    /// Those of [`Self::call`].
    pub fn call_bytes(
        &mut self,
        now_ms: u64,
        verb: Verb,
        payload: &[u8],
    ) -> Result<(), ClientError> {
        self.begin(now_ms, verb, |header| {
            Ok(header.message(payload.len(), |bytes| bytes.extend(payload)))
        })
    }

    /// Asks what the server is.
    ///
    /// # Errors
    ///
    /// Those of [`Self::call`].
    pub fn spec(&mut self, now_ms: u64) -> Result<(), ClientError> {
        self.call_empty(now_ms, Verb::Spec)
    }

    /// Asks what the server does at present.
    ///
    /// # Errors
    ///
    /// Those of [`Self::call`].
    pub fn stats(&mut self, now_ms: u64) -> Result<(), ClientError> {
        self.call_empty(now_ms, Verb::Stats)
    }

    /// Goes on with the call that was not answered in time: the same bytes again.
    ///
    /// # Errors
    ///
    /// [`ClientError::Busy`] if a call is in flight, [`ClientError::NothingToRetry`] if every call was answered.
    pub fn retry(&mut self, now_ms: u64) -> Result<(), ClientError> {
        self.check_free()?;
        let Doubt { request, after } = self.doubt.clone().ok_or(ClientError::NothingToRetry)?;
        self.start(now_ms, request, after);
        Ok(())
    }

    /// A message has come back; it is kept as it is, not copied.
    pub fn on_reply(&mut self, now_ms: u64, message: Bytes) {
        let (header, payload) = match Header::read(&message) {
            Ok(parts) => parts,
            Err(HeaderError::Version { major }) if self.call.is_some() => {
                let fault = Fault::VersionMismatch { least: major, most: major };
                return self.finish(Err(fault.into()));
            }
            Err(_) => {
                self.ignored += 1;
                return;
            }
        };
        let fault = match header.kind {
            Kind::Fault => codec::read_fault(payload).ok(),
            _ => None,
        };
        let boot_id = match fault {
            Some(Fault::SessionLost { boot_id }) => Some(boot_id),
            Some(_) => None,
            None => Some(header.boot_id),
        };
        let Some(call) =
            self.call.as_ref().filter(|call| call.request.is_answer(&header, fault.as_ref()))
        else {
            return self.on_stray(&header, boot_id);
        };
        if let Some(Fault::Busy { retry_ms }) = fault {
            return self.pause(now_ms, retry_ms);
        }
        let Request { verb, header: asked, .. } = call.request;
        if fault.is_none() && verb.has_session() && header.boot_id != asked.boot_id {
            self.has_two_servers = true;
            return self.finish(Err(ClientError::TwoServers));
        }
        self.answered = Some(Answered { verb, header: asked, boot_id, attempts: call.attempts });
        match fault {
            Some(fault) => self.on_fault(now_ms, fault),
            None => self.on_answer(now_ms, &header, message),
        }
    }

    /// Nobody has answered, or the transport has failed.
    pub fn on_nothing(&mut self, now_ms: u64) {
        if let Some(Call { progress: Progress::Sent { .. }, .. }) = self.call {
            self.pause(now_ms, 0);
        }
    }

    /// Nobody has answered in time.
    pub fn on_timeout(&mut self, now_ms: u64) {
        self.on_nothing(now_ms);
    }

    /// What is to be done now.
    pub fn poll(&mut self, now_ms: u64) -> ClientOutput {
        if let Some(done) = self.done.take() {
            return ClientOutput::Done(done);
        }
        let Some(call) = &mut self.call else { return ClientOutput::Idle };
        let end_ms = call.began_ms.saturating_add(self.options.deadline_ms);
        if now_ms >= end_ms {
            let waited_ms = now_ms - call.began_ms;
            return ClientOutput::Done(Err(self.give_up(waited_ms)));
        }
        match call.progress {
            Progress::Paused { until_ms } if now_ms < until_ms => {
                ClientOutput::Wait { until_ms: until_ms.min(end_ms) }
            }
            Progress::Sent { until_ms } if now_ms < until_ms => ClientOutput::Wait { until_ms },
            Progress::Sent { .. } => {
                self.pause(now_ms, 0);
                self.poll(now_ms)
            }
            Progress::ToSend | Progress::Paused { .. } => {
                let timeout_ms = self.options.attempt_ms.max(1).min(end_ms - now_ms);
                call.attempts = call.attempts.saturating_add(1);
                call.progress = Progress::Sent { until_ms: now_ms + timeout_ms };
                let Request { verb, message, .. } = call.request.clone();
                ClientOutput::Send { verb, message, timeout_ms }
            }
        }
    }

    /// The session's name, a secret; none if none was opened.
    #[must_use]
    pub fn sid(&self) -> Option<u128> {
        self.session.map(|session| session.sid)
    }

    /// The name of the session's lease.
    #[must_use]
    pub fn lid(&self) -> Option<u128> {
        self.session.map(|session| session.lid)
    }

    /// Largest message that the session's server takes in, bytes.
    #[must_use]
    pub fn max_msg(&self) -> Option<u32> {
        self.session.map(|session| session.max_msg)
    }

    /// What the session's server drew when it started.
    #[must_use]
    pub fn boot_id(&self) -> Option<u128> {
        self.session.map(|session| session.boot_id)
    }

    /// The number that the next reset, step or restore has.
    #[must_use]
    pub fn next_seq(&self) -> u64 {
        self.seq + 1
    }

    /// Whether the last call was not answered in time.
    #[must_use]
    pub fn is_in_doubt(&self) -> bool {
        self.doubt.is_some()
    }

    /// Whether the call is over, and [`Self::poll`] tells how.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.done.is_some()
    }

    /// How many messages were no answer to what was asked.
    #[must_use]
    pub fn ignored(&self) -> u64 {
        self.ignored
    }

    fn check_free(&self) -> Result<(), ClientError> {
        if self.call.is_some() || self.done.is_some() {
            Err(ClientError::Busy)
        } else if self.has_two_servers {
            Err(ClientError::TwoServers)
        } else {
            Ok(())
        }
    }

    fn begin(
        &mut self,
        now_ms: u64,
        verb: Verb,
        write: impl FnOnce(&Header) -> Result<Vec<u8>, Fault>,
    ) -> Result<(), ClientError> {
        self.check_free()?;
        let kind = Kind::Request(verb);
        let mut header = Header { boot_id: 0, sid: 0, seq: 0, kind };
        let mut limit = u32::MAX;
        if verb.has_session() {
            if let Some(fault) = &self.lost {
                return Err(fault.clone().into());
            }
            let Session { boot_id, sid, max_msg, .. } = self.session.ok_or(ClientError::NotOpen)?;
            limit = max_msg;
            let seq = self.seq + u64::from(verb.is_numbered());
            header = Header { boot_id, sid, seq, kind };
        }
        let doubtful = self.doubt.as_ref().map(|doubt| doubt.request.verb).filter(|verb| {
            // Whether these were carried out makes no difference.
            !matches!(verb, Verb::Spec | Verb::Stats | Verb::Snapshot)
        });
        // Zenoh drops what is much too large for a server, which then says nothing of it.
        let write = |header: &Header| -> Result<Vec<u8>, Fault> {
            let message = write(header)?;
            let (size, limit) = (message.len() as u64, u64::from(limit));
            if size > limit { Err(Fault::TooLarge { size, limit }) } else { Ok(message) }
        };
        match (verb, doubtful) {
            (Verb::Open, None) if self.session.is_some() && self.lost.is_none() => {
                return Err(ClientError::IsOpen);
            }
            (Verb::Spec | Verb::Stats | Verb::Close, _) | (_, None) => (),
            (Verb::Reset, Some(before)) if before.is_numbered() => {
                let message = write(&header)?;
                let Doubt { request, .. } = self.doubt.clone().expect("it is in doubt");
                self.start(now_ms, request, Some((verb, message)));
                return Ok(());
            }
            _ => return Err(ClientError::InDoubt),
        }
        let message = write(&header)?.into();
        self.start(now_ms, Request { verb, header, message }, None);
        Ok(())
    }

    fn start(&mut self, now_ms: u64, request: Request, after: Option<(Verb, Vec<u8>)>) {
        self.call = Some(Call {
            request,
            after,
            began_ms: now_ms,
            attempts: 0,
            pause_ms: self.options.pause_ms,
            progress: Progress::ToSend,
        });
    }

    /// The answer to the request that was sent, in full.
    fn on_answer(&mut self, now_ms: u64, header: &Header, message: Bytes) {
        let call = self.call.as_ref().expect("it is answered");
        let (verb, seq) = (call.request.verb, call.request.header.seq);
        match verb {
            Verb::Open => match codec::read::<OpenReply>(&message[HEADER_BYTES..]) {
                Ok(OpenReply { sid, lid, limits: Limits { max_msg, .. }, .. })
                    if sid == header.sid =>
                {
                    self.session = Some(Session { boot_id: header.boot_id, sid, lid, max_msg });
                    (self.seq, self.lost) = (0, None);
                }
                _ => return self.finish(Err(ClientError::Unexpected(verb))),
            },
            Verb::Close => self.session = None,
            _ if verb.is_numbered() => self.seq = seq,
            _ => (),
        }
        if self.go_on(now_ms) {
            return;
        }
        self.finish(Ok(message));
    }

    fn on_fault(&mut self, now_ms: u64, fault: Fault) {
        match fault {
            Fault::NoSession { .. } | Fault::SessionLost { .. } => self.lost = Some(fault.clone()),
            // A request that was in doubt has not been carried out: what was to come after it can come now.
            Fault::BadAction { .. } | Fault::BadConfig { .. } | Fault::NotReset { .. }
                if self.go_on(now_ms) =>
            {
                return;
            }
            _ => (),
        }
        self.finish(Err(fault.into()));
    }

    /// Goes on to the call proper once the one before is settled, within the same deadline.
    fn go_on(&mut self, now_ms: u64) -> bool {
        let Some(call) = &mut self.call else { return false };
        let Some((verb, mut message)) = call.after.take() else { return false };
        let seq = self.seq + 1;
        message[40..48].copy_from_slice(&seq.to_le_bytes());
        let header = Header { seq, kind: Kind::Request(verb), ..call.request.header };
        call.request = Request { verb, header, message: message.into() };
        call.pause_ms = self.options.pause_ms;
        call.progress = Progress::Paused { until_ms: now_ms };
        self.doubt = None;
        true
    }

    /// A message that does not answer the present call: nothing, unless another server answered the last one as well.
    fn on_stray(&mut self, header: &Header, boot_id: Option<u128>) {
        self.ignored += 1;
        // A call that was sent again may meet a server that was started anew; one that was sent once may not.
        let is_second = self.answered.is_some_and(|last| {
            last.attempts == 1
                && last.request_is_of(header)
                && matches!((last.boot_id, boot_id), (Some(one), Some(other)) if one != other)
        });
        if is_second {
            self.has_two_servers = true;
            if self.call.is_some() {
                self.finish(Err(ClientError::TwoServers));
            }
        }
    }

    fn pause(&mut self, now_ms: u64, least_ms: u64) {
        let Some(call) = &mut self.call else { return };
        // SplitMix64; Steele, Lea & Flood (2014).
        self.jitter = self.jitter.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.jitter;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        let per_mille = 750 + (bits ^ (bits >> 31)) % 501;
        let pause_ms = call.pause_ms.saturating_mul(per_mille) / 1000;
        call.pause_ms = call.pause_ms.saturating_mul(2).min(self.options.longest_pause_ms);
        let until_ms = now_ms.saturating_add(pause_ms.max(least_ms).max(1));
        call.progress = Progress::Paused { until_ms };
    }

    /// Gives up a call in flight whose caller does not wait for it any more: nobody knows whether it was carried out.
    pub fn abandon(&mut self) {
        if self.call.is_some() {
            self.give_up(0);
        }
        self.done = None;
    }

    /// Forgets a snapshot that was not answered in time: nothing depends on it.
    pub fn forget_snapshot(&mut self) {
        self.doubt.take_if(|doubt| doubt.request.verb == Verb::Snapshot);
    }

    fn give_up(&mut self, waited_ms: u64) -> ClientError {
        let call = self.call.take().expect("it has taken too long");
        // What asks about no session can be asked anew.
        if !matches!(call.request.verb, Verb::Spec | Verb::Stats) {
            self.doubt = Some(Doubt { request: call.request, after: call.after });
        }
        ClientError::Timeout { waited_ms, attempts: call.attempts }
    }

    fn finish(&mut self, result: Result<Bytes, ClientError>) {
        let call = self.call.take().expect("a call is in flight");
        if call.request.verb.has_session() || call.request.verb == Verb::Open {
            self.doubt = None;
        }
        self.done = Some(result);
    }
}

impl fmt::Debug for ClientSession {
    // The session's name is a secret.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ClientSession")
            .field("boot_id", &self.boot_id())
            .field("lid", &self.lid())
            .field("next_seq", &self.next_seq())
            .field("is_in_doubt", &self.is_in_doubt())
            .finish_non_exhaustive()
    }
}
