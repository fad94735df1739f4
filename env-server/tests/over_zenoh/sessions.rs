//! Over a real network a session is what it is without one.

use std::time::Duration;

use crate::common::{Client, Opened, Running, batch, fault_of, header, payload};
use swath_server::clock::Clock;
use swath_wire::codec;
use swath_wire::fault::Fault;
use swath_wire::header::{Header, Verb};
use swath_wire::hosted::Hosted;
use swath_wire::message::{CloseReply, Limits, Open, Reset, Seeds, StatsReply};
use zenoh::Wait as _;
use zenoh::query::ConsolidationMode;

#[test]
fn a_batch_on_a_server_sends_the_bytes_that_a_batch_at_hand_forms() {
    const ENVS: u8 = 5;
    let server = Running::start(&[]);
    let client = Client::new(&server.endpoint);
    let open = batch(1, ENVS.into());
    let session = client.open(&open).unwrap();
    let limits = Limits::default();
    let mut local = Hosted::open(&open, &limits, 1).unwrap();
    assert_eq!(session.reply, local.open_reply(session.reply.sid, session.reply.lid, limits));
    let mut ask = |verb: Verb, message: &[u8]| {
        let (header, payload) = Header::read(message).unwrap();
        let expected = local.answer(&header, payload).unwrap();
        assert_eq!(client.ask(verb, message), Some(expected));
    };
    ask(Verb::Reset, &session.reset(1, 7));
    for seq in 2..300_u16 {
        let action = |env: u8| f32::from((seq * 7 + u16::from(env) * 3) % 21) / 10.0 - 1.0;
        let actions: Vec<f32> = (0..ENVS).map(action).collect();
        ask(Verb::Step, &session.step(seq.into(), &actions));
    }
    let closed = client.ask(Verb::Close, &session.close()).unwrap();
    let closed: CloseReply = codec::read(payload(&closed)).unwrap();
    assert_eq!(closed.steps, local.steps());
}

#[test]
fn a_client_that_does_not_read_holds_up_nobody_else() {
    const GIVES_UP: Duration = Duration::from_secs(1);
    let server = Running::start(&[]);
    let deaf = Client::new(&server.endpoint);
    let many = batch(1, 4096);
    let session = deaf.open(&many).unwrap();
    let reset = session.reset(1, 7);
    let (asked, request) = Header::read(&reset).unwrap();
    let mut local = Hosted::open(&many, &Limits::default(), 1).unwrap();
    let expected = local.answer(&asked, request).unwrap();
    assert!(expected.len() > 500_000, "as long as the next ones need it");
    assert_eq!(deaf.ask(Verb::Reset, &reset), Some(expected));
    // Further sessions of its own: with any fixed number of threads it could keep them all.
    let others: Vec<(Opened, Vec<u8>)> = (10..18)
        .map(|nonce| {
            let session = deaf.open(&batch(nonce, 4096)).unwrap();
            let reset = session.reset(1, 7);
            // What is asked again keeps no worker busy.
            deaf.ask(Verb::Reset, &reset).unwrap();
            (session, reset)
        })
        .collect();
    let small = deaf.open(&batch(30, 1)).unwrap();
    deaf.ask(Verb::Reset, &small.reset(1, 7)).unwrap();
    // The first reply keeps Zenoh's thread; the next ones fill every buffer on the way.
    let (wake, sleep) = std::sync::mpsc::channel::<()>();
    let sleep = std::sync::Mutex::new(sleep);
    let sleep = std::sync::Arc::new(sleep);
    for _ in 0..60 {
        let sleep = std::sync::Arc::clone(&sleep);
        let heard = move |_| {
            let _ = sleep.lock().unwrap().recv();
        };
        let query =
            deaf.session.get("swath/v1/default/rpc/reset").payload(&reset).timeout(GIVES_UP);
        query.consolidation(ConsolidationMode::None).callback(heard).wait().unwrap();
        for (_, reset) in &others {
            let query =
                deaf.session.get("swath/v1/default/rpc/reset").payload(reset).timeout(GIVES_UP);
            let unheard = query.consolidation(ConsolidationMode::None).callback(|_| ());
            unheard.wait().unwrap();
        }
    }
    // And short things, with a session, without one and with one that is not there: its connection is full for these too.
    let client = Client::new(&server.endpoint);
    let spec = codec::write_empty(&header(Verb::Spec));
    let unknown = Header { sid: 99, ..small.header(Verb::Close, 0) };
    let unheard = |verb: Verb, message: &[u8]| {
        let key = format!("swath/v1/default/rpc/{}", verb.name());
        let query = deaf.session.get(key).payload(message).consolidation(ConsolidationMode::None);
        query.callback(|_| ()).wait().unwrap();
    };
    unheard(Verb::Step, &small.step(2, &[0.5]));
    for _ in 0..20 {
        unheard(Verb::Step, &small.step(2, &[0.5]));
        unheard(Verb::Step, b"garbage");
        unheard(Verb::Stats, &codec::write_empty(&header(Verb::Stats)));
        unheard(Verb::Spec, &spec);
        unheard(Verb::Close, &codec::write_empty(&unknown));
    }
    // The server's Zenoh gives up the queries, and has to say so on the same connection.
    std::thread::sleep(GIVES_UP + Duration::from_millis(500));
    // Sooner than Zenoh gives up who does not read.
    client.ask_within(Duration::from_secs(2), Verb::Spec, &spec).unwrap();
    let clock = Clock::start();
    let session = client.open(&batch(2, 1)).unwrap();
    assert!(clock.now_ms() < 2_000, "{} ms", clock.now_ms());
    client.ask_within(Duration::from_secs(2), Verb::Reset, &session.reset(1, 7)).unwrap();
    for seq in 2..100 {
        let step = session.step(seq, &[0.5]);
        client.ask_within(Duration::from_secs(2), Verb::Step, &step).unwrap();
    }
    let long = client.open(&batch(3, 4096)).unwrap();
    for seq in 1..5 {
        let reset = long.reset(seq, 7);
        let reply = client.ask_within(Duration::from_secs(2), Verb::Reset, &reset).unwrap();
        assert!(reply.len() > 500_000);
    }
    drop(wake);
}

