//! Some rows of a batch on one of its servers.

use bytes::Bytes;
use swath_wire::client::ClientError;
use swath_wire::header::{Header, Kind};
use swath_wire::resume::ResumingSession;

use crate::errors::Error;

/// Neighbouring rows on one server.
pub(super) struct Part {
    pub(super) session: ResumingSession,
    pub(super) first: usize,
    pub(super) rows: usize,
    /// Whether it has a part in the call in flight, and what it has answered.
    pub(super) was_asked: bool,
    pub(super) reply: Option<Result<Bytes, ClientError>>,
    /// Longest reply that a step can have, bytes; 0 until the session is open.
    pub(super) max_reply: u32,
}

impl Part {
    /// So many rows from `first` on, which are not open yet.
    pub(super) fn new(session: ResumingSession, first: usize, rows: usize) -> Self {
        Self { session, first, rows, was_asked: false, reply: None, max_reply: 0 }
    }

    /// What to ask a server for, if the row is one of its own: its place there, or all.
    #[expect(clippy::option_option, reason = "None asks for nothing, Some(None) for all rows")]
    pub(super) fn place(&self, row: Option<usize>) -> Option<Option<u32>> {
        match row {
            None => Some(None),
            Some(row) => {
                let place = row.checked_sub(self.first).filter(|&place| place < self.rows)?;
                Some(Some(u32::try_from(place).expect("rows are few")))
            }
        }
    }
}

/// Whether every server has answered the last call, and Python was given what they said: until then, nothing may follow
/// that goes by its result. Nor where some have carried out what others refused.
pub(super) fn settled(parts: &[Part]) -> Result<(), Error> {
    let has_failed = parts.iter().any(|part| matches!(part.reply, Some(Err(_))));
    let is_kept = |part: &Part| matches!(part.reply, Some(Ok(_))) && !has_failed;
    if parts.iter().any(|part| part.session.is_in_doubt() || is_kept(part)) {
        return Err(ClientError::InDoubt.into());
    }
    let has_changed = |part: &Part| {
        let Some(Ok(reply)) = &part.reply else { return false };
        Header::read(reply)
            .is_ok_and(|(header, _)| matches!(header.kind, Kind::Reply(verb) if verb.is_numbered()))
    };
    if has_failed && parts.iter().any(has_changed) {
        let text = "one server refused what another one has carried out: reset every row, or close";
        return Err(Error::Remote(text.to_owned()));
    }
    Ok(())
}

/// What every server that was asked has answered.
pub(super) fn replies(parts: &mut [Part]) -> Result<Vec<Bytes>, Error> {
    let has_failed = |part: &Part| matches!(part.reply, Some(Err(_)));
    if let Some(part) = parts.iter_mut().find(|part| has_failed(part)) {
        // A server that has not answered in time can be asked once more.
        let error = match &part.reply {
            Some(Err(error)) => error.clone(),
            _ => unreachable!("it has failed"),
        };
        return Err(error.into());
    }
    if parts.iter().any(|part| part.was_asked && part.reply.is_none()) {
        return Err(Error::Remote("the last call was not answered: reset or close".to_owned()));
    }
    Ok(parts.iter_mut().filter_map(|part| part.reply.take()?.ok()).collect())
}
