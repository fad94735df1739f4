//! What the server's end of sessions promises.

use super::*;
use crate::message::{AutoresetMode, Limits, Seeds};

const BOOT: u128 = 77;

/// A server, and what it said last.
struct Bench {
    server: ServerSessions,
    queries: u64,
}

impl Bench {
    fn new(limits: Limits) -> Self {
        let options = ServerOptions {
            server: "default".to_owned(),
            build: "0".to_owned(),
            boot_id: BOOT,
            limits,
            allow_snapshot: true,
            envs: Vec::new(),
            max_cached_bytes: 1000,
        };
        let mut id = 0;
        let ids = Box::new(move || {
            id += 1;
            id
        });
        Self { server: ServerSessions::new(options, ids), queries: 0 }
    }

    fn ask(&mut self, now_ms: u64, verb: Verb, message: &[u8]) -> Vec<ServerOutput> {
        self.queries += 1;
        self.server.on_query(now_ms, QueryId(self.queries), verb, message);
        self.outputs(now_ms)
    }

    fn outputs(&mut self, now_ms: u64) -> Vec<ServerOutput> {
        std::iter::from_fn(|| self.server.poll(now_ms)).collect()
    }

    /// The end of the job that was started, and what is then said.
    fn finish(
        &mut self,
        now_ms: u64,
        started: &[ServerOutput],
        result: Result<Finished, Fault>,
    ) -> Vec<ServerOutput> {
        let [.., ServerOutput::Start(job)] = started else { panic!("{started:?}") };
        self.server.on_finished(now_ms, job.id, result);
        self.outputs(now_ms)
    }

    /// Opens a session; returns its sid.
    fn opened(&mut self, nonce: u128) -> u128 {
        let started = self.ask(0, Verb::Open, &open(nonce, "{}"));
        let [ServerOutput::Start(job)] = &started[..] else { panic!("{started:?}") };
        let sid = job.sid;
        let reply = Header { kind: Kind::Reply(Verb::Open), ..job.header };
        let said = self.finish(0, &started, Ok(done(&codec::write_empty(&reply))));
        assert!(matches!(said[..], [ServerOutput::Reply { .. }]));
        sid
    }
}

fn open(nonce: u128, config: &str) -> Vec<u8> {
    open_of(nonce, config, "test")
}

fn open_of(nonce: u128, config: &str, client: &str) -> Vec<u8> {
    let header = Header { boot_id: 0, sid: 0, seq: 0, kind: Kind::Request(Verb::Open) };
    let open = Open {
        nonce,
        env_id: String::new(),
        config: config.to_owned(),
        num_envs: 2,
        autoreset: AutoresetMode::NextStep,
        hash_every: 0,
        infos: true,
        snapshot: None,
        percept: false,
        client: client.to_owned(),
    };
    codec::write(&header, &open).unwrap()
}

fn header(verb: Verb, sid: u128, seq: u64) -> Header {
    Header { boot_id: BOOT, sid, seq, kind: Kind::Request(verb) }
}

fn step(sid: u128, seq: u64, action: u8) -> Vec<u8> {
    codec::write(&header(Verb::Step, sid, seq), &Step { actions: vec![&[action]] }).unwrap()
}

fn snapshot(sid: u128, seq: u64) -> Vec<u8> {
    codec::write(&header(Verb::Snapshot, sid, seq), &Snapshot { env: None }).unwrap()
}

fn close(sid: u128) -> Vec<u8> {
    codec::write_empty(&header(Verb::Close, sid, 0))
}

fn done(message: &[u8]) -> Finished {
    Finished { message: message.to_vec(), steps: 2, max_reply: 400 }
}

fn replied(query: u64, message: &[u8]) -> ServerOutput {
    ServerOutput::Reply { query: QueryId(query), message: Bytes::copy_from_slice(message) }
}

/// A bench draws the name of a lease right after that of its session.
fn freed(sid: u128, why: &'static str) -> ServerOutput {
    ServerOutput::Free { sid, lid: sid + 1, why }
}

/// The one fault that was said.
fn fault(said: &[ServerOutput]) -> Fault {
    let [ServerOutput::Reply { message, .. }, ..] = said else { panic!("{said:?}") };
    let (header, payload) = Header::read(message).unwrap();
    assert_eq!(header.kind, Kind::Fault);
    codec::read_fault(payload).unwrap()
}

fn loss(said: &[ServerOutput]) -> u64 {
    let Fault::NoSession { reason, .. } = fault(said) else { panic!("{said:?}") };
    reason
}

