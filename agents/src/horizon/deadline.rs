//! When to stop planning.

use std::time::{Duration, Instant};

/// A moment after which no more is tried. Only whoever asks for a time budget has one: what is decided then depends on the machine.
#[derive(Debug, Clone, Copy)]
pub(super) struct Deadline(Instant);

impl Deadline {
    /// So many milliseconds from now; none if that is for ever.
    pub(super) fn within(time_ms: f64) -> Option<Self> {
        time_ms.is_finite().then(|| Self(now() + Duration::from_secs_f64(1e-3 * time_ms)))
    }

    pub(super) fn is_over(self) -> bool {
        now() >= self.0
    }
}

#[expect(clippy::disallowed_methods, reason = "a time budget was asked for")]
fn now() -> Instant {
    Instant::now()
}
