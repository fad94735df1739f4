//! The thread between Zenoh and the workers.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TryRecvError, sync_channel};
use std::time::Duration;

use swath_core::config;
use swath_wire::fault::{Fault, FaultMessage};
use swath_wire::header::{Header, Verb};
use swath_wire::hosted::ENV_ID;
use swath_wire::message::{EnvInfo, SessionStats};
use swath_wire::room::Room;
use swath_wire::server::{QueryId, ServerOptions, ServerOutput, ServerSessions};
use zenoh::query::Query;

use crate::clock::Clock;
use crate::endpoint::Endpoint;
use crate::front::{Arrival, Front, FrontError};
use crate::memory::{self, Leftovers};
use crate::options::Options;
use crate::post::Post;
use crate::settings::{settings, settings_of_low_latency, settings_to_ask};
use crate::stall::Watch;
use crate::worker::{Done, Resting, Task, Workers};

/// What may wait to be looked at: more is dropped, and asked again.
const WAITING: usize = 4096;
/// The server looks at its clock at least so often, milliseconds.
const LONGEST_SLEEP_MS: u64 = 1000;
/// After a brief step the next message is waited for awake, for so long.
const AWAKE: Duration = Duration::from_micros(500);
/// Whoever takes the core meanwhile for longer than this needs it more.
const TAKEN: Duration = Duration::from_micros(200);
/// How long running requests may take to end when the server does, milliseconds.
const LAST_WAIT_MS: u64 = 5000;
/// The autoreset modes that an environment has: all three.
const EVERY_MODE: u8 = 0b111;

/// What the server's thread is told.
#[derive(Debug)]
enum Event {
    Arrival(Arrival),
    Done(Box<Done>),
    Stop,
}

impl From<Arrival> for Event {
    fn from(arrival: Arrival) -> Self {
        Self::Arrival(arrival)
    }
}

impl From<Done> for Event {
    fn from(done: Done) -> Self {
        Self::Done(Box::new(done))
    }
}

/// A server that is ready to run.
pub struct Server {
    clock: Clock,
    listen: Endpoint,
    front: Front,
    post: Post,
    _watch: Option<Watch>,
    sessions: ServerSessions,
    events: Receiver<Event>,
    workers: Workers,
    resting: BTreeMap<u128, Resting>,
    /// Queries that are not answered yet, without their payloads, and the session that each says it is of.
    queries: BTreeMap<QueryId, (Box<Query>, u128)>,
    next_query: u64,
    running: usize,
    /// Whether the next message may be expected soon: the last one asked for a brief step.
    is_awake: bool,
    leftovers: Leftovers,
    is_stop_wanted: Arc<AtomicBool>,
}

/// Tells a server to end.
#[derive(Debug, Clone)]
pub struct Stop {
    is_wanted: Arc<AtomicBool>,
    events: SyncSender<Event>,
}

impl Stop {
    /// Ends it: no new sessions, running requests to their end.
    pub fn stop(&self) {
        self.is_wanted.store(true, Ordering::Relaxed);
        // Where there is no room for this, the server looks before long; one that has ended needs no telling.
        let _ = self.events.try_send(Event::Stop);
    }
}

fn random() -> u128 {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).expect("the system has random numbers");
    u128::from_le_bytes(bytes)
}

/// As much of the name of a session or lease as a log may show: the whole of it opens the session.
fn short(id: u128) -> String {
    format!("{:08x}", id >> 96)
}

/// Offers low latency at a port of its own, over which somebody watches.
fn offer(
    front: &mut Front,
    options: &Options,
    boot_id: u128,
    events: &SyncSender<Event>,
) -> Result<Watch, FrontError> {
    let system = |error: std::io::Error| FrontError::Zenoh(error.to_string());
    let listen = options.listen.with_port_of_its_own().map_err(system)?;
    let config = settings_of_low_latency(options, &listen)?;
    let watch = Watch::start(&listen).map_err(system)?;
    front.offer_low_latency(config, &options.name, boot_id, listen.port(), events)?;
    tracing::info!(%listen, "low latency is offered");
    Ok(watch)
}

