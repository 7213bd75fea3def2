//! A serial port, USB serial device or pseudo-terminal, found by its path or by its USB identity.

use std::fmt;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use serialport::{SerialPortInfo, SerialPortType, TTYPort};
use tactus_schema::rig::SerialPort;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio_serial::SerialStream;

use super::identity::{Candidate, the_one};
use super::{ByteStream, Connect};
use crate::{DeviceError, ErrorKind};

/// Opens a serial port exclusively: 8 data bits, no parity, 1 stop bit, no flow control.
#[derive(Debug, Clone)]
pub struct SerialConnector {
    port: SerialPort,
    baud: u32,
}

impl SerialConnector {
    /// The port at `path`, at `baud` bits per second. Prefer a path that stays with the device, such as one under
    /// `/dev/serial/by-id`.
    pub fn new(path: impl Into<PathBuf>, baud: u32) -> Self {
        let path: PathBuf = path.into();
        Self::of(SerialPort::Path(path.to_string_lossy().into_owned()), baud)
    }

    /// A port at `baud` bits per second. A port given by its USB identity is searched for at each connection.
    pub fn of(port: SerialPort, baud: u32) -> Self {
        Self { port, baud }
    }

    fn open(&self) -> Result<Box<dyn ByteStream>, DeviceError> {
        let path = self.path()?;
        match SerialLink::open(&path, self.baud) {
            Ok(link) => {
                tracing::info!(device = %self, path, baud = self.baud, "opened");
                Ok(Box::new(link))
            }
            Err(error) => Err(self.explain(&path, error)),
        }
    }

    /// The present path of the port.
    fn path(&self) -> Result<String, DeviceError> {
        match &self.port {
            SerialPort::Path(path) => Ok(path.clone()),
            SerialPort::Usb(identity) => {
                let ports = ports().map_err(|error| {
                    let what = format!("serial ports cannot be listed: {error}");
                    DeviceError::from_io(self, ErrorKind::DeviceFault, what, error)
                })?;
                let on_usb =
                    ports.into_iter().filter(|port| matches!(port.port_type, SerialPortType::UsbPort(_)));
                the_one(self, identity, on_usb.collect(), APART).map(|port| port.port_name)
            }
        }
    }

    fn explain(&self, path: &str, error: tokio_serial::Error) -> DeviceError {
        use tokio_serial::ErrorKind::{InvalidInput, Io, NoDevice, Unknown};
        let is_there = Path::new(path).exists();
        let (kind, what) = match error.kind {
            Io(io::ErrorKind::PermissionDenied) => (ErrorKind::Permission, PERMISSION),
            // The library's error for a port that another program has locked.
            NoDevice if is_there => (ErrorKind::Busy, BUSY),
            InvalidInput | Unknown | Io(_) if is_there => (ErrorKind::Protocol, NOT_SERIAL),
            NoDevice | InvalidInput | Unknown | Io(_) => (ErrorKind::Absent, ABSENT),
        };
        let what = match &self.port {
            SerialPort::Path(_) => format!("{what} ({error})"),
            SerialPort::Usb(_) => format!("{what} ({path}: {error})"),
        };
        DeviceError::from_io(self, kind, what, error.into())
    }
}

/// The longest that the second way to a port waits for room.
const SECOND_PATIENCE: Duration = Duration::from_millis(10);

/// An open port, and a second handle of it: an asynchronous stream cannot be cloned.
struct SerialLink {
    stream: SerialStream,
    second: TTYPort,
}

impl SerialLink {
    fn open(path: &str, baud: u32) -> tokio_serial::Result<Self> {
        let port = serialport::new(path, baud).timeout(SECOND_PATIENCE).open_native()?;
        let second = port.try_clone_native()?;
        Ok(Self { stream: SerialStream::try_from(port)?, second })
    }
}

impl ByteStream for SerialLink {
    fn second_writer(&self) -> Option<Box<dyn Write + Send>> {
        let cloned = self.second.try_clone_native();
        let cloned = cloned.inspect_err(|error| tracing::warn!(%error, "no second way to the port"));
        Some(Box::new(cloned.ok()?))
    }
}

impl AsyncRead for SerialLink {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl AsyncWrite for SerialLink {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

/// Lists all serial ports, sorted by name, without opening them.
pub(crate) fn ports() -> io::Result<Vec<SerialPortInfo>> {
    // Without this folder, as in some containers, the library would panic.
    if !Path::new("/sys/class/tty").is_dir() {
        return Ok(Vec::new());
    }
    let mut ports = serialport::available_ports()?;
    ports.sort_by(|a, b| a.port_name.cmp(&b.port_name));
    Ok(ports)
}

impl Candidate for SerialPortInfo {
    /// Both are 0 for a port that is not on USB.
    fn vid_pid(&self) -> (u16, u16) {
        match &self.port_type {
            SerialPortType::UsbPort(usb) => (usb.vid, usb.pid),
            SerialPortType::PciPort | SerialPortType::BluetoothPort | SerialPortType::Unknown => (0, 0),
        }
    }

    fn serial(&self) -> Option<&str> {
        match &self.port_type {
            SerialPortType::UsbPort(usb) => usb.serial_number.as_deref().filter(|serial| !serial.is_empty()),
            SerialPortType::PciPort | SerialPortType::BluetoothPort | SerialPortType::Unknown => None,
        }
    }

    fn place(&self) -> String {
        self.port_name.clone()
    }
}

const APART: &str = "Name the serial number in the rig file; of ports that share one, or have none, name the path \
    under /dev/serial/by-id or by-path instead";
const ABSENT: &str = "there is no such port: is the device plugged in and switched on, and is the path right? \
    `tactus devices` shows what is there";
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
        self.port.fmt(f)
    }
}

#[cfg(test)]
#[path = "serial_tests.rs"]
mod tests;
