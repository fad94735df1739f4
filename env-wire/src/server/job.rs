//! A job: a request on its way through a worker, and what came of it.

use std::sync::Arc;

use crate::header::Header;

/// Which job.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct JobId(pub u64);

/// A request for the environments of a session.
///
/// For `open`, they are built and kept under `sid`, and the reply has the job's header. An open that ends in a fault leaves
/// nothing behind.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Job {
    /// Its number.
    pub id: JobId,
    /// The session.
    pub sid: u128,
    /// The name of the session's lease.
    pub lid: u128,
    /// What is asked, with the numbers that the reply has to bear.
    pub header: Header,
    /// All bytes of the request.
    pub message: Arc<[u8]>,
}

/// What a job brought.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finished {
    /// All bytes of the reply.
    pub message: Vec<u8>,
    /// Environment steps of the session so far.
    pub steps: u64,
    /// Of an open: the longest reply that the session can have, bytes.
    pub max_reply: u32,
}
