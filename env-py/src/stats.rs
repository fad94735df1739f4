//! What a server says of itself, as Python asks for it and reads it.

use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use swath_wire::client::ClientError;
use swath_wire::codec;
use swath_wire::fault::Fault;
use swath_wire::header::{Header, Kind, Verb};
use swath_wire::message::StatsReply;

use crate::errors::Error;

/// The message that asks a server for its numbers.
#[pyfunction]
pub(crate) fn stats_request(py: Python) -> Bound<PyBytes> {
    let header = Header { boot_id: 0, sid: 0, seq: 0, kind: Kind::Request(Verb::Stats) };
    PyBytes::new(py, &codec::write_empty(&header))
}

/// The numbers in a server's reply by their names in the protocol, and `boot_id`, which another start changes.
///
/// A `RemoteError` where it is no such reply.
#[pyfunction]
pub(crate) fn read_stats<'py>(
    py: Python<'py>,
    message: &[u8],
) -> Result<Bound<'py, PyDict>, Error> {
    let (header, payload) = Header::read(message).map_err(Fault::from)?;
    match header.kind {
        Kind::Reply(Verb::Stats) => (),
        Kind::Fault => return Err(ClientError::Fault(codec::read_fault(payload)?).into()),
        _ => return Err(Fault::Malformed { offset: 48 }.into()),
    }
    let stats: StatsReply = codec::read(payload)?;
    let dict = PyDict::new(py);
    dict.set_item("boot_id", format!("{:032x}", header.boot_id))?;
    dict.set_item("uptime_ms", stats.uptime_ms)?;
    dict.set_item("sessions", stats.sessions)?;
    dict.set_item("envs", stats.envs)?;
    dict.set_item("opened", stats.opened)?;
    dict.set_item("lost", stats.lost)?;
    dict.set_item("requests", stats.requests)?;
    dict.set_item("faults", stats.faults)?;
    dict.set_item("steps", stats.steps)?;
    dict.set_item("latency_us", stats.latency_us)?;
    let mut open = Vec::new();
    for session in stats.open {
        let row = PyDict::new(py);
        row.set_item("lease", session.lease)?;
        row.set_item("client", session.client)?;
        row.set_item("envs", session.envs)?;
        row.set_item("steps", session.steps)?;
        row.set_item("age_ms", session.age_ms)?;
        row.set_item("idle_ms", session.idle_ms)?;
        open.push(row);
    }
    dict.set_item("open", open)?;
    Ok(dict)
}

/// Whether a server says that it has no such session.
#[pyfunction]
pub(crate) fn knows_no_session(message: &[u8]) -> bool {
    let Ok((Header { kind: Kind::Fault, .. }, payload)) = Header::read(message) else {
        return false;
    };
    matches!(codec::read_fault(payload), Ok(Fault::NoSession { .. } | Fault::SessionLost { .. }))
}
