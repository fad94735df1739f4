//! Clients and a server in virtual time, over a network that loses, doubles, delays and reorders messages and is cut off
//! from clients for a while, with clients that crash and servers that are started anew.
//!
//! The state machines are those of `swath-wire`; the environment is a number that each request changes in a way that shows
//! order and repetition. What must never happen ends the run with a panic; [`World::check`] looks at what is left.

mod client;
mod server;

use std::collections::BTreeMap;
use std::sync::Arc;

use bytes::Bytes;
use swath_wire::header::{Header, Kind, Verb};
use swath_wire::server::{Finished, JobId, QueryId};

use self::client::Client;
use self::server::Server;
use crate::dice::Dice;

/// How long a client waits for an answer before it asks again, milliseconds.
pub const ATTEMPT_MS: u64 = 150;
/// How long it asks, milliseconds.
pub const DEADLINE_MS: u64 = 1_500;

/// What the network does to messages, and what befalls clients and servers: once in so many times, 0 for never.
#[derive(Debug, Clone, Copy)]
pub struct Weather {
    /// A message comes after its sender has given it up.
    pub late_in: u64,
    /// A message is lost.
    pub lost_in: u64,
    /// A message arrives twice.
    pub doubled_in: u64,
    /// Before a call, the client is cut off for up to twice the deadline.
    pub cut_in: u64,
    /// Before a call, the client crashes.
    pub crash_in: u64,
    /// A job takes longer than an attempt.
    pub slow_in: u64,
    /// How long a server lives at least, milliseconds; it lives up to three times as long. 0 for ever.
    pub server_life_ms: u64,
}

impl Default for Weather {
    /// Some of everything.
    fn default() -> Self {
        Self {
            late_in: 20,
            lost_in: 100,
            doubled_in: 100,
            cut_in: 400,
            crash_in: 800,
            slow_in: 50,
            server_life_ms: 2_000,
        }
    }
}

/// What happens next.
enum Event {
    ToServer { from: Sender, verb: Verb, message: Arc<[u8]> },
    ToClient { to: Sender, message: Option<Bytes> },
    Timeout(Sender),
    Wake { client: usize },
    Lease { lid: u128, is_there: bool },
    JobDone { boot: u64, job: JobId, finished: Finished },
    ServerWake,
    Crash,
    Start,
}

/// An attempt of a call of a client.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Sender {
    client: usize,
    call: u64,
    attempt: u64,
}

/// Clients, the network, and the server of the time.
pub struct World {
    now_ms: u64,
    events: BTreeMap<(u64, u64), Event>,
    count: u64,
    dice: Dice,
    weather: Weather,
    clients: Vec<Client>,
    boot: u64,
    server: Option<Server>,
    tally: Tally,
}

/// How often what happened.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    /// Requests that were carried out; those that were sent again after a resumption count again.
    pub executed: u64,
    /// Steps whose replies a client was given.
    pub stepped: u64,
    /// States that a client has put back.
    pub restored: u64,
    /// Sessions that were opened.
    pub opened: u64,
    /// Sessions that a client closed.
    pub closed: u64,
    /// Sessions whose environments were freed.
    pub freed: u64,
    /// Sessions that ended with their server.
    pub lost_with_server: u64,
    /// Clients that were told so.
    pub seen_lost: u64,
    /// Clients that were told that their session had ended.
    pub seen_ended: u64,
    /// Sessions that were resumed at the next server.
    pub resumed: u64,
    /// Clients that crashed.
    pub crashes: u64,
    /// Calls that were not answered in time.
    pub timeouts: u64,
    /// Opens that found no room.
    pub full: u64,
    /// Servers that were started anew.
    pub restarts: u64,
}

impl World {
    /// So many clients, each of which wants to make so many steps; every other one has its sessions resumed.
    #[must_use]
    pub fn new(seed: u64, weather: Weather, clients: usize, steps: u64) -> Self {
        let mut dice = Dice::new(seed);
        let all =
            (0..clients).map(|place| Client::new(dice.bits(), place % 2 == 1, steps)).collect();
        let mut world = Self {
            now_ms: 0,
            events: BTreeMap::new(),
            count: 0,
            dice,
            weather,
            clients: all,
            boot: 0,
            server: None,
            tally: Tally::default(),
        };
        world.at(0, Event::Start);
        for client in 0..clients {
            world.at(1, Event::Wake { client });
        }
        world
    }

    fn at(&mut self, in_ms: u64, event: Event) {
        self.count += 1;
        self.events.insert((self.now_ms + in_ms, self.count), event);
    }

