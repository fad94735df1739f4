//! The bytes before every message.

/// Length of a header, bytes.
pub const HEADER_BYTES: usize = 53;
/// The first bytes of every message of any version.
pub const MAGIC: [u8; 4] = *b"SWTH";
/// The version of the protocol: another major version may differ in anything but the first eight bytes of a header.
pub const MAJOR: u16 = 1;
/// A higher minor version adds kinds, faults and environments, never fields.
pub const MINOR: u16 = 0;
/// What a reply adds to the kind of its request.
const REPLY: u8 = 0x80;
/// The kind of every fault.
const FAULT: u8 = 0xff;

/// What a request asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Verb {
    /// What the server is and has.
    Spec,
    /// A session: a batch of environments.
    Open,
    /// Episodes to begin.
    Reset,
    /// A step of every environment.
    Step,
    /// The state as bytes.
    Snapshot,
    /// The end of a session.
    Close,
    /// A state to put back.
    Restore,
    /// What the server does at present.
    Stats,
}

impl Verb {
    /// Every verb.
    pub const ALL: [Self; 8] = [
        Self::Spec,
        Self::Open,
        Self::Reset,
        Self::Step,
        Self::Snapshot,
        Self::Close,
        Self::Restore,
        Self::Stats,
    ];

    /// Its name, the last part of the key that it is sent to.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Spec => "spec",
            Self::Open => "open",
            Self::Reset => "reset",
            Self::Step => "step",
            Self::Snapshot => "snapshot",
            Self::Close => "close",
            Self::Restore => "restore",
            Self::Stats => "stats",
        }
    }

    /// Its number, the kind of a request.
    fn number(self) -> u8 {
        match self {
            Self::Spec => 1,
            Self::Open => 2,
            Self::Reset => 3,
            Self::Step => 4,
            Self::Snapshot => 5,
            Self::Close => 6,
            Self::Restore => 7,
            Self::Stats => 8,
        }
    }

    /// Whether it takes the next number of the session, so that it is carried out exactly once.
    #[must_use]
    pub fn is_numbered(self) -> bool {
        matches!(self, Self::Reset | Self::Step | Self::Restore)
    }

    /// Whether it is about a session.
    #[must_use]
    pub fn has_session(self) -> bool {
        !matches!(self, Self::Spec | Self::Open | Self::Stats)
    }
}

/// What a message is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A request.
    Request(Verb),
    /// Its reply.
    Reply(Verb),
    /// A fault in place of the reply.
    Fault,
}

impl Kind {
    fn to_byte(self) -> u8 {
        match self {
            Self::Request(verb) => verb.number(),
            Self::Reply(verb) => verb.number() + REPLY,
            Self::Fault => FAULT,
        }
    }

    fn from_byte(byte: u8) -> Option<Self> {
        let verb = |number: u8| Verb::ALL.into_iter().find(|verb| verb.number() == number);
        match byte {
            FAULT => Some(Self::Fault),
            REPLY.. => verb(byte - REPLY).map(Self::Reply),
            _ => verb(byte).map(Self::Request),
        }
    }
}

/// Who speaks in which session about which step. Numbers are little-endian.
///
/// | bytes | field |
/// |---|---|
/// | 0 to 3 | `SWTH` |
/// | 4, 5 | major version |
/// | 6, 7 | minor version |
/// | 8 to 23 | `boot_id` |
/// | 24 to 39 | `sid` |
/// | 40 to 47 | `seq` |
/// | 48 | kind: the verb's number (1 spec, 2 open, 3 reset, 4 step, 5 snapshot, 6 close, 7 restore, 8 stats), with 0x80 added in a reply; 0xff for a fault |
/// | 49 to 52 | length of the payload, bytes |
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// What the server drew when it started; 0 in requests that no session is needed for.
    pub boot_id: u128,
    /// The session, a secret of its client; 0 where there is none yet.
    pub sid: u128,
    /// The number of the request in its session, from 1.
    pub seq: u64,
    /// What the message is.
    pub kind: Kind,
}

