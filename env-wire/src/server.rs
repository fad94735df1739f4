//! The server's end of all sessions: who may ask for what, and what is answered.
//!
//! Queries, finished jobs and signs of life go in; jobs to be done and replies to be sent come out. A request of a session
//! that changes something has the next number of that session, and its reply is kept until the one after: a request that
//! arrives again is not carried out again but answered again. Times are milliseconds since the server started.

mod answers;
mod job;
mod options;
mod session;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, VecDeque};
use std::fmt;

use bytes::Bytes;

use self::answers::{Answers, Asked};
use self::session::{
    Run, Session, Tombstone, digest, no_session, session_of, shortest_life_ms, why_ended,
};
use crate::codec;
use crate::fault::{Fault, Loss};
use crate::header::{Header, Kind, MAJOR, MINOR, Verb};
use crate::message::{
    CloseReply, Open, Reset, Restore, SessionStats, Snapshot, SpecReply, StatsReply, Step,
};

pub use self::job::{Finished, Job, JobId};
pub use self::options::ServerOptions;

/// How long it is remembered that a session has ended, milliseconds.
pub const TOMBSTONE_MS: u64 = 120_000;
/// How long a client is told to wait where a session has a request already, milliseconds.
const BUSY_MS: u64 = 10;

/// A query of the transport: what a reply is sent to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct QueryId(pub u64);

/// What the server has to do next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ServerOutput {
    /// A job for a worker; [`ServerSessions::on_finished`] is told of its end. A session has one job at a time.
    Start(Job),
    /// A reply to be sent.
    Reply {
        /// What it answers.
        query: QueryId,
        /// All of its bytes.
        message: Bytes,
    },
    /// A query that is not answered: its client has sent the request again, or may do so later.
    Drop(QueryId),
    /// The environments of this session are not needed any more; none of its jobs runs.
    Free {
        /// The session.
        sid: u128,
        /// The name of its lease.
        lid: u128,
        /// Why, in words for logs.
        why: &'static str,
    },
}

/// All sessions of a server.
pub struct ServerSessions {
    options: ServerOptions,
    ids: Box<dyn FnMut() -> u128 + Send>,
    // A sid is looked up as it is: what the time of a look-up among few keys tells of 128 random bits drowns in the noise
    // of a network's round trip.
    sessions: BTreeMap<u128, Session>,
    sid_of_lease: BTreeMap<u128, u128>,
    sid_of_nonce: BTreeMap<u128, u128>,
    tombstones: BTreeMap<u128, Tombstone>,
    /// Tombstones from the oldest to the newest.
    ended: VecDeque<(u64, u128)>,
    jobs: BTreeMap<JobId, u128>,
    last_job: u64,
    /// Before then no session ends by itself; not all are looked at with every message.
    due_ms: u64,
    answers: Answers,
    opened: u64,
    lost: u64,
    steps: u64,
    is_shutting_down: bool,
}

impl ServerSessions {
    /// A server without sessions. `ids` draws the names of sessions and leases: 128 bits that nobody can guess.
    #[must_use]
    pub fn new(options: ServerOptions, ids: Box<dyn FnMut() -> u128 + Send>) -> Self {
        Self {
            options,
            ids,
            sessions: BTreeMap::new(),
            sid_of_lease: BTreeMap::new(),
            sid_of_nonce: BTreeMap::new(),
            tombstones: BTreeMap::new(),
            ended: VecDeque::new(),
            jobs: BTreeMap::new(),
            last_job: 0,
            due_ms: u64::MAX,
            answers: Answers::default(),
            opened: 0,
            lost: 0,
            steps: 0,
            is_shutting_down: false,
        }
    }

    /// A message that came to the key of `verb`. Each is answered or dropped, now or when its job has ended.
    pub fn on_query(&mut self, now_ms: u64, query: QueryId, verb: Verb, message: &[u8]) {
        self.expire(now_ms);
        let nobody = Header { boot_id: 0, sid: 0, seq: 0, kind: Kind::Fault };
        let mut asked = Asked { query, header: nobody, at_ms: now_ms };
        let is_done = Header::read(message).map_err(Fault::from).and_then(|(header, payload)| {
            asked.header = header;
            self.check(verb, message, &header)?;
            match verb {
                Verb::Spec => self.tell_spec(asked, payload),
                Verb::Stats => self.tell_stats(asked, payload),
                Verb::Open => self.open(asked, message, payload),
                Verb::Close => self.close(asked, payload),
                Verb::Snapshot => self.snapshot(asked, message, payload),
                Verb::Reset | Verb::Step | Verb::Restore => self.numbered(asked, message, payload),
            }
        });
        if let Err(fault) = is_done {
            self.answers.fault(now_ms, &asked, &fault);
        }
    }

