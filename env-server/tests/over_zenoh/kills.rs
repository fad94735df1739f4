//! Servers and clients that are killed or stopped, as often as a promise needs it.

use std::io::{BufRead as _, BufReader};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use swath_server::clock::Clock;
use swath_wire::client::{ClientError, ClientOptions};
use swath_wire::codec;
use swath_wire::fault::Fault;
use swath_wire::header::Verb;
use swath_wire::message::StatsReply;
use swath_wire::resume::ResumeOptions;

use crate::agent::Agent;
use crate::common::{Client, LEASE_MS, Running, header, measured, payload, send_signal, size};

const ATTEMPT_MS: u64 = 200;
const DEADLINE_MS: u64 = 10_000;
/// How long a client may take to notice that a server is back, milliseconds.
const NOTICE_MS: u64 = 10_000;

fn options(seed: u64) -> ClientOptions {
    ClientOptions {
        attempt_ms: ATTEMPT_MS,
        deadline_ms: DEADLINE_MS,
        jitter_seed: seed,
        ..ClientOptions::default()
    }
}

/// What the clients of a run have met.
#[derive(Debug, Default)]
struct Tally {
    lost: AtomicU64,
    timeouts: AtomicU64,
    resumed: AtomicU64,
    steps: AtomicU64,
    longest_ms: AtomicU64,
}

#[test]
fn a_server_may_be_killed_and_every_client_is_told_so_or_goes_on_with_equal_states() {
    const CLIENTS: u64 = 16;
    let kills = size(5, 100);
    let flags = ["--allow-snapshot", "--listen"];
    let mut server = Running::start(&["--allow-snapshot"]);
    let endpoint = server.endpoint.clone();
    let (is_over, tally) = (AtomicBool::new(false), Tally::default());
    // How many kills each client has seen the other side of.
    let seen: Vec<AtomicU64> = (0..CLIENTS).map(|_| AtomicU64::new(0)).collect();
    let round = AtomicU64::new(0);
    thread::scope(|all| {
        for (client, seen) in (0..).zip(&seen) {
            let (endpoint, is_over, tally, round) = (&endpoint, &is_over, &tally, &round);
            all.spawn(move || live(client, endpoint, is_over, round, seen, tally));
        }
        let mut slowest_ms = 0;
        for kill in 1..=kills {
            thread::sleep(Duration::from_millis(30 + 37 * kill % 200));
            server.kill();
            thread::sleep(Duration::from_millis(53 * kill % 300));
            server = Running::start(&[&flags[..], &[&endpoint]].concat());
            round.store(kill, Ordering::SeqCst);
            let clock = Clock::start();
            let is_back = || seen.iter().all(|seen| seen.load(Ordering::SeqCst) >= kill);
            while !is_back() {
                if clock.now_ms() > NOTICE_MS + DEADLINE_MS {
                    is_over.store(true, Ordering::SeqCst);
                    panic!("a client hangs after kill {kill}: {seen:?}");
                }
                thread::sleep(Duration::from_millis(5));
            }
            slowest_ms = slowest_ms.max(clock.now_ms());
        }
        is_over.store(true, Ordering::SeqCst);
        measured(&format!(
            "after the return of a server the last client goes on within {slowest_ms} ms"
        ));
    });
    let count = |count: &AtomicU64| count.load(Ordering::SeqCst);
    let (lost, resumed) = (count(&tally.lost), count(&tally.resumed));
    assert!(lost > 0 && resumed > 0, "{tally:?}");
    measured(&format!(
        "{kills} kills of a server with {CLIENTS} clients: {lost} times told that the session is lost, {} times that \
         nobody answers, {resumed} times resumed with equal states; {} steps equal to a local replay; no hang, \
         longest call {} ms",
        count(&tally.timeouts),
        count(&tally.steps),
        count(&tally.longest_ms),
    ));
}

