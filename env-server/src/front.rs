//! Zenoh's side of a server: its keys, the queries that arrive at them, and signs of life.
//!
//! Callbacks only put what arrives into a bounded channel: a callback that takes long would hold up everybody. What the
//! channel does not take is dropped, and its client asks again.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use swath_wire::header::Verb;
use zenoh::bytes::ZBytes;
use zenoh::liveliness::LivelinessToken;
use zenoh::query::{Query, Queryable, Reply};
use zenoh::sample::SampleKind;
use zenoh::{Config, Session, Wait};

/// What arrives.
#[derive(Debug)]
pub enum Arrival {
    /// A question.
    Query(Box<Query>, Verb),
    /// Clients have come or are gone: there are [`Front::leases`] to be looked at.
    Leases,
}

/// A server's keys, declared.
pub struct Front {
    session: Session,
    _queryables: Vec<Queryable<()>>,
    _alive: LivelinessToken,
    low_latency: Option<LowLatency>,
    waiting: Arc<AtomicUsize>,
    most: usize,
    leases: Arc<Mutex<Vec<(u128, bool)>>>,
}

/// Another session of Zenoh, by its low-latency transport, at which steps are asked for.
struct LowLatency {
    session: Session,
    _steps: Queryable<()>,
    /// Shown by both sessions, so that clients find it and know what they have found.
    _tokens: [LivelinessToken; 2],
}

/// Why a server could not begin.
#[derive(Debug, thiserror::Error)]
pub enum FrontError {
    /// Another server has the name.
    #[error("a server called `{0}` is there already")]
    NameTaken(String),
    /// Zenoh's own trouble, or the system's.
    #[error("{0}")]
    Zenoh(String),
}

impl From<zenoh::Error> for FrontError {
    fn from(error: zenoh::Error) -> Self {
        Self::Zenoh(first_line(&error.to_string()))
    }
}

/// What went wrong, without where in Zenoh's own source that was.
fn first_line(text: &str) -> String {
    let mut parts = text.lines().next().unwrap_or_default().split(" at /");
    let mut line = parts.next().unwrap_or_default().to_owned();
    for place in parts {
        let rest = place.split_once(".rs:").map_or("", |(_, rest)| rest);
        line += rest.trim_start_matches(|digit: char| digit.is_ascii_digit() || digit == '.');
    }
    line
}

/// How long to look for another server of the same name.
const LOOK: Duration = Duration::from_millis(500);
/// How often to try for a name that another server wants at the same time.
const ATTEMPTS: u32 = 5;
/// How long one server's sign of life may take to another one: of two that start at once and are further apart than this,
/// both stay, and their clients say so.
const ON_THE_WAY: Duration = Duration::from_millis(100);
/// How long the end of the low-latency transport is waited for: clients see it all the same when the process ends.
const CLOSE: Duration = Duration::from_secs(2);
/// After such a try, 0 to 255 times this long.
const STEP_BACK: Duration = Duration::from_millis(4);

