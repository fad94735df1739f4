//! Connections whose other end takes nothing of what it is sent.
//!
//! By its usual transport Zenoh gives such a client up after some seconds. By its low-latency transport, whoever has
//! something to send writes to the connection and waits there for as long as it takes; so there somebody has to watch.

use std::collections::BTreeMap;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crate::endpoint::Endpoint;

/// Between two looks.
const LOOK: Duration = Duration::from_millis(250);

/// Whether this system shows which connections there are.
#[must_use]
pub fn can_be_watched() -> bool {
    cfg!(target_os = "linux") && std::fs::read_dir(DESCRIPTORS).is_ok()
}

/// Where Linux shows a process what it has open.
const DESCRIPTORS: &str = "/proc/self/fd";

/// How long something may take to be sent: as many looks, so that a process that stood still is not taken for one that
/// waits.
#[derive(Debug, Clone, Copy)]
pub enum Patience {
    /// A second: everybody waits for it.
    OfAll,
    /// Ten seconds: one session waits for it.
    OfSession,
}

impl Patience {
    const fn looks(self) -> u32 {
        match self {
            Self::OfAll => 4,
            Self::OfSession => 40,
        }
    }
}

/// Cuts clients off that hold up whoever sends to them for too long.
#[derive(Debug, Clone, Default)]
pub struct Watch(Arc<Book>);

#[derive(Debug, Default)]
struct Book {
    is_on: AtomicBool,
    /// For each of those who are sending, how many looks are left to it.
    sending: Mutex<BTreeMap<u64, u32>>,
}

impl Book {
    fn sending(&self) -> MutexGuard<'_, BTreeMap<u64, u32>> {
        self.sending.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Looks, and tells whether somebody has waited too long.
    fn look(&self) -> bool {
        let mut is_stuck = false;
        for left in self.sending().values_mut() {
            *left = left.saturating_sub(1);
            is_stuck |= *left == 0;
        }
        is_stuck
    }
}

/// What is being sent, until it is dropped.
#[derive(Debug)]
pub struct Sending<'a>(Option<(&'a Book, u64)>);

impl Drop for Sending<'_> {
    fn drop(&mut self) {
        if let Some((book, number)) = self.0 {
            book.sending().remove(&number);
        }
    }
}

impl Watch {
    /// Watches from now on over the connections that come in where this process listens.
    ///
    /// # Errors
    ///
    /// What the system says if it has no thread to give.
    pub fn start(&self, listen: &Endpoint) -> io::Result<()> {
        let (book, port) = (Arc::downgrade(&self.0), listen.port());
        std::thread::Builder::new().name("swath-watch".to_owned()).spawn(move || {
            while let Some(book) = book.upgrade() {
                if book.look() {
                    cut_off(port);
                }
                drop(book);
                std::thread::sleep(LOOK);
            }
        })?;
        self.0.is_on.store(true, Ordering::Relaxed);
        Ok(())
    }

    /// Something is being sent, which may take so long.
    #[must_use]
    pub fn sending(&self, patience: Patience) -> Sending<'_> {
        if !self.0.is_on.load(Ordering::Relaxed) {
            return Sending(None);
        }
        let mut sending = self.0.sending();
        let number = sending.last_key_value().map_or(0, |(last, _)| last + 1);
        sending.insert(number, patience.looks());
        Sending(Some((&self.0, number)))
    }
}

/// Ends the connections that came in at a port and take nothing just now.
#[cfg(target_os = "linux")]
fn cut_off(port: u16) {
    match full_connections(port) {
        Ok(connections) => {
            for connection in connections {
                let client = rustix::net::getpeername(&connection);
                // What waits for it is given up, too: Zenoh would wait ten seconds more for that when it closes. And whoever
                // has gone meanwhile needs no end.
                let _ = rustix::net::sockopt::set_socket_linger(&connection, Some(Duration::ZERO));
                let _ = rustix::net::shutdown(&connection, rustix::net::Shutdown::Both);
                tracing::warn!(?client, "cut off: it reads nothing, and others wait");
            }
        }
        Err(error) => tracing::warn!(%error, "who reads nothing cannot be found"),
    }
}