    /// A worker has done its job, or could not.
    ///
    /// A [`Fault::EnvFault`] says that the environments are lost; after any other fault they are as they were.
    pub fn on_finished(&mut self, now_ms: u64, job: JobId, result: Result<Finished, Fault>) {
        let Some(sid) = self.jobs.remove(&job) else { return };
        let session = self.sessions.get_mut(&sid).expect("it does not end while a job runs");
        let Run { verb, request, asked } = session.run.take().expect("it has this job");
        session.active_ms = now_ms;
        self.due_ms = self.due_ms.min(now_ms + shortest_life_ms(&self.options.limits));
        if let Ok(finished) = &result {
            self.steps += finished.steps.saturating_sub(session.steps);
            session.steps = finished.steps;
        }
        match result {
            Ok(finished) if verb == Verb::Open => self.opened(now_ms, sid, &asked, finished),
            Err(fault) if verb == Verb::Open => {
                self.answers.fault(now_ms, &asked, &fault);
                self.forget(sid);
            }
            Ok(finished) => {
                let message = Bytes::from(finished.message);
                if verb.is_numbered() {
                    session.seq += 1;
                    session.last = Some((request, message.clone()));
                }
                self.answers.reply(now_ms, &asked, message);
            }
            Err(fault) => {
                self.answers.fault(now_ms, &asked, &fault);
                if matches!(fault, Fault::EnvFault { .. }) {
                    (session.max_reply, session.last) = (0, None);
                    session.fault = Some(fault);
                    self.lost += 1;
                    let (lid, why) = (session.lid, why_ended(Loss::Fault));
                    self.answers.outputs.push_back(ServerOutput::Free { sid, lid, why });
                }
            }
        }
        let Some(session) = self.sessions.get_mut(&sid) else { return };
        if let Some(close) = session.closing.take() {
            self.end(now_ms, sid, Loss::Closed);
            self.tell_closed(now_ms, &close);
        } else if self.is_shutting_down {
            self.abandon(sid);
        }
    }

    /// The client's sign of life has appeared or is gone. Leases of unknown sessions are none of ours.
    pub fn on_lease(&mut self, now_ms: u64, lid: u128, is_there: bool) {
        self.expire(now_ms);
        let session = self.sid_of_lease.get(&lid).and_then(|sid| self.sessions.get_mut(sid));
        if let Some(session) = session {
            session.has_lease = is_there;
            session.lease_lost_ms = now_ms;
            self.due_ms = self.due_ms.min(now_ms + shortest_life_ms(&self.options.limits));
        }
    }

    /// What is to be done now; to be called until there is nothing.
    pub fn poll(&mut self, now_ms: u64) -> Option<ServerOutput> {
        self.expire(now_ms);
        self.answers.outputs.pop_front()
    }

    /// When [`Self::poll`] has to be called again at the latest, whatever happens until then.
    #[must_use]
    pub fn wake_ms(&self) -> Option<u64> {
        let first_ended = self.ended.front().map(|&(at_ms, _)| at_ms + TOMBSTONE_MS);
        let is_due = !self.sessions.is_empty() && self.due_ms < u64::MAX;
        is_due.then_some(self.due_ms).into_iter().chain(first_ended).min()
    }

    /// Whether there is a session of this name.
    #[must_use]
    pub fn is_open(&self, sid: u128) -> bool {
        self.sessions.contains_key(&sid)
    }

    /// What the server does at present.
    #[must_use]
    pub fn stats(&self, now_ms: u64) -> StatsReply {
        StatsReply {
            uptime_ms: now_ms,
            sessions: u32::try_from(self.sessions.len()).unwrap_or(u32::MAX),
            envs: self.sessions.values().fold(0, |sum, session| sum.saturating_add(session.envs)),
            opened: self.opened,
            lost: self.lost,
            requests: self.answers.requests,
            faults: self.answers.faults,
            steps: self.steps,
            latency_us: self.answers.latency_us.clone(),
            open: self.sessions.values().map(|session| session.stats(now_ms)).collect(),
        }
    }

    /// What a session does at present, if there is one of this name.
    #[must_use]
    pub fn stats_of(&self, now_ms: u64, sid: u128) -> Option<SessionStats> {
        self.sessions.get(&sid).map(|session| session.stats(now_ms))
    }

