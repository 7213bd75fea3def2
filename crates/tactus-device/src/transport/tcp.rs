//! A serial server: a device behind a TCP port.

use std::fmt;
use std::fs::File;
use std::io::{self, Write};
use std::os::fd::AsFd;
use std::time::Duration;

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use tokio::net::TcpStream;
use tokio::time::timeout;

use super::{ByteStream, Connect};
use crate::{DeviceError, ErrorKind};

/// Longest time to connect.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(2);

/// Connects to `host:port`.
#[derive(Debug, Clone)]
pub struct TcpConnector {
    address: String,
}

impl TcpConnector {
    /// The server at `host:port`.
    pub fn new(address: impl Into<String>) -> Self {
        Self { address: address.into() }
    }

    async fn open(&self) -> Result<Box<dyn ByteStream>, DeviceError> {
        let connected = timeout(CONNECT_TIMEOUT, TcpStream::connect(&self.address)).await;
        let connected = connected.unwrap_or_else(|_| Err(io::ErrorKind::TimedOut.into()));
        // Commands are small, and a stop must not wait to be sent together with other data.
        let stream = connected.and_then(|stream| stream.set_nodelay(true).map(|()| stream));
        match stream {
            Ok(stream) => Ok(Box::new(stream)),
            Err(error) => Err(self.explain(error)),
        }
    }

    fn explain(&self, error: io::Error) -> DeviceError {
        let (kind, what) = if error.kind() == io::ErrorKind::PermissionDenied {
            (ErrorKind::Permission, "this user or machine may not connect: ask whoever runs the firewall")
        } else if error.kind() == io::ErrorKind::TimedOut {
            (ErrorKind::Timeout, "nobody answers: is the server switched on and the address right?")
        } else {
            (ErrorKind::Absent, "there is no such server: is it switched on, and are host and port right?")
        };
        DeviceError::from_io(self, kind, format!("{what} ({error})"), error)
    }
}

impl ByteStream for TcpStream {
    fn second_writer(&self) -> Option<Box<dyn Write + Send>> {
        let cloned = self.as_fd().try_clone_to_owned();
        let cloned = cloned.inspect_err(|error| tracing::warn!(%error, "no second way to the server"));
        Some(Box::new(File::from(cloned.ok()?)))
    }
}

impl Connect for TcpConnector {
    fn connect(&self) -> BoxFuture<'_, Result<Box<dyn ByteStream>, DeviceError>> {
        self.open().boxed()
    }
}

impl fmt::Display for TcpConnector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "tcp:{}", self.address)
    }
}

#[cfg(test)]
#[path = "tcp_tests.rs"]
mod tests;
