//! Over a real network that delays, loses and doubles replies, every step is made once.

use std::sync::atomic::Ordering;
use std::thread;

use swath_server::clock::Clock;
use swath_wire::client::ClientOptions;

use crate::agent::Agent;
use crate::common::{Running, measured, size};
use crate::relay::{Relay, Weather};

const ENVS: u16 = 16;
const ATTEMPT_MS: u64 = 200;

#[test]
fn no_step_is_made_twice_or_left_out_and_every_observation_is_that_of_a_local_replay() {
    let (clients, steps) = (size(8, 64), size(200, 2_000));
    let server = Running::start(&[]);
    let weather = Weather { late: 50, late_ms: ATTEMPT_MS + 100, lost: 10, doubled: 10, seed: 1 };
    let relay = Relay::start(&server.endpoint, weather);
    let clock = Clock::start();
    thread::scope(|all| {
        for client in 0..clients {
            let endpoint = &relay.endpoint;
            all.spawn(move || {
                let options = ClientOptions {
                    attempt_ms: ATTEMPT_MS,
                    jitter_seed: client,
                    ..ClientOptions::default()
                };
                let mut agent = Agent::open(endpoint, client.into(), ENVS, options, None).unwrap();
                agent.reset(client * 1_000).unwrap();
                for _ in 0..steps {
                    agent.step().unwrap();
                }
                assert_eq!(agent.close(), Ok(steps * u64::from(ENVS)), "carried out once");
            });
        }
    });
    let count = |count: &std::sync::atomic::AtomicU64| count.load(Ordering::Relaxed);
    let tally = &relay.tally;
    let (queries, late, lost, doubled) =
        (count(&tally.queries), count(&tally.late), count(&tally.lost), count(&tally.doubled));
    assert!(late > queries / 40 && lost > 0 && doubled > 0, "{tally:?}");
    assert!(queries > clients * steps, "{tally:?}");
    measured(&format!(
        "relay: {clients} clients x {steps} steps x {ENVS} environments over Zenoh in {} s: {queries} queries, \
         {late} replies late, {lost} lost, {doubled} doubled; every step once, every reply equal to the local replay",
        clock.now_ms() / 1000
    ));
}
