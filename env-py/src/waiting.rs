//! Waiting for other threads without keeping Python from anything.

use std::sync::Mutex;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::thread::JoinHandle;
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// How long Ctrl-C may stay unnoticed.
const PATIENCE: Duration = Duration::from_millis(50);

/// The next message; `None` when no sender is left. Detached from the interpreter while it waits.
///
/// # Errors
///
/// What a signal handler raised, such as `KeyboardInterrupt`.
pub(crate) fn receive<T: Send>(py: Python, receiver: &Mutex<Receiver<T>>) -> PyResult<Option<T>> {
    loop {
        let received = py.detach(|| {
            receiver.lock().expect("no holder of the lock panics").recv_timeout(PATIENCE)
        });
        match received {
            Ok(message) => return Ok(Some(message)),
            Err(RecvTimeoutError::Disconnected) => return Ok(None),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
        }
    }
}

/// Offers this core, and the interpreter, to others.
#[pyfunction]
pub(crate) fn give_way(py: Python) {
    py.detach(std::thread::yield_now);
}

/// Joins a thread whose work is over.
///
/// # Errors
///
/// `RuntimeError` with the message of the thread's panic: a bug of ours.
pub(crate) fn ended(thread: JoinHandle<()>) -> PyResult<()> {
    thread.join().map_err(|panic| {
        let text = panic.downcast_ref::<String>().cloned();
        let text = text.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned()));
        let text = text.unwrap_or_else(|| "a panic without words".to_owned());
        PyRuntimeError::new_err(format!("an episode failed: {text}"))
    })
}
