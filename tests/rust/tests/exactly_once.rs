//! Whatever happens to messages, clients and servers: every request is carried out once, in its order, and every client is
//! given the answers to what it asked.
//!
//! Both ends run in virtual time over a network that loses, doubles, delays and reorders messages and is cut off from
//! clients for a while, with clients that crash and servers that are started anew. The environment is a number that each
//! request changes in a way that shows order and repetition.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use std::collections::BTreeMap;
use std::sync::Arc;

use swath_tests::dice::{Dice, mixed, size};
use swath_wire::client::{ClientError, ClientOptions, ClientOutput, ClientSession};
use swath_wire::codec;
use swath_wire::fault::{Fault, Loss};
use swath_wire::header::{Header, Kind, Verb};
use swath_wire::message::{
    AutoresetMode, CloseReply, Limits, Open, OpenReply, Reset, Seeds, Snapshot, SnapshotReply, Step,
};
use swath_wire::server::{
    Finished, Job, JobId, QueryId, ServerOptions, ServerOutput, ServerSessions,
};

const CLIENTS: usize = 64;
const ATTEMPT_MS: u64 = 150;
const DEADLINE_MS: u64 = 1_500;
const GRACE_MS: u32 = 4_000;
const IDLE_MS: u32 = 20_000;
/// Fewer than there are clients and sessions of crashed ones, at times.
const MAX_SESSIONS: u32 = 68;

#[test]
fn every_request_is_carried_out_once_and_every_client_sees_its_replies() {
    for seed in 0..size(8, 2) {
        let steps = size(300, 10_000);
        let mut world = World::new(seed, steps);
        world.run();
        world.check();
    }
}

/// What happens next.
enum Event {
    ToServer { from: Sender, verb: Verb, message: Arc<[u8]> },
    ToClient { to: Sender, message: Option<Arc<[u8]>> },
    Timeout(Sender),
    Wake { client: usize },
    Lease { lid: u128, is_there: bool },
    JobDone { boot: u64, job: JobId, finished: Finished },
    ServerWake,
    Crash,
    Start,
}

/// An attempt of a call of a client.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Sender {
    client: usize,
    call: u64,
    attempt: u64,
}

struct World {
    now_ms: u64,
    events: BTreeMap<(u64, u64), Event>,
    count: u64,
    dice: Dice,
    clients: Vec<Client>,
    boot: u64,
    server: Option<Server>,
    tally: Tally,
}

struct Server {
    sessions: ServerSessions,
    queries: BTreeMap<QueryId, Sender>,
    envs: BTreeMap<u128, Toy>,
    last_query: u64,
    /// When it is woken next.
    wake_ms: Option<u64>,
}

/// How often what happened.
#[derive(Debug, Default)]
struct Tally {
    executed: u64,
    opened: u64,
    closed: u64,
    freed: u64,
    lost_with_server: u64,
    seen_lost: u64,
    seen_ended: u64,
    crashes: u64,
    timeouts: u64,
    full: u64,
    restarts: u64,
}

/// The environments of a session.
struct Toy {
    state: u64,
    journal: Vec<u64>,
}

struct Client {
    machine: ClientSession,
    ask: Ask,
    call: u64,
    attempt: u64,
    /// The state that its session has to have.
    state: u64,
    has_reset: bool,
    steps_left: u64,
    session_left: u64,
    cut_until_ms: u64,
    pause_until_ms: u64,
    /// When it is woken next.
    wake_ms: Option<u64>,
    is_done: bool,
}

#[derive(Debug, Clone, Copy)]
enum Ask {
    Nothing,
    Open,
    Reset(u64),
    Step(u64),
    Snapshot,
    Close,
}

fn stepped(state: u64, action: u64) -> u64 {
    mixed(state.rotate_left(7) ^ action)
}

