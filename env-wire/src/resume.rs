//! A client's session that goes on at the next server when its own was started anew.
//!
//! The client keeps what the session can be built from again: the bytes of a snapshot, and the requests since. When the
//! session is lost, it opens another one from the snapshot, sends the requests again, and holds each reply against the one
//! that there was: the same digest, with the hash of the state in it wherever that was due. Then it goes on with the call
//! that was in flight. Nothing is written to a disk, and the memory has a bound: every so often a new snapshot takes the
//! place of the requests before it.

mod memory;
#[cfg(test)]
mod tests;

use std::fmt;
use std::sync::Arc;

use bincode::Encode;
use bytes::Bytes;

use crate::client::{ClientError, ClientOptions, ClientOutput, ClientSession};
use crate::codec;
use crate::fault::{Fault, Loss};
use crate::header::{HEADER_BYTES, Header, Kind, Verb};
use crate::message::{Limits, Open, OpenReply, Snapshot, SnapshotReply};
use memory::{Memory, Wish, digest};

/// How a session is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ResumeOptions {
    /// After every so many requests the reply has a hash of the state; from 1.
    pub hash_every: u32,
    /// A snapshot is taken after so many requests, at the next one whose reply has a hash.
    pub snapshot_every: u32,
    /// It is taken earlier if the requests since the last one have more bytes than this.
    pub max_bytes: usize,
}

impl Default for ResumeOptions {
    fn default() -> Self {
        Self { hash_every: 64, snapshot_every: 512, max_bytes: 64 << 20 }
    }
}

/// A [`ClientSession`] that may be resumed: the same calls, and the same outputs.
///
/// After a resumption the session has another lease: whoever holds that looks at [`Self::lid`] when a call has ended.
pub struct ResumingSession {
    session: ClientSession,
    deadline_ms: u64,
    options: Option<ResumeOptions>,
    memory: Option<Memory>,
    stage: Stage,
    /// What the caller wants: a call, or one whose outcome is not known and the reset that follows it.
    wishes: Vec<Wish>,
    /// The number that the first wish has if it is carried out.
    first_seq: u64,
    /// A reply that the caller is given once what has to be done before is done.
    held: Option<Bytes>,
    /// A session is lost and there is none in its place.
    is_lost: bool,
    /// Others had the room that a request of the journal needs: it is sent again with a retry.
    is_held_up: bool,
    /// The call in flight is for no session.
    is_aside: bool,
    ended: Option<ClientError>,
    began_ms: u64,
    attempts: u32,
    resumed: u64,
}

/// How a call ends: with all bytes of the reply, or without.
type Outcome = Result<Bytes, ClientError>;

/// What a call in flight is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// For the caller.
    Plain,
    /// A snapshot to be kept.
    Saving,
    /// Another session.
    Opening,
    /// This request of those that are kept.
    Replaying(usize),
    /// The first of the wishes, after a resumption.
    Wishing,
}

impl ResumingSession {
    /// A client without a session; without `resume` it is a [`ClientSession`] and nothing else.
    #[must_use]
    pub fn new(options: ClientOptions, resume: Option<ResumeOptions>) -> Self {
        Self {
            session: ClientSession::new(options),
            deadline_ms: options.deadline_ms,
            options: resume,
            memory: None,
            stage: Stage::Plain,
            wishes: Vec::new(),
            first_seq: 1,
            held: None,
            is_lost: false,
            is_held_up: false,
            is_aside: false,
            ended: None,
            began_ms: 0,
            attempts: 0,
            resumed: 0,
        }
    }

    /// As [`ClientSession::open`]. A session that may be resumed takes its first snapshot with it, so that a server that
    /// sends none is found out.
    ///
    /// # Errors
    ///
    /// Those of [`ClientSession::open`].
    pub fn open(&mut self, now_ms: u64, open: &Open<'static>) -> Result<(), ClientError> {
        let Some(options) = self.options else { return self.session.open(now_ms, open) };
        let open = Open { hash_every: options.hash_every, ..open.clone() };
        self.session.open(now_ms, &open)?;
        self.memory = Some(Memory::new(open));
        (self.stage, self.is_lost, self.is_held_up, self.ended) =
            (Stage::Plain, false, false, None);
        self.wishes.clear();
        self.begin(now_ms);
        Ok(())
    }

