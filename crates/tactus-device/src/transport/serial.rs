//! A serial port, a USB serial device or a pseudo-terminal.

use std::fmt;
use std::io;
use std::path::PathBuf;

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use tokio_serial::SerialPortBuilderExt;

use super::{ByteStream, Connect};
use crate::{DeviceError, ErrorKind};

/// Opens a serial port: 8 data bits, no parity, 1 stop bit, no flow control, for us alone.
#[derive(Debug, Clone)]
pub struct SerialConnector {
    path: PathBuf,
    baud: u32,
}

impl SerialConnector {
    /// The port at `path`, `baud` bits a second. Of a device's names choose the one that stays with it,
    /// such as those under `/dev/serial/by-id`.
    pub fn new(path: impl Into<PathBuf>, baud: u32) -> Self {
        Self { path: path.into(), baud }
    }

    fn open(&self) -> Result<Box<dyn ByteStream>, DeviceError> {
        let builder = tokio_serial::new(self.path.to_string_lossy(), self.baud);
        match builder.open_native_async() {
            Ok(stream) => Ok(Box::new(stream)),
            Err(error) => Err(self.explain(error)),
        }
    }

    fn explain(&self, error: tokio_serial::Error) -> DeviceError {
        use tokio_serial::ErrorKind::{InvalidInput, Io, NoDevice, Unknown};
        let (kind, what) = match error.kind {
            Io(io::ErrorKind::PermissionDenied) => (ErrorKind::Permission, PERMISSION),
            // So the library calls it when somebody else has locked the port.
            NoDevice if self.path.exists() => (ErrorKind::Busy, BUSY),
            InvalidInput | Unknown | Io(_) if self.path.exists() => (ErrorKind::Protocol, NOT_SERIAL),
            NoDevice | InvalidInput | Unknown | Io(_) => (ErrorKind::Absent, ABSENT),
        };
        DeviceError::from_io(self, kind, format!("{what} ({error})"), error.into())
    }
}

const ABSENT: &str = "there is no such port: is the device plugged in and switched on, and is the path right? \
    `ls /dev/serial/by-id` shows what is there";
const PERMISSION: &str = "this user may not open the port: add the user to the group that owns it \
    (`ls -l` shows it, often dialout) and log in again";
const BUSY: &str = "another program holds the port: end that program; `fuser -v` on the path shows it";
const NOT_SERIAL: &str = "the path is not a serial port that takes these settings: is it the right device?";

impl Connect for SerialConnector {
    fn connect(&self) -> BoxFuture<'_, Result<Box<dyn ByteStream>, DeviceError>> {
        async { self.open() }.boxed()
    }
}

impl fmt::Display for SerialConnector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())
    }
}

#[cfg(test)]
#[path = "serial_tests.rs"]
mod tests;