impl Toy {
    fn answer(&mut self, header: &Header, payload: &[u8]) -> Vec<u8> {
        let Kind::Request(verb) = header.kind else { unreachable!() };
        let reply = Header { kind: Kind::Reply(verb), ..*header };
        if verb == Verb::Snapshot {
            assert_eq!(header.seq, self.journal.len() as u64, "a snapshot is of the present");
            let data = self.state.to_le_bytes();
            return codec::write(&reply, &SnapshotReply { config_hash: [0; 32], data: &data })
                .unwrap();
        }
        assert_eq!(header.seq, self.journal.len() as u64 + 1, "carried out once, and in order");
        self.journal.push(header.seq);
        self.state = if verb == Verb::Reset {
            let reset: Reset = codec::read(payload).unwrap();
            let Seeds::One(seed) = reset.seeds else { unreachable!() };
            seed
        } else {
            let step: Step = codec::read(payload).unwrap();
            stepped(self.state, u64::from_le_bytes(step.actions[0].try_into().unwrap()))
        };
        codec::write(&reply, &self.state).unwrap()
    }
}

fn machine(seed: u64) -> ClientSession {
    ClientSession::new(ClientOptions {
        attempt_ms: ATTEMPT_MS,
        deadline_ms: DEADLINE_MS,
        jitter_seed: seed,
        ..ClientOptions::default()
    })
}

