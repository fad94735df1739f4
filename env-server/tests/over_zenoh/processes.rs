//! Servers that start, refuse to, and end.

use crate::common::{Client, Router, Running, batch, refusal, size};
use swath_wire::fault::Fault;
use swath_wire::header::Verb;

#[test]
fn a_server_that_is_killed_is_silence_and_the_next_one_says_that_sessions_are_lost() {
    let mut server = Running::start(&[]);
    let client = Client::new(&server.endpoint);
    let session = client.open(&batch(1, 1)).unwrap();
    client.ask(Verb::Reset, &session.reset(1, 7)).unwrap();
    server.kill();
    assert_eq!(client.ask(Verb::Step, &session.step(2, &[0.5])), None);
    let step = session.step(2, &[0.5]);
    let next = Running::start(&["--listen", &server.endpoint]);
    let client = Client::new(&next.endpoint);
    assert!(matches!(client.fault(Verb::Step, &step), Fault::SessionLost { .. }));
}

#[test]
fn a_server_that_is_told_to_end_does_so_and_its_keys_are_gone() {
    let mut server = Running::start(&[]);
    let client = Client::new(&server.endpoint);
    let session = client.open(&batch(1, 64)).unwrap();
    client.ask(Verb::Reset, &session.reset(1, 7)).unwrap();
    assert_eq!(server.terminate().code(), Some(0));
    assert_eq!(client.spec(), None);
}

#[test]
fn a_second_server_of_one_name_or_at_one_endpoint_does_not_start() {
    let server = Running::start(&["--name", "field"]);
    let other = ["--name", "field", "--listen", "tcp/127.0.0.1:0", "--connect", &server.endpoint];
    let taken = "swath-server: a server called `field` is there already\n";
    assert_eq!(refusal(&other), (Some(2), taken.to_owned()));
    let (status, text) = refusal(&["--name", "meadow", "--listen", &server.endpoint]);
    assert_eq!((status, text.lines().count()), (Some(2), 1), "{text}");
    assert!(text.ends_with(")]\n") && !text.contains(".rs"), "{text}");
    let beside = Running::start(&["--name", "meadow", "--connect", &server.endpoint]);
    let mut client = Client::new(&beside.endpoint);
    client.server = "meadow".to_owned();
    assert!(client.spec().is_some());
}

#[test]
fn of_servers_of_one_name_that_start_at_once_one_stays() {
    for _ in 0..size(3, 20) {
        let router = Router::start();
        let start = || {
            let flags = ["--name", "field", "--listen", "tcp/127.0.0.1:0", "--connect"];
            Running::try_start(&[&flags[..], &[&router.endpoint]].concat())
        };
        let (one, other) = std::thread::scope(|both| {
            let (one, other) = (both.spawn(start), both.spawn(start));
            (one.join().unwrap(), other.join().unwrap())
        });
        assert!(
            one.is_some() != other.is_some(),
            "one of them, not {} and {}",
            one.is_some(),
            other.is_some()
        );
    }
}

#[test]
fn what_cannot_be_used_is_one_line_and_status_2() {
    for (flags, part) in [
        (&["--listen", "tcp/0.0.0.0:0"][..], "missing: tls/ in place of tcp/, `--tls-ca`"),
        (&["--listen", "tcp/localhost:0"], "not an address of this machine's loopback"),
        (&["--listen", "tls/127.0.0.1:0"], "needs mutual TLS; missing: `--tls-ca`"),
        (&["--connect", "tcp/192.0.2.1:7447"], "not an address of this machine's loopback"),
        (&["--workers", "0"], "`workers` must be from 1 to 1024, got 0"),
        (&["--workers", "many"], "invalid value 'many' for '--workers <N>'"),
        (&["--graze-ms", "5"], "unexpected argument '--graze-ms' found"),
        (&["--config", "no/such/server.toml"], "`no/such/server.toml`: No such file"),
    ] {
        let (status, text) = refusal(flags);
        assert_eq!((status, text.lines().count()), (Some(2), 1), "{flags:?}: {text}");
        assert!(text.starts_with("swath-server: ") && text.contains(part), "{flags:?}: {text}");
    }
}

#[test]
fn whoever_insists_may_listen_everywhere() {
    let server = Running::start(&["--listen", "tcp/0.0.0.0:0", "--insecure"]);
    let client = Client::new(&server.endpoint.replace("0.0.0.0", "127.0.0.1"));
    assert!(client.spec().is_some());
}