    /// How long a message takes: one in twenty comes after the sender has given it up.
    fn delay_ms(&mut self) -> u64 {
        if self.happens(self.weather.late_in) {
            100 + self.dice.below(300)
        } else {
            self.dice.below(4)
        }
    }

    /// Lets the time go by until every client has made its steps, and then until the last session is forgotten.
    pub fn run(&mut self) {
        while let Some(((at_ms, _), event)) = self.events.pop_first() {
            self.now_ms = at_ms;
            self.happen(event);
            if self.clients.iter().all(|client| client.is_done) {
                break;
            }
        }
        // Nobody asks any more: what is left expires.
        while let Some(((at_ms, _), event)) = self.events.pop_first() {
            self.now_ms = at_ms;
            if !matches!(event, Event::Crash) {
                self.happen(event);
            }
        }
    }

    fn happen(&mut self, event: Event) {
        let now_ms = self.now_ms;
        match event {
            Event::ToServer { from, verb, message } => match &mut self.server {
                Some(server) => {
                    server.last_query += 1;
                    let query = QueryId(server.last_query);
                    server.queries.insert(query, from);
                    server.sessions.on_query(now_ms, query, verb, &message);
                    self.serve();
                }
                None => self.at(0, Event::ToClient { to: from, message: None }),
            },
            Event::ToClient { to, message } => {
                let client = &mut self.clients[to.client];
                let is_current = (client.call, client.attempt) == (to.call, to.attempt);
                match message {
                    Some(message) if client.call == to.call || is_numbered_reply(&message) => {
                        client.machine.on_reply(now_ms, message);
                    }
                    None if is_current => client.machine.on_nothing(now_ms),
                    _ => (),
                }
                self.drive(to.client);
            }
            Event::Timeout(from) => {
                let client = &mut self.clients[from.client];
                if (client.call, client.attempt) == (from.call, from.attempt) {
                    client.machine.on_timeout(now_ms);
                }
                self.drive(from.client);
            }
            Event::Wake { client } => {
                self.clients[client].wake_ms = None;
                self.drive(client);
            }
            Event::Lease { lid, is_there } => {
                if let Some(server) = &mut self.server {
                    server.sessions.on_lease(now_ms, lid, is_there);
                    self.serve();
                }
            }
            Event::JobDone { boot, job, finished } => {
                if boot == self.boot
                    && let Some(server) = &mut self.server
                {
                    server.sessions.on_finished(now_ms, job, Ok(finished));
                    self.serve();
                }
            }
            Event::ServerWake => {
                if let Some(server) = &mut self.server {
                    server.wake_ms = None;
                }
                self.serve();
            }
            Event::Crash => {
                let server = self.server.take().expect("it crashes while it runs");
                self.tally.lost_with_server += server.envs.len() as u64;
                self.tally.restarts += 1;
                let down_ms = self.dice.below(2 * DEADLINE_MS);
                self.at(down_ms, Event::Start);
            }
            Event::Start => self.start_server(),
        }
    }

    /// Whether what happens once in so many times happens now.
    fn happens(&mut self, once_in: u64) -> bool {
        once_in > 0 && self.dice.one_in(once_in)
    }

    /// How many of a message arrive.
    fn copies(&mut self, client: usize) -> usize {
        if self.clients[client].cut_until_ms > self.now_ms || self.happens(self.weather.lost_in) {
            0
        } else if self.happens(self.weather.doubled_in) {
            2
        } else {
            1
        }
    }

    /// Every session has ended, and nothing is left of any; how often what happened.
    ///
    /// # Panics
    ///
    /// If it is otherwise.
    #[must_use]
    pub fn check(&self) -> Tally {
        let tally = &self.tally;
        assert!(self.clients.iter().all(|client| client.is_done && client.steps_left == 0));
        let server = self.server.as_ref().expect("it was started again");
        let stats = server.sessions.stats(self.now_ms);
        assert_eq!((stats.sessions, stats.envs, server.envs.len()), (0, 0, 0), "{tally:?}");
        assert!(server.queries.is_empty(), "every query was answered or dropped");
        assert_eq!(server.sessions.wake_ms(), None, "everything is forgotten");
        assert_eq!(tally.opened, tally.freed + tally.lost_with_server, "{tally:?}");
        *tally
    }
}

/// Whether a message is a reply that may come late: to a numbered request, which later ones are not mistaken for.
fn is_numbered_reply(message: &[u8]) -> bool {
    let (header, _) = Header::read(message).expect("the server writes headers");
    matches!(header.kind, Kind::Reply(verb) if verb.is_numbered())
}
