//! What a session that may be resumed promises, message by message; `tests/rust/tests/exactly_once.rs` has the rest.

use super::*;
use crate::message::{AutoresetMode, Step};

const RESUME: ResumeOptions =
    ResumeOptions { hash_every: 2, snapshot_every: 4, max_bytes: 1 << 20 };

fn open() -> Open<'static> {
    Open {
        nonce: 1,
        env_id: "one".to_owned(),
        config: String::new(),
        num_envs: 1,
        autoreset: AutoresetMode::NextStep,
        hash_every: 0,
        infos: true,
        snapshot: None,
        percept: false,
        client: String::new(),
    }
}

/// A server that adds up actions of one byte.
struct Adder {
    boot_id: u128,
    sum: u8,
    allows_snapshots: bool,
    /// Those after so many are too large.
    most_snapshots: usize,
    snapshots: usize,
    /// How many steps it takes before others have all the room.
    room: usize,
    replayed: usize,
    max_msg: u32,
    is_too_small: bool,
    refuses_long: bool,
}

impl Adder {
    fn new(boot_id: u128) -> Self {
        Self {
            boot_id,
            sum: 0,
            allows_snapshots: true,
            most_snapshots: usize::MAX,
            snapshots: 0,
            room: usize::MAX,
            replayed: 0,
            max_msg: u32::MAX,
            is_too_small: false,
            refuses_long: false,
        }
    }

    fn answer(&mut self, message: &[u8]) -> Bytes {
        self.written(message).into()
    }

    fn written(&mut self, message: &[u8]) -> Vec<u8> {
        let (header, payload) = Header::read(message).unwrap();
        let Kind::Request(verb) = header.kind else { panic!("a request") };
        if verb.has_session() && header.boot_id != self.boot_id {
            return codec::write_fault(&header, &Fault::SessionLost { boot_id: self.boot_id });
        }
        let reply = Header { kind: Kind::Reply(verb), ..header };
        match verb {
            Verb::Open if self.is_too_small => codec::write_fault(&header, &too_many()),
            Verb::Open => {
                let open: Open = codec::read(payload).unwrap();
                assert_eq!(open.hash_every, RESUME.hash_every);
                self.sum = open.snapshot.map_or(0, |snapshot| snapshot[0]);
                let header = Header { boot_id: self.boot_id, sid: self.boot_id, ..reply };
                let told = OpenReply {
                    sid: self.boot_id,
                    lid: self.boot_id + 1,
                    observation: Vec::new(),
                    action: Vec::new(),
                    info: Vec::new(),
                    ended: Vec::new(),
                    outcomes: Vec::new(),
                    config_hash: [0; 32],
                    max_reply: 0,
                    limits: Limits { max_msg: self.max_msg, ..Limits::default() },
                };
                codec::write(&header, &told).unwrap()
            }
            Verb::Snapshot if !self.allows_snapshots => {
                let text = "no snapshots".to_owned();
                codec::write_fault(&header, &Fault::NotAllowed { text })
            }
            Verb::Snapshot if self.snapshots >= self.most_snapshots => {
                codec::write_fault(&header, &too_large())
            }
            Verb::Snapshot => {
                self.snapshots += 1;
                let told = SnapshotReply { config_hash: [0; 32], data: &[self.sum] };
                codec::write(&reply, &told).unwrap()
            }
            _ if self.refuses_long && payload.len() > 500 => {
                codec::write_fault(&header, &too_many())
            }
            _ if self.replayed >= self.room => codec::write_fault(&header, &full()),
            _ => {
                let step: Step = codec::read(payload).unwrap();
                self.replayed += 1;
                self.sum = self.sum.wrapping_add(step.actions[0][0]);
                codec::write(&reply, &self.sum).unwrap()
            }
        }
    }
}

fn too_large() -> Fault {
    Fault::TooLarge { size: 2, limit: 1 }
}

fn too_many() -> Fault {
    Fault::BadConfig { text: "`num_envs` must be at most 1 on this server, got 2".to_owned() }
}

fn full() -> Fault {
    Fault::full(3, 3, "sessions", "max_sessions")
}

fn settle(client: &mut ResumingSession, server: &mut Adder) -> Result<Bytes, ClientError> {
    loop {
        match client.poll(0) {
            ClientOutput::Send { message, .. } => client.on_reply(0, server.answer(&message)),
            ClientOutput::Done(result) => return result,
            output => panic!("{output:?}"),
        }
    }
}

fn opened(server: &mut Adder) -> ResumingSession {
    let mut client = ResumingSession::new(ClientOptions::default(), Some(RESUME));
    client.open(0, &open()).unwrap();
    settle(&mut client, server).unwrap();
    client
}