    /// As [`ClientSession::call`].
    ///
    /// # Errors
    ///
    /// Those of [`ClientSession::call`], and those that a resumption has failed with.
    pub fn call(
        &mut self,
        now_ms: u64,
        verb: Verb,
        payload: &impl Encode,
    ) -> Result<(), ClientError> {
        if self.memory.is_none() {
            return self.session.call(now_ms, verb, payload);
        }
        let nobody = Header { boot_id: 0, sid: 0, seq: 0, kind: Kind::Request(verb) };
        let payload = codec::write(&nobody, payload)?[HEADER_BYTES..].into();
        self.wish(now_ms, Wish { verb, payload })
    }

    /// As [`ClientSession::call_empty`].
    ///
    /// # Errors
    ///
    /// Those of [`Self::call`].
    pub fn call_empty(&mut self, now_ms: u64, verb: Verb) -> Result<(), ClientError> {
        if self.memory.is_none() || !verb.has_session() {
            self.session.call_empty(now_ms, verb)?;
            self.is_aside = true;
            return Ok(());
        }
        self.wish(now_ms, Wish { verb, payload: Arc::new([]) })
    }

    /// As [`ClientSession::retry`]; a resumption that was not finished goes on.
    ///
    /// # Errors
    ///
    /// Those of [`ClientSession::retry`], and those that a resumption has failed with.
    pub fn retry(&mut self, now_ms: u64) -> Result<(), ClientError> {
        if let Some(error) = &self.ended {
            return Err(error.clone());
        }
        if self.is_lost {
            self.resume(now_ms)?;
        } else if let Stage::Replaying(place) = self.stage
            && std::mem::take(&mut self.is_held_up)
        {
            self.replay(now_ms, place).transpose()?;
        } else {
            self.session.retry(now_ms)?;
        }
        self.begin(now_ms);
        Ok(())
    }

    /// As [`ClientSession::on_reply`].
    pub fn on_reply(&mut self, now_ms: u64, message: Bytes) {
        self.session.on_reply(now_ms, message);
    }

    /// As [`ClientSession::on_nothing`].
    pub fn on_nothing(&mut self, now_ms: u64) {
        self.session.on_nothing(now_ms);
    }

    /// As [`ClientSession::on_timeout`].
    pub fn on_timeout(&mut self, now_ms: u64) {
        self.session.on_timeout(now_ms);
    }

    /// As [`ClientSession::poll`]; the deadline is that of the caller's call, with all that had to be done for it.
    pub fn poll(&mut self, now_ms: u64) -> ClientOutput {
        loop {
            let end_ms = self.began_ms.saturating_add(self.deadline_ms);
            let is_late = self.stage != Stage::Plain && now_ms >= end_ms;
            let output = match self.session.poll(now_ms) {
                ClientOutput::Send { .. } | ClientOutput::Wait { .. } if is_late => {
                    self.session.abandon();
                    let waited_ms = now_ms - self.began_ms;
                    let attempts = self.attempts;
                    ClientOutput::Done(Err(ClientError::Timeout { waited_ms, attempts }))
                }
                ClientOutput::Send { verb, message, timeout_ms } => {
                    self.attempts = self.attempts.saturating_add(1);
                    let is_plain = self.stage == Stage::Plain;
                    let most_ms = if is_plain { timeout_ms } else { end_ms - now_ms };
                    ClientOutput::Send { verb, message, timeout_ms: timeout_ms.min(most_ms) }
                }
                ClientOutput::Wait { until_ms } if self.stage != Stage::Plain => {
                    ClientOutput::Wait { until_ms: until_ms.min(end_ms) }
                }
                output => output,
            };
            let ClientOutput::Done(result) = output else { return output };
            if let Some(result) = self.on_done(now_ms, result) {
                return ClientOutput::Done(result);
            }
        }
    }

    /// As [`ClientSession::abandon`]; what the caller's call has brought already is returned.
    pub fn abandon(&mut self, now_ms: u64) -> Option<Result<Bytes, ClientError>> {
        if let ClientOutput::Done(result) = self.poll(now_ms) {
            return Some(result);
        }
        self.session.abandon();
        self.is_aside = false;
        if self.stage != Stage::Saving {
            return None;
        }
        self.session.forget_snapshot();
        self.stage = Stage::Plain;
        self.held.take().map(Ok)
    }

    /// The number that the next reset, step or restore of the present session has.
    #[must_use]
    pub fn next_seq(&self) -> u64 {
        self.session.next_seq()
    }

