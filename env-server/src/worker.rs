//! Environments at work.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

use swath_wire::codec;
use swath_wire::fault::Fault;
use swath_wire::header::{Header, Kind, Verb};
use swath_wire::hosted::Hosted;
use swath_wire::message::Limits;
use swath_wire::room::Room;
use swath_wire::server::{Finished, Job, JobId};

use crate::clock::Clock;

/// A worker without a task takes so many naps of at least this length before it sleeps until it is woken.
const NAPS: u32 = 40;
const NAP: Duration = Duration::from_micros(50);
/// What took less is brief: to hand it over and to be woken for it takes about as long.
const BRIEF: Duration = Duration::from_micros(50);
/// A step may begin an episode, and that must not hold up a server for longer.
const HOLDS_UP: Duration = Duration::from_millis(5);

/// Environments that rest, and the worker that stepped them last.
#[derive(Debug)]
pub struct Resting {
    /// The environments.
    pub hosted: Box<Hosted>,
    /// The worker: what they are made of may still lie in its core's cache.
    pub worker: usize,
    /// How long jobs of theirs may take.
    pub pace: Pace,
}

/// How long jobs of some environments may take, as far as the last ones tell.
#[derive(Debug, Clone, Copy)]
pub struct Pace {
    /// The next one.
    may_take: Duration,
    /// One in which episodes begin: what was no step took about so long.
    may_begin: Duration,
}

impl Pace {
    /// Of environments that have done nothing yet.
    const UNKNOWN: Self = Self { may_take: Duration::ZERO, may_begin: Duration::MAX };

    /// Whether a step takes next to no time, and not long if an episode begins.
    fn is_brief(self) -> bool {
        self.may_take < BRIEF && self.may_begin < HOLDS_UP
    }

    /// The same after a job that took so long. Some steps take longer than others: what did once is believed to be brief only
    /// after some that were.
    fn after(self, verb: Verb, took: Duration) -> Self {
        let may_begin = if verb == Verb::Step { self.may_begin } else { took };
        Self { may_take: took.max(self.may_take / 2), may_begin }
    }
}

/// A job, with the environments that it is for; an open has none yet.
#[derive(Debug)]
pub struct Task {
    /// What is to be done.
    pub job: Job,
    /// The environments.
    pub resting: Option<Resting>,
}

impl Task {
    /// Whether it is a step that takes next to no time, as far as the last jobs tell.
    #[must_use]
    pub fn is_brief(&self) -> bool {
        let is_step = self.job.header.kind == Kind::Request(Verb::Step);
        is_step && self.resting.as_ref().is_some_and(|resting| resting.pace.is_brief())
    }
}

/// A job that is done.
#[derive(Debug)]
pub struct Done {
    /// Which one.
    pub job: JobId,
    /// What was asked.
    pub verb: Verb,
    /// Its session.
    pub sid: u128,
    /// Who did it, or had its environments last if the job was done at once.
    pub worker: usize,
    /// How long jobs of these environments may take.
    pub pace: Pace,
    /// The environments, unless they failed or were never built.
    pub hosted: Option<Box<Hosted>>,
    /// The reply.
    pub result: Result<Finished, Fault>,
}

/// Threads that do tasks.
///
/// A task goes to the worker that had its environments last if that one is free, or else to the one that has worked most
/// recently: what it needs is then more likely to lie in a cache near by.
#[derive(Debug)]
pub struct Workers {
    seats: Vec<Seat>,
    /// Who is free, the one that has worked most recently last.
    free: Vec<usize>,
    waiting: VecDeque<Task>,
    limits: Limits,
    room: Arc<Room>,
}

#[derive(Debug)]
struct Seat {
    tasks: Sender<Task>,
    thread: JoinHandle<()>,
}

