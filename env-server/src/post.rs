//! Replies on their way out.
//!
//! Where a client does not read, Zenoh holds whoever sends to it for seconds before it gives the client up, were it only
//! that its query is dropped. Short replies find room and leave at once, as long as nothing of their session waits; what
//! else there is leaves from threads of their own. A session has one thread at a time, and there is a thread for every
//! session that has something to send: a client holds up nobody else.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use bytes::Bytes;
use swath_wire::header::Header;
use zenoh::Wait as _;
use zenoh::query::Query;

/// Longer replies leave from threads of their own, bytes.
const SHORT: usize = 32 << 10;
/// Most threads: so many clients may not read at the same time.
const SENDERS: usize = 256;
/// How many replies of a session may wait; older ones are not sent any more, since their client has asked again.
const WAITING: usize = 2;
/// How many queries of a session may wait, to be answered or dropped.
const QUERIES: usize = 256;

/// A query and its reply; none if it is to be dropped.
type Letter = (Box<Query>, Option<Bytes>);

/// The threads that send long replies, as many as it takes.
#[derive(Debug, Default)]
pub struct Post {
    office: Arc<Office>,
    senders: Vec<JoinHandle<()>>,
    /// Sessions have names of 128 bits; who asks without one is given a number.
    strangers: u128,
}

#[derive(Debug, Default)]
struct Office {
    desk: Mutex<Desk>,
    has_work: Condvar,
}

#[derive(Debug, Default)]
struct Desk {
    /// What waits, by session. A session that stands here is ready or is being sent to.
    letters: BTreeMap<u128, VecDeque<Letter>>,
    /// Sessions that nobody sends to.
    ready: VecDeque<u128>,
    /// Threads without work.
    idle: usize,
    is_closed: bool,
}

impl Post {
    /// Answers a query. An answer that does not arrive is asked for again.
    ///
    /// # Panics
    ///
    /// If the system has no thread to give.
    pub fn send(&mut self, query: Box<Query>, message: Bytes) {
        let session = self.session_of(&message);
        if message.len() <= SHORT && !self.office.desk().letters.contains_key(&session) {
            return reply(&query, message);
        }
        self.hand_over(session, (query, Some(message)));
    }

    /// Leaves a query without an answer.
    ///
    /// # Panics
    ///
    /// As [`Self::send`].
    pub fn discard(&mut self, query: Box<Query>) {
        let payload = query.payload().cloned().unwrap_or_default();
        let session = self.session_of(&payload.to_bytes());
        self.hand_over(session, (query, None));
    }

    fn session_of(&mut self, message: &[u8]) -> u128 {
        match Header::read(message) {
            Ok((header, _)) if header.sid != 0 => header.sid,
            _ => {
                self.strangers += 1;
                self.strangers
            }
        }
    }

    fn hand_over(&mut self, session: u128, letter: Letter) {
        let mut desk = self.office.desk();
        let Desk { letters, ready, .. } = &mut *desk;
        let waiting = letters.entry(session).or_insert_with(|| {
            ready.push_back(session);
            VecDeque::new()
        });
        waiting.push_back(letter);
        if let Some(stale) = waiting.len().checked_sub(WAITING + 1) {
            waiting[stale].1 = None;
        }
        let stale = if waiting.len() > QUERIES { waiting.pop_front() } else { None };
        let is_short_of_hands = desk.ready.len() > desk.idle && self.senders.len() < SENDERS;
        drop(desk);
        drop(stale);
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
    fn desk(&self) -> MutexGuard<'_, Desk> {
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sends letter by letter until the post closes.
    fn work(&self) {
        let mut desk = self.desk();
        loop {
            let Some(session) = desk.ready.pop_front() else {
                if desk.is_closed {
                    return;
                }
                desk.idle += 1;
                desk = self.has_work.wait(desk).unwrap_or_else(PoisonError::into_inner);
                desk.idle -= 1;
                continue;
            };
            let letter = desk.letters.get_mut(&session).and_then(VecDeque::pop_front);
            drop(desk);
            if let Some((query, Some(message))) = &letter {
                reply(query, message.clone());
            }
            drop(letter);
            desk = self.desk();
            if desk.letters.get(&session).is_some_and(VecDeque::is_empty) {
                desk.letters.remove(&session);
            } else {
                desk.ready.push_back(session);
            }
        }
    }
}

fn reply(query: &Query, message: Bytes) {
    // Bytes are shared with Zenoh, not copied.
    if let Err(error) = query.reply(query.key_expr().clone(), message).express(true).wait() {
        tracing::debug!(%error, "a reply was not sent");
    }
}
