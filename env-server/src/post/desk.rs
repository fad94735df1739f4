//! What waits to be sent.

use std::collections::{BTreeMap, VecDeque};

use bytes::Bytes;

/// How many replies of a lane may wait; older ones are not sent any more, since their client has asked again.
const WAITING: usize = 2;
/// Lanes for those without a session: where so many questions wait, the next one waits until Zenoh gives their clients up.
const STRANGERS: u128 = 128;
/// What a query takes itself that waits to be answered or dropped, bytes.
const QUERY: usize = 1 << 10;

/// A query and its reply; none if it is to be dropped.
#[derive(Debug)]
pub(super) struct Letter<Q> {
    pub(super) query: Q,
    pub(super) reply: Option<Bytes>,
    /// What the client has put into the query, bytes.
    pub(super) weight: usize,
}

impl<Q> Letter<Q> {
    fn bytes(&self) -> usize {
        QUERY + self.weight + self.reply.as_ref().map_or(0, Bytes::len)
    }
}

/// The letters of one session, or of some who have none.
#[derive(Debug)]
struct Lane<Q> {
    letters: VecDeque<Letter<Q>>,
    bytes: usize,
}

/// All lanes.
#[derive(Debug)]
pub(super) struct Desk<Q> {
    /// By session; it has a name of 128 random bits, and the others have small numbers. A lane that stands here is ready or
    /// is being sent from.
    lanes: BTreeMap<u128, Lane<Q>>,
    /// Lanes that nobody sends from.
    ready: VecDeque<u128>,
    /// Bytes that wait, and how many may.
    bytes: usize,
    most: usize,
    /// Where the last one without a session went when no lane was free.
    stranger: u128,
    /// Threads without work.
    pub(super) idle: usize,
    pub(super) is_closed: bool,
}

impl<Q> Desk<Q> {
    pub(super) fn new(most: usize) -> Self {
        Self {
            lanes: BTreeMap::new(),
            ready: VecDeque::new(),
            bytes: 0,
            most,
            stranger: 0,
            idle: 0,
            is_closed: false,
        }
    }

    /// Whether nothing waits and nothing is being sent.
    pub(super) fn is_empty(&self) -> bool {
        self.lanes.is_empty()
    }

    pub(super) fn is_short_of_hands(&self) -> bool {
        self.ready.len() > self.idle
    }

    /// Lets a letter wait; returns those that are too many now, to be dropped when the desk is free again.
    pub(super) fn put(&mut self, session: Option<u128>, letter: Letter<Q>) -> Vec<Letter<Q>> {
        let key = session.unwrap_or_else(|| self.lane_of_stranger());
        let Self { lanes, ready, .. } = self;
        let lane = lanes.entry(key).or_insert_with(|| {
            ready.push_back(key);
            Lane { letters: VecDeque::new(), bytes: 0 }
        });
        lane.bytes += letter.bytes();
        self.bytes += letter.bytes();
        lane.letters.push_back(letter);
        if let Some(stale) = lane.letters.len().checked_sub(WAITING + 1) {
            self.bytes -= lane.empty(stale);
        }
        let mut too_many = Vec::new();
        while self.bytes > self.most {
            too_many.extend(self.lighten());
        }
        too_many
    }

    /// A free lane, or else one after the other.
    fn lane_of_stranger(&mut self) -> u128 {
        (1..=STRANGERS).find(|lane| !self.lanes.contains_key(lane)).unwrap_or_else(|| {
            self.stranger = self.stranger % STRANGERS + 1;
            self.stranger
        })
    }

    /// Takes the oldest reply from the lane in which most waits, or the oldest letter where there is none.
    fn lighten(&mut self) -> Option<Letter<Q>> {
        let heaviest = self.lanes.values_mut().max_by_key(|lane| lane.bytes)?;
        let first = heaviest.letters.len().saturating_sub(WAITING);
        let oldest = (first..heaviest.letters.len()).find(|&i| heaviest.letters[i].reply.is_some());
        if let Some(oldest) = oldest {
            self.bytes -= heaviest.empty(oldest);
            return None;
        }
        let letter = heaviest.pop();
        self.bytes -= letter.as_ref().map_or(0, Letter::bytes);
        letter
    }

