//! What a server answers when it cannot do what was asked: a closed set, known by its numbers.

use bincode::{Decode, Encode};

/// Why there is no session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u64)]
pub enum Loss {
    /// The server has never heard of it, or has forgotten it.
    Unknown = 1,
    /// Its client closed it.
    Closed = 2,
    /// Its client was gone for longer than the grace.
    Lease = 3,
    /// Its client asked for nothing for too long.
    Idle = 4,
    /// Its environments failed.
    Fault = 5,
}

/// A request that was not carried out; the environments are as they were, but for [`Fault::EnvFault`].
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// The server speaks other versions.
    #[error("the server speaks version {least} to {most} of the protocol")]
    VersionMismatch {
        /// Oldest major version.
        least: u16,
        /// Newest one.
        most: u16,
    },
    /// There is no such session.
    #[error("{text}")]
    NoSession {
        /// The number of a [`Loss`].
        reason: u64,
        /// The same in words.
        text: String,
    },
    /// The server was started anew, and its sessions are gone.
    #[error("the server was started anew since the session began")]
    SessionLost {
        /// What the server drew when it started.
        boot_id: u128,
    },
    /// The request's number is not the next one.
    #[error("the session's next request has the number {expected}")]
    BadSeq {
        /// The next number.
        expected: u64,
    },
    /// A number that belongs to another request.
    #[error("another request had the number {seq}")]
    SeqReuse {
        /// The number.
        seq: u64,
    },
    /// An action that cannot be carried out.
    #[error("{text}")]
    BadAction {
        /// The environment.
        env: u64,
        /// The table of the action.
        leaf: u64,
        /// What is wrong.
        text: String,
    },
    /// A scenario, a seed, an option or a snapshot that cannot be used.
    #[error("{text}")]
    BadConfig {
        /// What is wrong.
        text: String,
    },
    /// A message, or what it would be answered with, is too large.
    #[error("a message must have at most {limit} bytes, `max_msg` of the server, got {size}")]
    TooLarge {
        /// How large it is, bytes.
        size: u64,
        /// How large it may be, bytes.
        limit: u64,
    },
    /// The server has too much to do just now.
    #[error("the server is busy")]
    Busy {
        /// How long to wait before the request is sent again, milliseconds.
        retry_ms: u64,
    },
    /// The server has no room for another session, or for what this one asks for: it counts sessions, bytes of the replies
    /// that it keeps, cells of pastures, and weeds.
    #[error("{text}")]
    Capacity {
        /// How many or how much of them others have taken.
        used: u64,
        /// How many or how much of them there are.
        most: u64,
        /// Of what, in words.
        text: String,
    },
    /// The environments failed in this request, and the session is over.
    #[error("{text}")]
    EnvFault {
        /// The request.
        seq: u64,
        /// What is known of it.
        text: String,
    },
    /// Bytes that are no request.
    #[error("not a request, from byte {offset} on")]
    Malformed {
        /// The first byte that is wrong.
        offset: u64,
    },
    /// A step before the first reset.
    #[error("{text}")]
    NotReset {
        /// The environment.
        env: u64,
        /// In words.
        text: String,
    },
    /// The server does not do this for anybody.
    #[error("{text}")]
    NotAllowed {
        /// What it does not do.
        text: String,
    },
    /// A fault of a newer minor version.
    #[error("fault {code} ({arg0}, {arg1}): {text}")]
    Unknown {
        /// Its number.
        code: u16,
        /// Its first argument.
        arg0: u64,
        /// Its second argument.
        arg1: u64,
        /// What the server says.
        text: String,
    },
}

impl Fault {
    /// [`Fault::Capacity`]: others have taken `used` of `most` of these, which the operator has limited by a setting.
    #[must_use]
    pub fn full(used: u64, most: u64, of: &str, setting: &str) -> Self {
        let text = format!("the server is full: {used} of {most} {of} are taken (`{setting}`)");
        Self::Capacity { used, most, text }
    }
}

/// The longest text of a fault, bytes: it may quote what a client wrote.
const LONGEST_TEXT: usize = 1 << 10;

/// A fault as it is sent.
#[derive(Debug, Clone, PartialEq, Eq, Encode, Decode)]
pub struct FaultMessage {
    /// Its number.
    pub code: u16,
    /// Its first argument.
    pub arg0: u64,
    /// Its second argument.
    pub arg1: u64,
    /// For people, at most 1024 bytes.
    pub text: String,
}

impl From<&Fault> for FaultMessage {
    #[expect(clippy::cast_possible_truncation, reason = "the two halves of a boot id")]
    fn from(fault: &Fault) -> Self {
        let (code, arg0, arg1) = match *fault {
            Fault::VersionMismatch { least, most } => (1, least.into(), most.into()),
            Fault::NoSession { reason, .. } => (3, reason, 0),
            Fault::SessionLost { boot_id } => (4, boot_id as u64, (boot_id >> 64) as u64),
            Fault::BadSeq { expected } => (5, expected, 0),
            Fault::SeqReuse { seq } => (6, seq, 0),
            Fault::BadAction { env, leaf, .. } => (7, env, leaf),
            Fault::BadConfig { .. } => (8, 0, 0),
            Fault::TooLarge { size, limit } => (9, size, limit),
            Fault::Busy { retry_ms } => (10, retry_ms, 0),
            Fault::Capacity { used, most, .. } => (11, used, most),
            Fault::EnvFault { seq, .. } => (12, seq, 0),
            Fault::Malformed { offset } => (13, offset, 0),
            Fault::NotReset { env, .. } => (14, env, 0),
            Fault::NotAllowed { .. } => (15, 0, 0),
            Fault::Unknown { code, arg0, arg1, .. } => (code, arg0, arg1),
        };
        let mut text = match fault {
            Fault::Unknown { text, .. } => text.clone(),
            _ => fault.to_string(),
        };
        if text.len() > LONGEST_TEXT {
            let most = LONGEST_TEXT - 3;
            let end = (0..=most).rev().find(|&end| text.is_char_boundary(end)).unwrap_or(0);
            text.truncate(end);
            text += "...";
        }
        Self { code, arg0, arg1, text }
    }
}

impl From<FaultMessage> for Fault {
    fn from(message: FaultMessage) -> Self {
        let FaultMessage { code, arg0, arg1, text } = message;
        let version = |arg: u64| u16::try_from(arg).unwrap_or(u16::MAX);
        match code {
            1 => Self::VersionMismatch { least: version(arg0), most: version(arg1) },
            3 => Self::NoSession { reason: arg0, text },
            4 => Self::SessionLost { boot_id: u128::from(arg0) | u128::from(arg1) << 64 },
            5 => Self::BadSeq { expected: arg0 },
            6 => Self::SeqReuse { seq: arg0 },
            7 => Self::BadAction { env: arg0, leaf: arg1, text },
            8 => Self::BadConfig { text },
            9 => Self::TooLarge { size: arg0, limit: arg1 },
            10 => Self::Busy { retry_ms: arg0 },
            11 => Self::Capacity { used: arg0, most: arg1, text },
            12 => Self::EnvFault { seq: arg0, text },
            13 => Self::Malformed { offset: arg0 },
            14 => Self::NotReset { env: arg0, text },
            15 => Self::NotAllowed { text },
            _ => Self::Unknown { code, arg0, arg1, text },
        }
    }
}
