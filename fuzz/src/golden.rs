//! The messages that `docs/protocol` shows, byte by byte.

/// The message of that name.
///
/// # Panics
///
/// If there is none.
#[must_use]
pub fn message(name: &str) -> Vec<u8> {
    all().find(|(found, _)| *found == name).expect("there is a message of this name").1
}

/// Every message and its name.
pub fn all() -> impl Iterator<Item = (&'static str, Vec<u8>)> {
    let lines = include_str!("../../docs/protocol/golden_messages.txt").lines();
    lines.filter_map(|line| line.split_once(' ')).map(|(name, digits)| {
        let byte = |at: usize| u8::from_str_radix(&digits[at..at + 2], 16).expect("two digits");
        (name, (0..digits.len()).step_by(2).map(byte).collect())
    })
}
