//! Bytes as a list of events: a byte says what happens, two how long the bytes are that go with it.

/// Reads events, whatever the bytes; the last one takes what is left.
#[derive(Debug, Clone, Copy)]
pub struct Records<'a>(pub &'a [u8]);

impl<'a> Iterator for Records<'a> {
    type Item = (u8, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let (&[what, low, high], rest) = self.0.split_first_chunk()?;
        let length = usize::from(u16::from_le_bytes([low, high])).min(rest.len());
        let (bytes, rest) = rest.split_at(length);
        self.0 = rest;
        Some((what, bytes))
    }
}

/// An event as bytes.
///
/// # Panics
///
/// If it is longer than an event can be.
#[must_use]
pub fn record(what: u8, bytes: &[u8]) -> Vec<u8> {
    let length = u16::try_from(bytes.len()).expect("an event has less than 65536 bytes");
    [&[what], &length.to_le_bytes()[..], bytes].concat()
}