/// Opens sessions and steps them until all is over; half of the clients have theirs resumed.
fn live(
    client: u64,
    endpoint: &str,
    is_over: &AtomicBool,
    round: &AtomicU64,
    seen: &AtomicU64,
    tally: &Tally,
) {
    let resume = ResumeOptions { hash_every: 1, snapshot_every: 32, ..ResumeOptions::default() };
    let resume = (client % 2 == 1).then_some(resume);
    let mut opened = 0_u128;
    while !is_over.load(Ordering::SeqCst) {
        let nonce = opened << 64 | u128::from(client) << 8;
        opened += 1;
        let Some(agent) = Agent::try_open(endpoint, nonce, 2, options(client), resume) else {
            thread::sleep(Duration::from_millis(20));
            continue;
        };
        let mut agent = match agent {
            Ok(agent) => agent,
            Err(error) => {
                note(&error, tally);
                continue;
            }
        };
        let mut go_on = || -> Result<(), ClientError> {
            agent.reset(client)?;
            while !is_over.load(Ordering::SeqCst) {
                let before = round.load(Ordering::SeqCst);
                agent.step()?;
                tally.steps.fetch_add(1, Ordering::SeqCst);
                seen.store(before, Ordering::SeqCst);
            }
            Ok(())
        };
        if let Err(error) = go_on() {
            assert!(resume.is_none(), "what is resumed goes on: {error}");
            note(&error, tally);
        }
        tally.longest_ms.fetch_max(agent.longest_ms, Ordering::SeqCst);
        tally.resumed.fetch_add(agent.resumed(), Ordering::SeqCst);
    }
}

fn note(error: &ClientError, tally: &Tally) {
    match error {
        ClientError::Fault(Fault::SessionLost { .. }) => &tally.lost,
        ClientError::Timeout { .. } => &tally.timeouts,
        other => panic!("{other}"),
    }
    .fetch_add(1, Ordering::SeqCst);
}

/// A client in a process of its own; ends with this.
struct ClientProcess {
    child: Child,
    lines: BufReader<ChildStdout>,
}

const ENDPOINT: &str = "SWATH_TEST_ENDPOINT";
const NONCE: &str = "SWATH_TEST_NONCE";

impl ClientProcess {
    fn start(endpoint: &str, nonce: u64, lease_ms: u64) -> Self {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args([
                "--exact",
                "kills::a_client_that_steps_until_it_is_killed",
                "--ignored",
                "--nocapture",
            ])
            .env(ENDPOINT, endpoint)
            .env(NONCE, nonce.to_string())
            .env(LEASE_MS, lease_ms.to_string())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap());
        Self { child, lines }
    }

    /// Waits until it says something that begins so, and returns the rest of the line.
    fn says(&mut self, what: &str) -> String {
        let mut last = String::new();
        loop {
            let mut line = String::new();
            let is_over = self.lines.read_line(&mut line).unwrap() == 0;
            assert!(!is_over, "it ends without `{what}`, after {last}");
            if let Some((_, rest)) = line.split_once(what) {
                return rest.trim().to_owned();
            }
            last = line;
        }
    }

    fn kill(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }
}

