//! Environments at work.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, SyncSender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use swath_wire::codec;
use swath_wire::fault::Fault;
use swath_wire::header::{Header, Kind, Verb};
use swath_wire::hosted::{Bounds, Hosted};
use swath_wire::message::Limits;
use swath_wire::server::{Finished, Job, JobId};

/// A job, with the environments that it is for; an open has none yet.
#[derive(Debug)]
pub struct Task {
    /// What is to be done.
    pub job: Job,
    /// The environments.
    pub hosted: Option<Box<Hosted>>,
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
    /// The environments, unless they failed or were never built.
    pub hosted: Option<Box<Hosted>>,
    /// The reply.
    pub result: Result<Finished, Fault>,
}

/// Starts so many workers, which take tasks one after the other until their channel ends.
///
/// # Panics
///
/// If the system has no threads to give.
#[must_use]
pub fn start<E: From<Done> + Send + 'static>(
    workers: usize,
    limits: Limits,
    bounds: Bounds,
    tasks: Receiver<Task>,
    events: &SyncSender<E>,
) -> Vec<JoinHandle<()>> {
    let tasks = Arc::new(Mutex::new(tasks));
    let worker = |number: usize| {
        let (tasks, events) = (Arc::clone(&tasks), events.clone());
        let work = move || {
            loop {
                let task = tasks.lock().unwrap_or_else(PoisonError::into_inner).recv();
                let Ok(task) = task else { return };
                if events.send(E::from(carry_out(task, &limits, bounds))).is_err() {
                    return;
                }
            }
        };
        std::thread::Builder::new()
            .name(format!("swath-worker-{number}"))
            .spawn(work)
            .expect("the system has threads to give")
    };
    (0..workers).map(worker).collect()
}

/// Does one job.
fn carry_out(task: Task, limits: &Limits, bounds: Bounds) -> Done {
    let Task { job, hosted } = task;
    let (id, sid, seq) = (job.id, job.sid, job.header.seq);
    let Kind::Request(verb) = job.header.kind else { unreachable!("jobs are requests") };
    let (hosted, result) = guarded(seq, || answer(&job, hosted, limits, bounds));
    Done { job: id, verb, sid, hosted, result }
}

/// A panic of the environments is the end of them, and of nothing else.
fn guarded(seq: u64, work: impl FnOnce() -> Answer) -> Answer {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| {
        let text = "the environments failed, and the session is over".to_owned();
        (None, Err(Fault::EnvFault { seq, text }))
    })
}

type Answer = (Option<Box<Hosted>>, Result<Finished, Fault>);

fn answer(job: &Job, hosted: Option<Box<Hosted>>, limits: &Limits, bounds: Bounds) -> Answer {
    let payload = match Header::read(&job.message) {
        Ok((_, payload)) => payload,
        Err(error) => return (hosted, Err(error.into())),
    };
    if job.header.kind == Kind::Request(Verb::Open) {
        return match open(job, payload, limits, bounds) {
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
    bounds: Bounds,
) -> Result<(Hosted, Finished), Fault> {
    // One thread: the workers are as many as the cores, and a pool for each session would have them fight.
    let hosted = Hosted::open_within(&codec::read(payload)?, limits, bounds, 1)?;
    let reply = hosted.open_reply(job.sid, job.lid, *limits);
    let header = Header { kind: Kind::Reply(Verb::Open), ..job.header };
    let message = codec::write(&header, &reply)?;
    Ok((hosted, Finished { message, steps: 0, max_reply: reply.max_reply }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_ends_the_environments_and_nothing_else() {
        let (hosted, result) = guarded(5, || panic!("as if they were broken"));
        assert!(hosted.is_none());
        assert!(matches!(result, Err(Fault::EnvFault { seq: 5, .. })), "{result:?}");
    }
}
