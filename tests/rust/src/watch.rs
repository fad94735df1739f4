//! A test that would hang fails instead.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

/// Runs `work` on a thread of its own: `Err` says that it panicked, or had not ended after `seconds`.
///
/// Work that hangs goes on in the background until the tests of the file are over.
///
/// # Errors
///
/// What went wrong, in a few words.
pub fn ends_within<T: Send + 'static>(
    seconds: u64,
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, String> {
    let (sender, receiver) = channel();
    thread::spawn(move || sender.send(work()));
    receiver.recv_timeout(Duration::from_secs(seconds)).map_err(|error| match error {
        RecvTimeoutError::Timeout => format!("not over after {seconds} s"),
        RecvTimeoutError::Disconnected => "panicked".to_owned(),
    })
}