    /// Lets the sessions end: those without a job now, the others with their job. Opens are dropped from now on, so that a
    /// client that goes on asking finds the server that comes after.
    pub fn shut_down(&mut self, now_ms: u64) {
        self.expire(now_ms);
        self.is_shutting_down = true;
        let is_idle = |(&sid, session): (&u128, &Session)| session.run.is_none().then_some(sid);
        let idle: Vec<u128> = self.sessions.iter().filter_map(is_idle).collect();
        for sid in idle {
            self.abandon(sid);
        }
    }

    /// What every message has to fulfil, in the order of the protocol.
    fn check(&self, verb: Verb, message: &[u8], header: &Header) -> Result<(), Fault> {
        let (size, limit) = (message.len() as u64, u64::from(self.options.limits.max_msg));
        if size > limit {
            return Err(Fault::TooLarge { size, limit });
        }
        if header.kind != Kind::Request(verb) {
            return Err(Fault::Malformed { offset: 48 });
        }
        let boot_id = self.options.boot_id;
        if verb.has_session() && header.boot_id != boot_id {
            return Err(Fault::SessionLost { boot_id });
        }
        if !verb.has_session() {
            let parts = [(8, header.boot_id), (24, header.sid), (40, header.seq.into())];
            if let Some((offset, _)) = parts.into_iter().find(|&(_, part)| part != 0) {
                return Err(Fault::Malformed { offset });
            }
        }
        Ok(())
    }

    fn tell_spec(&mut self, asked: Asked, payload: &[u8]) -> Result<(), Fault> {
        codec::read_empty(payload)?;
        let options = &self.options;
        let spec = SpecReply {
            major_min: MAJOR,
            major_max: MAJOR,
            minor: MINOR,
            server: options.server.clone(),
            build: options.build.clone(),
            envs: options.envs.clone(),
            limits: options.limits,
        };
        let message = codec::write(&self.reply_of_server(Verb::Spec), &spec)?;
        self.answers.reply(asked.at_ms, &asked, message.into());
        Ok(())
    }

    fn tell_stats(&mut self, asked: Asked, payload: &[u8]) -> Result<(), Fault> {
        codec::read_empty(payload)?;
        let stats = self.stats(asked.at_ms);
        let message = codec::write(&self.reply_of_server(Verb::Stats), &stats)?;
        self.answers.reply(asked.at_ms, &asked, message.into());
        Ok(())
    }

    fn reply_of_server(&self, verb: Verb) -> Header {
        Header { boot_id: self.options.boot_id, sid: 0, seq: 0, kind: Kind::Reply(verb) }
    }

    /// A session for this nonce: the one that it has, or else a new one.
    fn open(&mut self, asked: Asked, message: &[u8], payload: &[u8]) -> Result<(), Fault> {
        let open: Open = codec::read(payload)?;
        open.check_client()?;
        let request = digest(message);
        if let Some(sid) = self.sid_of_nonce.get(&open.nonce) {
            if let Some(tombstone) = self.tombstones.get(sid) {
                return Err(no_session(tombstone.loss));
            }
            let session = self.sessions.get_mut(sid).expect("it is open if it has not ended");
            if session.open != request {
                return Err(Fault::SeqReuse { seq: 0 });
            }
            session.active_ms = asked.at_ms;
            match (&session.opened, &mut session.run) {
                (Some(reply), _) => self.answers.reply(asked.at_ms, &asked, reply.clone()),
                (None, Some(run)) => self.answers.replace(&mut run.asked, asked),
                (None, None) => unreachable!("it is opened by a job"),
            }
            return Ok(());
        }
        if self.is_shutting_down {
            self.answers.outputs.push_back(ServerOutput::Drop(asked.query));
            return Ok(());
        }
        let (used, most) = (self.sessions.len() as u64, self.options.limits.max_sessions.into());
        if used >= most {
            return Err(Fault::full(used, most, "sessions", "max_sessions"));
        }
        let (sid, lid) = ((self.ids)(), (self.ids)());
        self.sid_of_nonce.insert(open.nonce, sid);
        self.sid_of_lease.insert(lid, sid);
        let session = Session {
            nonce: open.nonce,
            lid,
            client: open.client,
            envs: open.num_envs,
            open: request,
            opened: None,
            opened_ms: asked.at_ms,
            max_reply: 0,
            steps: 0,
            active_ms: asked.at_ms,
            has_lease: false,
            lease_lost_ms: asked.at_ms,
            seq: 0,
            last: None,
            run: None,
            closing: None,
            fault: None,
        };
        self.sessions.insert(sid, session);
        let header = Header { boot_id: self.options.boot_id, sid, seq: 0, kind: asked.header.kind };
        self.start(sid, header, Run { verb: Verb::Open, request, asked }, message);
        Ok(())
    }