impl World {
    fn new(seed: u64, steps: u64) -> Self {
        let mut dice = Dice::new(seed);
        let clients = (0..CLIENTS)
            .map(|_| Client {
                machine: machine(dice.bits()),
                ask: Ask::Nothing,
                call: 0,
                attempt: 0,
                state: 0,
                has_reset: false,
                steps_left: steps,
                session_left: 0,
                cut_until_ms: 0,
                pause_until_ms: 0,
                wake_ms: None,
                is_done: false,
            })
            .collect();
        let mut world = Self {
            now_ms: 0,
            events: BTreeMap::new(),
            count: 0,
            dice,
            clients,
            boot: 0,
            server: None,
            tally: Tally::default(),
        };
        world.at(0, Event::Start);
        for client in 0..CLIENTS {
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
        if self.dice.one_in(20) { 100 + self.dice.below(300) } else { self.dice.below(4) }
    }

    fn run(&mut self) {
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
                        client.machine.on_reply(now_ms, &message);
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
                let server = self.server.take().unwrap();
                self.tally.lost_with_server += server.envs.len() as u64;
                self.tally.restarts += 1;
                let down_ms = self.dice.below(2 * DEADLINE_MS);
                self.at(down_ms, Event::Start);
            }
            Event::Start => self.start_server(),
        }
    }

    fn start_server(&mut self) {
        self.boot += 1;
        let limits = Limits {
            max_sessions: MAX_SESSIONS,
            grace_ms: GRACE_MS,
            idle_ms: IDLE_MS,
            ..Limits::default()
        };
        let options = ServerOptions {
            server: "default".to_owned(),
            build: "test".to_owned(),
            boot_id: u128::from(mixed(self.boot)) + 1,
            limits,
            allow_snapshot: true,
            envs: Vec::new(),
            max_cached_bytes: 1 << 30,
        };
        let mut dice = Dice::new(self.dice.bits());
        let ids = Box::new(move || u128::from(dice.bits()) << 64 | u128::from(dice.bits()));
        self.server = Some(Server {
            sessions: ServerSessions::new(options, ids),
            queries: BTreeMap::new(),
            envs: BTreeMap::new(),
            last_query: 0,
            wake_ms: None,
        });
        let up_ms = 2_000 + self.dice.below(4_000);
        self.at(up_ms, Event::Crash);
    }

    /// Does what the server says.
    fn serve(&mut self) {
        let now_ms = self.now_ms;
        let Some(mut server) = self.server.take() else { return };
        while let Some(output) = server.sessions.poll(now_ms) {
            match output {
                ServerOutput::Start(job) => {
                    let took_ms = if self.dice.one_in(50) {
                        ATTEMPT_MS + self.dice.below(2 * ATTEMPT_MS)
                    } else {
                        self.dice.below(4)
                    };
                    let finished = self.work(&mut server, &job);
                    self.at(took_ms, Event::JobDone { boot: self.boot, job: job.id, finished });
                }
                ServerOutput::Reply { query, message } => {
                    let to = server.queries.remove(&query).expect("answered once");
                    let copies = self.copies(to.client);
                    for _ in 0..copies {
                        let delay_ms = self.delay_ms();
                        let message = Some(Arc::from(&message[..]));
                        self.at(delay_ms, Event::ToClient { to, message });
                    }
                }
                ServerOutput::Drop(query) => {
                    let to = server.queries.remove(&query).expect("answered once");
                    self.at(1, Event::ToClient { to, message: None });
                }
                ServerOutput::Free { sid } => {
                    server.envs.remove(&sid).expect("freed once");
                    self.tally.freed += 1;
                }
            }
        }
        if let Some(wake_ms) = server.sessions.wake_ms() {
            assert!(wake_ms > now_ms, "what is due is done");
            if server.wake_ms.is_none_or(|before_ms| wake_ms < before_ms) {
                server.wake_ms = Some(wake_ms);
                self.at(wake_ms - now_ms, Event::ServerWake);
            }
        }
        self.server = Some(server);
    }

    /// Carries out a job.
    fn work(&mut self, server: &mut Server, job: &Job) -> Finished {
        let (_, payload) = Header::read(&job.message).unwrap();
        if job.header.kind == Kind::Request(Verb::Open) {
            let is_new = server.envs.insert(job.sid, Toy { state: 0, journal: Vec::new() });
            assert!(is_new.is_none());
            self.tally.opened += 1;
            let header = Header { kind: Kind::Reply(Verb::Open), ..job.header };
            let reply = OpenReply {
                sid: job.sid,
                lid: job.lid,
                observation: Vec::new(),
                action: Vec::new(),
                info: Vec::new(),
                ended: Vec::new(),
                outcomes: Vec::new(),
                config_hash: [0; 32],
                max_reply: 100,
                limits: Limits::default(),
            };
            let message = codec::write(&header, &reply).unwrap();
            return Finished { message, steps: 0, max_reply: 100 };
        }
        let toy = server.envs.get_mut(&job.sid).expect("its environments are there");
        let message = toy.answer(&job.header, payload);
        self.tally.executed += 1;
        Finished { message, steps: toy.journal.len() as u64, max_reply: 0 }
    }

    /// How many of a message arrive.
    fn copies(&mut self, client: usize) -> usize {
        if self.clients[client].cut_until_ms > self.now_ms || self.dice.one_in(100) {
            0
        } else if self.dice.one_in(100) {
            2
        } else {
            1
        }
    }

    /// Does what a client's machine says, and asks the next thing when it has none.
    fn drive(&mut self, client: usize) {
        loop {
            let now_ms = self.now_ms;
            match self.clients[client].machine.poll(now_ms) {
                ClientOutput::Send { verb, message, timeout_ms } => {
                    let sender = &mut self.clients[client];
                    sender.attempt += 1;
                    let from = Sender { client, call: sender.call, attempt: sender.attempt };
                    for _ in 0..self.copies(client) {
                        let (delay_ms, message) = (self.delay_ms(), message.clone());
                        self.at(delay_ms, Event::ToServer { from, verb, message });
                    }
                    self.at(timeout_ms, Event::Timeout(from));
                    return;
                }
                ClientOutput::Wait { until_ms } => {
                    self.wake(client, until_ms);
                    return;
                }
                ClientOutput::Done(result) => self.done(client, result),
                ClientOutput::Idle => {
                    let sender = &self.clients[client];
                    if sender.is_done {
                        return;
                    }
                    if sender.pause_until_ms > now_ms {
                        let until_ms = sender.pause_until_ms;
                        self.wake(client, until_ms);
                        return;
                    }
                    self.ask(client);
                }
            }
        }
    }

    fn wake(&mut self, client: usize, at_ms: u64) {
        let me = &mut self.clients[client];
        if me.wake_ms.is_none_or(|before_ms| at_ms < before_ms) {
            me.wake_ms = Some(at_ms);
            self.at(at_ms - self.now_ms, Event::Wake { client });
        }
    }

    /// The next thing that a client wants.
    fn ask(&mut self, client: usize) {
        let now_ms = self.now_ms;
        let Self { clients, dice, .. } = self;
        let me = &mut clients[client];
        let ask = if me.machine.sid().is_none() {
            if me.steps_left == 0 {
                me.is_done = true;
                return;
            }
            Ask::Open
        } else if me.session_left == 0 || me.steps_left == 0 {
            Ask::Close
        } else if !me.has_reset || dice.one_in(100) {
            Ask::Reset(dice.bits())
        } else if dice.one_in(50) {
            Ask::Snapshot
        } else {
            Ask::Step(dice.bits())
        };
        if dice.one_in(400) {
            me.cut_until_ms = now_ms + dice.below(2 * DEADLINE_MS);
        }
        if dice.one_in(800) {
            self.crash(client);
            return;
        }
        self.call(client, ask);
    }

    fn call(&mut self, client: usize, ask: Ask) {
        let now_ms = self.now_ms;
        let me = &mut self.clients[client];
        (me.ask, me.call) = (ask, me.call + 1);
        let machine = &mut me.machine;
        let is_begun = match ask {
            Ask::Open => {
                let nonce = u128::from(self.dice.bits()) << 64 | client as u128;
                let open = Open {
                    nonce,
                    env_id: "toy".to_owned(),
                    config: String::new(),
                    num_envs: 1,
                    autoreset: AutoresetMode::NextStep,
                    hash_every: 0,
                    infos: true,
                    snapshot: None,
                    client: client.to_string(),
                };
                machine.open(now_ms, &open)
            }
            Ask::Reset(seed) => machine.call(
                now_ms,
                Verb::Reset,
                &Reset { seeds: Seeds::One(seed), mask: &[], weeds: Vec::new() },
            ),
            Ask::Step(action) => {
                machine.call(now_ms, Verb::Step, &Step { actions: vec![&action.to_le_bytes()] })
            }
            Ask::Snapshot => machine.call(now_ms, Verb::Snapshot, &Snapshot { env: None }),
            Ask::Close => machine.call_empty(now_ms, Verb::Close),
            Ask::Nothing => unreachable!("there is something to ask"),
        };
        assert_eq!(is_begun, Ok(()), "{ask:?}");
    }

    /// A call has ended.
    fn done(&mut self, client: usize, result: Result<Vec<u8>, ClientError>) {
        let now_ms = self.now_ms;
        let me = &mut self.clients[client];
        match result {
            Ok(message) => self.answered(client, &message),
            Err(ClientError::Timeout { waited_ms, .. }) => {
                assert_eq!(waited_ms, DEADLINE_MS);
                self.tally.timeouts += 1;
                self.doubt(client);
            }
            Err(ClientError::Fault(Fault::SessionLost { .. })) => {
                self.tally.seen_lost += 1;
                self.leave(client);
            }
            Err(ClientError::Fault(Fault::NoSession { reason, .. })) => {
                assert_ne!(reason, Loss::Unknown as u64, "no session is forgotten");
                self.tally.seen_ended += 1;
                self.leave(client);
            }
            Err(ClientError::Fault(Fault::Capacity { .. })) => {
                me.pause_until_ms = now_ms + 200;
                self.tally.full += 1;
            }
            Err(error) => panic!("{:?}: {error}", me.ask),
        }
    }

    fn answered(&mut self, client: usize, message: &[u8]) {
        let me = &mut self.clients[client];
        let (header, payload) = Header::read(message).unwrap();
        let lid = me.machine.lid();
        match me.ask {
            Ask::Open => {
                (me.has_reset, me.session_left) = (false, 50 + self.dice.below(150));
                self.at(1, Event::Lease { lid: lid.unwrap(), is_there: true });
            }
            Ask::Reset(seed) => {
                assert_eq!(codec::read::<u64>(payload).unwrap(), seed);
                assert_eq!(header.seq + 1, me.machine.next_seq());
                (me.state, me.has_reset) = (seed, true);
            }
            Ask::Step(action) => {
                me.state = stepped(me.state, action);
                assert_eq!(codec::read::<u64>(payload).unwrap(), me.state, "its own reply");
                assert_eq!(header.seq + 1, me.machine.next_seq());
                (me.steps_left, me.session_left) = (me.steps_left - 1, me.session_left - 1);
            }
            Ask::Snapshot => {
                let SnapshotReply { data, .. } = codec::read(payload).unwrap();
                assert_eq!(data, me.state.to_le_bytes());
            }
            Ask::Close => {
                // Each numbered request of the session was carried out, one of them perhaps without being seen.
                let CloseReply { steps } = codec::read(payload).unwrap();
                assert!((0..=1).contains(&(steps + 1 - me.machine.next_seq())));
                self.tally.closed += 1;
                me.has_reset = false;
            }
            Ask::Nothing => unreachable!("nothing was asked"),
        }
    }

    /// A call was not answered in time: asked again, or settled by a reset, or the client ends.
    fn doubt(&mut self, client: usize) {
        let now_ms = self.now_ms;
        let me = &mut self.clients[client];
        assert!(me.machine.is_in_doubt());
        let is_numbered = matches!(me.ask, Ask::Step(_) | Ask::Reset(_));
        let step = Step { actions: vec![&[0; 8]] };
        if is_numbered {
            let again = me.machine.call(now_ms, Verb::Step, &step);
            assert_eq!(again, Err(ClientError::InDoubt), "a step on a state that nobody knows");
        }
        match self.dice.below(4) {
            0 if is_numbered => {
                let seed = self.dice.bits();
                self.call(client, Ask::Reset(seed));
            }
            1 if is_numbered => self.call(client, Ask::Close),
            2 if self.dice.one_in(4) => self.crash(client),
            _ => {
                me.call += 1;
                me.machine.retry(now_ms).unwrap();
            }
        }
    }

    fn crash(&mut self, client: usize) {
        self.tally.crashes += 1;
        self.leave(client);
    }

    /// The client goes and comes back as a new one.
    fn leave(&mut self, client: usize) {
        let seed = self.dice.bits();
        let me = &mut self.clients[client];
        let lid = me.machine.lid();
        me.machine = machine(seed);
        (me.call, me.has_reset) = (me.call + 1, false);
        if let Some(lid) = lid {
            self.at(1, Event::Lease { lid, is_there: false });
        }
    }

    /// Every session has ended, and nothing is left of any.
    fn check(&mut self) {
        let tally = &self.tally;
        assert!(self.clients.iter().all(|client| client.is_done && client.steps_left == 0));
        let server = self.server.as_ref().expect("it was started again");
        let stats = server.sessions.stats(self.now_ms);
        assert_eq!((stats.sessions, stats.envs, server.envs.len()), (0, 0, 0), "{tally:?}");
        assert!(server.queries.is_empty(), "every query was answered or dropped");
        assert_eq!(server.sessions.wake_ms(), None, "everything is forgotten");
        assert_eq!(tally.opened, tally.freed + tally.lost_with_server, "{tally:?}");
        // The run has met what it is about.
        let met = [tally.closed, tally.seen_lost, tally.crashes, tally.timeouts, tally.restarts];
        assert!(met.iter().all(|&count| count > 0), "{tally:?}");
    }
}

/// Whether a message is a reply that may come late: to a numbered request, which later ones are not mistaken for.
fn is_numbered_reply(message: &[u8]) -> bool {
    let (header, _) = Header::read(message).unwrap();
    matches!(header.kind, Kind::Reply(verb) if verb.is_numbered())
}
