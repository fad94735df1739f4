//! The thread between Zenoh and the workers.

use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

use swath_core::config;
use swath_wire::hosted::{ENV_ID, Hosted};
use swath_wire::message::EnvInfo;
use swath_wire::server::{QueryId, ServerOptions, ServerOutput, ServerSessions};
use zenoh::query::Query;

use crate::clock::Clock;
use crate::front::{Arrival, Front, FrontError, settings};
use crate::options::Options;
use crate::worker::{self, Done, Task};

/// What may wait to be looked at: more is dropped, and asked again.
const WAITING: usize = 4096;
/// The server looks at its clock at least so often, milliseconds.
const LONGEST_SLEEP_MS: u64 = 1000;
/// All cached replies together.
const MAX_CACHED_BYTES: u64 = 1 << 30;
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
    front: Front,
    sessions: ServerSessions,
    events: Receiver<Event>,
    tasks: Sender<Task>,
    workers: Vec<JoinHandle<()>>,
    hosted: BTreeMap<u128, Box<Hosted>>,
    queries: BTreeMap<QueryId, Box<Query>>,
    next_query: u64,
    running: usize,
}

/// Tells a server to end.
#[derive(Debug, Clone)]
pub struct Stop(SyncSender<Event>);

impl Stop {
    /// Ends it: no new sessions, running requests to their end.
    pub fn stop(&self) {
        // A server that has ended already needs no telling.
        let _ = self.0.send(Event::Stop);
    }
}

fn random() -> u128 {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).expect("the system has random numbers");
    u128::from_le_bytes(bytes)
}

impl Server {
    /// A server that listens.
    ///
    /// # Errors
    ///
    /// [`FrontError`] if the endpoint or the name is taken.
    pub fn open(options: &Options) -> Result<(Self, Stop), FrontError> {
        let boot_id = random();
        let (events_in, events) = sync_channel::<Event>(WAITING);
        let (tasks, tasks_out) = channel();
        let config = settings(&options.listen, options.limits.max_msg)?;
        let front = Front::open(config, &options.name, boot_id, &events_in)?;
        let workers = worker::start(options.workers, options.limits, tasks_out, &events_in);
        let schema = serde_json::to_string(&config::schema()).expect("a schema is JSON");
        let envs =
            vec![EnvInfo { id: ENV_ID.to_owned(), config_schema: schema, autoreset: EVERY_MODE }];
        let sessions = ServerSessions::new(
            ServerOptions {
                server: options.name.clone(),
                build: env!("CARGO_PKG_VERSION").to_owned(),
                boot_id,
                limits: options.limits,
                allow_snapshot: options.allow_snapshot,
                envs,
                max_cached_bytes: MAX_CACHED_BYTES,
            },
            Box::new(random),
        );
        let server = Self {
            clock: Clock::start(),
            front,
            sessions,
            events,
            tasks,
            workers,
            hosted: BTreeMap::new(),
            queries: BTreeMap::new(),
            next_query: 0,
            running: 0,
        };
        Ok((server, Stop(events_in)))
    }

    /// Serves until it is told to stop and every running request has ended.
    ///
    /// # Errors
    ///
    /// [`FrontError`] if Zenoh does not end well.
    pub fn run(mut self) -> Result<(), FrontError> {
        let mut is_stopping = false;
        while !is_stopping || self.running > 0 {
            let now_ms = self.clock.now_ms();
            let wake_ms = self.sessions.wake_ms().unwrap_or(u64::MAX);
            let sleep_ms = wake_ms.saturating_sub(now_ms).min(LONGEST_SLEEP_MS);
            let first = match self.events.recv_timeout(Duration::from_millis(sleep_ms)) {
                Ok(event) => Some(event),
                Err(RecvTimeoutError::Timeout) => None,
                Err(RecvTimeoutError::Disconnected) => break,
            };
            let now_ms = self.clock.now_ms();
            let mut next = first;
            while let Some(event) = next {
                match event {
                    Event::Arrival(arrival) => self.take_in(now_ms, arrival),
                    Event::Done(done) => self.put_away(now_ms, *done),
                    Event::Stop => {
                        tracing::info!("stopping");
                        self.sessions.shut_down(now_ms);
                        is_stopping = true;
                    }
                }
                next = self.events.try_recv().ok();
            }
            while let Some(output) = self.sessions.poll(now_ms) {
                self.carry_out(output);
            }
        }
        drop(self.tasks);
        for worker in self.workers {
            // A worker catches what its environments throw.
            let _ = worker.join();
        }
        self.front.close()
    }

    fn take_in(&mut self, now_ms: u64, arrival: Arrival) {
        match arrival {
            Arrival::Lease(lid, is_there) => self.sessions.on_lease(now_ms, lid, is_there),
            Arrival::Query(query, verb) => {
                let id = QueryId(self.next_query);
                self.next_query += 1;
                let message = query.payload().map(|payload| payload.to_bytes().into_owned());
                self.queries.insert(id, query);
                self.sessions.on_query(now_ms, id, verb, &message.unwrap_or_default());
            }
        }
    }

    fn put_away(&mut self, now_ms: u64, done: Done) {
        self.running -= 1;
        if let Err(fault) = &done.result {
            tracing::debug!(%fault, "a request was refused");
        }
        if let Some(hosted) = done.hosted {
            self.hosted.insert(done.sid, hosted);
        }
        self.sessions.on_finished(now_ms, done.job, done.result);
    }

    fn carry_out(&mut self, output: ServerOutput) {
        match output {
            ServerOutput::Start(job) => {
                self.running += 1;
                let hosted = self.hosted.remove(&job.sid);
                self.tasks.send(Task { job, hosted }).expect("the workers end after the server");
            }
            ServerOutput::Reply { query, message } => {
                if let Some(query) = self.queries.remove(&query) {
                    Front::reply(&query, &message);
                }
            }
            ServerOutput::Drop(query) => {
                self.queries.remove(&query);
            }
            ServerOutput::Free { sid } => {
                tracing::info!(session = %format!("{:.8}", format!("{sid:032x}")), "freed");
                self.hosted.remove(&sid);
            }
        }
    }
}
