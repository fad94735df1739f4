//! One tree of errors for Python, with the text of the Rust errors.

use pyo3::prelude::*;
use swath_core::action::ActionError;
use swath_core::batch::BatchError;
use swath_core::config::ConfigError;
use swath_core::env::SnapshotError;
use swath_wire::client::ClientError;
use swath_wire::fault::Fault;
use swath_wire::peer::Mismatch;

/// The classes of `swath.errors`: written in Python, so that `ConfigError` can be a `ValueError` too.
mod python {
    pyo3::import_exception!(swath.errors, ConfigError);
    pyo3::import_exception!(swath.errors, ActionError);
    pyo3::import_exception!(swath.errors, SnapshotError);
    pyo3::import_exception!(swath.errors, RemoteError);
    pyo3::import_exception!(swath.errors, RemoteTimeout);
    pyo3::import_exception!(swath.errors, ResumeError);
}

/// Whatever a function of this module may raise.
#[derive(Debug)]
pub(crate) enum Error {
    /// A scenario, a seed, an agent or an option.
    Config(ConfigError),
    /// An action.
    Action(ActionError),
    /// The actions of a batch.
    Batch(BatchError),
    /// An action that has not even the form of one.
    ActionForm(String),
    /// The bytes of a snapshot.
    Snapshot(SnapshotError),
    /// A scenario, a seed or a snapshot that a server refuses.
    RemoteConfig(String),
    /// What a server does, or does not do.
    Remote(String),
    /// A server that has not answered in time.
    RemoteTimeout(String),
    /// A session that was lost and cannot be resumed.
    Resume(String),
    /// An error of Python itself.
    Python(PyErr),
}

impl From<ConfigError> for Error {
    fn from(error: ConfigError) -> Self {
        Self::Config(error)
    }
}

impl From<ActionError> for Error {
    fn from(error: ActionError) -> Self {
        Self::Action(error)
    }
}

impl From<BatchError> for Error {
    fn from(error: BatchError) -> Self {
        Self::Batch(error)
    }
}

impl From<SnapshotError> for Error {
    fn from(error: SnapshotError) -> Self {
        Self::Snapshot(error)
    }
}

impl From<Fault> for Error {
    fn from(fault: Fault) -> Self {
        match fault {
            Fault::BadConfig { text } => Self::RemoteConfig(text),
            Fault::BadAction { text, .. } | Fault::NotReset { text, .. } => Self::ActionForm(text),
            lost @ Fault::SessionLost { .. } => {
                let advice = "make the environments anew, or with `resume` from the start, which goes on by snapshots";
                Self::Remote(format!("{lost}: {advice}"))
            }
            other => Self::Remote(other.to_string()),
        }
    }
}

impl From<ClientError> for Error {
    fn from(error: ClientError) -> Self {
        match error {
            ClientError::Fault(fault) => fault.into(),
            ClientError::Timeout { .. } => Self::RemoteTimeout(error.to_string()),
            ClientError::NotResumable(_)
            | ClientError::NotTaken(_)
            | ClientError::Differs { .. } => Self::Resume(error.to_string()),
            other => Self::Remote(other.to_string()),
        }
    }
}

impl From<Mismatch> for Error {
    fn from(mismatch: Mismatch) -> Self {
        Self::Remote(mismatch.to_string())
    }
}

impl From<PyErr> for Error {
    fn from(error: PyErr) -> Self {
        Self::Python(error)
    }
}

impl From<Error> for PyErr {
    fn from(error: Error) -> Self {
        match error {
            Error::Config(error) => python::ConfigError::new_err(error.to_string()),
            Error::Action(error) => python::ActionError::new_err(error.to_string()),
            Error::Batch(error) => python::ActionError::new_err(error.to_string()),
            Error::ActionForm(text) => python::ActionError::new_err(text),
            Error::Snapshot(error) => python::SnapshotError::new_err(error.to_string()),
            Error::RemoteConfig(text) => python::ConfigError::new_err(text),
            Error::Remote(text) => python::RemoteError::new_err(text),
            Error::Resume(text) => python::ResumeError::new_err(text),
            Error::RemoteTimeout(text) => python::RemoteTimeout::new_err(text),
            Error::Python(error) => error,
        }
    }
}

/// A shape as Python writes it.
pub(crate) fn shape_text(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        sizes => format!("({})", sizes.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}

/// What kind of object somebody has passed.
pub(crate) fn type_text(object: &Bound<PyAny>) -> String {
    let name = object.get_type().name().map_or_else(|_| "object".to_owned(), |n| n.to_string());
    format!("`{name}`")
}
