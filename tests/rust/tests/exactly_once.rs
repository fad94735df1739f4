//! Whatever happens to messages, clients and servers: every request is carried out once, in its order, and every client is
//! given the answers to what it asked.

use proptest::prelude::*;
use swath_tests::dice::{measured, size};
use swath_tests::simulator::{Tally, Weather, World};

fn ran(seed: u64, weather: Weather, clients: usize, steps: u64) -> Tally {
    let mut world = World::new(seed, weather, clients, steps);
    world.run();
    world.check()
}

/// Under `LONG=1`, ten times the 64 x 2,000 requests that are sent over a real network.
#[test]
fn every_request_is_carried_out_once_and_every_client_sees_its_replies() {
    let (seeds, clients, steps) = (size(8, 2), 64, size(300, 10_000));
    let mut steps_seen = 0;
    for seed in 0..seeds {
        let tally = ran(seed, Weather::default(), clients, steps);
        // The run has met what it is about.
        let Tally { restored, closed, seen_lost, resumed, crashes, timeouts, restarts, .. } = tally;
        let met = [restored, closed, seen_lost, resumed, crashes, timeouts, restarts];
        assert!(met.iter().all(|&count| count > 0), "{tally:?}");
        measured(&format!("seed {seed}: {tally:?}"));
        steps_seen += tally.stepped;
    }
    assert_eq!(steps_seen, seeds * clients as u64 * steps);
    measured(&format!("simulator: {steps_seen} steps of {clients} clients, each carried out once"));
}

prop_compose! {
    /// From fine to foul.
    fn weather()(
        late_in in 0..30_u64,
        lost_in in prop_oneof![Just(0), 4..100_u64],
        doubled_in in 0..30_u64,
        cut_in in prop_oneof![Just(0), 20..400_u64],
        crash_in in prop_oneof![Just(0), 50..400_u64],
        slow_in in prop_oneof![Just(0), 4..50_u64],
        server_life_ms in prop_oneof![Just(0), 1_500..20_000_u64],
    ) -> Weather {
        let late_in = if late_in < 3 { 0 } else { late_in };
        Weather { late_in, lost_in, doubled_in, cut_in, crash_in, slow_in, server_life_ms }
    }
}

proptest! {
    #[test]
    fn in_any_weather_too(seed: u64, weather in weather(), clients in 1..6_usize, steps in 1..120_u64) {
        let tally = ran(seed, weather, clients, steps);
        prop_assert_eq!(tally.stepped, clients as u64 * steps);
    }
}