impl Server {
    /// A server that listens.
    ///
    /// # Errors
    ///
    /// [`FrontError`] if the endpoint or the name is taken.
    pub fn open(mut options: Options) -> Result<(Self, Stop), FrontError> {
        let boot_id = random();
        let (events_in, events) = sync_channel::<Event>(WAITING);
        options.listen =
            options.listen.with_port().map_err(|error| FrontError::Zenoh(error.to_string()))?;
        let (config, most) = (settings(&options)?, options.max_waiting);
        let to_ask = settings_to_ask(&options)?;
        let mut front = Front::open(config, to_ask, &options.name, boot_id, most, &events_in)?;
        let offered = options.low_latency.then(|| offer(&mut front, &options, boot_id, &events_in));
        let watch = match offered {
            Some(Ok(watch)) => Some(watch),
            Some(Err(error)) => {
                tracing::warn!(%error, "low latency is not offered");
                None
            }
            None => None,
        };
        let room = Room::new(options.bounds, options.all_bounds);
        let workers = Workers::start(options.workers, options.limits, &room, &events_in);
        let schema = serde_json::to_string(&config::schema()).expect("a schema is JSON");
        let envs =
            vec![EnvInfo { id: ENV_ID.to_owned(), config_schema: schema, autoreset: EVERY_MODE }];
        let sessions = ServerSessions::new(
            ServerOptions {
                server: options.name,
                build: env!("CARGO_PKG_VERSION").to_owned(),
                boot_id,
                limits: options.limits,
                allow_snapshot: options.allow_snapshot,
                envs,
                max_cached_bytes: options.max_cached,
            },
            Box::new(random),
        );
        let is_wanted = Arc::new(AtomicBool::new(false));
        let server = Self {
            clock: Clock::start(),
            listen: options.listen,
            front,
            post: Post::new(most),
            _watch: watch,
            sessions,
            events,
            workers,
            resting: BTreeMap::new(),
            queries: BTreeMap::new(),
            next_query: 0,
            running: 0,
            is_awake: false,
            leftovers: Leftovers::default(),
            is_stop_wanted: Arc::clone(&is_wanted),
        };
        Ok((server, Stop { is_wanted, events: events_in }))
    }

    /// Where it listens.
    #[must_use]
    pub fn listen(&self) -> &Endpoint {
        &self.listen
    }

    /// Serves until it is told to stop and running requests have ended, or have had their time to.
    ///
    /// # Errors
    ///
    /// [`FrontError`] if Zenoh does not end well.
    pub fn run(mut self) -> Result<(), FrontError> {
        let mut end_ms = None;
        loop {
            let now_ms = self.clock.now_ms();
            if end_ms.is_some_and(|end_ms| self.running == 0 || now_ms >= end_ms) {
                break;
            }
            let wake_ms = self.sessions.wake_ms().into_iter().chain(end_ms).min();
            let sleep_ms =
                wake_ms.map_or(LONGEST_SLEEP_MS, |wake_ms| wake_ms.saturating_sub(now_ms));
            let sleep = Duration::from_millis(sleep_ms.min(LONGEST_SLEEP_MS));
            let event = match self.next_event(sleep) {
                Ok(event) => Some(event),
                Err(RecvTimeoutError::Timeout) => None,
                Err(RecvTimeoutError::Disconnected) => break,
            };
            let mut just_done = matches!(event, Some(Event::Done(_)));
            let now_ms = self.clock.now_ms();
            for (lid, is_there) in self.front.leases() {
                tracing::debug!(lease = short(lid), is_there, "a client's sign of life");
                if !is_there {
                    self.leftovers.add(now_ms);
                }
                self.sessions.on_lease(now_ms, lid, is_there);
            }
            match event {
                Some(Event::Arrival(Arrival::Query(query, verb))) => {
                    self.take_in(now_ms, query, verb);
                }
                Some(Event::Done(done)) => {
                    self.running -= 1;
                    self.workers.is_free(done.worker);
                    self.put_away(now_ms, *done);
                }
                Some(Event::Arrival(Arrival::Leases) | Event::Stop) | None => {}
            }
            if end_ms.is_none() && self.is_stop_wanted.load(Ordering::Relaxed) {
                tracing::info!(running = self.running, "stopping");
                self.sessions.shut_down(now_ms);
                end_ms = Some(now_ms + LAST_WAIT_MS);
            }
            while let Some(output) = self.sessions.poll(now_ms) {
                just_done |= self.carry_out(now_ms, output, just_done);
            }
            if self.leftovers.are_due(now_ms) {
                memory::give_back();
            }
        }
        self.workers.end();
        self.post.close();
        self.front.close()?;
        tracing::info!("stopped");
        Ok(())
    }

