//! Bytes that are no request do nothing to a server: it answers them with a fault or drops them, and its sessions are as
//! they were.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use allocation_counter::measure;
use swath_tests::dice::{Dice, measured, size};
use swath_wire::codec;
use swath_wire::fault::{Fault, FaultMessage};
use swath_wire::header::{HEADER_BYTES, Header, Kind, Verb};
use swath_wire::message::{
    AutoresetMode, CloseReply, Limits, Open, OpenReply, Reset, ResetReply, Restore, Seeds,
    Snapshot, SnapshotReply, SpecReply, StatsReply, Step, StepReply,
};
use swath_wire::server::{Finished, JobId, QueryId, ServerOptions, ServerOutput, ServerSessions};

const BOOT: u128 = 0x1234_5678_9abc_def0_1234_5678_9abc_def0;
const NONCE: u128 = 99;

/// A server with one session, which has made two steps.
struct Bench {
    server: ServerSessions,
    queries: u64,
    sid: u128,
    messages: Vec<(Verb, Vec<u8>)>,
}

impl Bench {
    fn new() -> Self {
        let options = ServerOptions {
            server: "default".to_owned(),
            build: "test".to_owned(),
            boot_id: BOOT,
            limits: Limits { max_msg: 1 << 20, ..Limits::default() },
            allow_snapshot: true,
            envs: Vec::new(),
            max_cached_bytes: 1 << 20,
        };
        let mut dice = Dice::new(1);
        let ids = Box::new(move || u128::from(dice.bits()) << 64 | u128::from(dice.bits()));
        let mut bench = Self {
            server: ServerSessions::new(options, ids),
            queries: 0,
            sid: 0,
            messages: Vec::new(),
        };
        bench.ask(Verb::Open, &open());
        let step = Step { actions: vec![&[1; 64]] };
        for seq in 1..3 {
            let message = codec::write(&bench.header(Verb::Step, seq), &step).unwrap();
            bench.ask(Verb::Step, &message);
        }
        let reset = Reset { seeds: Seeds::Each(&[7; 32]), mask: &[1; 4], weeds: vec![None, None] };
        let restore = Restore { env: Some(1), data: &[3; 50] };
        let of_server = |verb| Header { boot_id: 0, sid: 0, seq: 0, kind: Kind::Request(verb) };
        bench.messages = vec![
            (Verb::Spec, codec::write_empty(&of_server(Verb::Spec))),
            (Verb::Stats, codec::write_empty(&of_server(Verb::Stats))),
            (Verb::Open, open()),
            (Verb::Close, codec::write_empty(&bench.header(Verb::Close, 2))),
            (Verb::Step, codec::write(&bench.header(Verb::Step, 2), &step).unwrap()),
            (Verb::Step, codec::write(&bench.header(Verb::Step, 3), &step).unwrap()),
            (Verb::Reset, codec::write(&bench.header(Verb::Reset, 3), &reset).unwrap()),
            (Verb::Restore, codec::write(&bench.header(Verb::Restore, 3), &restore).unwrap()),
            (
                Verb::Snapshot,
                codec::write(&bench.header(Verb::Snapshot, 2), &Snapshot { env: None }).unwrap(),
            ),
        ];
        bench
    }

    fn header(&self, verb: Verb, seq: u64) -> Header {
        Header { boot_id: BOOT, sid: self.sid, seq, kind: Kind::Request(verb) }
    }

    /// Sends a message and does what has to be done; returns what it was answered with, and the job that it was, if any.
    fn ask(&mut self, verb: Verb, message: &[u8]) -> (Option<Fault>, Option<JobId>) {
        self.queries += 1;
        self.server.on_query(0, QueryId(self.queries), verb, message);
        let (mut fault, mut job, mut is_answered) = (None, None, false);
        while let Some(output) = self.server.poll(0) {
            match output {
                ServerOutput::Start(started) => {
                    job = Some(started.id);
                    if verb == Verb::Open {
                        self.sid = started.sid;
                    }
                    let Kind::Request(verb) = started.header.kind else { unreachable!() };
                    let reply = Header { kind: Kind::Reply(verb), ..started.header };
                    let message = codec::write_empty(&reply);
                    let finished = Finished { message, steps: 0, max_reply: 0 };
                    self.server.on_finished(0, started.id, Ok(finished));
                }
                ServerOutput::Reply { query, message } => {
                    assert_eq!(query, QueryId(self.queries));
                    let (header, payload) = Header::read(&message).unwrap();
                    if header.kind == Kind::Fault {
                        fault = Some(codec::read_fault(payload).unwrap());
                    }
                    is_answered = true;
                }
                ServerOutput::Drop(query) => {
                    assert_eq!(query, QueryId(self.queries));
                    is_answered = true;
                }
                ServerOutput::Free { .. } => (),
            }
        }
        assert!(is_answered, "every query is answered or dropped");
        (fault, job)
    }

