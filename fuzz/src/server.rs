//! A server with a session, fed with messages.

use std::collections::{BTreeMap, BTreeSet};

use swath_wire::codec;
use swath_wire::fault::Fault;
use swath_wire::header::{Header, Kind, Verb};
use swath_wire::hosted::Hosted;
use swath_wire::message::{Limits, Open};
use swath_wire::server::{Finished, Job, QueryId, ServerOptions, ServerOutput, ServerSessions};

use crate::golden;
use crate::records::Records;

/// Bytes as they are, to the key of a verb: this plus the verb's place in [`Verb::ALL`].
pub const MESSAGE: u8 = 0;
/// Bytes behind the header of the request that the session expects.
pub const PAYLOAD: u8 = 8;
/// The last message once more.
pub const AGAIN: u8 = 16;
/// Time passes, and the client's sign of life comes or goes.
pub const LATER: u8 = 24;

const BOOT_ID: u128 = 0x1234_5678_9abc_def0_1234_5678_9abc_def0;
const LIMITS: Limits = Limits {
    max_msg: 1 << 20,
    max_sessions: 3,
    max_envs: 4,
    lease_ms: 1000,
    grace_ms: 3000,
    idle_ms: 10_000,
};

struct Bench {
    server: ServerSessions,
    hosted: BTreeMap<u128, Hosted>,
    now_ms: u64,
    /// Queries that were neither answered nor dropped.
    waiting: BTreeSet<QueryId>,
    next_query: u64,
    sid: u128,
    lid: u128,
    /// Of the first session: the number of the last request that was carried out.
    seq: u64,
    last: (Verb, Vec<u8>),
}

/// Feeds a server, which has one session of the golden `open`.
///
/// # Panics
///
/// If a query is not settled exactly once, a request is carried out out of order, or there are more sessions than places.
pub fn feed(data: &[u8]) {
    let mut bench = Bench::new();
    for (what, bytes) in Records(data) {
        bench.happen(what, bytes);
        assert!(bench.waiting.is_empty(), "every query is answered or dropped");
        assert!(bench.server.stats(bench.now_ms).sessions <= LIMITS.max_sessions);
        assert_eq!(bench.server.stats(bench.now_ms).sessions as usize, bench.hosted.len());
    }
}

impl Bench {
    fn new() -> Self {
        let mut next_id = 0;
        let options = ServerOptions {
            server: "default".to_owned(),
            build: "fuzz".to_owned(),
            boot_id: BOOT_ID,
            limits: LIMITS,
            allow_snapshot: true,
            envs: Vec::new(),
            max_cached_bytes: 1 << 22,
        };
        let ids = Box::new(move || {
            next_id += 1;
            next_id
        });
        let mut bench = Self {
            server: ServerSessions::new(options, ids),
            hosted: BTreeMap::new(),
            now_ms: 0,
            waiting: BTreeSet::new(),
            next_query: 0,
            sid: 0,
            lid: 0,
            seq: 0,
            last: (Verb::Open, golden::message("open")),
        };
        let (verb, open) = bench.last.clone();
        bench.ask(verb, &open);
        assert_eq!(bench.hosted.len(), 1, "the golden open is a session");
        bench.server.on_lease(0, bench.lid, true);
        bench
    }

    fn happen(&mut self, what: u8, bytes: &[u8]) {
        let verb = Verb::ALL[usize::from(what % 8)];
        match what & 0b0001_1000 {
            MESSAGE => self.ask(verb, bytes),
            PAYLOAD => {
                let (boot_id, sid) = if verb.has_session() { (BOOT_ID, self.sid) } else { (0, 0) };
                let seq = self.seq + u64::from(verb.is_numbered());
                let seq = if verb.has_session() { seq } else { 0 };
                let header = Header { boot_id, sid, seq, kind: Kind::Request(verb) };
                let message = header.message(bytes.len(), |payload| payload.extend(bytes));
                self.ask(verb, &message);
            }
            AGAIN => {
                let (verb, message) = self.last.clone();
                self.ask(verb, &message);
            }
            _ => {
                self.now_ms += bytes.iter().map(|&byte| 16 * u64::from(byte)).sum::<u64>();
                self.server.on_lease(self.now_ms, self.lid, what.is_multiple_of(2));
                self.carry_out();
            }
        }
    }

    fn ask(&mut self, verb: Verb, message: &[u8]) {
        self.last = (verb, message.to_vec());
        let query = QueryId(self.next_query);
        self.next_query += 1;
        self.waiting.insert(query);
        self.server.on_query(self.now_ms, query, verb, message);
        self.carry_out();
    }

    fn carry_out(&mut self) {
        while let Some(output) = self.server.poll(self.now_ms) {
            match output {
                ServerOutput::Start(job) => {
                    let result = self.run(&job);
                    self.server.on_finished(self.now_ms, job.id, result);
                }
                ServerOutput::Reply { query, message } => {
                    assert!(self.waiting.remove(&query), "a query is answered once");
                    assert!(Header::read(&message).is_ok(), "an answer can be read");
                }
                ServerOutput::Drop(query) => {
                    assert!(self.waiting.remove(&query), "a query is dropped once");
                }
                ServerOutput::Free { sid, .. } => {
                    self.hosted.remove(&sid);
                }
            }
        }
    }

    /// What a worker does.
    fn run(&mut self, job: &Job) -> Result<Finished, Fault> {
        let Job { sid, lid, header, message, .. } = job;
        let (_, payload) = Header::read(message)?;
        let Kind::Request(verb) = header.kind else { unreachable!("jobs are requests") };
        if verb == Verb::Open {
            let hosted = Hosted::open(&codec::read::<Open>(payload)?, &LIMITS, 1)?;
            let reply = hosted.open_reply(*sid, *lid, LIMITS);
            let max_reply = reply.max_reply;
            let header = Header { sid: *sid, kind: Kind::Reply(verb), ..*header };
            let message = codec::write(&header, &reply)?;
            if self.sid == 0 {
                (self.sid, self.lid) = (*sid, *lid);
            }
            self.hosted.insert(*sid, hosted);
            return Ok(Finished { message, steps: 0, max_reply });
        }
        let hosted = self.hosted.get_mut(sid).expect("a job is for a session that is there");
        let before = hosted.steps();
        let result = hosted.answer(header, payload);
        if *sid == self.sid && verb.is_numbered() {
            assert_eq!(header.seq, self.seq + 1, "requests are carried out in order, each once");
            self.seq += u64::from(result.is_ok());
        }
        let may_step = result.is_ok() && verb == Verb::Step;
        assert!(may_step || hosted.steps() == before, "nothing else steps");
        Ok(Finished { message: result?, steps: hosted.steps(), max_reply: 0 })
    }
}
