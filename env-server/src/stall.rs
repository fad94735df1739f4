//! Connections whose other end takes nothing of what it is sent.
//!
//! By its usual transport Zenoh gives such a client up after some seconds. By its low-latency transport, whoever has
//! something to send writes to the connection and waits there for as long as it takes, and so do all who want to know
//! about it; so there somebody has to watch.

use std::io;
use std::sync::Arc;
use std::time::Duration;

use crate::endpoint::Endpoint;

/// Between two looks.
const LOOK: Duration = Duration::from_millis(250);
/// Where so many looks in a row found no room in a connection, it ends. What an honest client may leave unread leaves room
/// by far.
const MOST_LOOKS: u32 = 4;
/// Where Linux shows a process what it has open.
const DESCRIPTORS: &str = "/proc/self/fd";

/// Whether this system shows which connections there are.
#[must_use]
pub fn can_be_watched() -> bool {
    cfg!(target_os = "linux") && std::fs::read_dir(DESCRIPTORS).is_ok()
}

/// Cuts clients off that read nothing, or next to nothing, until it is dropped.
#[derive(Debug)]
pub struct Watch {
    _is_wanted: Arc<()>,
}

impl Watch {
    /// Watches over the connections that come in where this process listens.
    ///
    /// # Errors
    ///
    /// What the system says if it has no thread to give.
    pub fn start(listen: &Endpoint) -> io::Result<Self> {
        let is_wanted = Arc::new(());
        let (wanted, port) = (Arc::downgrade(&is_wanted), listen.port());
        std::thread::Builder::new().name("swath-watch".to_owned()).spawn(move || {
            let (mut looks, mut is_blind) = (Looks::default(), false);
            while wanted.strong_count() > 0 {
                let looked = looks.look(port);
                if let (Err(error), false) = (&looked, is_blind) {
                    tracing::warn!(%error, "nobody sees which client reads nothing");
                }
                is_blind = looked.is_err();
                std::thread::sleep(LOOK);
            }
        })?;
        Ok(Self { _is_wanted: is_wanted })
    }
}

#[cfg(target_os = "linux")]
use linux::Looks;

#[cfg(target_os = "linux")]
mod linux {
    use std::collections::BTreeMap;
    use std::io;
    use std::net::SocketAddr;
    use std::os::fd::{BorrowedFd, OwnedFd, RawFd};
    use std::time::Duration;

    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    use rustix::io::{Errno, fcntl_dupfd_cloexec};
    use rustix::net::{Shutdown, getpeername, getsockname, shutdown, sockopt};

    use super::{DESCRIPTORS, MOST_LOOKS};

    /// For each client whose connection had no room, how many looks in a row that was so.
    #[derive(Debug, Default)]
    pub(super) struct Looks(BTreeMap<SocketAddr, u32>);

    impl Looks {
        /// Looks at the connections that came in at a port, and ends those that had no room for too long.
        pub(super) fn look(&mut self, port: u16) -> io::Result<()> {
            let full = full_connections(port)?;
            self.0.retain(|client, _| full.iter().any(|(other, _)| other == client));
            for (client, connection) in full {
                let looks = self.0.entry(client).or_default();
                *looks += 1;
                if *looks < MOST_LOOKS {
                    continue;
                }
                tracing::warn!(%client, "cut off: it does not read");
                // What waits for it is given up, too: Zenoh would wait ten seconds more for that when it closes. And whoever
                // has gone meanwhile needs no end.
                let _ = sockopt::set_socket_linger(&connection, Some(Duration::ZERO));
                let _ = shutdown(&connection, Shutdown::Both);
            }
            Ok(())
        }
    }