    /// That the session is as it was: it answers its last request again, and expects the same next one.
    fn check_unchanged(&mut self) {
        let last = self.messages[4].1.clone();
        assert_eq!(self.ask(Verb::Step, &last), (None, None), "the last reply is still there");
        let much_later = codec::write_empty(&self.header(Verb::Step, 9));
        let expected = Some(Fault::BadSeq { expected: 3 });
        assert_eq!(self.ask(Verb::Step, &much_later), (expected, None));
        assert_eq!(self.server.stats(0).sessions, 1);
    }
}

fn open() -> Vec<u8> {
    let header = Header { boot_id: 0, sid: 0, seq: 0, kind: Kind::Request(Verb::Open) };
    let open = Open {
        nonce: NONCE,
        env_id: "toy".to_owned(),
        config: "scenario".to_owned(),
        num_envs: 4,
        autoreset: AutoresetMode::NextStep,
        hash_every: 0,
        infos: true,
        snapshot: Some(&[1, 2, 3]),
        percept: false,
        client: "test".to_owned(),
    };
    codec::write(&header, &open).unwrap()
}

/// Every payload that there is, read from these bytes.
fn read_all(payload: &[u8]) {
    let _ = codec::read::<SpecReply>(payload);
    let _ = codec::read::<StatsReply>(payload);
    let _ = codec::read::<Open>(payload);
    let _ = codec::read::<OpenReply>(payload);
    let _ = codec::read::<Reset>(payload);
    let _ = codec::read::<ResetReply>(payload);
    let _ = codec::read::<Step>(payload);
    let _ = codec::read::<StepReply>(payload);
    let _ = codec::read::<Snapshot>(payload);
    let _ = codec::read::<SnapshotReply>(payload);
    let _ = codec::read::<Restore>(payload);
    let _ = codec::read::<CloseReply>(payload);
    let _ = codec::read::<FaultMessage>(payload);
}

fn random(dice: &mut Dice, most: u64) -> Vec<u8> {
    let length = dice.below(most);
    (0..length).map(|_| u8::try_from(dice.below(256)).unwrap()).collect()
}

#[test]
fn random_bytes_are_refused_and_change_nothing() {
    let mut bench = Bench::new();
    let mut dice = Dice::new(2);
    let count = size(25_000, 500_000);
    let mut live_bytes = 0;
    for i in 0..count {
        let verb = Verb::ALL[usize::try_from(dice.below(8)).unwrap()];
        let bytes = random(&mut dice, 160);
        read_all(&bytes);
        assert!(matches!(bench.ask(verb, &bytes), (Some(Fault::Malformed { .. }), None)));
        // The same behind a header that is fine.
        let verb = Verb::ALL[usize::try_from(dice.below(8)).unwrap()];
        let header = if verb.has_session() {
            bench.header(verb, 2 + u64::from(verb.is_numbered()))
        } else {
            Header { boot_id: 0, sid: 0, seq: 0, kind: Kind::Request(verb) }
        };
        let message = header.message(0, |payload| payload.extend(&bytes));
        let is_fine = match verb {
            Verb::Open => codec::read::<Open>(&bytes).is_ok(),
            Verb::Reset => codec::read::<Reset>(&bytes).is_ok(),
            Verb::Step => codec::read::<Step>(&bytes).is_ok(),
            Verb::Restore => codec::read::<Restore>(&bytes).is_ok(),
            Verb::Snapshot => codec::read::<Snapshot>(&bytes).is_ok(),
            Verb::Spec | Verb::Stats | Verb::Close => bytes.is_empty(),
        };
        if !is_fine {
            assert!(matches!(bench.ask(verb, &message), (Some(Fault::Malformed { .. }), None)));
        }
        if i % 20 == 0 {
            bench.check_unchanged();
        }
        if i % 5000 == 0 {
            // What is asked for and not given back, in as many messages.
            let used = measure(|| {
                for verb in Verb::ALL.into_iter().cycle().take(1_000) {
                    let bytes = random(&mut dice, 160);
                    bench.ask(verb, &bytes);
                }
            });
            live_bytes += used.bytes_current;
        }
    }
    bench.check_unchanged();
    assert!(live_bytes.abs() < 10_000, "{live_bytes} bytes");
    measured(&format!(
        "{} random messages, half of them behind a header that is fine: no panic, no state changed, {live_bytes} \
         bytes kept",
        2 * count
    ));
}