impl Drop for ClientProcess {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
#[ignore = "the other tests run it, in processes of its own"]
#[expect(clippy::print_stdout, reason = "the other tests read it")]
fn a_client_that_steps_until_it_is_killed() {
    let endpoint = std::env::var(ENDPOINT).expect("the other tests say where the server is");
    let nonce: u64 = std::env::var(NONCE).unwrap().parse().unwrap();
    let mut agent = Agent::open(&endpoint, nonce.into(), 16, options(nonce), None).unwrap();
    agent.reset(nonce).unwrap();
    loop {
        for _ in 0..20 {
            if let Err(error) = agent.step() {
                println!("it ends: {error}");
                return;
            }
        }
        println!("it is at {}", agent.steps);
        thread::sleep(Duration::from_millis(5));
    }
}

fn stats(client: &Client) -> StatsReply {
    let reply = client.ask(Verb::Stats, &codec::write_empty(&header(Verb::Stats))).unwrap();
    codec::read(payload(&reply)).unwrap()
}

/// Waits until so many sessions are open; how long it took, milliseconds.
fn wait_for_sessions(client: &Client, sessions: u32, most_ms: u64) -> u64 {
    let clock = Clock::start();
    while stats(client).sessions != sessions {
        assert!(clock.now_ms() <= most_ms, "{} sessions are open", stats(client).sessions);
        thread::sleep(Duration::from_millis(10));
    }
    clock.now_ms()
}

#[test]
fn a_client_may_be_killed_and_its_place_is_free_after_the_grace_and_its_memory_too() {
    const TOGETHER: u64 = 8;
    const GRACE_MS: u64 = 1_000;
    // With the first ones, each thread puts by a little of what it frees, and hardly more after them.
    let (first, batches) = (size(1, 30), size(2, 55));
    let grace = GRACE_MS.to_string();
    let server = Running::start(&["--max-sessions", "8", "--grace-ms", &grace]);
    let observer = Client::new(&server.endpoint);
    let (mut slowest_ms, mut settled) = (0, None);
    let unused = server.memory_bytes();
    for batch in 0..batches {
        let start =
            |place| ClientProcess::start(&server.endpoint, 1 + batch * TOGETHER + place, 10_000);
        let mut clients: Vec<ClientProcess> = (0..TOGETHER).map(start).collect();
        for client in &mut clients {
            client.says("it is at ");
        }
        for client in &mut clients {
            client.kill();
        }
        slowest_ms = slowest_ms.max(wait_for_sessions(&observer, 0, GRACE_MS + 1_000));
        if batch + 1 == first {
            settled = server.memory_at_rest_bytes();
        }
    }
    let stats = stats(&observer);
    assert_eq!((stats.sessions, stats.envs, stats.lost), (0, 0, batches * TOGETHER));
    measured(&format!(
        "{} kills of a client: every place free within {slowest_ms} ms, with a grace of {GRACE_MS} ms",
        batches * TOGETHER
    ));
    let after = server.memory_at_rest_bytes();
    if let (Some(unused), Some(before), Some(after)) = (unused, settled, after) {
        let kib = |bytes: u64| bytes >> 10;
        let (grown, used) = (after as f64 / before as f64, after as f64 / unused as f64);
        let text = format!(
            "the server's memory: {} KiB before the first client, {} KiB after the first {} of these kills, {} KiB after \
             the last; the last is {grown:.3} times the one after the first {}, and {used:.3} times the one before",
            kib(unused),
            kib(before),
            first * TOGETHER,
            kib(after),
            first * TOGETHER
        );
        measured(&text);
        // What eight clients had at once was half as much again. Where the allocator is told to, nearly all of that is back.
        let is_told = cfg!(all(target_os = "linux", target_env = "gnu"));
        assert!(used <= 1.4 || !is_told, "{text}");
        // Few kills tell less.
        assert!(grown <= if batches > 5 { 1.05 } else { 1.1 }, "{text}");
    }
}

#[test]
fn a_server_that_is_stopped_goes_on_where_it_was() {
    let stops = size(2, 10);
    let server = Running::start(&["--lease-ms", "1000"]);
    let mut agent = Agent::open(&server.endpoint, 1, 16, options(1), None).unwrap();
    agent.reset(1).unwrap();
    let mut longest_ms = 0;
    for stop in 0..stops {
        for _ in 0..50 {
            agent.step().unwrap();
        }
        server.signal("-STOP");
        let stopped_ms = [400, 3_000][usize::try_from(stop % 2).unwrap()];
        thread::scope(|all| {
            all.spawn(|| {
                thread::sleep(Duration::from_millis(stopped_ms));
                server.signal("-CONT");
            });
            agent.longest_ms = 0;
            agent.step().unwrap();
        });
        assert!(agent.longest_ms >= stopped_ms - 50, "{} ms", agent.longest_ms);
        longest_ms = longest_ms.max(agent.longest_ms - stopped_ms.min(agent.longest_ms));
    }
    let steps = agent.steps * 16;
    assert_eq!(agent.close(), Ok(steps), "no step twice");
    measured(&format!(
        "{stops} stops of a server for 400 and 3000 ms: no step twice; answered within {longest_ms} ms after it went on"
    ));
}

#[test]
fn a_client_that_is_stopped_goes_on_within_its_grace_and_is_told_after_it() {
    let stops = size(1, 10);
    let (lease_ms, grace_ms) = (1_000, 2_000);
    let server = Running::start(&["--grace-ms", "2000"]);
    let observer = Client::new(&server.endpoint);
    let mut slowest_ms = 0;
    for stop in 0..stops {
        let mut client = ClientProcess::start(&server.endpoint, stop + 1, lease_ms);
        client.says("it is at ");
        send_signal(&client.child, "-STOP");
        thread::sleep(Duration::from_millis(1_500));
        assert_eq!(stats(&observer).sessions, 1);
        send_signal(&client.child, "-CONT");
        for _ in 0..100 {
            client.says("it is at ");
        }
        send_signal(&client.child, "-STOP");
        let took_ms = wait_for_sessions(&observer, 0, lease_ms + grace_ms + 1_000);
        slowest_ms = slowest_ms.max(took_ms);
        send_signal(&client.child, "-CONT");
        let error = client.says("it ends: ");
        assert_eq!(error, "the session ended because its client was gone");
    }
    measured(&format!(
        "{stops} stops of a client: it goes on after 1500 ms; its place is free within {slowest_ms} ms, with a lease \
         of {lease_ms} ms and a grace of {grace_ms} ms, and then it is told so"
    ));
}
