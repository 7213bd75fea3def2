//! Address of a service: `tcp/HOST:PORT`.

use std::{fmt, net::IpAddr, str::FromStr};

use crate::BusError;

/// A checked address on the bus, `tcp/HOST:PORT`; `[...]` around an IPv6 host.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Endpoint {
    /// `HOST:PORT`.
    address: String,
}

impl Endpoint {
    /// Default port, which is zenoh's.
    pub const DEFAULT_PORT: u16 = 7447;

    /// The loopback address with [`Endpoint::DEFAULT_PORT`].
    pub fn loopback() -> Self {
        Self { address: format!("127.0.0.1:{}", Self::DEFAULT_PORT) }
    }

    /// `HOST:PORT`, as sockets take it.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// True if only this machine can reach it: a literal loopback address or `localhost`.
    pub fn is_loopback(&self) -> bool {
        let host = self.address.rsplit_once(':').map_or("", |(host, _)| host);
        let literal = host.trim_start_matches('[').trim_end_matches(']');
        literal == "localhost" || literal.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
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
        let address = text.strip_prefix("tcp/").ok_or_else(|| wrong("it must begin with tcp/"))?;
        let (host, port) = address.rsplit_once(':').ok_or_else(|| wrong("the port is missing"))?;
        port.parse::<u16>().ok().filter(|port| *port != 0).ok_or_else(|| wrong("the port is 1 to 65535"))?;
        let bracketed = host.starts_with('[') && host.ends_with(']');
        if host.is_empty() || (host.contains(':') && !bracketed) {
            return Err(wrong("the host is a name, an IPv4 address or an [IPv6 address]"));
        }
        // Zenoh would read `?`, `#` and `;` as options.
        let plain = |c: char| c.is_ascii_alphanumeric() || ".-_:[]%".contains(c);
        if !host.chars().all(plain) {
            return Err(wrong("the host is a name, an IPv4 address or an [IPv6 address]"));
        }
        Ok(Self { address: address.to_owned() })
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "tcp/{}", self.address)
    }
}

#[cfg(test)]
#[path = "endpoint_tests.rs"]
mod tests;
