//! Where a server listens.

use std::fmt;
use std::net::{IpAddr, TcpListener};

/// An address and how it is spoken to: `tcp/127.0.0.1:7447`, `tls/field.example.org:7447`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Endpoint {
    is_tls: bool,
    host: String,
    port: u16,
}

/// A text that is no endpoint.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("tcp/HOST:PORT or tls/HOST:PORT")]
pub struct EndpointError;

impl Endpoint {
    /// The endpoint that a text names. Settings in it, which Zenoh would read behind `?` or `#`, are refused: they could
    /// switch off what was checked.
    ///
    /// # Errors
    ///
    /// [`EndpointError`] if it is none.
    pub fn parse(text: &str) -> Result<Self, EndpointError> {
        let (protocol, address) = text.split_once('/').ok_or(EndpointError)?;
        let is_tls = match protocol {
            "tcp" => false,
            "tls" => true,
            _ => return Err(EndpointError),
        };
        let (host, port) = address.rsplit_once(':').ok_or(EndpointError)?;
        let port = port.parse().map_err(|_| EndpointError)?;
        let bare = host.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
        let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b".-".contains(&byte);
        let is_host = bare.map_or_else(
            || !host.is_empty() && host.bytes().all(is_plain),
            |bare| bare.parse().is_ok_and(|host: IpAddr| host.is_ipv6()),
        );
        if !is_host {
            return Err(EndpointError);
        }
        Ok(Self { is_tls, host: host.to_owned(), port })
    }

    /// Whether it is spoken to through TLS.
    #[must_use]
    pub fn is_tls(&self) -> bool {
        self.is_tls
    }

    /// Whether only this machine can reach it: its host is a literal address of the loopback. A name is not, since nobody
    /// knows what it will mean.
    #[must_use]
    pub fn is_loopback(&self) -> bool {
        let host = self.host.trim_start_matches('[').trim_end_matches(']');
        host.parse().is_ok_and(|host: IpAddr| host.is_loopback())
    }

    /// Its port.
    #[must_use]
    pub fn port(&self) -> u16 {
        self.port
    }

    /// The same with a port that is free just now in place of port 0: Zenoh does not tell which one it was given.
    ///
    /// # Errors
    ///
    /// That of the system, if it has no port for this host.
    pub fn with_port(self) -> Result<Self, std::io::Error> {
        if self.port != 0 {
            return Ok(self);
        }
        self.with_port_of_its_own()
    }

    /// The same with another port, which is free just now.
    ///
    /// # Errors
    ///
    /// As [`Self::with_port`].
    pub fn with_port_of_its_own(&self) -> Result<Self, std::io::Error> {
        let port = TcpListener::bind(format!("{}:0", self.host))?.local_addr()?.port();
        Ok(Self { port, ..self.clone() })
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let protocol = if self.is_tls { "tls" } else { "tcp" };
        write!(f, "{protocol}/{}:{}", self.host, self.port)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_literal_of_the_loopback_is_and_nothing_else() {
        let is_loopback = |text: &str| Endpoint::parse(text).unwrap().is_loopback();
        for endpoint in ["tcp/127.0.0.1:7447", "tcp/127.9.9.9:0", "tls/[::1]:7447"] {
            assert!(is_loopback(endpoint), "{endpoint}");
        }
        for endpoint in [
            "tcp/0.0.0.0:7447",
            "tcp/[::]:7447",
            "tcp/[::ffff:127.0.0.1]:7447",
            "tcp/localhost:7447",
            "tcp/192.168.0.7:7447",
            "tcp/127.0.0.1.example.org:7447",
        ] {
            assert!(!is_loopback(endpoint), "{endpoint}");
        }
    }

    #[test]
    fn an_endpoint_is_read_as_it_is_written_and_bears_no_settings() {
        for text in ["tcp/127.0.0.1:7447", "tls/[::1]:0", "tls/field.example.org:7447"] {
            assert_eq!(Endpoint::parse(text).unwrap().to_string(), text);
        }
        for text in [
            "",
            "127.0.0.1:7447",
            "udp/127.0.0.1:7447",
            "tcp/127.0.0.1",
            "tcp/:7447",
            "tcp/::1:7447",
            "tls/0.0.0.0:7447#enable_mtls=false",
            "tls/0.0.0.0?x=1:7447",
        ] {
            assert_eq!(Endpoint::parse(text), Err(EndpointError), "{text}");
        }
    }

    #[test]
    fn port_0_becomes_one_that_is_free() {
        let endpoint = Endpoint::parse("tcp/127.0.0.1:0").unwrap().with_port().unwrap();
        assert_ne!(endpoint.port, 0);
        assert_eq!(endpoint.clone().with_port().unwrap(), endpoint);
    }
}