/// Bytes that are no message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum HeaderError {
    /// Too short, not of this protocol, of an unknown kind, or not as long as they say.
    #[error("not a message, from byte {offset} on")]
    Malformed {
        /// The first byte that is wrong.
        offset: u64,
    },
    /// A message of another major version.
    #[error("a message of version {major}, where {MAJOR} is spoken")]
    Version {
        /// Its major version.
        major: u16,
    },
}

impl Header {
    /// A message of this header and the payload that `write` adds.
    ///
    /// # Panics
    ///
    /// If the payload has 4 GiB or more.
    #[must_use]
    pub fn message(&self, room: usize, write: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEADER_BYTES + room);
        bytes.extend(MAGIC);
        bytes.extend(MAJOR.to_le_bytes());
        bytes.extend(MINOR.to_le_bytes());
        bytes.extend(self.boot_id.to_le_bytes());
        bytes.extend(self.sid.to_le_bytes());
        bytes.extend(self.seq.to_le_bytes());
        bytes.push(self.kind.to_byte());
        bytes.extend([0; 4]);
        write(&mut bytes);
        let payload = u32::try_from(bytes.len() - HEADER_BYTES).expect("limits are below 4 GiB");
        bytes[HEADER_BYTES - 4..HEADER_BYTES].copy_from_slice(&payload.to_le_bytes());
        bytes
    }

    /// The header and the payload of a message.
    ///
    /// # Errors
    ///
    /// [`HeaderError`], the first that applies: the length, the magic, the major version, the length of the payload, the
    /// kind.
    pub fn read(bytes: &[u8]) -> Result<(Self, &[u8]), HeaderError> {
        let malformed = |offset: usize| HeaderError::Malformed { offset: offset as u64 };
        let (header, payload) =
            bytes.split_at_checked(HEADER_BYTES).ok_or(malformed(bytes.len()))?;
        if header[..4] != MAGIC {
            return Err(malformed(0));
        }
        let major = u16::from_le_bytes(part(header, 4));
        if major != MAJOR {
            return Err(HeaderError::Version { major });
        }
        if u32::from_le_bytes(part(header, 49)) as usize != payload.len() {
            return Err(malformed(49));
        }
        let kind = Kind::from_byte(header[48]).ok_or(malformed(48))?;
        let header = Self {
            boot_id: u128::from_le_bytes(part(header, 8)),
            sid: u128::from_le_bytes(part(header, 24)),
            seq: u64::from_le_bytes(part(header, 40)),
            kind,
        };
        Ok((header, payload))
    }
}

/// The bytes of a number.
fn part<const N: usize>(header: &[u8], offset: usize) -> [u8; N] {
    std::array::from_fn(|i| header[offset + i])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(kind: Kind) -> Header {
        Header { boot_id: 1, sid: 2, seq: 3, kind }
    }

    #[test]
    fn every_kind_comes_back_with_its_payload() {
        let requests =
            Verb::ALL.into_iter().flat_map(|verb| [Kind::Request(verb), Kind::Reply(verb)]);
        for kind in requests.chain([Kind::Fault]) {
            let bytes = header(kind).message(3, |bytes| bytes.extend(b"abc"));
            assert_eq!(Header::read(&bytes), Ok((header(kind), &b"abc"[..])));
        }
    }

    #[test]
    fn what_is_wrong_is_told_by_its_first_byte() {
        let whole = header(Kind::Fault).message(1, |bytes| bytes.push(9));
        let with = |offset: usize, byte: u8| {
            let mut bytes = whole.clone();
            bytes[offset] = byte;
            Header::read(&bytes).map(|(header, _)| header)
        };
        assert_eq!(with(0, b'X'), Err(HeaderError::Malformed { offset: 0 }));
        assert_eq!(with(4, 2), Err(HeaderError::Version { major: 2 }));
        assert_eq!(with(48, 0), Err(HeaderError::Malformed { offset: 48 }));
        assert_eq!(with(48, 0x89), Err(HeaderError::Malformed { offset: 48 }));
        assert_eq!(with(49, 2), Err(HeaderError::Malformed { offset: 49 }));
        assert_eq!(Header::read(&whole[..52]), Err(HeaderError::Malformed { offset: 52 }));
        assert_eq!(with(6, 9), Ok(header(Kind::Fault)));
    }
}
