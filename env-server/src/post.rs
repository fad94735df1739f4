//! Replies on their way out.
//!
//! Where a client does not read, Zenoh holds whoever sends to it for seconds before it gives the client up, were it only that
//! its query is dropped. Short replies to sessions find room and leave at once, as long as nothing waits: who has several
//! sessions has one connection for all of them, and whose a question without a session is, nobody knows. What else there
//! is leaves from threads of their own. A session has one thread at a time, and so has each of the lanes for those without
//! one; there is a thread for each of them that has something to send: a client holds up nobody else's session.
//!
//! Whether a client reads is not known until it does not: for a while after an answer that was to leave at once and did not,
//! nothing does.

mod desk;

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use bytes::Bytes;
use zenoh::Wait as _;
use zenoh::query::Query;

use self::desk::{Desk, Letter};
use crate::clock::Clock;
use crate::front;

/// Longer replies leave from threads of their own, bytes.
const SHORT: usize = 32 << 10;
/// What took longer was held up: an answer leaves within a fraction of this.
const HELD_UP: Duration = Duration::from_millis(2);
/// So many times as long nothing leaves at once then: the server's thread is held up for a hundredth of its time at most.
const PATIENCE: u32 = 100;
/// Most threads: so many clients may not read at the same time.
const SENDERS: usize = 256;

/// The threads that send what does not leave at once, as many as it takes.
#[derive(Debug)]
pub struct Post {
    office: Arc<Office>,
    senders: Vec<JoinHandle<()>>,
    /// Since when nothing leaves at once, and for how long.
    held_up: Option<(Clock, Duration)>,
}

#[derive(Debug)]
struct Office {
    desk: Mutex<Desk<Box<Query>>>,
    has_work: Condvar,
}

impl Post {
    /// A post at which not more than `most` bytes wait.
    #[must_use]
    pub fn new(most: usize) -> Self {
        let desk = Mutex::new(Desk::new(most));
        let office = Arc::new(Office { desk, has_work: Condvar::new() });
        Self { office, senders: Vec::new(), held_up: None }
    }

    /// Answers a query of a session that is open, or of whom nobody knows. An answer that does not arrive is asked for
    /// again. Only what was `just_done` may leave at once: mostly its client has read the answer before, or it would not ask for
    /// the next thing, while one that asks for the same again perhaps reads nothing.
    ///
    /// # Panics
    ///
    /// If the system has no thread to give.
    pub fn send(
        &mut self,
        session: Option<u128>,
        query: Box<Query>,
        message: Bytes,
        just_done: bool,
    ) {
        let is_quick = just_done && session.is_some() && message.len() <= SHORT;
        self.held_up.take_if(|(since, wait)| since.elapsed() > *wait);
        if is_quick && self.held_up.is_none() && self.office.desk().is_empty() {
            let clock = Clock::start();
            reply(&query, message);
            let took = clock.elapsed();
            if took > HELD_UP {
                self.held_up = Some((Clock::start(), took * PATIENCE));
            }
            return;
        }
        self.hand_over(session, query, Some(message));
    }

    /// Leaves a query without an answer.
    ///
    /// # Panics
    ///
    /// As [`Self::send`].
    pub fn discard(&mut self, session: Option<u128>, query: Box<Query>) {
        self.hand_over(session, query, None);
    }

    fn hand_over(&mut self, session: Option<u128>, query: Box<Query>, reply: Option<Bytes>) {
        let mut desk = self.office.desk();
        let weight = front::length(&query);
        let too_many = desk.put(session, Letter { query, reply, weight });
        let is_short_of_hands = desk.is_short_of_hands() && self.senders.len() < SENDERS;
        drop(desk);
        drop(too_many);
        if is_short_of_hands {
            let office = Arc::clone(&self.office);
            let sender = std::thread::Builder::new()
                .name(format!("swath-sender-{}", self.senders.len()))
                .spawn(move || office.work());
            self.senders.push(sender.expect("the system has threads to give"));
        }
        self.office.has_work.notify_one();
    }

    /// Sends what still waits.
    pub fn close(self) {
        self.office.desk().is_closed = true;
        self.office.has_work.notify_all();
        for sender in self.senders {
            // A sender that failed has nothing left to send.
            let _ = sender.join();
        }
    }
}

impl Office {
    fn desk(&self) -> MutexGuard<'_, Desk<Box<Query>>> {
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sends letter by letter until the post closes.
    fn work(&self) {
        let mut desk = self.desk();
        loop {
            let Some((lane, letter)) = desk.take() else {
                if desk.is_closed {
                    return;
                }
                desk.idle += 1;
                desk = self.has_work.wait(desk).unwrap_or_else(PoisonError::into_inner);
                desk.idle -= 1;
                continue;
            };
            drop(desk);
            if let Some(Letter { query, reply: Some(message), .. }) = &letter {
                reply(query, message.clone());
            }
            drop(letter);
            desk = self.desk();
            desk.done(lane);
        }
    }
}

fn reply(query: &Query, message: Bytes) {
    // Bytes are shared with Zenoh, not copied.
    if let Err(error) = query.reply(query.key_expr().clone(), message).express(true).wait() {
        tracing::debug!(%error, "a reply was not sent");
    }
}