    /// The next event, for which it sleeps at most so long.
    ///
    /// A core that slept begins slowly, since it was another's meanwhile; so at first it stays awake where the event may be
    /// expected soon, and offers its core to others.
    fn next_event(&mut self, sleep: Duration) -> Result<Event, RecvTimeoutError> {
        if std::mem::take(&mut self.is_awake) {
            let clock = Clock::start();
            let mut now = Duration::ZERO;
            while now < AWAKE {
                match self.events.try_recv() {
                    Ok(event) => return Ok(event),
                    Err(TryRecvError::Disconnected) => return Err(RecvTimeoutError::Disconnected),
                    Err(TryRecvError::Empty) => std::thread::yield_now(),
                }
                let given = std::mem::replace(&mut now, clock.elapsed());
                if now > given + TAKEN {
                    break;
                }
            }
        }
        self.events.recv_timeout(sleep)
    }

    fn take_in(&mut self, now_ms: u64, mut query: Box<Query>, verb: Verb) {
        let id = QueryId(self.next_query);
        self.next_query += 1;
        self.front.taken(&query);
        // A query may wait for long to be answered, its payload does not.
        let payload = query.payload_mut().map(std::mem::take).unwrap_or_default();
        drop(query.attachment_mut().map(std::mem::take));
        // Bytes are shared, not copied, unless they came in pieces.
        let message = payload.to_bytes();
        let sid = Header::read(&message).map_or(0, |(header, _)| header.sid);
        self.queries.insert(id, (query, sid));
        self.sessions.on_query(now_ms, id, verb, &message);
    }

    fn put_away(&mut self, now_ms: u64, done: Done) {
        let session = short(done.sid);
        match &done.result {
            Err(fault) => {
                // As it is sent, which is cut short.
                let (verb, text) = (done.verb.name(), FaultMessage::from(fault).text);
                if matches!(fault, Fault::EnvFault { .. }) {
                    tracing::error!(session, verb, fault = text, "environments failed");
                } else {
                    tracing::info!(session, verb, fault = text, "a request was refused");
                }
            }
            Ok(done) => tracing::trace!(session, steps = done.steps, "answered"),
        }
        if let Some(hosted) = done.hosted {
            let Done { worker, pace, .. } = done;
            self.resting.insert(done.sid, Resting { hosted, worker, pace });
        }
        self.sessions.on_finished(now_ms, done.job, done.result);
        if done.verb == Verb::Open
            && let Some(stats) = self.sessions.stats_of(now_ms, done.sid)
        {
            let SessionStats { lease, client, envs, .. } = &stats;
            tracing::info!(session = short(done.sid), lease, client, envs, "opened");
        }
    }

    /// A session by the name that a query gives, if there is one: any other name may be made up.
    fn open_session(&self, sid: u128) -> Option<u128> {
        self.sessions.is_open(sid).then_some(sid)
    }

    /// Does what the sessions want. Returns whether that was a job that is done by now.
    fn carry_out(&mut self, now_ms: u64, output: ServerOutput, just_done: bool) -> bool {
        match output {
            ServerOutput::Start(job) => {
                let resting = self.resting.remove(&job.sid);
                let task = Task { job, resting };
                // Where nobody waits for this thread meanwhile.
                if task.is_brief() && self.running == 0 && !self.front.has_waiting() {
                    let done = self.workers.do_at_once(task);
                    tracing::trace!(session = short(done.sid), "done at once");
                    self.put_away(self.clock.now_ms(), done);
                    self.is_awake = true;
                    return true;
                }
                self.running += 1;
                self.workers.give(task);
            }
            ServerOutput::Reply { query, message } => {
                if let Some((query, sid)) = self.queries.remove(&query) {
                    self.post.send(self.open_session(sid), query, message, just_done);
                }
            }
            ServerOutput::Drop(query) => {
                if let Some((query, sid)) = self.queries.remove(&query) {
                    self.post.discard(self.open_session(sid), query);
                }
            }
            ServerOutput::Free { sid, lid, why } => {
                tracing::info!(session = short(sid), lease = short(lid), why, "freed");
                self.resting.remove(&sid);
                self.leftovers.add(now_ms);
            }
        }
        false
    }
}