#[test]
fn what_waits_for_a_client_that_does_not_read_keeps_no_request_in_memory() {
    const ENVS: u32 = 4096;
    const QUERIES: u64 = 150;
    let server = Running::start(&[]);
    let deaf = Client::new(&server.endpoint);
    let session = deaf.open(&batch(1, ENVS)).unwrap();
    let ten = [1_f64; 20].map(f64::to_le_bytes).concat();
    let weeds = vec![Some(&ten[..]); ENVS as usize];
    let reset = Reset { seeds: Seeds::One(7), mask: &[], weeds };
    let reset = codec::write(&session.header(Verb::Reset, 1), &reset).unwrap();
    assert!(deaf.ask(Verb::Reset, &reset).unwrap().len() > 500_000);
    let before = server.memory_bytes();
    let (wake, sleep) = std::sync::mpsc::channel::<()>();
    let sleep = std::sync::Mutex::new(sleep);
    let sleep = std::sync::Arc::new(sleep);
    for _ in 0..QUERIES {
        let sleep = std::sync::Arc::clone(&sleep);
        let heard = move |_| {
            let _ = sleep.lock().unwrap().recv();
        };
        let query = deaf.session.get("swath/v1/default/rpc/reset").payload(&reset);
        query.consolidation(ConsolidationMode::None).callback(heard).wait().unwrap();
    }
    // What came last is looked at last.
    let client = Client::new(&server.endpoint);
    client.spec().unwrap();
    let after = server.memory_bytes();
    drop(wake);
    if let (Some(before), Some(after)) = (before, after) {
        let (grown, sent) = (after.saturating_sub(before), QUERIES * reset.len() as u64);
        assert!(grown < sent / 3, "{grown} bytes of {sent}");
    }
}

#[test]
fn a_request_that_is_sent_twice_is_carried_out_once() {
    let server = Running::start(&[]);
    let client = Client::new(&server.endpoint);
    let session = client.open(&batch(1, 1)).unwrap();
    client.ask(Verb::Reset, &session.reset(1, 7)).unwrap();
    let step = session.step(2, &[0.5]);
    let first = client.ask(Verb::Step, &step).unwrap();
    assert_eq!(client.ask(Verb::Step, &step), Some(first));
    assert_eq!(client.fault(Verb::Step, &session.step(2, &[0.6])), Fault::SeqReuse { seq: 2 });
    let closed = client.ask(Verb::Close, &session.close()).unwrap();
    assert_eq!(codec::read::<CloseReply>(payload(&closed)).unwrap().steps, 1);
}

#[test]
fn a_server_that_is_full_says_so_until_a_session_ends() {
    let server = Running::start(&["--max-sessions", "2"]);
    let client = Client::new(&server.endpoint);
    let first = client.open(&batch(1, 1)).unwrap();
    client.open(&batch(2, 1)).unwrap();
    let full = client.open(&batch(3, 1)).map(|opened| opened.reply.sid);
    assert_eq!(full, Err(Fault::full(2, 2, "sessions", "max_sessions")));
    client.ask(Verb::Close, &first.close()).unwrap();
    client.open(&batch(3, 1)).unwrap();
}

#[test]
fn all_sessions_share_the_room_for_cells_until_one_ends() {
    // A pasture has 4000 cells, in 65 squares of 64.
    let server = Running::start(&["--max-all-cells", "6000"]);
    let client = Client::new(&server.endpoint);
    let first = client.open(&batch(1, 1)).unwrap();
    let full = client.open(&batch(2, 1)).map(|opened| opened.reply.sid);
    assert_eq!(full, Err(Fault::full(4160, 6000, "cells of pastures", "max_all_cells")));
    client.ask(Verb::Close, &first.close()).unwrap();
    client.open(&batch(3, 1)).unwrap();
}