    /// The environments of a session are there; it is kept if its replies can be kept.
    fn opened(&mut self, now_ms: u64, sid: u128, asked: &Asked, finished: Finished) {
        let (size, limit) = (u64::from(finished.max_reply), self.options.max_cached_bytes);
        let used: u64 = self.sessions.values().map(|session| u64::from(session.max_reply)).sum();
        let fault = if size > limit {
            let text = format!(
                "`num_envs` must leave replies of at most {limit} bytes, `max_cached` of the server, got {size}"
            );
            Some(Fault::BadConfig { text })
        } else if used + size > limit {
            Some(Fault::full(used, limit, "bytes of kept replies", "max_cached"))
        } else {
            None
        };
        if let Some(fault) = fault {
            self.answers.fault(now_ms, asked, &fault);
            let (lid, why) = (self.sessions[&sid].lid, "refused: no room for its replies");
            self.answers.outputs.push_back(ServerOutput::Free { sid, lid, why });
            self.forget(sid);
            return;
        }
        let session = self.sessions.get_mut(&sid).expect("it is being opened");
        let message = Bytes::from(finished.message);
        session.max_reply = finished.max_reply;
        session.opened = Some(message.clone());
        self.opened += 1;
        self.answers.reply(now_ms, asked, message);
    }

    /// A request with the next number, or the last one again.
    fn numbered(&mut self, asked: Asked, message: &[u8], payload: &[u8]) -> Result<(), Fault> {
        let Asked { header, at_ms, .. } = asked;
        let session = session_of(&mut self.sessions, &self.tombstones, &asked)?;
        let request = digest(message);
        let (seq, next) = (header.seq, session.seq + 1);
        if let Some((last, reply)) = session.last.as_ref().filter(|_| seq == session.seq) {
            let reply = reply.clone();
            if *last != request {
                return Err(Fault::SeqReuse { seq });
            }
            self.answers.reply(at_ms, &asked, reply);
            return Ok(());
        }
        if seq != next {
            return Err(Fault::BadSeq { expected: next });
        }
        if let Some(run) = &mut session.run {
            if !run.verb.is_numbered() {
                return Err(Fault::Busy { retry_ms: BUSY_MS });
            }
            if run.request != request {
                return Err(Fault::SeqReuse { seq });
            }
            self.answers.replace(&mut run.asked, asked);
            return Ok(());
        }
        let Kind::Request(verb) = header.kind else { unreachable!("it has been checked") };
        match verb {
            Verb::Reset => codec::read::<Reset>(payload).map(|_| ())?,
            Verb::Restore => codec::read::<Restore>(payload).map(|_| ())?,
            _ => codec::read::<Step>(payload).map(|_| ())?,
        }
        self.start(header.sid, header, Run { verb, request, asked }, message);
        Ok(())
    }

    /// The state as bytes: nothing changes, so it bears the number of the last request and may be asked for again.
    fn snapshot(&mut self, asked: Asked, message: &[u8], payload: &[u8]) -> Result<(), Fault> {
        let header = asked.header;
        let is_allowed = self.options.allow_snapshot;
        let session = session_of(&mut self.sessions, &self.tombstones, &asked)?;
        if !is_allowed {
            let text =
                "this server sends no snapshots: it runs without `--allow-snapshot`".to_owned();
            return Err(Fault::NotAllowed { text });
        }
        if header.seq != session.seq {
            return Err(Fault::BadSeq { expected: session.seq + 1 });
        }
        codec::read::<Snapshot>(payload)?;
        let request = digest(message);
        if let Some(run) = &mut session.run {
            if run.verb != Verb::Snapshot || run.request != request {
                return Err(Fault::Busy { retry_ms: BUSY_MS });
            }
            self.answers.replace(&mut run.asked, asked);
            return Ok(());
        }
        self.start(header.sid, header, Run { verb: Verb::Snapshot, request, asked }, message);
        Ok(())
    }