#[test]
fn a_request_that_comes_again_is_answered_again_and_not_carried_out_again() {
    let mut bench = Bench::new(Limits::default());
    let sid = bench.opened(1);
    let started = bench.ask(1, Verb::Step, &step(sid, 1, 5));
    assert_eq!(bench.finish(2, &started, Ok(done(b"one"))), [replied(2, b"one")]);
    assert_eq!(bench.ask(3, Verb::Step, &step(sid, 1, 5)), [replied(3, b"one")]);
    assert_eq!(fault(&bench.ask(3, Verb::Step, &step(sid, 1, 6))), Fault::SeqReuse { seq: 1 });
    for seq in [0, 3] {
        let said = bench.ask(3, Verb::Step, &step(sid, seq, 5));
        assert_eq!(fault(&said), Fault::BadSeq { expected: 2 });
    }
    // Whatever else was asked for, the reply is still kept.
    assert_eq!(bench.ask(4, Verb::Step, &step(sid, 1, 5)), [replied(7, b"one")]);
}

#[test]
fn a_request_that_comes_again_while_it_runs_is_answered_to_the_newest_query() {
    let mut bench = Bench::new(Limits::default());
    let sid = bench.opened(1);
    let started = bench.ask(1, Verb::Step, &step(sid, 1, 5));
    let again = bench.ask(2, Verb::Step, &step(sid, 1, 5));
    assert_eq!(again, [ServerOutput::Drop(QueryId(2))]);
    assert_eq!(fault(&bench.ask(2, Verb::Step, &step(sid, 1, 6))), Fault::SeqReuse { seq: 1 });
    let snapshot = bench.ask(2, Verb::Snapshot, &snapshot(sid, 0));
    assert!(matches!(fault(&snapshot), Fault::Busy { .. }));
    assert_eq!(bench.finish(3, &started, Ok(done(b"one"))), [replied(3, b"one")]);
}

#[test]
fn a_refused_request_uses_no_number_up() {
    let mut bench = Bench::new(Limits::default());
    let sid = bench.opened(1);
    let refused = Fault::BadAction { env: 0, leaf: 0, text: "no".to_owned() };
    for _ in 0..2 {
        let started = bench.ask(1, Verb::Step, &step(sid, 1, 5));
        assert_eq!(fault(&bench.finish(2, &started, Err(refused.clone()))), refused);
    }
    let started = bench.ask(3, Verb::Step, &step(sid, 1, 6));
    assert_eq!(bench.finish(4, &started, Ok(done(b"one"))), [replied(4, b"one")]);
}

#[test]
fn a_snapshot_uses_no_number_up() {
    let mut bench = Bench::new(Limits::default());
    let sid = bench.opened(1);
    for _ in 0..2 {
        let started = bench.ask(1, Verb::Snapshot, &snapshot(sid, 0));
        assert!(matches!(fault(&bench.ask(1, Verb::Step, &step(sid, 1, 5))), Fault::Busy { .. }));
        let said = bench.finish(2, &started, Ok(done(b"state")));
        assert!(matches!(said[..], [ServerOutput::Reply { .. }]));
    }
    let said = bench.ask(3, Verb::Snapshot, &snapshot(sid, 1));
    assert_eq!(fault(&said), Fault::BadSeq { expected: 1 });
    assert!(matches!(bench.ask(3, Verb::Step, &step(sid, 1, 5))[..], [ServerOutput::Start(_)]));
}

#[test]
fn an_open_that_comes_again_is_the_same_session() {
    let mut bench = Bench::new(Limits::default());
    let started = bench.ask(0, Verb::Open, &open(9, "{}"));
    let again = bench.ask(1, Verb::Open, &open(9, "{}"));
    assert_eq!(again, [ServerOutput::Drop(QueryId(1))]);
    assert_eq!(bench.finish(2, &started, Ok(done(b"opened"))), [replied(2, b"opened")]);
    assert_eq!(bench.ask(3, Verb::Open, &open(9, "{}")), [replied(3, b"opened")]);
    assert_eq!(fault(&bench.ask(3, Verb::Open, &open(9, "[]"))), Fault::SeqReuse { seq: 0 });
    assert_eq!(bench.server.stats(3).sessions, 1);
}

#[test]
fn a_client_has_a_short_name_in_one_line() {
    let mut bench = Bench::new(Limits::default());
    for (client, got) in [
        ("a".repeat(65), "65 characters"),
        ("two\nlines".to_owned(), "\"two\\nlines\""),
        ("\x1b[2J".to_owned(), "\"\\u{1b}[2J\""),
    ] {
        let text = format!("`client` must be at most 64 printable characters, got {got}");
        let said = bench.ask(0, Verb::Open, &open_of(1, "{}", &client));
        assert_eq!(fault(&said), Fault::BadConfig { text });
    }
    assert_eq!(bench.server.stats(0).sessions, 0);
    let longest = "\u{e9}".repeat(64);
    let said = bench.ask(0, Verb::Open, &open_of(1, "{}", &longest));
    assert!(matches!(said[..], [ServerOutput::Start(_)]));
    assert_eq!(bench.server.stats(0).open[0].client, longest);
}

