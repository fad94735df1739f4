//! Clients that send what they should not, or are too many: nobody else is worse off.

use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use swath_server::clock::Clock;
use swath_wire::client::ClientOptions;
use swath_wire::codec;
use swath_wire::fault::Fault;
use swath_wire::header::Verb;
use zenoh::Wait as _;
use zenoh::query::ConsolidationMode;

use crate::agent::Agent;
use crate::common::{Client, Running, batch, fault_of, header, measured, size};

#[test]
fn random_bytes_are_refused_while_others_go_on() {
    let messages = size(2_000, 50_000);
    let server = Running::start(&["--max-msg", "100000"]);
    let client = Client::new(&server.endpoint);
    let mut agent = Agent::open(&server.endpoint, 1, 16, ClientOptions::default(), None).unwrap();
    agent.reset(1).unwrap();
    let before = server.memory_bytes();
    let mut bits = 1_u64;
    for number in 0..messages {
        let mut garbage: Vec<u8> = Vec::new();
        bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        for _ in 0..(bits >> 33) % 400 {
            bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            garbage.push(bits.to_be_bytes()[0]);
        }
        let verb = Verb::ALL[usize::try_from(number % 8).unwrap()];
        let fault = client.fault(verb, &garbage);
        assert!(matches!(fault, Fault::Malformed { .. }), "{fault}");
        if number % 20 == 0 {
            agent.step().unwrap();
        }
    }
    let steps = agent.steps * 16;
    assert_eq!(agent.close(), Ok(steps));
    measured(&format!(
        "{messages} random messages over Zenoh: each refused by name, {steps} steps of a client beside them equal \
         to a local replay"
    ));
    check_growth("these messages", before, server.memory_bytes(), 16 << 10);
}

#[test]
fn a_message_that_is_too_large_is_refused_or_not_taken_in_and_others_go_on() {
    let server = Running::start(&["--max-msg", "100000"]);
    let client = Client::new(&server.endpoint);
    let session = client.open(&batch(1, 1)).unwrap();
    client.ask(Verb::Reset, &session.reset(1, 7)).unwrap();
    let large = |bytes| session.header(Verb::Step, 2).message(0, |all| all.extend(vec![0; bytes]));
    let limit = 100_000;
    assert_eq!(client.fault(Verb::Step, &large(100_000)), Fault::TooLarge { size: 100_053, limit });
    // Far larger ones are not even put together.
    let mut agent = Agent::open(&server.endpoint, 2, 1, ClientOptions::default(), None).unwrap();
    agent.reset(1).unwrap();
    let before = server.memory_bytes();
    let sender = Client::new(&server.endpoint);
    for _ in 0..20 {
        let query = sender.session.get("swath/v1/default/rpc/step").payload(large(32 << 20));
        let query = query.consolidation(ConsolidationMode::None);
        let replies = query.timeout(Duration::from_millis(300)).wait().unwrap();
        assert!(replies.into_iter().all(|reply| reply.result().is_err()));
        agent.step().unwrap();
    }
    let after = server.memory_bytes();
    assert_eq!(agent.close(), Ok(20));
    measured("20 messages of 32 MiB where 100000 bytes are allowed: none answered");
    check_growth("these messages", before, after, 64 << 10);
}

/// Holds what a server has grown by, where the system tells; bytes, and KiB.
fn check_growth(by: &str, before: Option<u64>, after: Option<u64>, most_kib: u64) {
    if let (Some(before), Some(after)) = (before, after) {
        let (before, after) = (before >> 10, after >> 10);
        assert!(after <= before + most_kib, "{before} KiB, {after} KiB");
        measured(&format!("the server's memory: {before} KiB before {by}, {after} KiB after them"));
    }
}

#[test]
fn of_more_clients_than_places_as_many_as_there_are_places_come_in() {
    let (clients, places) = (size(32, 256), size(8, 64));
    let text = places.to_string();
    let server = Running::start(&["--max-sessions", &text]);
    let (opened, refused, slowest_ms) = (AtomicU64::new(0), AtomicU64::new(0), AtomicU64::new(0));
    let all_clients: Vec<Client> = (0..16).map(|_| Client::new(&server.endpoint)).collect();
    thread::scope(|all| {
        for (thread, client) in (0..).zip(&all_clients) {
            let (opened, refused, slowest_ms) = (&opened, &refused, &slowest_ms);
            all.spawn(move || {
                for number in 0..clients / 16 {
                    let clock = Clock::start();
                    let nonce = u128::from(number * 16 + thread);
                    match client.open(&batch(nonce, 1)).map(|opened| opened.reply.sid) {
                        Ok(_) => opened.fetch_add(1, Ordering::SeqCst),
                        Err(fault) => {
                            let full = Fault::full(places, places, "sessions", "max_sessions");
                            assert_eq!(fault, full);
                            slowest_ms.fetch_max(clock.now_ms(), Ordering::SeqCst);
                            refused.fetch_add(1, Ordering::SeqCst)
                        }
                    };
                }
            });
        }
    });
    let (opened, refused) = (opened.into_inner(), refused.into_inner());
    assert_eq!((opened, refused), (places, clients - places));
    measured(&format!(
        "{clients} clients for {places} places: {opened} came in, {refused} were told that all places are taken, \
         the last of them within {} ms",
        slowest_ms.into_inner()
    ));
}

#[test]
fn another_version_is_refused_by_name_whatever_it_asks_for() {
    let server = Running::start(&[]);
    let client = Client::new(&server.endpoint);
    for verb in Verb::ALL {
        let mut newer = codec::write_empty(&header(verb));
        newer[4] = 2;
        let reply = client.ask(verb, &newer).unwrap();
        let fault = fault_of(&reply);
        assert_eq!(fault, Fault::VersionMismatch { least: 1, most: 1 });
        assert_eq!(fault.to_string(), "the server speaks version 1 to 1 of the protocol");
    }
}