    /// The end of a session, once its job has ended; of an ended one, the same answer again.
    fn close(&mut self, asked: Asked, payload: &[u8]) -> Result<(), Fault> {
        codec::read_empty(payload)?;
        let sid = asked.header.sid;
        if let Some(session) = self.sessions.get_mut(&sid) {
            session.active_ms = asked.at_ms;
            if session.run.is_some() {
                match &mut session.closing {
                    Some(close) => self.answers.replace(close, asked),
                    None => session.closing = Some(asked),
                }
                return Ok(());
            }
            self.end(asked.at_ms, sid, Loss::Closed);
        }
        match self.tombstones.get(&sid) {
            Some(Tombstone { loss: Loss::Closed, .. }) => self.tell_closed(asked.at_ms, &asked),
            Some(tombstone) => return Err(no_session(tombstone.loss)),
            None => return Err(no_session(Loss::Unknown)),
        }
        Ok(())
    }

    fn tell_closed(&mut self, now_ms: u64, asked: &Asked) {
        let header = Header { kind: Kind::Reply(Verb::Close), ..asked.header };
        let steps = self.tombstones.get(&header.sid).map_or(0, |tombstone| tombstone.steps);
        let message = codec::write(&header, &CloseReply { steps }).expect("it is short");
        self.answers.reply(now_ms, asked, message.into());
    }

    fn start(&mut self, sid: u128, header: Header, run: Run, message: &[u8]) {
        self.last_job += 1;
        let id = JobId(self.last_job);
        self.jobs.insert(id, sid);
        let session = self.sessions.get_mut(&sid).expect("the job is its");
        session.run = Some(run);
        let job = Job { id, sid, lid: session.lid, header, message: message.into() };
        self.answers.outputs.push_back(ServerOutput::Start(job));
    }

    /// Ends the sessions whose client is gone or silent, and forgets those that ended long ago.
    fn expire(&mut self, now_ms: u64) {
        if self.due_ms <= now_ms {
            let limits = self.options.limits;
            let is_over = |(&sid, session): (&u128, &Session)| {
                let (at_ms, loss) = session.end_ms(&limits)?;
                (at_ms <= now_ms).then_some((sid, loss))
            };
            let over: Vec<(u128, Loss)> = self.sessions.iter().filter_map(is_over).collect();
            for (sid, loss) in over {
                self.end(now_ms, sid, loss);
            }
            let ends = self.sessions.values().filter_map(|session| session.end_ms(&limits));
            self.due_ms = ends.map(|(at_ms, _)| at_ms).min().unwrap_or(u64::MAX);
        }
        while let Some(&(at_ms, sid)) = self.ended.front()
            && at_ms + TOMBSTONE_MS <= now_ms
        {
            self.ended.pop_front();
            self.forget(sid);
        }
    }

    /// Ends a session without a job; that it was there is remembered for a while.
    fn end(&mut self, now_ms: u64, sid: u128, loss: Loss) {
        let session = self.sessions.remove(&sid).expect("it has not ended");
        self.sid_of_lease.remove(&session.lid);
        let loss = match loss {
            Loss::Lease | Loss::Idle if session.fault.is_some() => Loss::Fault,
            loss => loss,
        };
        if session.fault.is_none() {
            self.lost += u64::from(loss != Loss::Closed);
            let (lid, why) = (session.lid, why_ended(loss));
            self.answers.outputs.push_back(ServerOutput::Free { sid, lid, why });
        }
        let tombstone = Tombstone { nonce: session.nonce, loss, steps: session.steps };
        self.tombstones.insert(sid, tombstone);
        self.ended.push_back((now_ms, sid));
        if self.ended.len() > 4 * self.options.limits.max_sessions as usize {
            let (_, oldest) = self.ended.pop_front().expect("there are many");
            self.forget(oldest);
        }
    }

    /// Ends a session without a job that nobody will ask about.
    fn abandon(&mut self, sid: u128) {
        let session = self.sessions.get(&sid).filter(|session| session.fault.is_none());
        if let Some(&Session { lid, .. }) = session {
            self.lost += 1;
            self.answers.outputs.push_back(ServerOutput::Free { sid, lid, why: "server ends" });
        }
        self.forget(sid);
    }

    fn forget(&mut self, sid: u128) {
        if let Some(session) = self.sessions.remove(&sid) {
            self.sid_of_lease.remove(&session.lid);
            self.sid_of_nonce.remove(&session.nonce);
        }
        if let Some(tombstone) = self.tombstones.remove(&sid) {
            self.sid_of_nonce.remove(&tombstone.nonce);
        }
    }
}

impl fmt::Debug for ServerSessions {
    // The names of sessions are secrets of their clients.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ServerSessions")
            .field("server", &self.options.server)
            .field("sessions", &self.sessions.len())
            .finish_non_exhaustive()
    }
}