    /// The name of the session's lease.
    #[must_use]
    pub fn lid(&self) -> Option<u128> {
        self.session.lid()
    }

    /// Whether what was sent last is answered, and [`Self::poll`] tells what follows.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.session.is_done()
    }

    /// Whether the last call was not answered in time, or its session was lost and is not resumed.
    #[must_use]
    pub fn is_in_doubt(&self) -> bool {
        self.is_lost || self.is_held_up || self.session.is_in_doubt()
    }

    /// Whether sessions that are lost are resumed.
    #[must_use]
    pub fn is_resuming(&self) -> bool {
        self.options.is_some()
    }

    /// How often the session was resumed.
    #[must_use]
    pub fn resumed(&self) -> u64 {
        self.resumed
    }

    /// Why the session, which goes on, can no longer be resumed: a snapshot was refused.
    #[must_use]
    pub fn gap(&self) -> Option<&Fault> {
        self.memory.as_ref()?.gap.as_ref()
    }

    /// How many bytes are kept for a resumption: of the snapshot, and of the requests since.
    #[must_use]
    pub fn kept_bytes(&self) -> usize {
        self.memory.as_ref().map_or(0, Memory::bytes)
    }

    fn begin(&mut self, now_ms: u64) {
        (self.began_ms, self.attempts) = (now_ms, 0);
    }

    fn wish(&mut self, now_ms: u64, wish: Wish) -> Result<(), ClientError> {
        if let Some(error) = self.ended.as_ref().filter(|_| wish.verb != Verb::Close) {
            return Err(error.clone());
        }
        let is_resuming = self.is_lost || self.is_in_doubt() && self.stage != Stage::Plain;
        match wish.verb {
            Verb::Close => {
                self.session.call_bytes(now_ms, wish.verb, &wish.payload)?;
                self.stage = Stage::Plain;
                self.wishes = vec![wish];
            }
            // What is not carried out yet comes first, at the server that comes next.
            Verb::Reset if is_resuming => {
                self.wishes.retain(|wish| wish.verb.is_numbered());
                self.wishes.truncate(1);
                self.wishes.push(wish);
                self.held = None;
                return self.retry(now_ms);
            }
            _ if is_resuming => return Err(ClientError::InDoubt),
            _ => {
                let is_doubtful = self.session.is_in_doubt();
                self.session.call_bytes(now_ms, wish.verb, &wish.payload)?;
                self.wishes.retain(|wish| is_doubtful && wish.verb.is_numbered());
                self.wishes.truncate(1);
                self.wishes.push(wish);
                self.first_seq = self.session.next_seq();
                self.stage = Stage::Plain;
            }
        }
        self.begin(now_ms);
        Ok(())
    }

    /// A call has ended: what the caller is told, unless something else has to be done first.
    fn on_done(&mut self, now_ms: u64, result: Outcome) -> Option<Outcome> {
        if std::mem::take(&mut self.is_aside) || self.memory.is_none() {
            return Some(result);
        }
        match (self.stage, result) {
            (Stage::Plain, result) => self.on_plain(now_ms, result),
            (Stage::Saving, result) => self.on_saved(now_ms, result),
            (_, Err(error)) if is_loss(&error) => self.try_resume(now_ms),
            // The same stage again with a retry.
            (_, Err(error @ ClientError::Timeout { .. })) => Some(Err(error)),
            (Stage::Opening, Ok(message)) => self.on_opened(now_ms, &message),
            (Stage::Opening, Err(error)) => {
                // Another server may take it, or the same one with other settings.
                self.is_lost = true;
                Some(Err(match error {
                    ClientError::Fault(fault) if !matches!(fault, Fault::Capacity { .. }) => {
                        ClientError::NotTaken(fault)
                    }
                    error => error,
                }))
            }
            (Stage::Replaying(place), Ok(message)) => {
                let before = self.memory.as_ref()?.entry(place)?.reply;
                if before.is_some_and(|before| before != digest(&message)) {
                    return Some(self.fail(ClientError::Differs { request: place as u64 + 1 }));
                }
                self.replay(now_ms, place + 1)
            }
            // Less than the one before allowed is allowed here.
            (Stage::Replaying(_), Err(ClientError::Fault(fault @ Fault::BadConfig { .. }))) => {
                Some(self.fail(ClientError::NotResumable(fault)))
            }
            (Stage::Replaying(place), Err(error)) if is_refusal(&error) => {
                Some(self.fail(ClientError::Differs { request: place as u64 + 1 }))
            }
            (Stage::Replaying(_), Err(error @ ClientError::Fault(Fault::Capacity { .. }))) => {
                self.is_held_up = true;
                Some(Err(error))
            }
            (Stage::Replaying(_), Err(error)) => Some(self.fail(error)),
            (Stage::Wishing, Ok(message)) => {
                self.keep(0, Some(&message));
                self.wishes.remove(0);
                self.fulfil(now_ms, Some(message))
            }
            (Stage::Wishing, Err(error)) if is_refusal(&error) && self.wishes.len() > 1 => {
                self.wishes.remove(0);
                self.fulfil(now_ms, None)
            }
            (Stage::Wishing, Err(error)) => Some(self.end(Err(error))),
        }
    }

    fn on_plain(&mut self, now_ms: u64, result: Outcome) -> Option<Outcome> {
        let verb = self.wishes.last().map_or(Verb::Open, |wish| wish.verb);
        if verb == Verb::Open {
            let memory = self.memory.as_mut()?;
            if let Ok(message) = &result {
                memory.reply = opened(message).map(lasting);
            }
            return match result {
                Ok(message) => self.save(now_ms, message),
                refused => Some(refused),
            };
        }
        if verb == Verb::Close {
            if result.is_ok() {
                self.memory = None;
            }
            return Some(result);
        }
        self.settle(result.as_ref().ok());
        match result {
            Err(error) if is_loss(&error) => self.try_resume(now_ms),
            Ok(message) => self.deliver(now_ms, message),
            Err(error) => Some(Err(error)),
        }
    }

    /// Puts the wishes that were carried out into the journal; those that were not stay.
    fn settle(&mut self, reply: Option<&Bytes>) {
        let carried_out = self.session.next_seq() - self.first_seq;
        if let Some(reply) = reply {
            // Of two, the first may have been refused.
            let first = self.wishes.len()
                - usize::try_from(carried_out).unwrap_or(0).min(self.wishes.len());
            let last = self.wishes.len() - 1;
            for place in first..self.wishes.len() {
                self.keep(place, (place == last).then_some(reply));
            }
            self.wishes.clear();
        } else if carried_out == 1 && self.wishes.len() == 2 {
            self.keep(0, None);
            self.wishes.remove(0);
        }
        self.first_seq = self.session.next_seq();
    }

    fn keep(&mut self, place: usize, reply: Option<&Bytes>) {
        let wish = self.wishes[place].clone();
        if let Some(memory) = &mut self.memory {
            memory.keep(wish, reply.map(AsRef::as_ref));
        }
    }

    /// Gives the caller a reply, after a snapshot if one is due.
    fn deliver(&mut self, now_ms: u64, message: Bytes) -> Option<Outcome> {
        let (options, memory) = (self.options?, self.memory.as_ref()?);
        let requests = self.session.next_seq() - 1;
        let is_due = memory.is_long(options.snapshot_every as usize, options.max_bytes)
            && requests.is_multiple_of(options.hash_every.max(1).into());
        if is_due { self.save(now_ms, message) } else { Some(self.end(Ok(message))) }
    }

    fn end(&mut self, outcome: Outcome) -> Outcome {
        self.stage = Stage::Plain;
        self.wishes.clear();
        outcome
    }

    /// Asks for a snapshot; the caller's reply waits for it.
    fn save(&mut self, now_ms: u64, message: Bytes) -> Option<Outcome> {
        if self.session.call(now_ms, Verb::Snapshot, &Snapshot { env: None }).is_err() {
            return Some(self.end(Ok(message)));
        }
        (self.stage, self.held) = (Stage::Saving, Some(message));
        self.wishes.clear();
        None
    }

    fn on_saved(&mut self, now_ms: u64, result: Outcome) -> Option<Outcome> {
        let is_first = self.memory.as_ref()?.is_new();
        match result {
            Err(error) if is_loss(&error) => return self.try_resume(now_ms),
            Err(ClientError::Fault(fault)) if is_first => {
                self.held = None;
                return Some(self.fail(ClientError::NotResumable(fault)));
            }
            Err(ClientError::Fault(fault)) => {
                self.memory.as_mut()?.give_up(fault);
            }
            Ok(message) => {
                let data = Header::read(&message).ok().and_then(|(_, payload)| {
                    codec::read::<SnapshotReply>(payload).ok().map(|reply| reply.data.to_vec())
                });
                if let Some(data) = data {
                    self.memory.as_mut()?.rebase(data);
                }
                let max_msg = self.session.max_msg()?;
                if let Some(fault) = self.memory.as_ref()?.too_large_to_open(max_msg) {
                    if is_first {
                        self.held = None;
                        return Some(self.fail(ClientError::NotResumable(fault)));
                    }
                    self.memory.as_mut()?.give_up(fault);
                }
            }
            // Not in time: there will be another one.
            Err(_) => self.session.forget_snapshot(),
        }
        let message = self.held.take()?;
        Some(self.end(Ok(message)))
    }

    /// Begins a resumption, where there is something to resume from.
    fn try_resume(&mut self, now_ms: u64) -> Option<Outcome> {
        if let Some(fault) = self.memory.as_ref()?.gap.clone() {
            return Some(self.fail(ClientError::NotResumable(fault)));
        }
        self.resume(now_ms).err().map(Err)
    }

    fn resume(&mut self, now_ms: u64) -> Result<(), ClientError> {
        let memory = self.memory.as_mut().ok_or(ClientError::NotOpen)?;
        self.is_lost = true;
        self.session.open(now_ms, &memory.next_open())?;
        memory.count_open();
        (self.is_lost, self.stage) = (false, Stage::Opening);
        Ok(())
    }

    fn on_opened(&mut self, now_ms: u64, message: &[u8]) -> Option<Outcome> {
        let reply = opened(message).map(lasting);
        if reply != self.memory.as_ref()?.reply {
            return Some(self.fail(ClientError::Differs { request: 0 }));
        }
        self.replay(now_ms, 0)
    }

    /// Sends a request of the journal again, or goes on if there are no more.
    fn replay(&mut self, now_ms: u64, place: usize) -> Option<Outcome> {
        let Some(entry) = self.memory.as_ref()?.entry(place) else {
            self.resumed += 1;
            let held = self.held.take();
            return self.fulfil(now_ms, held);
        };
        let Wish { verb, payload } = entry.wish.clone();
        self.stage = Stage::Replaying(place);
        let error = match self.session.call_bytes(now_ms, verb, &payload).err()? {
            // Messages have to be shorter here.
            ClientError::Fault(fault) => ClientError::NotResumable(fault),
            error => error,
        };
        // The session stands at an earlier state: nothing may go on from there.
        Some(self.fail(error))
    }

    /// Sends a wish, or gives the caller the last reply if there are no more.
    fn fulfil(&mut self, now_ms: u64, last: Option<Bytes>) -> Option<Outcome> {
        let Some(Wish { verb, payload }) = self.wishes.first().cloned() else {
            return self.deliver(now_ms, last?);
        };
        self.stage = Stage::Wishing;
        self.session.call_bytes(now_ms, verb, &payload).err().map(Err)
    }

    /// The session is over, and will not be resumed.
    fn fail(&mut self, error: ClientError) -> Outcome {
        self.ended = Some(error.clone());
        self.end(Err(error))
    }
}