impl Front {
    /// Declares the keys of the server `name`, which nobody else may have, here or where `to_ask` leads; what arrives at
    /// them goes to `events`, as long as not more than `most` bytes wait there.
    ///
    /// # Errors
    ///
    /// [`FrontError`] if the endpoint is taken or the name is.
    pub fn open<E: From<Arrival> + Send + 'static>(
        config: Config,
        to_ask: Option<Config>,
        name: &str,
        boot_id: u128,
        most: usize,
        events: &SyncSender<E>,
    ) -> Result<Self, FrontError> {
        let session = zenoh::open(config).wait()?;
        let routers = to_ask.map(|config| zenoh::open(config).wait()).transpose()?;
        let alive = take_name(&session, routers.as_ref(), name, boot_id)?;
        if let Some(routers) = routers {
            routers.close().wait()?;
        }
        let lease = format!("swath/v1/{name}/lease/");
        let leases = Arc::new(Mutex::new(Vec::new()));
        let (into, comings) = (events.clone(), Arc::clone(&leases));
        session
            .liveliness()
            .declare_subscriber(format!("{lease}*"))
            .history(true)
            .callback(move |sample| {
                let lid = sample.key_expr().as_str().strip_prefix(lease.as_str());
                if let Some(lid) = lid.and_then(|lid| u128::from_str_radix(lid, 16).ok()) {
                    let is_there = sample.kind() == SampleKind::Put;
                    comings.lock().unwrap_or_else(PoisonError::into_inner).push((lid, is_there));
                    // Where there is no room for this, the server looks at them before long.
                    let _ = into.try_send(Arrival::Leases.into());
                }
            })
            .background()
            .wait()?;
        let waiting = Arc::new(AtomicUsize::new(0));
        let declare = |verb| declare(&session, name, verb, &waiting, most, events);
        let queryables = Verb::ALL.into_iter().map(declare).collect::<Result<_, _>>()?;
        let low_latency = None;
        Ok(Self {
            session,
            _queryables: queryables,
            _alive: alive,
            low_latency,
            waiting,
            most,
            leases,
        })
    }

    /// Lets clients of the server `name` have Zenoh's low-latency transport, by a session of these settings that listens at
    /// a port of its own.
    ///
    /// # Errors
    ///
    /// [`FrontError`] of Zenoh's.
    pub fn offer_low_latency<E: From<Arrival> + Send + 'static>(
        &mut self,
        config: Config,
        name: &str,
        boot_id: u128,
        port: u16,
        events: &SyncSender<E>,
    ) -> Result<(), FrontError> {
        let session = zenoh::open(config).wait()?;
        let steps = declare(&session, name, Verb::Step, &self.waiting, self.most, events)?;
        let key = format!("swath/v1/{name}/low-latency/{boot_id:032x}/{port}");
        let show = |session: &Session| session.liveliness().declare_token(key.as_str()).wait();
        let tokens = [show(&session)?, show(&self.session)?];
        self.low_latency = Some(LowLatency { session, _steps: steps, _tokens: tokens });
        Ok(())
    }

    /// A query does not wait any longer.
    pub fn taken(&self, query: &Query) {
        self.waiting.fetch_sub(length(query), Ordering::Relaxed);
    }

    /// Whether there are queries that nobody has looked at yet.
    #[must_use]
    pub fn has_waiting(&self) -> bool {
        self.waiting.load(Ordering::Relaxed) > 0
    }

    /// The leases that have come (`true`) or gone since the last look, in order.
    #[must_use]
    pub fn leases(&self) -> Vec<(u128, bool)> {
        std::mem::take(&mut *self.leases.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Takes the keys away.
    ///
    /// # Errors
    ///
    /// [`FrontError`] of Zenoh's.
    pub fn close(self) -> Result<(), FrontError> {
        if let Some(LowLatency { session, .. }) = self.low_latency {
            let (ending, ended) = std::sync::mpsc::channel();
            std::thread::spawn(move || ending.send(session.close().wait()));
            if !matches!(ended.recv_timeout(CLOSE), Ok(Ok(()))) {
                tracing::warn!("low latency did not end in time");
                // Nor would the rest: it ends with the process.
                std::mem::forget(self.session);
                return Ok(());
            }
        }
        Ok(self.session.close().wait()?)
    }
}

/// Declares the key of one verb; what arrives there goes to `events`, as long as not more than `most` bytes are `waiting`.
fn declare<E: From<Arrival> + Send + 'static>(
    session: &Session,
    name: &str,
    verb: Verb,
    waiting: &Arc<AtomicUsize>,
    most: usize,
    events: &SyncSender<E>,
) -> Result<Queryable<()>, FrontError> {
    // A client of another version finds out which one is spoken here.
    let version = if verb == Verb::Spec { "*" } else { "v1" };
    let key = format!("swath/{version}/{name}/rpc/{}", verb.name());
    let (into, waiting) = (events.clone(), Arc::clone(waiting));
    let callback = move |query: Query| {
        // One that is meant for many reaches no environment.
        if query.key_expr().is_wild() {
            return;
        }
        let bytes = length(&query);
        let is_room = waiting.fetch_add(bytes, Ordering::Relaxed) + bytes <= most;
        let arrival = Arrival::Query(Box::new(query), verb);
        if !is_room || into.try_send(arrival.into()).is_err() {
            waiting.fetch_sub(bytes, Ordering::Relaxed);
        }
    };
    Ok(session.declare_queryable(key).complete(true).callback(callback).wait()?)
}

/// Shows that a server of this name is alive, unless there is another one.
///
/// Of two that start at once, each may find nobody and then both are there: who finds another one after showing itself
/// steps back, waits for a while that chance decides, and looks anew.
fn take_name(
    session: &Session,
    routers: Option<&Session>,
    name: &str,
    boot_id: u128,
) -> Result<LivelinessToken, FrontError> {
    let alive = format!("swath/v1/{name}/alive");
    let own = format!("{alive}/{boot_id:032x}");
    let others = || -> Result<bool, FrontError> {
        for session in [Some(session), routers].into_iter().flatten() {
            let tokens = session.liveliness().get(format!("{alive}/*")).timeout(LOOK).wait()?;
            let is_other =
                |reply: Reply| reply.result().is_ok_and(|token| token.key_expr().as_str() != own);
            if tokens.into_iter().any(is_other) {
                return Ok(true);
            }
        }
        Ok(false)
    };
    for attempt in 0..ATTEMPTS {
        if others()? {
            break;
        }
        let token = session.liveliness().declare_token(own.as_str()).wait()?;
        if routers.is_none() {
            // Whoever comes later looks here.
            return Ok(token);
        }
        // What the other one has shown may still be on its way here.
        std::thread::sleep(ON_THE_WAY);
        if !others()? {
            return Ok(token);
        }
        token.undeclare().wait()?;
        let chance = (boot_id >> (16 * attempt)) & 0xff;
        std::thread::sleep(STEP_BACK * u32::try_from(chance).expect("it is below 256"));
    }
    Err(FrontError::NameTaken(name.to_owned()))
}

/// What a client has put into a query, bytes.
pub(crate) fn length(query: &Query) -> usize {
    let [payload, attachment] =
        [query.payload(), query.attachment()].map(|bytes| bytes.map_or(0, ZBytes::len));
    payload + attachment + query.key_expr().len() + query.parameters().as_str().len()
}
