//! Memory that sessions leave behind.
//!
//! The allocator of glibc keeps what is freed, in a pool for each of a dozen threads, and gives back only what lies at the
//! end of a pool: of a server with hundreds of clients that had come and gone, eight at a time, the pools kept nearly twice
//! what eight had had at once, and a fortieth of it was in use. So the server gives it back itself: soon after a session has
//! ended, and once more when its connection is closed for sure and the threads that Zenoh took on for it have ended.

/// Between the end of a session and the first time, milliseconds: others that end together with it have ended, too. Where
/// sessions end all the time, it is given back once in so long.
const SOON_MS: u64 = 1_000;
/// Between the end of the last session and the last time, milliseconds: a thread of Zenoh's that has nothing to do ends
/// after ten seconds.
const LATE_MS: u64 = 12_000;

/// When memory is to be given back.
#[derive(Debug, Default)]
pub struct Leftovers {
    soon_ms: Option<u64>,
    late_ms: Option<u64>,
}

impl Leftovers {
    /// A session has ended, or the connection of one is gone.
    pub fn add(&mut self, now_ms: u64) {
        self.soon_ms.get_or_insert(now_ms + SOON_MS);
        self.late_ms = Some(now_ms + LATE_MS);
    }

    /// Whether it is time to [`give_back`]; says so once.
    pub fn are_due(&mut self, now_ms: u64) -> bool {
        let is_over = |at_ms: &mut Option<u64>| at_ms.take_if(|at_ms| *at_ms <= now_ms).is_some();
        // Both are looked at.
        is_over(&mut self.soon_ms) | is_over(&mut self.late_ms)
    }
}

/// Gives the system what is free, in a thread of its own: who allocates meanwhile waits for one pool at most.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub fn give_back() {
    #[expect(unsafe_code, reason = "there is no other way to the allocator of the system")]
    let trim = || {
        // SAFETY: it takes no pointer, may be called from any thread at any time, and touches only memory that is free.
        unsafe { libc::malloc_trim(0) };
    };
    // Where the system has no thread to give, the next time is soon enough.
    let _ = std::thread::Builder::new().name("swath-memory".to_owned()).spawn(trim);
}

/// Other allocators give back by themselves.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub fn give_back() {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_given_back_soon_after_the_first_end_and_long_after_the_last() {
        let mut leftovers = Leftovers::default();
        let mut given_back = Vec::new();
        for now_ms in (0..60_000).step_by(100) {
            // A session ends every 300 ms, for ten seconds.
            if now_ms < 10_000 && now_ms % 300 == 0 {
                leftovers.add(now_ms);
            }
            if leftovers.are_due(now_ms) {
                given_back.push(now_ms);
            }
        }
        // Once a second, or a little less often, as long as sessions end; then once more.
        assert_eq!(given_back.pop(), Some(9_900 + LATE_MS));
        assert_eq!(given_back[0], SOON_MS);
        assert!(given_back.len() >= 8, "{given_back:?}");
        assert!(given_back.windows(2).all(|pair| pair[1] - pair[0] >= SOON_MS), "{given_back:?}");
    }
}