impl Workers {
    /// Starts so many workers; what is done they tell `events`, and whoever reads those tells [`Self::is_free`].
    ///
    /// # Panics
    ///
    /// If the system has no threads to give.
    #[must_use]
    pub fn start<E: From<Done> + Send + 'static>(
        count: usize,
        limits: Limits,
        room: &Arc<Room>,
        events: &SyncSender<E>,
    ) -> Self {
        let seat = |worker: usize| {
            let (tasks, tasks_out) = channel();
            let (room, events) = (Arc::clone(room), events.clone());
            let work = move || {
                while let Some(task) = next(&tasks_out) {
                    let done = carry_out(worker, task, &limits, &room);
                    if events.send(E::from(done)).is_err() {
                        return;
                    }
                }
            };
            let thread = std::thread::Builder::new().name(format!("swath-worker-{worker}"));
            Seat { tasks, thread: thread.spawn(work).expect("the system has threads to give") }
        };
        let seats: Vec<Seat> = (0..count).map(seat).collect();
        let free = (0..seats.len()).collect();
        Self { free, seats, waiting: VecDeque::new(), limits, room: Arc::clone(room) }
    }

    /// Has a task done, as soon as somebody is free.
    ///
    /// # Panics
    ///
    /// If a worker has ended.
    pub fn give(&mut self, task: Task) {
        let last = task.resting.as_ref().map(|resting| resting.worker);
        let place = self.free.iter().position(|&free| Some(free) == last);
        let worker = match place {
            Some(place) => Some(self.free.remove(place)),
            None => self.free.pop(),
        };
        match worker {
            Some(worker) => self.seats[worker].tasks.send(task).expect("workers end with us"),
            None => self.waiting.push_back(task),
        }
    }

    /// Does a task on the caller's own thread.
    #[must_use]
    pub fn do_at_once(&self, task: Task) -> Done {
        let worker = task.resting.as_ref().map_or(0, |resting| resting.worker);
        carry_out(worker, task, &self.limits, &self.room)
    }

    /// A worker has done its task.
    ///
    /// # Panics
    ///
    /// If a worker has ended.
    pub fn is_free(&mut self, worker: usize) {
        self.free.push(worker);
        if let Some(task) = self.waiting.pop_front() {
            self.give(task);
        }
    }

    /// Ends the workers; waits for them if none has a task.
    pub fn end(self) {
        let are_all_free = self.free.len() == self.seats.len();
        for Seat { tasks, thread } in self.seats {
            drop(tasks);
            if are_all_free {
                // A worker catches what its environments throw.
                let _ = thread.join();
            }
        }
    }
}

/// The next task; `None` if there will be none any more.
///
/// At first a worker sleeps lightly: a core that slept for long begins slowly, since it was another's meanwhile.
fn next(tasks: &Receiver<Task>) -> Option<Task> {
    for _ in 0..NAPS {
        match tasks.recv_timeout(NAP) {
            Ok(task) => return Some(task),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return None,
        }
    }
    tasks.recv().ok()
}

/// Does one job.
fn carry_out(worker: usize, task: Task, limits: &Limits, room: &Arc<Room>) -> Done {
    let Task { job, resting } = task;
    let (id, sid, seq) = (job.id, job.sid, job.header.seq);
    let Kind::Request(verb) = job.header.kind else { unreachable!("jobs are requests") };
    let (hosted, pace) =
        resting.map_or((None, Pace::UNKNOWN), |resting| (Some(resting.hosted), resting.pace));
    let clock = Clock::start();
    let (hosted, result) = guarded(seq, || answer(&job, hosted, limits, room));
    // What was refused tells nothing.
    let pace = if result.is_ok() { pace.after(verb, clock.elapsed()) } else { pace };
    Done { job: id, verb, sid, worker, pace, hosted, result }
}

/// A panic of the environments is the end of them, and of nothing else.
fn guarded(seq: u64, work: impl FnOnce() -> Answer) -> Answer {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| {
        let text = "the environments failed, and the session is over".to_owned();
        (None, Err(Fault::EnvFault { seq, text }))
    })
}

type Answer = (Option<Box<Hosted>>, Result<Finished, Fault>);

fn answer(job: &Job, hosted: Option<Box<Hosted>>, limits: &Limits, room: &Arc<Room>) -> Answer {
    let payload = match Header::read(&job.message) {
        Ok((_, payload)) => payload,
        Err(error) => return (hosted, Err(error.into())),
    };
    if job.header.kind == Kind::Request(Verb::Open) {
        return match open(job, payload, limits, room) {
            Ok((hosted, finished)) => (Some(Box::new(hosted)), Ok(finished)),
            Err(fault) => (None, Err(fault)),
        };
    }
    let Some(mut hosted) = hosted else {
        let text = "the session has no environments".to_owned();
        return (None, Err(Fault::EnvFault { seq: job.header.seq, text }));
    };
    let result = hosted.answer(&job.header, payload).map(|message| Finished {
        message,
        steps: hosted.steps(),
        max_reply: 0,
    });
    (Some(hosted), result)
}

