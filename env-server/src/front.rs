//! Zenoh's side of a server: its keys, the queries that arrive at them, and signs of life.
//!
//! Callbacks only put what arrives into a bounded channel: a callback that takes long would hold up everybody. What the
//! channel does not take is dropped, and its client asks again.

use std::sync::mpsc::SyncSender;
use std::time::Duration;

use swath_wire::header::Verb;
use zenoh::liveliness::LivelinessToken;
use zenoh::query::{Query, Queryable};
use zenoh::sample::SampleKind;
use zenoh::{Config, Session, Wait};

/// What arrives.
#[derive(Debug)]
pub enum Arrival {
    /// A question.
    Query(Box<Query>, Verb),
    /// A client has come, or is gone.
    Lease(u128, bool),
}

/// A server's keys, declared.
pub struct Front {
    session: Session,
    _queryables: Vec<Queryable<()>>,
    _alive: LivelinessToken,
}

/// Why a server could not begin.
#[derive(Debug, thiserror::Error)]
pub enum FrontError {
    /// Another server has the name.
    #[error("a server called `{0}` is there already")]
    NameTaken(String),
    /// Zenoh's own trouble.
    #[error("{0}")]
    Zenoh(String),
}

impl From<zenoh::Error> for FrontError {
    fn from(error: zenoh::Error) -> Self {
        Self::Zenoh(error.to_string().lines().next().unwrap_or_default().to_owned())
    }
}

/// Longer than Zenoh needs to add to a message.
const MESSAGE_SLACK: u32 = 64 << 10;
/// How long to look for another server of the same name.
const LOOK: Duration = Duration::from_millis(500);

/// Zenoh's settings for a server that listens at one endpoint and looks for nobody.
///
/// # Errors
///
/// [`FrontError`] if Zenoh refuses the endpoint.
pub fn settings(listen: &str, max_msg: u32) -> Result<Config, FrontError> {
    let listen = serde_json::json!([listen]).to_string();
    let max_message_size = (max_msg + MESSAGE_SLACK).to_string();
    let mut config = Config::default();
    for (key, value) in [
        ("mode", "\"peer\""),
        ("listen/endpoints", listen.as_str()),
        ("scouting/multicast/enabled", "false"),
        ("scouting/gossip/enabled", "false"),
        ("transport/link/rx/max_message_size", max_message_size.as_str()),
    ] {
        config.insert_json5(key, value)?;
    }
    Ok(config)
}

impl Front {
    /// Declares the keys of the server `name`; what arrives at them goes to `events`.
    ///
    /// # Errors
    ///
    /// [`FrontError`] if the endpoint is taken or the name is.
    pub fn open<E: From<Arrival> + Send + 'static>(
        config: Config,
        name: &str,
        boot_id: u128,
        events: &SyncSender<E>,
    ) -> Result<Self, FrontError> {
        let session = zenoh::open(config).wait()?;
        let alive = format!("swath/v1/{name}/alive");
        let others = session.liveliness().get(format!("{alive}/*")).timeout(LOOK).wait()?;
        if others.into_iter().any(|reply| reply.result().is_ok()) {
            return Err(FrontError::NameTaken(name.to_owned()));
        }
        let lease = format!("swath/v1/{name}/lease/");
        let into = events.clone();
        session
            .liveliness()
            .declare_subscriber(format!("{lease}*"))
            .history(true)
            .callback(move |sample| {
                let lid = sample.key_expr().as_str().strip_prefix(lease.as_str());
                if let Some(lid) = lid.and_then(|lid| u128::from_str_radix(lid, 16).ok()) {
                    let is_there = sample.kind() == SampleKind::Put;
                    // Few and far between: there is room for them.
                    let _ = into.try_send(Arrival::Lease(lid, is_there).into());
                }
            })
            .background()
            .wait()?;
        let mut queryables = Vec::new();
        for verb in Verb::ALL {
            // A client of another version finds out which one is spoken here.
            let version = if verb == Verb::Spec { "*" } else { "v1" };
            let key = format!("swath/{version}/{name}/rpc/{}", verb.name());
            let into = events.clone();
            let callback = move |query: Query| {
                if query.key_expr().as_str().contains('*') {
                    return;
                }
                let _ = into.try_send(Arrival::Query(Box::new(query), verb).into());
            };
            let queryable =
                session.declare_queryable(key).complete(true).callback(callback).wait()?;
            queryables.push(queryable);
        }
        let alive = session.liveliness().declare_token(format!("{alive}/{boot_id:032x}")).wait()?;
        Ok(Self { session, _queryables: queryables, _alive: alive })
    }

    /// Answers a query. An answer that does not arrive is asked for again.
    pub fn reply(query: &Query, message: &[u8]) {
        if let Err(error) = query.reply(query.key_expr().clone(), message).wait() {
            tracing::debug!(%error, "a reply was not sent");
        }
    }

    /// Takes the keys away.
    ///
    /// # Errors
    ///
    /// [`FrontError`] of Zenoh's.
    pub fn close(self) -> Result<(), FrontError> {
        Ok(self.session.close().wait()?)
    }
}
