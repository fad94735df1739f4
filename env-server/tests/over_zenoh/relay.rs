//! A node between clients and a server that treats replies as a bad network does.
//!
//! Clients find it under the server's name. It hands their queries on, and of the replies it loses some, doubles some and
//! keeps some until their client has given them up.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use swath_server::clock::Clock;
use swath_server::endpoint::Endpoint;
use zenoh::query::{ConsolidationMode, Query};
use zenoh::{Config, Session, Wait as _};

use crate::common::{Client, PATIENCE};

/// What a relay does to replies.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Weather {
    /// How many of a thousand come late.
    pub(crate) late: u64,
    /// How long they take, milliseconds.
    pub(crate) late_ms: u64,
    /// How many of a thousand are lost.
    pub(crate) lost: u64,
    /// How many of a thousand are doubled; as many queries are doubled, too.
    pub(crate) doubled: u64,
    pub(crate) seed: u64,
}

/// How many replies met which fate.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    pub(crate) queries: AtomicU64,
    pub(crate) late: AtomicU64,
    pub(crate) lost: AtomicU64,
    pub(crate) doubled: AtomicU64,
}

/// A relay that runs; it ends with this.
pub(crate) struct Relay {
    session: Session,
    pub(crate) endpoint: String,
    pub(crate) tally: Arc<Tally>,
}

/// A reply on its way.
type Letter = (Query, Vec<u8>);

impl Relay {
    /// A relay to the server at an endpoint.
    pub(crate) fn start(server: &str, weather: Weather) -> Self {
        let endpoint = Endpoint::parse("tcp/127.0.0.1:0").unwrap().with_port().unwrap().to_string();
        let config = serde_json::json!({
            "mode": "peer",
            "listen": { "endpoints": [endpoint], "exit_on_failure": true },
            "scouting": { "multicast": { "enabled": false }, "gossip": { "enabled": false } },
        });
        let config = Config::from_json5(&config.to_string()).unwrap();
        let session = zenoh::open(config).wait().unwrap();
        let (queries_in, queries) = channel::<Query>();
        session
            .declare_queryable("swath/v1/default/rpc/*")
            .complete(true)
            .callback(move |query| drop(queries_in.send(query)))
            .background()
            .wait()
            .unwrap();
        let tally = Arc::new(Tally::default());
        let server = Client::new(server);
        let counts = Arc::clone(&tally);
        let dice = Arc::new(Mutex::new(Dice(weather.seed)));
        thread::spawn(move || {
            let late = later(weather.late_ms);
            for query in queries {
                counts.queries.fetch_add(1, Ordering::Relaxed);
                let copies = 1 + u64::from(dice.lock().unwrap().per_mille() < weather.doubled);
                for _ in 0..copies {
                    let (dice, late, counts) = (dice.clone(), late.clone(), counts.clone());
                    let (key, payload) = (query.key_expr().clone(), query.payload().cloned());
                    let query = query.clone();
                    let hand_on = move |reply: zenoh::query::Reply| {
                        let Ok(sample) = reply.result() else { return };
                        let letter = (query.clone(), sample.payload().to_bytes().into_owned());
                        let fate = dice.lock().unwrap().per_mille();
                        if fate < weather.late {
                            counts.late.fetch_add(1, Ordering::Relaxed);
                            late.send(letter).unwrap();
                        } else if fate < weather.late + weather.lost {
                            counts.lost.fetch_add(1, Ordering::Relaxed);
                            // Whoever drops a query tells its client that there is no reply; this one is to hear nothing.
                            late.send((letter.0, Vec::new())).unwrap();
                        } else if fate < weather.late + weather.lost + weather.doubled {
                            counts.doubled.fetch_add(1, Ordering::Relaxed);
                            deliver(&letter);
                            deliver(&letter);
                        } else {
                            deliver(&letter);
                        }
                    };
                    let asked = server.session.get(key).payload(payload.unwrap_or_default());
                    let asked = asked.consolidation(ConsolidationMode::None).timeout(PATIENCE);
                    asked.callback(hand_on).wait().unwrap();
                }
            }
        });
        Self { session, endpoint, tally }
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        let _ = self.session.close().wait();
    }
}

fn deliver((query, message): &Letter) {
    // A client that is gone needs none.
    let _ = query.reply(query.key_expr().clone(), message.as_slice()).wait();
}

/// Delivers what it is given after so many milliseconds; what is empty is forgotten then.
fn later(after_ms: u64) -> Sender<Letter> {
    let (letters_in, letters) = channel::<Letter>();
    thread::spawn(move || {
        let clock = Clock::start();
        let mut waiting: BTreeMap<(u64, u64), Letter> = BTreeMap::new();
        for count in 0.. {
            let now_ms = clock.now_ms();
            while let Some(entry) = waiting.first_entry() {
                if entry.key().0 > now_ms {
                    break;
                }
                let letter = entry.remove();
                if !letter.1.is_empty() {
                    deliver(&letter);
                }
            }
            let next_ms = waiting.keys().next().map_or(1_000, |&(due_ms, _)| due_ms - now_ms);
            match letters.recv_timeout(Duration::from_millis(next_ms)) {
                Ok(letter) => drop(waiting.insert((clock.now_ms() + after_ms, count), letter)),
                Err(RecvTimeoutError::Timeout) => (),
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    });
    letters_in
}

/// `SplitMix64`; Steele, Lea & Flood (2014).
struct Dice(u64);

impl Dice {
    fn per_mille(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (bits ^ (bits >> 31)) % 1000
    }
}