#[test]
fn an_open_that_fails_takes_no_place() {
    let mut bench = Bench::new(Limits { max_sessions: 1, ..Limits::default() });
    let refused = Fault::BadConfig { text: "no".to_owned() };
    let started = bench.ask(0, Verb::Open, &open(1, "{}"));
    assert_eq!(
        fault(&bench.ask(0, Verb::Open, &open(2, "{}"))),
        Fault::full(1, 1, "sessions", "max_sessions")
    );
    assert_eq!(fault(&bench.finish(1, &started, Err(refused.clone()))), refused);
    bench.opened(1);
}

#[test]
fn sessions_whose_replies_cannot_be_kept_are_not_opened() {
    let mut bench = Bench::new(Limits::default());
    let [first, _] = [bench.opened(1), bench.opened(2)];
    let started = bench.ask(0, Verb::Open, &open(3, "{}"));
    let said = bench.finish(0, &started, Ok(done(b"opened")));
    assert_eq!(fault(&said), Fault::full(800, 1000, "bytes of kept replies", "max_cached"));
    assert!(matches!(
        said[1..],
        [ServerOutput::Free { why: "refused: no room for its replies", .. }]
    ));
    bench.ask(1, Verb::Close, &close(first));
    bench.opened(3);
}

#[test]
fn a_close_waits_for_the_run_and_is_answered_again() {
    let mut bench = Bench::new(Limits::default());
    let sid = bench.opened(1);
    let started = bench.ask(1, Verb::Step, &step(sid, 1, 5));
    assert_eq!(bench.ask(2, Verb::Close, &close(sid)), []);
    assert_eq!(bench.ask(2, Verb::Close, &close(sid)), [ServerOutput::Drop(QueryId(3))]);
    let closed = codec::write(
        &Header { kind: Kind::Reply(Verb::Close), ..header(Verb::Close, sid, 0) },
        &CloseReply { steps: 2 },
    )
    .unwrap();
    let said = bench.finish(3, &started, Ok(done(b"one")));
    assert_eq!(said, [replied(2, b"one"), freed(sid, "closed"), replied(4, &closed)]);
    assert_eq!(bench.ask(4, Verb::Close, &close(sid)), [replied(5, &closed)]);
    assert_eq!(loss(&bench.ask(4, Verb::Step, &step(sid, 2, 5))), Loss::Closed as u64);
    assert_eq!(loss(&bench.ask(4, Verb::Open, &open(1, "{}"))), Loss::Closed as u64);
    assert_eq!(bench.server.wake_ms(), Some(3 + TOMBSTONE_MS));
    let later_ms = 3 + TOMBSTONE_MS;
    assert_eq!(loss(&bench.ask(later_ms, Verb::Close, &close(sid))), Loss::Unknown as u64);
    assert_eq!(bench.server.wake_ms(), None);
}

#[test]
fn a_session_whose_environments_failed_can_only_be_closed() {
    let mut bench = Bench::new(Limits::default());
    let sid = bench.opened(1);
    let failed = Fault::EnvFault { seq: 1, text: "it broke".to_owned() };
    let started = bench.ask(1, Verb::Step, &step(sid, 1, 5));
    let said = bench.finish(2, &started, Err(failed.clone()));
    assert_eq!(fault(&said), failed);
    assert_eq!(said[1..], [freed(sid, "environments failed")]);
    assert_eq!(fault(&bench.ask(3, Verb::Step, &step(sid, 1, 5))), failed);
    assert_eq!(fault(&bench.ask(3, Verb::Snapshot, &snapshot(sid, 0))), failed);
    let said = bench.ask(4, Verb::Close, &close(sid));
    assert!(matches!(said[..], [ServerOutput::Reply { .. }]), "it is freed once");
    let gone = bench.opened(2);
    let started = bench.ask(5, Verb::Step, &step(gone, 1, 5));
    bench.finish(5, &started, Err(failed));
    let later_ms = 5 + u64::from(Limits::default().grace_ms);
    assert_eq!(loss(&bench.ask(later_ms, Verb::Step, &step(gone, 1, 5))), Loss::Fault as u64);
}

