//! What a session can be built from again: a snapshot, and the requests since.

use std::sync::Arc;

use sha2::{Digest, Sha256};

use crate::codec;
use crate::fault::Fault;
use crate::header::{HEADER_BYTES, Header, Kind, Verb};
use crate::message::{Open, OpenReply};

/// Most bytes that the length of a snapshot takes in a message.
const LENGTH_BYTES: usize = 9;

/// A request of the caller's.
#[derive(Clone)]
pub(super) struct Wish {
    pub(super) verb: Verb,
    pub(super) payload: Arc<[u8]>,
}

/// A request that was carried out, and the digest of its reply if that was seen.
pub(super) struct Entry {
    pub(super) wish: Wish,
    pub(super) reply: Option<[u8; 32]>,
}

/// What is kept of a session.
pub(super) struct Memory {
    open: Open<'static>,
    /// How many sessions it was; each has a nonce of its own.
    opened: u64,
    /// What the first one was told when it was opened.
    pub(super) reply: Option<OpenReply>,
    /// The state that the journal begins with; none for that of an open.
    base: Option<Vec<u8>>,
    journal: Vec<Entry>,
    journal_bytes: usize,
    /// Why there is no snapshot any more.
    pub(super) gap: Option<Fault>,
}

impl Memory {
    /// Of a session that is being opened.
    pub(super) fn new(open: Open<'static>) -> Self {
        Self {
            open,
            opened: 1,
            reply: None,
            base: None,
            journal: Vec::new(),
            journal_bytes: 0,
            gap: None,
        }
    }

    /// The request of this place of the journal.
    pub(super) fn entry(&self, place: usize) -> Option<&Entry> {
        self.journal.get(place)
    }

    /// Whether nothing was kept yet.
    pub(super) fn is_new(&self) -> bool {
        self.base.is_none() && self.journal.is_empty()
    }

    /// Whether a snapshot should take the place of the journal.
    pub(super) fn is_long(&self, most_requests: usize, most_bytes: usize) -> bool {
        self.gap.is_none()
            && (self.journal.len() >= most_requests || self.journal_bytes > most_bytes)
    }

    /// Bytes of the snapshot and of the journal.
    pub(super) fn bytes(&self) -> usize {
        self.journal_bytes + self.base.as_ref().map_or(0, Vec::len)
    }

    /// Adds a request that was carried out; `reply` is its reply if that was seen.
    pub(super) fn keep(&mut self, wish: Wish, reply: Option<&[u8]>) {
        // Without a snapshot there is nothing that the requests since could follow.
        if self.gap.is_none() && wish.verb.is_numbered() {
            self.journal_bytes += wish.payload.len() + size_of::<Entry>();
            self.journal.push(Entry { wish, reply: reply.map(digest) });
        }
    }

    /// Takes a snapshot in the place of all before it.
    pub(super) fn rebase(&mut self, snapshot: Vec<u8>) {
        (self.base, self.journal, self.journal_bytes) = (Some(snapshot), Vec::new(), 0);
    }

    /// Keeps nothing any more, since there is no snapshot: the journal would grow for ever.
    pub(super) fn give_up(&mut self, fault: Fault) {
        (self.base, self.journal, self.journal_bytes) = (None, Vec::new(), 0);
        self.gap = Some(fault);
    }

    /// What opens the next session in the place of the last one: from the snapshot, with a nonce of its own.
    pub(super) fn next_open(&self) -> Open<'_> {
        let nonce = [self.open.nonce.to_le_bytes(), u128::from(self.opened).to_le_bytes()];
        let nonce: [u8; 32] = Sha256::digest(nonce.concat()).into();
        let nonce = u128::from_le_bytes(std::array::from_fn(|i| nonce[i]));
        Open { nonce, snapshot: self.base.as_deref(), ..self.open.clone() }
    }

    /// Why the next session cannot be opened from the snapshot, if it cannot: with the scenario it has to fit into a
    /// message.
    pub(super) fn too_large_to_open(&self, max_msg: u32) -> Option<Fault> {
        let limit = u64::from(max_msg);
        let without = Open { snapshot: None, ..self.next_open() };
        let nobody = Header { boot_id: 0, sid: 0, seq: 0, kind: Kind::Request(Verb::Open) };
        let size = codec::write(&nobody, &without).ok()?.len() + self.base.as_ref()?.len();
        let size = (size + LENGTH_BYTES) as u64;
        (size > limit).then_some(Fault::TooLarge { size, limit })
    }

    /// Another session is being opened.
    pub(super) fn count_open(&mut self) {
        self.opened += 1;
    }
}

/// What tells one reply from another.
pub(super) fn digest(reply: &[u8]) -> [u8; 32] {
    Sha256::digest(&reply[HEADER_BYTES..]).into()
}