#[test]
fn damaged_messages_are_refused_or_are_other_requests() {
    let mut dice = Dice::new(3);
    let mut bench = Bench::new();
    let mut refused = 0;
    let count = size(20_000, 1_000_000);
    for _ in 0..count {
        let place = usize::try_from(dice.below(bench.messages.len() as u64)).unwrap();
        let (verb, mut message) = bench.messages[place].clone();
        for _ in 0..=dice.below(3) {
            damage(&mut dice, &mut message);
        }
        if let Ok((_, payload)) = Header::read(&message) {
            read_all(payload);
        }
        let (fault, job) = bench.ask(verb, &message);
        match fault {
            Some(fault) => {
                refused += 1;
                assert_eq!(job, None, "{fault}");
                let is_known = matches!(
                    fault,
                    Fault::Malformed { .. }
                        | Fault::VersionMismatch { .. }
                        | Fault::SessionLost { .. }
                        | Fault::NoSession { .. }
                        | Fault::BadSeq { .. }
                        | Fault::SeqReuse { .. }
                );
                let is_name = fault.to_string().starts_with("`client` must be at most 64 ");
                assert!(is_known || is_name, "{fault}");
                bench.check_unchanged();
            }
            // Another action, another scenario, a close: a request like any other.
            None => bench = Bench::new(),
        }
    }
    assert!(refused > count / 2, "{refused} of {count}");
    measured(&format!(
        "{count} mutated messages: no panic; {refused} refused by name, no state changed; the others are requests"
    ));
}

/// Changes, adds or takes some bytes; most often so that the length is right all the same.
fn damage(dice: &mut Dice, message: &mut Vec<u8>) {
    let place = |dice: &mut Dice, message: &[u8]| {
        usize::try_from(dice.below(message.len().max(1) as u64)).unwrap()
    };
    let at = place(dice, message);
    match dice.below(6) {
        _ if message.is_empty() => message.push(0),
        0 => message[at] ^= 1 << dice.below(8),
        1 => message[at] = u8::try_from(dice.below(256)).unwrap(),
        2 => message.truncate(at),
        3 => message.extend(random(dice, 20)),
        4 => {
            let bytes = random(dice, 9);
            message.splice(at..at, bytes);
        }
        // A large length, wherever one may stand.
        _ => message.iter_mut().skip(at).take(8).for_each(|byte| *byte = 0xff),
    }
    if message.len() >= HEADER_BYTES && !dice.one_in(4) {
        let length = u32::try_from(message.len() - HEADER_BYTES).unwrap();
        message[HEADER_BYTES - 4..HEADER_BYTES].copy_from_slice(&length.to_le_bytes());
    }
}

#[test]
fn a_message_over_the_limit_is_refused_unread() {
    let mut bench = Bench::new();
    let limit = u64::from(Limits { max_msg: 1 << 20, ..Limits::default() }.max_msg);
    let room = usize::try_from(limit).unwrap() - HEADER_BYTES;
    let header = bench.header(Verb::Step, 3);
    let message = header.message(0, |bytes| bytes.extend(vec![0; room + 1]));
    let mut fault = None;
    let used = measure(|| fault = bench.ask(Verb::Step, &message).0);
    assert_eq!(fault, Some(Fault::TooLarge { size: limit + 1, limit }));
    assert!(used.bytes_max < 10_000, "{used:?}");
    bench.check_unchanged();
}

#[test]
fn a_length_of_2_to_the_63_asks_for_no_memory() {
    let mut bench = Bench::new();
    let header = bench.header(Verb::Step, 3);
    let length = (1_u64 << 63).to_le_bytes();
    let one = 1_u64.to_le_bytes();
    for payload in [&length[..], &[one, length].concat()] {
        let message = header.message(0, |bytes| bytes.extend(payload));
        let used = measure(|| {
            let fault = bench.ask(Verb::Step, &message).0;
            assert!(matches!(fault, Some(Fault::Malformed { .. })));
        });
        assert!(used.bytes_max < 10_000, "{used:?}");
    }
    bench.check_unchanged();
}
