//! Messages as bytes, and back: the only place that knows the format.
//!
//! Bincode's fixed-width little-endian format: whole numbers and floats as they are, a byte for a bool or before what may
//! be missing, a u32 before the variant of an enum, a u64 length before strings and lists. A message that claims to hold
//! more than the limit is refused before memory is asked for; so is one with bytes to spare, and one that ends early.

use bincode::config::{Configuration, Fixint, Limit, LittleEndian};
use bincode::enc::write::SizeWriter;
use bincode::{BorrowDecode, Encode};

use crate::fault::{Fault, FaultMessage};
use crate::header::{HEADER_BYTES, Header, HeaderError, Kind, MAJOR};

/// Largest payload that is ever read, bytes; servers and clients may have lower limits.
pub const LARGEST_PAYLOAD: usize = 64 << 20;

type Format = Configuration<LittleEndian, Fixint, Limit<LARGEST_PAYLOAD>>;

const FORMAT: Format = bincode::config::standard()
    .with_little_endian()
    .with_fixed_int_encoding()
    .with_limit::<LARGEST_PAYLOAD>();

/// A whole message.
///
/// # Errors
///
/// [`Fault::TooLarge`] if it has more than [`LARGEST_PAYLOAD`] behind its header.
pub fn write(header: &Header, payload: &impl Encode) -> Result<Vec<u8>, Fault> {
    // Long messages are not moved as they grow.
    let mut room = SizeWriter::default();
    let mut is_fine = bincode::encode_into_writer(payload, &mut room, FORMAT).is_ok();
    let bytes = header.message(room.bytes_written, |bytes| {
        is_fine = is_fine && bincode::encode_into_std_write(payload, bytes, FORMAT).is_ok();
    });
    let (size, limit) = (bytes.len() as u64, (HEADER_BYTES + LARGEST_PAYLOAD) as u64);
    if is_fine && size <= limit { Ok(bytes) } else { Err(Fault::TooLarge { size, limit }) }
}

/// A whole message without a payload.
#[must_use]
pub fn write_empty(header: &Header) -> Vec<u8> {
    header.message(0, |_| ())
}

/// A fault in answer to a request with these numbers.
#[must_use]
pub fn write_fault(header: &Header, fault: &Fault) -> Vec<u8> {
    let header = Header { kind: Kind::Fault, ..*header };
    write(&header, &FaultMessage::from(fault)).expect("a fault is short")
}

/// The payload of a message.
///
/// # Errors
///
/// [`Fault::Malformed`] if it is not exactly such a payload.
pub fn read<'a, T: BorrowDecode<'a, ()>>(payload: &'a [u8]) -> Result<T, Fault> {
    match bincode::borrow_decode_from_slice(payload, FORMAT) {
        Ok((message, length)) if length == payload.len() => Ok(message),
        Ok((_, length)) => Err(malformed(length)),
        // Where exactly is not told by the format.
        Err(_) => Err(malformed(0)),
    }
}

/// The empty payload of a message.
///
/// # Errors
///
/// [`Fault::Malformed`] if it is not empty.
pub fn read_empty(payload: &[u8]) -> Result<(), Fault> {
    if payload.is_empty() { Ok(()) } else { Err(malformed(0)) }
}

/// The fault that a message with this payload is.
///
/// # Errors
///
/// [`Fault::Malformed`] if it is none.
pub fn read_fault(payload: &[u8]) -> Result<Fault, Fault> {
    read::<FaultMessage>(payload).map(Fault::from)
}

fn malformed(offset: usize) -> Fault {
    Fault::Malformed { offset: (HEADER_BYTES + offset) as u64 }
}

impl From<HeaderError> for Fault {
    fn from(error: HeaderError) -> Self {
        match error {
            HeaderError::Malformed { offset } => Self::Malformed { offset },
            HeaderError::Version { .. } => Self::VersionMismatch { least: MAJOR, most: MAJOR },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_is_short_whatever_it_quotes() {
        let header =
            Header { boot_id: 1, sid: 2, seq: 3, kind: Kind::Request(crate::header::Verb::Open) };
        for (text, length) in [("\u{80}", 40 << 20), ("x", 1024), ("x", 1025), ("€", 500)] {
            let text = text.repeat(length);
            let message = write_fault(&header, &Fault::BadConfig { text: text.clone() });
            let (_, payload) = Header::read(&message).unwrap();
            let Fault::BadConfig { text: told } = read_fault(payload).unwrap() else { panic!() };
            let is_whole = text.len() <= 1024;
            assert_eq!(told == text, is_whole);
            assert!(told.len() <= 1024 && (is_whole || told.len() > 1018), "{}", told.len());
            assert!(text.starts_with(told.trim_end_matches("...")));
        }
    }
    use crate::header::Verb;
    use crate::message::{AutoresetMode, Open, Snapshot, Step};

    #[test]
    fn the_bytes_of_a_step_are_those_of_the_protocols_page() {
        let header = Header {
            boot_id: 0x0f0e_0d0c_0b0a_0908_0706_0504_0302_0100,
            sid: 0x1f1e_1d1c_1b1a_1918_1716_1514_1312_1110,
            seq: 7,
            kind: Kind::Request(Verb::Step),
        };
        let actions: Vec<u8> =
            [0.5_f32, -1.0, 0.25, 1.0].iter().flat_map(|number| number.to_le_bytes()).collect();
        let bytes = write(&header, &Step { actions: vec![&actions] }).unwrap();
        let expected = "5357544801000000000102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1d1e1f\
                        07000000000000000420000000010000000000000010000000000000000000003f000080bf0000803e0000803f";
        let byte = |i: usize| u8::from_str_radix(&expected[2 * i..2 * i + 2], 16).unwrap();
        assert_eq!(bytes, (0..expected.len() / 2).map(byte).collect::<Vec<u8>>());
    }

    #[test]
    fn what_was_written_is_read_and_nothing_shorter_or_longer() {
        let header = Header { boot_id: 0, sid: 0, seq: 0, kind: Kind::Request(Verb::Open) };
        let open = Open {
            nonce: 5,
            env_id: "swath/MowerRouting-v0".to_owned(),
            config: "{}".to_owned(),
            num_envs: 3,
            autoreset: AutoresetMode::SameStep,
            hash_every: 0,
            infos: true,
            snapshot: Some(b"abc"),
            percept: false,
            client: String::new(),
        };
        let bytes = write(&header, &open).unwrap();
        let (_, payload) = Header::read(&bytes).unwrap();
        assert_eq!(read::<Open>(payload), Ok(open));
        for length in 0..payload.len() {
            assert!(read::<Open>(&payload[..length]).is_err(), "{length}");
        }
        let longer = [payload, b"x"].concat();
        let end = bytes.len() as u64;
        assert_eq!(read::<Open>(&longer), Err(Fault::Malformed { offset: end }));
    }

    #[test]
    fn a_length_beyond_the_limit_asks_for_no_memory() {
        for length in [u64::MAX, 1 << 63, (LARGEST_PAYLOAD + 1) as u64] {
            let mut payload = 1_u64.to_le_bytes().to_vec();
            payload.extend(length.to_le_bytes());
            assert!(read::<Step>(&payload).is_err(), "{length}");
            assert!(read::<Step>(&length.to_le_bytes()).is_err(), "{length}");
        }
        assert!(read::<Snapshot>(&[2, 0, 0, 0, 0]).is_err(), "neither missing nor there");
    }
}