    /// Clients whose connections, which came in at a port, have no room just now.
    pub(super) fn full_connections(port: u16) -> io::Result<Vec<(SocketAddr, OwnedFd)>> {
        let mut full = Vec::new();
        for entry in std::fs::read_dir(DESCRIPTORS)? {
            let Some(number) =
                entry?.file_name().to_str().and_then(|name| name.parse::<RawFd>().ok())
            else {
                continue;
            };
            #[expect(unsafe_code, reason = "Zenoh does not give its sockets away")]
            // SAFETY: numbers of open descriptors are not negative. It is asked, and copied: if it was closed meanwhile the
            // system refuses, and if it is another one by now that one is looked at.
            let descriptor = unsafe { BorrowedFd::borrow_raw(number) };
            let port_of = |own| SocketAddr::try_from(own).ok().map(|own| own.port());
            if getsockname(descriptor).ok().and_then(port_of) != Some(port) {
                continue;
            }
            let copy = match fcntl_dupfd_cloexec(descriptor, 0) {
                Ok(copy) => copy,
                Err(Errno::BADF) => continue,
                Err(error) => return Err(error.into()),
            };
            let own = getsockname(&copy).ok().and_then(|own| SocketAddr::try_from(own).ok());
            if own.is_none_or(|own| own.port() != port) {
                continue;
            }
            // What listens has nobody at the other end.
            let client = getpeername(&copy).ok().flatten();
            let Some(client) = client.and_then(|client| SocketAddr::try_from(client).ok()) else {
                continue;
            };
            let mut polled = [PollFd::new(&copy, PollFlags::OUT)];
            if poll(&mut polled, Some(&Timespec::default()))? == 0 {
                full.push((client, copy));
            }
        }
        Ok(full)
    }
}

/// Other systems than Linux are not watched.
#[cfg(not(target_os = "linux"))]
#[derive(Debug, Default)]
struct Looks;

#[cfg(not(target_os = "linux"))]
impl Looks {
    fn look(&mut self, _: u16) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
#[cfg(target_os = "linux")]
mod tests {
    use std::io::{Read as _, Write as _};
    use std::net::{TcpListener, TcpStream};

    use super::linux::full_connections;
    use super::*;

    fn pair() -> (TcpListener, TcpStream, TcpStream) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let client = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let served = listener.accept().unwrap().0;
        (listener, client, served)
    }

    fn fill(served: &mut TcpStream) {
        served.set_nonblocking(true).unwrap();
        while served.write(&[0; 1 << 12]).is_ok() {}
    }

    #[test]
    fn only_a_connection_of_that_port_without_room_for_so_many_looks_in_a_row_is_cut_off() {
        let (listener, mut reads_nothing, mut full) = pair();
        let mut other = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let mut free = listener.accept().unwrap().0;
        let (_elsewhere, _client, mut full_elsewhere) = pair();
        fill(&mut full);
        fill(&mut full_elsewhere);
        let (mut looks, port) = (Looks::default(), listener.local_addr().unwrap().port());
        for _ in 1..MOST_LOOKS {
            looks.look(port).unwrap();
        }
        // It reads after all, and then no more.
        full.set_nonblocking(false).unwrap();
        reads_nothing.set_nonblocking(true).unwrap();
        let mut some = vec![0; 1 << 20];
        while !full_connections(port).unwrap().is_empty() {
            let _ = reads_nothing.read(&mut some);
        }
        looks.look(port).unwrap();
        fill(&mut full);
        for _ in 1..MOST_LOOKS {
            looks.look(port).unwrap();
            assert_eq!(full.write(b"more").unwrap_err().kind(), io::ErrorKind::WouldBlock);
        }
        looks.look(port).unwrap();
        assert_eq!(full.write(b"more").unwrap_err().kind(), io::ErrorKind::BrokenPipe);
        // Nor is there any wait for what was sent.
        drop(full);
        reads_nothing.set_nonblocking(false).unwrap();
        let end = std::io::copy(&mut reads_nothing, &mut std::io::sink()).unwrap_err();
        assert_eq!(end.kind(), io::ErrorKind::ConnectionReset);
        free.write_all(b"there").unwrap();
        let mut there = [0; 5];
        other.read_exact(&mut there).unwrap();
        assert_eq!(&there, b"there");
        assert_eq!(full_elsewhere.write(b"more").unwrap_err().kind(), io::ErrorKind::WouldBlock);
    }
}