fn open(
    job: &Job,
    payload: &[u8],
    limits: &Limits,
    room: &Arc<Room>,
) -> Result<(Hosted, Finished), Fault> {
    // One thread: the workers are as many as the cores, and a pool for each session would have them fight.
    let hosted = Hosted::open_in(&codec::read(payload)?, limits, room, 1)?;
    let reply = hosted.open_reply(job.sid, job.lid, *limits);
    let header = Header { kind: Kind::Reply(Verb::Open), ..job.header };
    let message = codec::write(&header, &reply)?;
    Ok((hosted, Finished { message, steps: 0, max_reply: reply.max_reply }))
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::sync_channel;

    use swath_wire::hosted::ENV_ID;
    use swath_wire::message::{AutoresetMode, Open, Reset, Seeds};
    use swath_wire::room::Bounds;
    use swath_wire::server::JobId;

    use super::*;

    /// A task that fails at once, since its session has no environments.
    fn task(id: u64) -> Task {
        let header = Header { boot_id: 1, sid: 1, seq: id, kind: Kind::Request(Verb::Step) };
        let message = codec::write_empty(&header).into();
        Task { job: Job { id: JobId(id), sid: 1, lid: 1, header, message }, resting: None }
    }

    fn one_env() -> Open<'static> {
        Open {
            nonce: 1,
            env_id: ENV_ID.to_owned(),
            config: String::new(),
            num_envs: 1,
            autoreset: AutoresetMode::NextStep,
            hash_every: 0,
            infos: false,
            snapshot: None,
            percept: false,
            client: String::new(),
        }
    }

    fn hosted(room: &Arc<Room>) -> Box<Hosted> {
        Box::new(Hosted::open_in(&one_env(), &Limits::default(), room, 1).unwrap())
    }

    fn resting(hosted: Box<Hosted>, worker: usize) -> Resting {
        Resting { hosted, worker, pace: Pace::UNKNOWN }
    }

    fn done(events: &Receiver<Done>, workers: &mut Workers) -> usize {
        let worker = events.recv().unwrap().worker;
        workers.is_free(worker);
        worker
    }

    #[test]
    fn who_has_worked_last_works_next_and_what_is_too_much_waits() {
        let (events_in, events) = sync_channel(8);
        let bounds = Bounds { max_cells: 0, max_weeds: 0 };
        let room = Room::new(bounds, bounds);
        let mut workers = Workers::start(3, Limits::default(), &room, &events_in);
        workers.give(task(0));
        let first = done(&events, &mut workers);
        for id in 1..9 {
            workers.give(task(id));
            assert_eq!(done(&events, &mut workers), first);
        }
        (9..14).for_each(|id| workers.give(task(id)));
        assert_eq!((workers.free.len(), workers.waiting.len()), (0, 2));
        for _ in 9..14 {
            done(&events, &mut workers);
        }
        assert_eq!((workers.free.len(), workers.waiting.len()), (3, 0));
        workers.end();
    }

    #[test]
    fn environments_go_back_to_the_worker_that_had_them_and_to_another_if_that_one_is_busy() {
        let (events_in, events) = sync_channel(8);
        let room = Room::new(Bounds::OF_SESSION, Bounds::OF_ALL);
        let mut workers = Workers::start(3, Limits::default(), &room, &events_in);
        let mut hosted = Some(hosted(&room));
        for (id, last, expected) in [(0, 1, 1), (1, 0, 0), (2, 1, 1), (3, 1, 1)] {
            let resting = hosted.take().map(|hosted| resting(hosted, last));
            workers.give(Task { resting, ..task(id) });
            let done: Done = events.recv().unwrap();
            assert_eq!(done.worker, expected);
            workers.is_free(done.worker);
            hosted = done.hosted;
            assert!(hosted.is_some(), "a request that is refused loses no environments");
        }
        // Worker 1 is busy until its end is told.
        workers.give(task(4));
        let resting = hosted.map(|hosted| resting(hosted, 1));
        workers.give(Task { resting, ..task(5) });
        let both: [Done; 2] = [events.recv().unwrap(), events.recv().unwrap()];
        let worker_of = |id| both.iter().find(|done| done.job == JobId(id)).unwrap().worker;
        assert_eq!((worker_of(4), worker_of(5)), (1, 0));
        for done in both {
            workers.is_free(done.worker);
        }
        workers.end();
    }

    /// Of environments whose episodes begin in no time.
    fn pace(may_take: Duration) -> Pace {
        Pace { may_take, may_begin: Duration::ZERO }
    }

    #[test]
    fn only_a_step_of_environments_whose_last_jobs_took_next_to_no_time_is_brief() {
        let room = Room::new(Bounds::OF_SESSION, Bounds::OF_ALL);
        let with = |kind, pace| {
            let resting = Resting { pace, ..resting(hosted(&room), 0) };
            let mut task = Task { resting: Some(resting), ..task(0) };
            task.job.header.kind = kind;
            task.is_brief()
        };
        assert!(with(Kind::Request(Verb::Step), pace(BRIEF / 2)));
        assert!(!with(Kind::Request(Verb::Step), pace(BRIEF)));
        assert!(!with(Kind::Request(Verb::Reset), pace(BRIEF / 2)));
        assert!(!task(0).is_brief());
    }

    #[test]
    fn no_step_is_brief_where_the_beginning_of_an_episode_within_it_would_hold_up_the_server() {
        let (long, short) = (2 * HOLDS_UP, BRIEF / 2);
        let mut pace = Pace::UNKNOWN.after(Verb::Reset, long);
        for _ in 0..1000 {
            pace = pace.after(Verb::Step, short);
        }
        assert!(!pace.is_brief());
        pace = pace.after(Verb::Reset, HOLDS_UP / 2);
        for _ in 0..1000 {
            pace = pace.after(Verb::Step, short);
        }
        assert!(pace.is_brief());
        assert!(!Pace::UNKNOWN.is_brief());
    }

    #[test]
    fn what_took_long_once_is_brief_only_after_jobs_that_were_and_what_is_refused_tells_nothing() {
        let (events_in, _events) = sync_channel::<Done>(8);
        let room = Room::new(Bounds::OF_SESSION, Bounds::OF_ALL);
        let workers = Workers::start(1, Limits::default(), &room, &events_in);
        let long = Duration::from_secs(3600);
        let may_take = |verb: Verb, message: Vec<u8>| {
            let mut task = task(1);
            task.job.header.kind = Kind::Request(verb);
            task.job.message = message.into();
            task.resting = Some(Resting { pace: pace(long), ..resting(hosted(&room), 0) });
            workers.do_at_once(task).pace.may_take
        };
        let header = Header { boot_id: 1, sid: 1, seq: 1, kind: Kind::Request(Verb::Reset) };
        let reset = Reset { seeds: Seeds::One(7), mask: &[], weeds: Vec::new() };
        let reset = codec::write(&header, &reset).unwrap();
        assert_eq!(may_take(Verb::Reset, reset), long / 2);
        assert_eq!(may_take(Verb::Step, codec::write_empty(&header)), long);
        workers.end();
    }

    #[test]
    fn what_is_done_at_once_is_answered_as_a_worker_would_and_leaves_the_workers_free() {
        let (events_in, events) = sync_channel(8);
        let room = Room::new(Bounds::OF_SESSION, Bounds::OF_ALL);
        let mut workers = Workers::start(2, Limits::default(), &room, &events_in);
        // A step that asks for no environment's action is refused.
        let refused = || Task { resting: Some(resting(hosted(&room), 1)), ..task(7) };
        let at_once = workers.do_at_once(refused());
        workers.give(refused());
        let handed_over: Done = events.recv().unwrap();
        workers.is_free(handed_over.worker);
        assert!(at_once.hosted.is_some());
        assert_eq!((at_once.job, at_once.worker), (handed_over.job, handed_over.worker));
        let faults = [at_once.result.unwrap_err(), handed_over.result.unwrap_err()];
        assert_eq!(faults[0], faults[1]);
        assert_eq!(workers.free.len(), 2);
        workers.end();
    }

    #[test]
    fn a_task_is_taken_from_light_sleep_and_from_deep_until_there_will_be_none() {
        let (tasks, tasks_out) = channel();
        for delay in [Duration::ZERO, 10 * NAP, 4 * NAPS * NAP] {
            let sender = tasks.clone();
            let later = std::thread::spawn(move || {
                std::thread::sleep(delay);
                sender.send(task(3)).unwrap();
            });
            assert_eq!(next(&tasks_out).unwrap().job.id, JobId(3));
            later.join().unwrap();
        }
        drop(tasks);
        assert!(next(&tasks_out).is_none());
    }

    #[test]
    fn a_panic_ends_the_environments_and_nothing_else() {
        let (hosted, result) = guarded(5, || panic!("as if they were broken"));
        assert!(hosted.is_none());
        assert!(matches!(result, Err(Fault::EnvFault { seq: 5, .. })), "{result:?}");
    }
}