impl fmt::Debug for ResumingSession {
    // What is kept shows weeds that nobody has seen.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ResumingSession")
            .field("session", &self.session)
            .field("stage", &self.stage)
            .field("resumed", &self.resumed)
            .field("kept_bytes", &self.kept_bytes())
            .finish_non_exhaustive()
    }
}

/// Whether a session is lost that may be opened again: not one that was closed, or whose environments failed.
fn is_loss(error: &ClientError) -> bool {
    match error {
        ClientError::Fault(Fault::SessionLost { .. }) => true,
        ClientError::Fault(Fault::NoSession { reason, .. }) => {
            ![Loss::Closed as u64, Loss::Fault as u64].contains(reason)
        }
        _ => false,
    }
}

/// Whether a server has looked at a request and has not carried it out.
fn is_refusal(error: &ClientError) -> bool {
    matches!(
        error,
        ClientError::Fault(
            Fault::BadAction { .. } | Fault::BadConfig { .. } | Fault::NotReset { .. }
        )
    )
}

/// What is the same in every session of the same environments.
fn lasting(reply: OpenReply) -> OpenReply {
    OpenReply { sid: 0, lid: 0, limits: Limits::default(), ..reply }
}

fn opened(message: &[u8]) -> Option<OpenReply> {
    let (_, payload) = Header::read(message).ok()?;
    codec::read(payload).ok()
}