#[test]
fn a_session_is_freed_once_its_client_is_gone_for_the_grace() {
    let server = Running::start(&["--max-sessions", "1", "--grace-ms", "300"]);
    let gone = Client::new(&server.endpoint);
    let lid = gone.open(&batch(1, 1)).unwrap().reply.lid;
    let lease = format!("swath/v1/default/lease/{lid:032x}");
    let token = gone.session.liveliness().declare_token(lease).wait().unwrap();
    let client = Client::new(&server.endpoint);
    std::thread::sleep(Duration::from_millis(500));
    assert!(client.open(&batch(2, 1)).is_err(), "its lease holds it");
    drop(token);
    drop(gone);
    std::thread::sleep(Duration::from_millis(1300));
    client.open(&batch(2, 1)).unwrap();
}

#[test]
fn bytes_that_are_no_request_are_told_so_and_change_nothing() {
    let server = Running::start(&["--max-msg", "10000"]);
    let client = Client::new(&server.endpoint);
    let session = client.open(&batch(1, 1)).unwrap();
    client.ask(Verb::Reset, &session.reset(1, 7)).unwrap();
    for length in 0..100_u8 {
        let garbage: Vec<u8> = (0..length).map(|i| i.wrapping_mul(37) ^ length).collect();
        for verb in Verb::ALL {
            let fault = client.fault(verb, &garbage);
            assert!(matches!(fault, Fault::Malformed { .. }), "{verb:?}: {fault:?}");
        }
    }
    let step = session.step(2, &[0.5]);
    for place in 48..step.len() {
        let mut damaged = step.clone();
        damaged[place] ^= 0x80;
        if place < 49 + 4 + 16 {
            let fault = client.fault(Verb::Step, &damaged);
            assert!(matches!(fault, Fault::Malformed { .. }), "{place}: {fault:?}");
        }
    }
    let large = session.header(Verb::Step, 2).message(0, |bytes| bytes.extend([0; 10_000]));
    assert_eq!(client.fault(Verb::Step, &large), Fault::TooLarge { size: 10_053, limit: 10_000 });
    let reply = client.ask(Verb::Step, &step).unwrap();
    assert_eq!(Header::read(&reply).unwrap().0.seq, 2);
}

#[test]
fn a_query_that_is_meant_for_many_gets_nothing() {
    let server = Running::start(&[]);
    let client = Client::new(&server.endpoint);
    let spec = codec::write_empty(&header(Verb::Spec));
    for key in ["swath/**", "swath/v1/*/rpc/spec", "swath/v1/default/rpc/*", "**"] {
        assert_eq!(client.get(key, &spec), Vec::<Vec<u8>>::new(), "{key}");
    }
    assert_eq!(client.get("swath/v1/default/rpc/spec", &spec).len(), 1);
    assert_eq!(client.get("swath/v1/another/rpc/spec", &spec), Vec::<Vec<u8>>::new());
}

#[test]
fn every_version_is_told_which_one_is_spoken() {
    let server = Running::start(&["--name", "field-1"]);
    let mut client = Client::new(&server.endpoint);
    client.server = "field-1".to_owned();
    let spec = client.spec().unwrap();
    assert_eq!((spec.server.as_str(), spec.major_max), ("field-1", 1));
    assert_eq!(spec.envs[0].id, batch(1, 1).env_id);
    assert!(spec.envs[0].config_schema.contains("deck_width_m"));
    let mut newer = codec::write_empty(&header(Verb::Spec));
    newer[4] = 9;
    let replies = client.get("swath/v9/field-1/rpc/spec", &newer);
    assert_eq!(replies.len(), 1);
    assert_eq!(fault_of(&replies[0]), Fault::VersionMismatch { least: 1, most: 1 });
}

#[test]
fn a_scenario_that_cannot_be_used_is_refused_by_name_and_takes_no_place() {
    let server = Running::start(&["--max-sessions", "1"]);
    let client = Client::new(&server.endpoint);
    let wrong = Open { config: "[mower]\ndeck_with_m = 2.0\n".to_owned(), ..batch(1, 1) };
    let Err(Fault::BadConfig { text }) = client.open(&wrong).map(|opened| opened.reply) else {
        panic!("it is refused");
    };
    assert!(text.contains("deck_width_m"), "{text}");
    client.open(&batch(1, 1)).unwrap();
    let stats = client.ask(Verb::Stats, &codec::write_empty(&header(Verb::Stats))).unwrap();
    let stats: StatsReply = codec::read(payload(&stats)).unwrap();
    assert_eq!((stats.sessions, stats.opened, stats.faults), (1, 1, 1));
}
