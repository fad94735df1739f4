//! Replies on their way out.
//!
//! Where a client does not read, Zenoh holds whoever sends to it for seconds before it gives the client up. Short replies
//! find room all the same and leave at once; long ones leave from threads of their own, so that nobody else waits.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use bytes::Bytes;
use zenoh::Wait as _;
use zenoh::query::Query;

/// Longer replies leave from threads of their own, bytes.
const SHORT: usize = 32 << 10;
/// How many threads.
const SENDERS: usize = 4;
/// How many long replies may wait; more are dropped, and asked for again.
const WAITING: usize = 256;

type Letter = (Box<Query>, Bytes);

/// The threads that send long replies.
#[derive(Debug)]
pub struct Post {
    letters: SyncSender<Letter>,
    senders: Vec<JoinHandle<()>>,
}

impl Post {
    /// Starts the threads.
    ///
    /// # Panics
    ///
    /// If the system has no threads to give.
    #[must_use]
    pub fn open() -> Self {
        let (letters, box_of_letters) = sync_channel(WAITING);
        let box_of_letters = Arc::new(Mutex::new(box_of_letters));
        let sender = |number: usize| {
            let letters = Arc::clone(&box_of_letters);
            std::thread::Builder::new()
                .name(format!("swath-sender-{number}"))
                .spawn(move || send_all(&letters))
                .expect("the system has threads to give")
        };
        Self { letters, senders: (0..SENDERS).map(sender).collect() }
    }

    /// Answers a query. An answer that does not arrive is asked for again.
    pub fn send(&self, query: Box<Query>, message: Bytes) {
        if message.len() <= SHORT {
            reply(&query, message);
        } else if self.letters.try_send((query, message)).is_err() {
            tracing::debug!("a reply was dropped: too many wait");
        }
    }

    /// Sends what still waits.
    pub fn close(self) {
        drop(self.letters);
        for sender in self.senders {
            // A sender that failed has nothing left to send.
            let _ = sender.join();
        }
    }
}

fn send_all(letters: &Mutex<Receiver<Letter>>) {
    loop {
        let letter = letters.lock().unwrap_or_else(PoisonError::into_inner).recv();
        let Ok((query, message)) = letter else { return };
        reply(&query, message);
    }
}

fn reply(query: &Query, message: Bytes) {
    // Bytes are shared with Zenoh, not copied.
    if let Err(error) = query.reply(query.key_expr().clone(), message).express(true).wait() {
        tracing::debug!(%error, "a reply was not sent");
    }
}