fn add(client: &mut ResumingSession, server: &mut Adder, number: u8) -> Result<u8, ClientError> {
    client.call(0, Verb::Step, &Step { actions: vec![&[number]] })?;
    let message = settle(client, server)?;
    Ok(codec::read(&message[HEADER_BYTES..]).unwrap())
}

#[test]
fn a_session_goes_on_at_the_next_server_where_it_was() {
    let mut server = Adder::new(10);
    let mut client = opened(&mut server);
    for number in 1..=6 {
        add(&mut client, &mut server, number).unwrap();
    }
    let lease = client.lid();
    let mut next = Adder::new(20);
    assert_eq!(add(&mut client, &mut next, 7), Ok(28));
    assert_eq!((next.replayed, client.resumed()), (2 + 1, 1), "two since the last snapshot");
    assert_ne!(client.lid(), lease);
    assert_eq!(add(&mut client, &mut next, 8), Ok(36));
}

#[test]
fn what_is_kept_does_not_grow() {
    let mut server = Adder::new(10);
    let mut client = opened(&mut server);
    let mut most = 0;
    for _ in 0..1_000 {
        add(&mut client, &mut server, 1).unwrap();
        most = most.max(client.kept_bytes());
    }
    assert_eq!(server.snapshots, 1 + 1_000 / 4);
    assert!(most < 2_000, "{most}");
}

#[test]
fn a_snapshot_that_fits_into_no_open_is_found_out_before_it_is_needed() {
    // What opens a session from a snapshot of one byte.
    let nobody = Header { boot_id: 0, sid: 0, seq: 0, kind: Kind::Request(Verb::Open) };
    let from = Open { snapshot: Some(&[0]), hash_every: RESUME.hash_every, ..open() };
    let size = u32::try_from(codec::write(&nobody, &from).unwrap().len()).unwrap();
    for (max_msg, fits) in [(size - 1, false), (size + 9, true)] {
        let mut server = Adder { max_msg, ..Adder::new(10) };
        let mut client = ResumingSession::new(ClientOptions::default(), Some(RESUME));
        client.open(0, &open()).unwrap();
        let told = settle(&mut client, &mut server);
        let is_refused = matches!(told, Err(ClientError::NotResumable(Fault::TooLarge { .. })));
        assert_eq!(is_refused, !fits, "{told:?}");
    }
}

#[test]
fn nothing_is_kept_after_a_snapshot_that_was_refused_and_the_next_loss_is_an_error() {
    let mut server = Adder { most_snapshots: 1, ..Adder::new(10) };
    let mut client = opened(&mut server);
    for number in 0..4 {
        assert_eq!(client.gap(), None, "{number}");
        add(&mut client, &mut server, 1).unwrap();
    }
    assert_eq!(client.gap(), Some(&too_large()));
    for number in 4..1_000 {
        add(&mut client, &mut server, 1).unwrap();
        assert_eq!(client.kept_bytes(), 0, "after {number} requests");
    }
    let mut next = Adder::new(20);
    let error = ClientError::NotResumable(too_large());
    assert_eq!(add(&mut client, &mut next, 1), Err(error));
}

#[test]
fn a_server_that_goes_another_way_is_found_out() {
    let mut server = Adder::new(10);
    let mut client = opened(&mut server);
    for number in 1..=3 {
        add(&mut client, &mut server, number).unwrap();
    }
    let mut other = Adder::new(20);
    client.call(0, Verb::Step, &Step { actions: vec![&[4]] }).unwrap();
    let result = loop {
        match client.poll(0) {
            ClientOutput::Send { message, .. } => {
                // It forgets the second of them.
                if other.replayed == 2 {
                    other.sum -= 2;
                }
                client.on_reply(0, other.answer(&message));
            }
            ClientOutput::Done(result) => break result,
            output => panic!("{output:?}"),
        }
    };
    assert_eq!(result, Err(ClientError::Differs { request: 3 }));
    assert_eq!(add(&mut client, &mut other, 5), Err(ClientError::Differs { request: 3 }));
}

#[test]
fn a_server_that_sends_no_snapshots_is_found_out_at_once() {
    let mut server = Adder { allows_snapshots: false, ..Adder::new(10) };
    let mut client = ResumingSession::new(ClientOptions::default(), Some(RESUME));
    client.open(0, &open()).unwrap();
    let fault = Fault::NotAllowed { text: "no snapshots".to_owned() };
    assert_eq!(settle(&mut client, &mut server), Err(ClientError::NotResumable(fault)));
}

