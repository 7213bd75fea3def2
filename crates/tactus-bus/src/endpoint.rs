//! Address of a service: `tcp/HOST:PORT`, `tls/HOST:PORT` or `unixsock-stream/PATH`.

use std::{fmt, net::IpAddr, path::Path, str::FromStr};

use crate::BusError;

/// Where the packaged service listens for the members of its group.
const INSTALLED: &str = "/run/tactus/bus.sock";

/// A checked address on the bus, in zenoh's form: `tcp/HOST:PORT` or `tls/HOST:PORT`, with `[...]` around an IPv6 host, or
/// `unixsock-stream/PATH`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Endpoint {
    transport: Transport,
    /// `HOST:PORT`, or a path.
    address: String,
}

/// How bytes get there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Transport {
    Tcp,
    Tls,
    Unix,
}

impl Endpoint {
    /// Default port, which is zenoh's.
    pub const DEFAULT_PORT: u16 = 7447;

    /// The loopback address with [`Endpoint::DEFAULT_PORT`].
    pub fn loopback() -> Self {
        Self { transport: Transport::Tcp, address: format!("127.0.0.1:{}", Self::DEFAULT_PORT) }
    }

    /// The socket of the installed service of this machine if there is one, else [`Endpoint::loopback`].
    pub fn of_this_machine() -> Self {
        if Path::new(INSTALLED).exists() {
            Self { transport: Transport::Unix, address: INSTALLED.to_owned() }
        } else {
            Self::loopback()
        }
    }

    /// `HOST:PORT`, as sockets take it, or the path of a Unix socket.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// The path of a Unix socket; `None` for a network address.
    pub fn unix_path(&self) -> Option<&Path> {
        (self.transport == Transport::Unix).then(|| Path::new(&self.address))
    }

    /// True if clients show a certificate.
    pub fn is_tls(&self) -> bool {
        self.transport == Transport::Tls
    }

    /// True if only this machine can reach it: a Unix socket, a literal loopback address or `localhost`.
    pub fn is_loopback(&self) -> bool {
        if self.transport == Transport::Unix {
            return true;
        }
        let host = self.address.rsplit_once(':').map_or("", |(host, _)| host);
        let literal = host.trim_start_matches('[').trim_end_matches(']');
        literal == "localhost" || literal.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
    }
}

impl Transport {
    const ALL: [Self; 3] = [Self::Tcp, Self::Tls, Self::Unix];

    const fn word(self) -> &'static str {
        match self {
            Self::Tcp => "tcp",
            Self::Tls => "tls",
            Self::Unix => "unixsock-stream",
        }
    }
}

impl Default for Endpoint {
    fn default() -> Self {
        Self::loopback()
    }
}

impl FromStr for Endpoint {
    type Err = BusError;

    fn from_str(text: &str) -> Result<Self, BusError> {
        let wrong = |reason| BusError::Endpoint { endpoint: text.to_owned(), reason };
        let (word, address) = text.split_once('/').unwrap_or_default();
        let transport = Transport::ALL.into_iter().find(|transport| transport.word() == word);
        let transport =
            transport.ok_or_else(|| wrong("it must begin with tcp/, tls/ or unixsock-stream/"))?;
        // Zenoh would read `?`, `#` and `;` as options.
        let plain = |c: char| c.is_ascii_alphanumeric() || ".-_:[]%".contains(c);
        if transport == Transport::Unix {
            if !address.starts_with('/') || !address.chars().all(|c| plain(c) || c == '/') {
                return Err(wrong("the path begins with / and has letters, digits, and any of . - _ only"));
            }
            return Ok(Self { transport, address: address.to_owned() });
        }
        let (host, port) = address.rsplit_once(':').ok_or_else(|| wrong("the port is missing"))?;
        port.parse::<u16>().ok().filter(|port| *port != 0).ok_or_else(|| wrong("the port is 1 to 65535"))?;
        let bracketed = host.starts_with('[') && host.ends_with(']');
        if host.is_empty() || (host.contains(':') && !bracketed) || !host.chars().all(plain) {
            return Err(wrong("the host is a name, an IPv4 address or an [IPv6 address]"));
        }
        Ok(Self { transport, address: address.to_owned() })
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.transport.word(), self.address)
    }
}

#[cfg(test)]
#[path = "endpoint_tests.rs"]
mod tests;
