//! What the server says, in order, and how it is counted.

use std::collections::VecDeque;

use bytes::Bytes;

use super::{QueryId, ServerOutput};
use crate::codec;
use crate::fault::Fault;
use crate::header::Header;

/// A request that has arrived.
#[derive(Debug, Clone, Copy)]
pub(super) struct Asked {
    pub(super) query: QueryId,
    pub(super) header: Header,
    pub(super) at_ms: u64,
}

/// What goes out, and how it is counted.
#[derive(Debug, Default)]
pub(super) struct Answers {
    pub(super) outputs: VecDeque<ServerOutput>,
    pub(super) requests: u64,
    pub(super) faults: u64,
    pub(super) latency_us: Vec<u64>,
}

impl Answers {
    pub(super) fn reply(&mut self, now_ms: u64, asked: &Asked, message: Bytes) {
        // By a clock of milliseconds, a request took less than one more than it seems.
        let most_us = (now_ms.saturating_sub(asked.at_ms) + 1).saturating_mul(1000);
        let place = (u64::BITS - (most_us - 1).leading_zeros()) as usize;
        if self.latency_us.len() <= place {
            self.latency_us.resize(place + 1, 0);
        }
        self.latency_us[place] += 1;
        self.requests += 1;
        self.outputs.push_back(ServerOutput::Reply { query: asked.query, message });
    }

    pub(super) fn fault(&mut self, now_ms: u64, asked: &Asked, fault: &Fault) {
        self.faults += 1;
        self.reply(now_ms, asked, codec::write_fault(&asked.header, fault).into());
    }

    /// The newest query is the one whose client still waits.
    pub(super) fn replace(&mut self, older: &mut Asked, newer: Asked) {
        let older = std::mem::replace(older, newer);
        self.outputs.push_back(ServerOutput::Drop(older.query));
    }
}