    /// The next letter and its lane, which is [`Self::done`] once it is sent.
    pub(super) fn take(&mut self) -> Option<(u128, Option<Letter<Q>>)> {
        let key = self.ready.pop_front()?;
        let letter = self.lanes.get_mut(&key).and_then(Lane::pop);
        self.bytes -= letter.as_ref().map_or(0, Letter::bytes);
        Some((key, letter))
    }

    /// Nobody sends from a lane any more.
    pub(super) fn done(&mut self, key: u128) {
        if self.lanes.get(&key).is_some_and(|lane| lane.letters.is_empty()) {
            self.lanes.remove(&key);
        } else {
            self.ready.push_back(key);
        }
    }
}

impl<Q> Lane<Q> {
    fn pop(&mut self) -> Option<Letter<Q>> {
        let letter = self.letters.pop_front()?;
        self.bytes -= letter.bytes();
        Some(letter)
    }

    /// Takes the reply from a letter; its bytes.
    fn empty(&mut self, place: usize) -> usize {
        let reply = self.letters[place].reply.take();
        let bytes = reply.map_or(0, |reply| reply.len());
        self.bytes -= bytes;
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn letter(query: u32, reply: usize) -> Letter<u32> {
        Letter { query, reply: Some(Bytes::from(vec![0; reply])), weight: 0 }
    }

    fn queries(letters: &[Letter<u32>]) -> Vec<u32> {
        letters.iter().map(|letter| letter.query).collect()
    }

    #[test]
    fn what_waits_is_bounded_in_bytes_and_the_oldest_of_the_heaviest_goes_first() {
        let mut desk = Desk::new(100 * QUERY);
        let (one, other) = (Some(1 << 100), Some(1 << 101));
        assert!(desk.put(other, letter(1, 20 * QUERY)).is_empty());
        // Two large replies are too much together: the older one is not sent.
        for query in [2, 3] {
            assert!(desk.put(one, letter(query, 60 * QUERY)).is_empty());
        }
        assert_eq!(desk.bytes, (20 + 60 + 3) * QUERY);
        // Queries alone: those of who has many of them.
        let mut dropped = Vec::new();
        for query in 4..200 {
            dropped.extend(queries(&desk.put(one, letter(query, 0))));
            assert!(desk.bytes <= desk.most);
        }
        // 100, less the 21 of the other one and 79 queries that still wait.
        assert_eq!(dropped, (2..121).collect::<Vec<_>>());
        let (lane, first) = desk.take().unwrap();
        let first = first.unwrap();
        assert_eq!((Some(lane), first.query, first.reply.unwrap().len()), (other, 1, 20 * QUERY));
        desk.done(lane);
        while let Some((lane, _)) = desk.take() {
            desk.done(lane);
        }
        assert_eq!((desk.bytes, desk.is_empty()), (0, true));
    }

    #[test]
    fn who_has_no_session_finds_a_free_lane_and_there_are_only_so_many() {
        let mut desk = Desk::new(1 << 30);
        let lanes = usize::try_from(STRANGERS).unwrap();
        for query in 0..1000 {
            desk.put(None, letter(query, 10));
            assert_eq!(desk.ready.len(), lanes.min(query as usize + 1));
        }
        let (lane, _) = desk.take().unwrap();
        while desk.lanes[&lane].letters.front().is_some() {
            desk.lanes.get_mut(&lane).unwrap().pop();
        }
        desk.done(lane);
        desk.put(None, letter(1000, 10));
        assert_eq!(desk.lanes[&lane].letters.len(), 1);
    }
}