#[cfg(target_os = "linux")]
fn full_connections(port: u16) -> io::Result<Vec<std::os::fd::OwnedFd>> {
    use std::net::SocketAddr;
    use std::os::fd::{BorrowedFd, RawFd};

    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    use rustix::io::fcntl_dupfd_cloexec;
    use rustix::net::{getpeername, getsockname};

    let mut full = Vec::new();
    for entry in std::fs::read_dir(DESCRIPTORS)? {
        let Some(number) = entry?.file_name().to_str().and_then(|name| name.parse::<RawFd>().ok())
        else {
            continue;
        };
        #[expect(unsafe_code, reason = "Zenoh does not give its sockets away")]
        // SAFETY: numbers of open descriptors are not negative. It is copied, and no more: if it was closed meanwhile the
        // system refuses, and if it is another one by now that one is looked at.
        let Ok(copy) = fcntl_dupfd_cloexec(unsafe { BorrowedFd::borrow_raw(number) }, 0) else {
            continue;
        };
        // What listens has nobody at the other end.
        let own = getsockname(&copy).ok().and_then(|own| SocketAddr::try_from(own).ok());
        if own.map(|own| own.port()) != Some(port) || getpeername(&copy).is_err() {
            continue;
        }
        let mut polled = [PollFd::new(&copy, PollFlags::OUT)];
        if poll(&mut polled, Some(&Timespec::default()))? == 0 {
            full.push(copy);
        }
    }
    Ok(full)
}

/// Other systems than Linux are not watched.
#[cfg(not(target_os = "linux"))]
fn cut_off(_: u16) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_sent_in_time_is_nobodys_concern_and_what_is_not_is_seen() {
        let watch = Watch::default();
        watch.0.is_on.store(true, Ordering::Relaxed);
        for (patience, looks) in [(Patience::OfAll, 4), (Patience::OfSession, 40)] {
            let (first, second) = (watch.sending(patience), watch.sending(patience));
            for look in 1..looks {
                assert!(!watch.0.look(), "look {look}");
            }
            drop(first);
            let third = watch.sending(patience);
            assert!(watch.0.look(), "the second one has waited {looks} looks");
            drop(second);
            assert!(!watch.0.look(), "the third one came later");
            drop(third);
        }
        assert!(watch.0.sending().is_empty());
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn only_a_connection_of_that_port_whose_other_end_reads_nothing_is_cut_off() {
        use std::io::{Read, Write};
        use std::net::{TcpListener, TcpStream};

        let pair = || {
            let listener = TcpListener::bind("127.0.0.1:0").unwrap();
            let client = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
            let served = listener.accept().unwrap().0;
            (listener, client, served)
        };
        let fill = |served: &mut TcpStream| {
            served.set_nonblocking(true).unwrap();
            while served.write(&[0; 1 << 12]).is_ok() {}
        };
        let (listener, mut reads_nothing, mut full) = pair();
        let mut other = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let mut free = listener.accept().unwrap().0;
        let (_elsewhere, _client, mut full_elsewhere) = pair();
        fill(&mut full);
        fill(&mut full_elsewhere);
        cut_off(listener.local_addr().unwrap().port());
        free.write_all(b"there").unwrap();
        let mut there = [0; 5];
        other.read_exact(&mut there).unwrap();
        assert_eq!(&there, b"there");
        assert_eq!(full.write(b"more").unwrap_err().kind(), io::ErrorKind::BrokenPipe);
        // Nor is there any wait for what was sent.
        drop(full);
        let end = std::io::copy(&mut reads_nothing, &mut std::io::sink()).unwrap_err();
        assert_eq!(end.kind(), io::ErrorKind::ConnectionReset);
        assert_eq!(full_elsewhere.write(b"more").unwrap_err().kind(), io::ErrorKind::WouldBlock);
    }
}
