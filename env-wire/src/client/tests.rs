//! What the client's end of a session promises.

use super::*;
use crate::message::{AutoresetMode, Limits, Step};

const BOOT: u128 = 77;
const OPTIONS: ClientOptions = ClientOptions {
    attempt_ms: 100,
    deadline_ms: 1_000,
    pause_ms: 10,
    longest_pause_ms: 40,
    jitter_seed: 0,
};

fn open() -> Open<'static> {
    Open {
        nonce: 1,
        env_id: String::new(),
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

fn opened(boot_id: u128) -> Bytes {
    opened_with(boot_id, Limits::default())
}

fn opened_with(boot_id: u128, limits: Limits) -> Bytes {
    let reply = OpenReply {
        sid: 5,
        lid: 6,
        observation: Vec::new(),
        action: Vec::new(),
        info: Vec::new(),
        ended: Vec::new(),
        outcomes: Vec::new(),
        config_hash: [0; 32],
        max_reply: 0,
        limits,
    };
    let header = Header { boot_id, sid: 5, seq: 0, kind: Kind::Reply(Verb::Open) };
    codec::write(&header, &reply).unwrap().into()
}

/// A client whose session is open.
fn client() -> ClientSession {
    let mut client = ClientSession::new(OPTIONS);
    client.open(0, &open()).unwrap();
    assert_eq!(sent(&mut client, 0).kind, Kind::Request(Verb::Open));
    client.on_reply(0, opened(BOOT));
    assert_eq!(client.poll(0), ClientOutput::Done(Ok(opened(BOOT))));
    client
}

#[test]
fn a_name_that_a_server_would_not_take_is_not_even_sent() {
    let mut client = ClientSession::new(OPTIONS);
    let named = Open { client: "a\tb".to_owned(), ..open() };
    let text = "`client` must be at most 64 printable characters, got \"a\\tb\"".to_owned();
    assert_eq!(client.open(0, &named), Err(ClientError::Fault(Fault::BadConfig { text })));
    client.open(0, &open()).unwrap();
}

fn step(client: &mut ClientSession, now_ms: u64) -> Result<(), ClientError> {
    client.call(now_ms, Verb::Step, &Step { actions: vec![&[1]] })
}

/// The header of the message that has to be sent now.
fn sent(client: &mut ClientSession, now_ms: u64) -> Header {
    let output = client.poll(now_ms);
    let ClientOutput::Send { message, .. } = output else { panic!("{output:?}") };
    Header::read(&message).unwrap().0
}

fn reply(verb: Verb, seq: u64) -> Bytes {
    codec::write_empty(&Header { boot_id: BOOT, sid: 5, seq, kind: Kind::Reply(verb) }).into()
}

fn fault(seq: u64, fault: &Fault) -> Bytes {
    codec::write_fault(&Header { boot_id: BOOT, sid: 5, seq, kind: Kind::Fault }, fault).into()
}

/// Lets a call end without an answer; returns when.
fn given_up(client: &mut ClientSession, mut now_ms: u64) -> u64 {
    loop {
        match client.poll(now_ms) {
            ClientOutput::Send { timeout_ms, .. } => {
                now_ms += timeout_ms;
                client.on_timeout(now_ms);
            }
            ClientOutput::Wait { until_ms } => now_ms = until_ms,
            ClientOutput::Done(Err(ClientError::Timeout { waited_ms, .. })) => {
                assert_eq!(waited_ms, OPTIONS.deadline_ms);
                return now_ms;
            }
            output => panic!("{output:?}"),
        }
    }
}

#[test]
fn an_open_session_knows_its_names_and_counts_from_one() {
    let mut client = client();
    assert_eq!(
        (client.boot_id(), client.sid(), client.lid(), client.next_seq()),
        (Some(BOOT), Some(5), Some(6), 1)
    );
    assert_eq!(client.open(0, &open()), Err(ClientError::IsOpen));
    for seq in 1..3 {
        step(&mut client, 1).unwrap();
        let kind = Kind::Request(Verb::Step);
        assert_eq!(sent(&mut client, 1), Header { boot_id: BOOT, sid: 5, seq, kind });
        assert_eq!(step(&mut client, 1), Err(ClientError::Busy));
        client.on_reply(2, reply(Verb::Step, seq));
        assert_eq!(client.poll(2), ClientOutput::Done(Ok(reply(Verb::Step, seq))));
        assert_eq!(client.poll(2), ClientOutput::Idle);
    }
}

#[test]
fn what_answers_something_else_is_ignored() {
    let mut client = client();
    step(&mut client, 0).unwrap();
    sent(&mut client, 0);
    let other_sid = Header { boot_id: BOOT, sid: 4, seq: 1, kind: Kind::Reply(Verb::Step) };
    let strays = [
        reply(Verb::Step, 0),
        reply(Verb::Reset, 1),
        codec::write_empty(&other_sid).into(),
        fault(2, &Fault::BadSeq { expected: 1 }),
        Bytes::from_static(b"abc"),
    ];
    for (i, stray) in strays.into_iter().enumerate() {
        client.on_reply(1, stray);
        assert_eq!(
            (client.poll(1), client.ignored()),
            (ClientOutput::Wait { until_ms: 100 }, i as u64 + 1)
        );
    }
}

#[test]
fn silence_and_a_busy_server_are_asked_again_with_the_same_bytes() {
    let mut client = client();
    step(&mut client, 0).unwrap();
    let first = client.poll(0);
    client.on_nothing(1);
    let ClientOutput::Wait { until_ms } = client.poll(1) else { panic!() };
    assert!((1 + 7..=1 + 13).contains(&until_ms), "{until_ms}");
    assert_eq!(client.poll(until_ms), first);
    client.on_timeout(until_ms + 100);
    let ClientOutput::Wait { until_ms } = client.poll(until_ms + 100) else { panic!() };
    assert_eq!(client.poll(until_ms), first);
    client.on_reply(until_ms, fault(1, &Fault::Busy { retry_ms: 500 }));
    assert_eq!(client.poll(until_ms), ClientOutput::Wait { until_ms: until_ms + 500 });
    // A late reply to an earlier attempt is a reply.
    client.on_reply(until_ms + 1, reply(Verb::Step, 1));
    assert!(matches!(client.poll(until_ms + 1), ClientOutput::Done(Ok(_))));
}

#[test]
fn an_attempt_whose_end_nobody_reports_ends_by_itself() {
    let mut client = client();
    step(&mut client, 0).unwrap();
    sent(&mut client, 0);
    assert_eq!(client.poll(50), ClientOutput::Wait { until_ms: 100 });
    let ClientOutput::Wait { until_ms } = client.poll(100) else { panic!() };
    sent(&mut client, until_ms);
}

#[test]
fn a_call_without_an_answer_can_be_retried() {
    let mut client = client();
    assert_eq!(client.retry(0), Err(ClientError::NothingToRetry));
    step(&mut client, 0).unwrap();
    let now_ms = given_up(&mut client, 0);
    assert_eq!(step(&mut client, now_ms), Err(ClientError::InDoubt));
    assert_eq!(client.call(now_ms, Verb::Snapshot, &1_u8), Err(ClientError::InDoubt));
    client.retry(now_ms).unwrap();
    assert_eq!(sent(&mut client, now_ms).seq, 1);
    client.on_reply(now_ms, reply(Verb::Step, 1));
    assert!(matches!(client.poll(now_ms), ClientOutput::Done(Ok(_))));
    assert_eq!((client.is_in_doubt(), client.next_seq()), (false, 2));
}

#[test]
fn a_reset_settles_what_is_in_doubt_first() {
    let refused = Fault::BadAction { env: 0, leaf: 0, text: "no".to_owned() };
    for (answer, next) in [(reply(Verb::Step, 1), 2), (fault(1, &refused), 1)] {
        let mut client = client();
        step(&mut client, 0).unwrap();
        let now_ms = given_up(&mut client, 0);
        client.call(now_ms, Verb::Reset, &3_u8).unwrap();
        assert_eq!(sent(&mut client, now_ms).kind, Kind::Request(Verb::Step));
        client.on_reply(now_ms, answer);
        let reset = sent(&mut client, now_ms);
        assert_eq!((reset.kind, reset.seq), (Kind::Request(Verb::Reset), next));
        client.on_reply(now_ms, reply(Verb::Reset, next));
        let done = reply(Verb::Reset, next);
        assert_eq!(client.poll(now_ms), ClientOutput::Done(Ok(done)));
        assert_eq!(client.next_seq(), next + 1);
    }
}

#[test]
fn a_retry_of_a_reset_that_had_to_settle_a_step_is_the_reset() {
    let mut client = client();
    step(&mut client, 0).unwrap();
    let now_ms = given_up(&mut client, 0);
    client.call(now_ms, Verb::Reset, &3_u8).unwrap();
    let now_ms = given_up(&mut client, now_ms);
    client.retry(now_ms).unwrap();
    assert_eq!(sent(&mut client, now_ms).kind, Kind::Request(Verb::Step));
    client.on_reply(now_ms, reply(Verb::Step, 1));
    assert_eq!(sent(&mut client, now_ms).kind, Kind::Request(Verb::Reset));
}

#[test]
fn a_close_ends_the_session_whatever_is_in_doubt() {
    let mut client = client();
    step(&mut client, 0).unwrap();
    let now_ms = given_up(&mut client, 0);
    client.call_empty(now_ms, Verb::Close).unwrap();
    assert_eq!(sent(&mut client, now_ms).kind, Kind::Request(Verb::Close));
    client.on_reply(now_ms, reply(Verb::Close, 0));
    assert!(matches!(client.poll(now_ms), ClientOutput::Done(Ok(_))));
    assert_eq!(step(&mut client, now_ms), Err(ClientError::NotOpen));
    client.open(now_ms, &open()).unwrap();
}

#[test]
fn a_fault_ends_the_call_and_the_loss_of_the_session_all_calls() {
    let mut client = client();
    for (fault_, is_over) in [
        (Fault::NotReset { env: 0, text: "no".to_owned() }, false),
        (Fault::SessionLost { boot_id: 9 }, true),
    ] {
        step(&mut client, 0).unwrap();
        assert_eq!(sent(&mut client, 0).seq, 1);
        client.on_reply(1, fault(1, &fault_));
        assert_eq!(client.poll(1), ClientOutput::Done(Err(fault_.clone().into())));
        assert_eq!((client.next_seq(), client.is_in_doubt()), (1, false));
        if is_over {
            assert_eq!(step(&mut client, 1), Err(fault_.into()));
            client.open(1, &open()).unwrap();
        }
    }
}

#[test]
fn what_is_larger_than_the_session_s_server_takes_in_is_refused_unsent_and_others_may_follow() {
    let mut client = ClientSession::new(OPTIONS);
    client.open(0, &open()).unwrap();
    sent(&mut client, 0);
    client.on_reply(0, opened_with(BOOT, Limits { max_msg: 100, ..Limits::default() }));
    assert!(matches!(client.poll(0), ClientOutput::Done(Ok(_))));
    let payload = 100 - HEADER_BYTES;
    let refused = Err(Fault::TooLarge { size: 101, limit: 100 }.into());
    assert_eq!(client.call_bytes(0, Verb::Restore, &vec![1; payload + 1]), refused);
    assert_eq!(client.poll(0), ClientOutput::Idle);
    assert_eq!((client.next_seq(), client.is_in_doubt()), (1, false));
    client.call_bytes(0, Verb::Step, &vec![1; payload]).unwrap();
    assert_eq!(sent(&mut client, 0).seq, 1);
}

#[test]
fn two_servers_of_one_name_are_noticed() {
    let mut client = client();
    client.on_reply(1, opened(BOOT + 1));
    assert_eq!(step(&mut client, 1), Err(ClientError::TwoServers));

    let mut client = self::client();
    step(&mut client, 0).unwrap();
    sent(&mut client, 0);
    client.on_reply(1, reply(Verb::Step, 1));
    client.on_reply(1, reply(Verb::Step, 1));
    client.on_reply(1, fault(1, &Fault::SessionLost { boot_id: BOOT }));
    assert!(matches!(client.poll(1), ClientOutput::Done(Ok(_))));
    step(&mut client, 2).unwrap();
    client.on_reply(2, fault(1, &Fault::SessionLost { boot_id: BOOT + 1 }));
    assert_eq!(client.poll(2), ClientOutput::Done(Err(ClientError::TwoServers)));
}

#[test]
fn a_server_of_another_version_is_named() {
    let mut client = ClientSession::new(OPTIONS);
    assert_eq!(step(&mut client, 0), Err(ClientError::NotOpen));
    client.spec(0).unwrap();
    sent(&mut client, 0);
    let mut message = codec::write_empty(&Header { boot_id: 1, sid: 0, seq: 0, kind: Kind::Fault });
    message[4] = 3;
    client.on_reply(1, message.into());
    let fault = Fault::VersionMismatch { least: 3, most: 3 };
    assert_eq!(client.poll(1), ClientOutput::Done(Err(fault.into())));
}