#[test]
fn a_resumption_that_takes_too_long_goes_on_with_a_retry() {
    let mut server = Adder::new(10);
    let mut client = opened(&mut server);
    for number in 1..=3 {
        add(&mut client, &mut server, number).unwrap();
    }
    let mut next = Adder::new(20);
    client.call(0, Verb::Step, &Step { actions: vec![&[4]] }).unwrap();
    let deadline_ms = ClientOptions::default().deadline_ms;
    let mut now_ms = 0;
    let result = loop {
        match client.poll(now_ms) {
            // The next server is gone after the first request of those that are sent again.
            ClientOutput::Send { message, .. } if next.replayed == 0 => {
                client.on_reply(now_ms, next.answer(&message));
            }
            ClientOutput::Send { .. } => client.on_nothing(now_ms),
            ClientOutput::Wait { until_ms } => now_ms = until_ms,
            ClientOutput::Done(result) => break result,
            ClientOutput::Idle => panic!("there is a call"),
        }
    };
    assert!(matches!(result, Err(ClientError::Timeout { .. })), "{result:?}");
    assert_eq!(now_ms, deadline_ms, "with all that had to be done");
    assert!(client.is_in_doubt());
    let step = client.call(now_ms, Verb::Step, &Step { actions: vec![&[9]] });
    assert_eq!(step, Err(ClientError::InDoubt));
    client.retry(now_ms).unwrap();
    let mut third = Adder::new(30);
    let message = loop {
        match client.poll(now_ms) {
            ClientOutput::Send { message, .. } => {
                client.on_reply(now_ms, third.answer(&message));
            }
            ClientOutput::Done(result) => break result.unwrap(),
            output => panic!("{output:?}"),
        }
    };
    assert_eq!(codec::read::<u8>(&message[HEADER_BYTES..]), Ok(10));
}

#[test]
fn a_resumption_for_which_there_is_no_room_goes_on_with_a_retry() {
    let mut server = Adder::new(10);
    let mut client = opened(&mut server);
    for number in 1..=3 {
        add(&mut client, &mut server, number).unwrap();
    }
    let mut next = Adder { room: 1, ..Adder::new(20) };
    assert_eq!(add(&mut client, &mut next, 4), Err(ClientError::Fault(full())));
    for _ in 0..3 {
        assert!(client.is_in_doubt());
        let step = client.call(0, Verb::Step, &Step { actions: vec![&[9]] });
        assert_eq!(step, Err(ClientError::InDoubt));
        client.retry(0).unwrap();
        assert_eq!(settle(&mut client, &mut next), Err(ClientError::Fault(full())));
    }
    assert_eq!(next.replayed, 1);
    next.room = usize::MAX;
    client.retry(0).unwrap();
    let message = settle(&mut client, &mut next).unwrap();
    assert_eq!(codec::read::<u8>(&message[HEADER_BYTES..]), Ok(10));
    assert_eq!(add(&mut client, &mut next, 5), Ok(15));
}

#[test]
fn a_server_that_does_not_take_the_session_is_named_as_that_and_the_next_may_take_it() {
    let mut server = Adder::new(10);
    let mut client = opened(&mut server);
    add(&mut client, &mut server, 1).unwrap();
    let mut small = Adder { is_too_small: true, ..Adder::new(20) };
    let told = add(&mut client, &mut small, 2);
    assert_eq!(told, Err(ClientError::NotTaken(too_many())));
    assert!(client.is_in_doubt());
    let mut third = Adder::new(30);
    client.retry(0).unwrap();
    let message = settle(&mut client, &mut third).unwrap();
    assert_eq!(codec::read::<u8>(&message[HEADER_BYTES..]), Ok(3));
}

#[test]
fn a_request_that_the_next_server_allows_no_more_ends_the_session_and_no_step_goes_on_from_before_it()
 {
    for is_too_long in [true, false] {
        let mut server = Adder::new(10);
        let mut client = opened(&mut server);
        // It is part of the journal, and longer than what opens a session.
        client.call(0, Verb::Step, &Step { actions: vec![&[1; 500]] }).unwrap();
        settle(&mut client, &mut server).unwrap();
        let mut next = Adder { refuses_long: !is_too_long, ..Adder::new(20) };
        if is_too_long {
            next.max_msg = 400;
        }
        let told = add(&mut client, &mut next, 2);
        let fault = match &told {
            Err(ClientError::NotResumable(fault)) => fault.clone(),
            told => panic!("{told:?}"),
        };
        assert_eq!(matches!(fault, Fault::TooLarge { limit: 400, .. }), is_too_long, "{fault:?}");
        assert_eq!(fault == too_many(), !is_too_long, "{fault:?}");
        for _ in 0..2 {
            assert_eq!(add(&mut client, &mut next, 3), told);
            assert_eq!(client.retry(0).map(|()| 0), told);
        }
        assert_eq!(next.replayed, 0);
    }
}
