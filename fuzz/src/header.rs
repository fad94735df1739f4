//! The bytes before every message.

use swath_wire::header::{Header, Kind, Verb};

/// A header like any other.
pub const ANY: Header = Header { boot_id: 1, sid: 2, seq: 3, kind: Kind::Request(Verb::Step) };

/// Reads a message, and wants it written as the same bytes but for the minor version, which nobody reads.
/// Returns whether it could be read.
///
/// # Panics
///
/// If it is not.
pub fn feed(data: &[u8]) -> bool {
    let message = Header::read(data);
    if let Ok((header, payload)) = message {
        let written = header.message(payload.len(), |bytes| bytes.extend(payload));
        assert_eq!((&written[..6], &written[8..]), (&data[..6], &data[8..]));
    }
    message.is_ok()
}
