//! Connections whose other end takes nothing of what it is sent.
//!
//! By its usual transport Zenoh gives such a client up after five seconds. By its low-latency transport, whoever has
//! something to send writes to the connection and waits there for as long as it takes, without regard to the lease; so
//! there the system has to give the client up.

use std::io::{self, Error, ErrorKind};
use std::time::Duration;

use crate::endpoint::Endpoint;

/// Whether this system can do that.
pub const CAN_BE_ENDED: bool = cfg!(target_os = "linux");

/// Lets the system end what is accepted from now on where this process listens, as soon as the other end has taken nothing
/// for so long of what waits for it.
///
/// # Errors
///
/// What the system says; [`ErrorKind::NotFound`] if this process does not listen there, [`ErrorKind::Unsupported`] if the
/// system is not Linux.
#[cfg(target_os = "linux")]
pub fn end_after(listen: &Endpoint, wait: Duration) -> io::Result<()> {
    use std::os::fd::{BorrowedFd, RawFd};

    use socket2::SockRef;

    let mut sockets = 0;
    for entry in std::fs::read_dir("/proc/self/fd")? {
        let Some(number) = entry?.file_name().to_str().and_then(|name| name.parse::<RawFd>().ok())
        else {
            continue;
        };
        #[expect(unsafe_code, reason = "Zenoh does not give its sockets away")]
        // SAFETY: numbers of open descriptors are not negative; this one is asked and told a setting, neither read from nor
        // written to nor closed, and if it is closed meanwhile, the system refuses.
        let descriptor = unsafe { BorrowedFd::borrow_raw(number) };
        let socket = SockRef::from(&descriptor);
        let port = || socket.local_addr().ok()?.as_socket().map(|address| address.port());
        if socket.is_listener().unwrap_or(false) && port() == Some(listen.port()) {
            // Those that are accepted there inherit it (`man 7 tcp`).
            socket.set_tcp_user_timeout(Some(wait))?;
            sockets += 1;
        }
    }
    if sockets == 0 {
        return Err(Error::new(ErrorKind::NotFound, format!("nothing listens at {listen}")));
    }
    Ok(())
}

/// Other systems than Linux cannot.
///
/// # Errors
///
/// Always.
#[cfg(not(target_os = "linux"))]
pub fn end_after(_: &Endpoint, _: Duration) -> io::Result<()> {
    Err(Error::from(ErrorKind::Unsupported))
}