#[test]
fn a_session_outlives_its_client_by_the_grace_and_its_silence_by_the_idle_time() {
    let mut bench = Bench::new(Limits { grace_ms: 100, idle_ms: 1000, ..Limits::default() });
    let [gone, silent] = [bench.opened(1), bench.opened(2)];
    for lid in [2, 4] {
        bench.server.on_lease(10, lid, true);
    }
    assert_eq!(bench.outputs(100), []);
    assert_eq!(bench.server.wake_ms(), Some(1000));
    bench.server.on_lease(200, 2, false);
    bench.server.on_lease(250, 2, true);
    bench.server.on_lease(300, 2, false);
    assert_eq!(bench.server.wake_ms(), Some(400));
    let started = bench.ask(390, Verb::Step, &step(gone, 1, 5));
    assert_eq!(bench.outputs(450), [], "it has a job");
    bench.finish(450, &started, Ok(done(b"one")));
    assert_eq!(bench.outputs(549), []);
    assert_eq!(bench.outputs(550), [freed(gone, "client gone")]);
    assert_eq!(loss(&bench.ask(551, Verb::Step, &step(gone, 2, 5))), Loss::Lease as u64);
    assert_eq!(bench.outputs(1000), [freed(silent, "client silent")]);
    assert_eq!(loss(&bench.ask(1001, Verb::Close, &close(silent))), Loss::Idle as u64);
    assert_eq!((bench.server.stats(1001).sessions, bench.server.stats(1001).lost), (0, 2));
}

#[test]
fn another_start_of_the_server_says_that_its_sessions_are_lost() {
    let mut bench = Bench::new(Limits::default());
    let mut message = step(1, 1, 5);
    message[8] = 5;
    assert_eq!(fault(&bench.ask(1, Verb::Step, &message)), Fault::SessionLost { boot_id: BOOT });
    assert_eq!(loss(&bench.ask(1, Verb::Step, &step(1, 1, 5))), Loss::Unknown as u64);
}

#[test]
fn what_is_no_request_is_told_so() {
    let mut bench = Bench::new(Limits { max_msg: 200, ..Limits::default() });
    let malformed = |offset: u64| Fault::Malformed { offset };
    assert_eq!(fault(&bench.ask(0, Verb::Spec, b"abc")), malformed(3));
    let spec = Header { boot_id: 0, sid: 0, seq: 0, kind: Kind::Request(Verb::Spec) };
    assert_eq!(fault(&bench.ask(0, Verb::Stats, &codec::write_empty(&spec))), malformed(48));
    let with_sid = codec::write_empty(&Header { sid: 1, ..spec });
    assert_eq!(fault(&bench.ask(0, Verb::Spec, &with_sid)), malformed(24));
    let long = spec.message(0, |bytes| bytes.extend([0; 148]));
    let too_large = Fault::TooLarge { size: 201, limit: 200 };
    assert_eq!(fault(&bench.ask(0, Verb::Spec, &long)), too_large);
    let mut newer = codec::write_empty(&spec);
    newer[4] = 2;
    let versions = Fault::VersionMismatch { least: MAJOR, most: MAJOR };
    assert_eq!(fault(&bench.ask(0, Verb::Spec, &newer)), versions);
    let sid = bench.opened(1);
    let reset = codec::write(&header(Verb::Reset, sid, 1), &Seeds::None).unwrap();
    assert!(matches!(fault(&bench.ask(0, Verb::Reset, &reset)), Fault::Malformed { .. }));
}

#[test]
fn a_server_that_shuts_down_lets_jobs_end_and_opens_nothing() {
    let mut bench = Bench::new(Limits::default());
    let [idle, busy] = [bench.opened(1), bench.opened(2)];
    let started = bench.ask(1, Verb::Step, &step(busy, 1, 5));
    bench.server.shut_down(2);
    assert_eq!(bench.outputs(2), [freed(idle, "server ends")]);
    assert_eq!(bench.ask(3, Verb::Open, &open(3, "{}")), [ServerOutput::Drop(QueryId(4))]);
    let said = bench.finish(4, &started, Ok(done(b"one")));
    assert_eq!(said, [replied(3, b"one"), freed(busy, "server ends")]);
    assert_eq!(bench.server.stats(4).sessions, 0);
}

#[test]
fn spec_and_stats_are_answered_without_a_session() {
    let mut bench = Bench::new(Limits::default());
    bench.opened(1);
    for verb in [Verb::Spec, Verb::Stats] {
        let asked = Header { boot_id: 0, sid: 0, seq: 0, kind: Kind::Request(verb) };
        let said = bench.ask(5, verb, &codec::write_empty(&asked));
        let [ServerOutput::Reply { message, .. }] = &said[..] else { panic!("{said:?}") };
        let (header, payload) = Header::read(message).unwrap();
        assert_eq!((header.boot_id, header.kind), (BOOT, Kind::Reply(verb)));
        if verb == Verb::Spec {
            let spec: SpecReply = codec::read(payload).unwrap();
            assert_eq!((spec.major_min, spec.limits), (MAJOR, Limits::default()));
        } else {
            let stats: StatsReply = codec::read(payload).unwrap();
            assert_eq!((stats.sessions, stats.envs, stats.requests), (1, 2, 2));
            assert_eq!(stats.open[0].lease, "00000000");
        }
    }
}
