//! Where a server may listen.

use std::net::IpAddr;

/// Whether only this machine can reach an endpoint: its host is a literal address of the loopback. A name is not, since
/// nobody knows what it will mean.
#[must_use]
pub fn is_loopback(endpoint: &str) -> bool {
    let address = endpoint.split_once('/').map_or("", |(_, rest)| rest);
    let address = address.split(['?', '#']).next().unwrap_or_default();
    let Some((host, _port)) = address.rsplit_once(':') else { return false };
    let host = host.trim_start_matches('[').trim_end_matches(']');
    host.parse().is_ok_and(|host: IpAddr| host.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_literal_of_the_loopback_is_and_nothing_else() {
        for endpoint in ["tcp/127.0.0.1:7447", "tcp/127.9.9.9:0", "tls/[::1]:7447"] {
            assert!(is_loopback(endpoint), "{endpoint}");
        }
        for endpoint in [
            "tcp/0.0.0.0:7447",
            "tcp/[::]:7447",
            "tcp/localhost:7447",
            "tcp/192.168.0.7:7447",
            "tcp/127.0.0.1.example.org:7447",
            "tcp/127.0.0.1",
            "",
        ] {
            assert!(!is_loopback(endpoint), "{endpoint}");
        }
    }
}
