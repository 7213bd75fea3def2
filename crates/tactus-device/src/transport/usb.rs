//! A vendor-specific USB interface with bulk or interrupt endpoints.
//!
//! A bulk transfer is one packet of the stream. It ends with a packet that is not full, or when nothing follows for
//! 5 ms. (A device whose transfers end with a full packet should send an empty one; some do not.) Each packet of an
//! interrupt endpoint is one packet of the stream.
//!
//! A device that is not read waits, so a slow reader loses nothing.

use std::fmt;
use std::fs::OpenOptions;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use rusb::{Context, DeviceHandle, UsbContext};
use tactus_schema::rig::UsbLink;
use tactus_wire::declared::MAX_FRAME_BYTES;

use super::identity::{ABSENT, Candidate, permission, the_one};
use super::packets::{LastReader, PacketSink, PacketSource, PacketStream, StillOpen, open_apart, stream_of};
use super::{ByteStream, Connect};
use crate::bus::{self, EndpointKind, UsbDevice, UsbEndpoint};
use crate::{DeviceError, ErrorKind};

/// How long a read waits before the thread checks whether it should end.
const PATIENCE: Duration = Duration::from_millis(100);

/// Longest pause between packets of one transfer.
const GAP: Duration = Duration::from_millis(5);

/// A transfer that takes longer than this is handed out in parts.
const TRANSFER_MAX: Duration = Duration::from_millis(100);

/// A longer transfer is handed out in parts, too. No frame is longer.
const TRANSFER_MAX_BYTES: usize = MAX_FRAME_BYTES;

/// A device that does not accept a packet within this time is taken as disconnected.
const WRITE_TIMEOUT: Duration = Duration::from_secs(1);

/// Opens an interface of a USB device exclusively.
#[derive(Debug, Clone)]
pub struct UsbConnector {
    link: UsbLink,
    last: LastReader,
}

impl UsbConnector {
    /// A connector that searches for the device by its identity at each connection.
    pub fn new(link: UsbLink) -> Self {
        Self { link, last: LastReader::default() }
    }

    fn open(&self) -> Result<PacketStream, DeviceError> {
        self.last.wait().map_err(|StillOpen| self.error(ErrorKind::Busy, "this program holds it already"))?;
        let device = the_one(self, &self.link.identity, bus::devices(Path::new(bus::ROOT)), APART)?;
        let endpoints =
            choose(&device, &self.link).map_err(|what| self.error(ErrorKind::WrongDevice, what))?;
        let handle = self.claim(&device)?;
        let sink = endpoints.write.map(|endpoint| -> Box<dyn PacketSink> {
            Box::new(UsbSink { handle: handle.clone(), endpoint })
        });
        let pipe = UsbPipe { handle, endpoint: endpoints.read };
        tracing::info!(
            device = %self,
            node = %device.node().display(),
            interface = self.link.interface,
            read = ?endpoints.read,
            write = ?endpoints.write,
            "opened"
        );
        let source = UsbSource::new(self.to_string(), pipe, endpoints.read);
        stream_of(self, source, sink, &self.last)
    }

    /// Opens the device and claims the interface, detaching a kernel driver if there is one.
    fn claim(&self, device: &UsbDevice) -> Result<Arc<DeviceHandle<Context>>, DeviceError> {
        let explain = |error| explain(self, device, self.link.interface, error);
        // Try the node first: libusb reports some refusals, such as those of a systemd unit, as device faults.
        if let Err(error) = OpenOptions::new().read(true).write(true).open(device.node())
            && let Some(refused) = refused(self, device, error)
        {
            return Err(refused);
        }
        let devices = Context::new().and_then(|context| context.devices()).map_err(|error| {
            let what = format!("{NO_LIBUSB} ({error})");
            DeviceError::from_io(self, ErrorKind::Permission, what, io::Error::other(error))
        })?;
        let found = devices
            .iter()
            .find(|found| (found.bus_number(), found.address()) == (device.bus, device.address))
            .ok_or_else(|| self.error(ErrorKind::Absent, ABSENT))?;
        let handle = found.open().map_err(explain)?;
        match handle.set_auto_detach_kernel_driver(true) {
            // A system that cannot detach drivers has none to detach.
            Ok(()) | Err(rusb::Error::NotSupported) => {}
            Err(error) => return Err(explain(error)),
        }
        handle.claim_interface(self.link.interface).map_err(explain)?;
        Ok(Arc::new(handle))
    }

    fn error(&self, kind: ErrorKind, what: impl Into<String>) -> DeviceError {
        DeviceError::new(self, kind, what)
    }
}

impl Connect for UsbConnector {
    fn connect(&self) -> BoxFuture<'_, Result<Box<dyn ByteStream>, DeviceError>> {
        let connector = self.clone();
        open_apart(self, move || connector.open()).boxed()
    }
}

impl fmt::Display for UsbConnector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.link.fmt(f)
    }
}

const APART: &str = "Name the serial number in the rig file; of devices without one, plug in one only";

impl Candidate for UsbDevice {
    fn vid_pid(&self) -> (u16, u16) {
        (self.vid, self.pid)
    }

    fn serial(&self) -> Option<&str> {
        self.serial.as_deref()
    }

    fn place(&self) -> String {
        self.node().display().to_string()
    }
}

/// The endpoints of a link.
#[derive(Debug, PartialEq, Eq)]
struct Endpoints {
    read: UsbEndpoint,
    write: Option<UsbEndpoint>,
}

/// The endpoints that the rig file names; an error says why the device does not match.
fn choose(device: &UsbDevice, link: &UsbLink) -> Result<Endpoints, String> {
    let Some(interface) = device.interfaces.iter().find(|interface| interface.number == link.interface)
    else {
        let numbers: Vec<_> =
            device.interfaces.iter().map(|interface| interface.number.to_string()).collect();
        return Err(format!(
            "it has no interface {}, but {}: put interface right in the rig file; `tactus devices` shows what to write",
            link.interface,
            if numbers.is_empty() { "none at all".to_owned() } else { numbers.join(", ") }
        ));
    };
    let find = |name: &str, address: u8| {
        let found = interface.endpoints.iter().find(|endpoint| endpoint.address == address);
        match found {
            Some(endpoint) if endpoint.kind != EndpointKind::Other && endpoint.packet_bytes > 0 => {
                Ok(*endpoint)
            }
            _ => {
                let there: Vec<_> = interface.endpoints.iter().copied().map(in_words).collect();
                Err(format!(
                    "interface {} has no bulk or interrupt endpoint {address:#04x}, but {}: put {name} right in the \
                     rig file; `tactus devices` shows what to write",
                    link.interface,
                    if there.is_empty() { "none at all".to_owned() } else { there.join(", ") }
                ))
            }
        }
    };
    Ok(Endpoints {
        read: find("endpoint_in", link.endpoint_in)?,
        write: link.endpoint_out.map(|address| find("endpoint_out", address)).transpose()?,
    })
}

fn in_words(endpoint: UsbEndpoint) -> String {
    let kind = match endpoint.kind {
        EndpointKind::Bulk => "bulk",
        EndpointKind::Interrupt => "interrupt",
        EndpointKind::Other => "neither bulk nor interrupt",
    };
    format!("{:#04x} ({kind})", endpoint.address)
}

const NO_LIBUSB: &str = "this program is not let look for USB devices: under systemd, its unit needs AF_NETLINK among \
    RestrictAddressFamilies";

/// The error for a node that is missing or that this user may not open; `None` for other causes.
fn refused(name: impl fmt::Display, device: &UsbDevice, error: io::Error) -> Option<DeviceError> {
    let UsbDevice { vid, pid, .. } = device;
    let node = device.node();
    let (kind, what) = if error.kind() == io::ErrorKind::PermissionDenied {
        let rule =
            format!("SUBSYSTEM==\"usb\", ATTR{{idVendor}}==\"{vid:04x}\", ATTR{{idProduct}}==\"{pid:04x}\"");
        (ErrorKind::Permission, permission(node.display(), &rule))
    } else if error.kind() == io::ErrorKind::NotFound {
        // A container may list the machine's devices without having their nodes.
        let node = node.display();
        (
            ErrorKind::Absent,
            format!("the system knows it, but {node} is not here: is it handed to this container?"),
        )
    } else {
        return None;
    };
    Some(DeviceError::from_io(name, kind, format!("{what} ({error})"), error))
}

/// The error for a device that could not be opened, or whose interface could not be claimed.
fn explain(name: impl fmt::Display, device: &UsbDevice, interface: u8, error: rusb::Error) -> DeviceError {
    if error == rusb::Error::Access
        && let Some(refused) = refused(&name, device, io::ErrorKind::PermissionDenied.into())
    {
        return refused;
    }
    let (kind, what) = if error == rusb::Error::Busy {
        let node = device.node();
        let what = format!(
            "another program holds interface {interface}: end it; `fuser -v {}` shows it",
            node.display()
        );
        (ErrorKind::Busy, what)
    } else if error == rusb::Error::NoDevice {
        (ErrorKind::Absent, ABSENT.to_owned())
    } else if error == rusb::Error::NotFound {
        let what = format!("it has no interface {interface} that can be claimed: is it the right device?");
        (ErrorKind::WrongDevice, what)
    } else {
        let what = "it is there and cannot be opened: unplug it and plug it in again";
        (ErrorKind::DeviceFault, what.to_owned())
    };
    DeviceError::from_io(name, kind, format!("{what} ({error})"), io::Error::other(error))
}

/// An endpoint that sends to the host.
trait Pipe: Send + 'static {
    fn read(&mut self, packet: &mut [u8], timeout: Duration) -> rusb::Result<usize>;

    fn clear_halt(&mut self) -> rusb::Result<()>;
}

struct UsbPipe {
    handle: Arc<DeviceHandle<Context>>,
    endpoint: UsbEndpoint,
}

impl Pipe for UsbPipe {
    fn read(&mut self, packet: &mut [u8], timeout: Duration) -> rusb::Result<usize> {
        let UsbEndpoint { address, kind, .. } = self.endpoint;
        match kind {
            EndpointKind::Interrupt => self.handle.read_interrupt(address, packet, timeout),
            EndpointKind::Bulk | EndpointKind::Other => self.handle.read_bulk(address, packet, timeout),
        }
    }

    fn clear_halt(&mut self) -> rusb::Result<()> {
        self.handle.clear_halt(self.endpoint.address)
    }
}

/// Joins packets into transfers. It requests one packet at a time, because the length of each shows where a transfer
/// ends, and because a read that times out then never holds part of a packet.
struct UsbSource<P> {
    name: String,
    pipe: P,
    kind: EndpointKind,
    packet: Box<[u8]>,
    /// The endpoint stalled, and has sent nothing since.
    stalled: bool,
}

impl<P: Pipe> UsbSource<P> {
    fn new(name: String, pipe: P, endpoint: UsbEndpoint) -> Self {
        let packet = vec![0; endpoint.packet_bytes.into()].into();
        Self { name, pipe, kind: endpoint.kind, packet, stalled: false }
    }

    /// The length of the next packet; `None` if none came in time.
    fn packet(&mut self, timeout: Duration) -> io::Result<Option<usize>> {
        match self.pipe.read(&mut self.packet, timeout) {
            Ok(length) => {
                self.stalled = false;
                Ok(Some(length))
            }
            Err(rusb::Error::Timeout | rusb::Error::Interrupted) => Ok(None),
            Err(rusb::Error::Pipe) if !self.stalled => {
                self.stalled = true;
                tracing::warn!(device = self.name, "the endpoint has stalled; it is cleared once");
                self.pipe.clear_halt().map_err(broken)?;
                Ok(None)
            }
            Err(error) => Err(broken(error)),
        }
    }
}

impl<P: Pipe> PacketSource for UsbSource<P> {
    fn next(&mut self) -> io::Result<Option<Vec<u8>>> {
        let Some(length) = self.packet(PATIENCE)? else { return Ok(None) };
        let mut transfer = self.packet.get(..length).unwrap_or_default().to_vec();
        let begun = Instant::now();
        let mut is_full = length == self.packet.len();
        while self.kind == EndpointKind::Bulk
            && is_full
            && transfer.len() < TRANSFER_MAX_BYTES
            && begun.elapsed() < TRANSFER_MAX
        {
            let Some(length) = self.packet(GAP)? else { break };
            transfer.extend_from_slice(self.packet.get(..length).unwrap_or_default());
            is_full = length == self.packet.len();
        }
        Ok(Some(transfer))
    }
}

struct UsbSink {
    handle: Arc<DeviceHandle<Context>>,
    endpoint: UsbEndpoint,
}

impl PacketSink for UsbSink {
    fn send(&mut self, packet: &[u8]) -> io::Result<()> {
        let UsbEndpoint { address, kind, .. } = self.endpoint;
        let written = match kind {
            EndpointKind::Interrupt => self.handle.write_interrupt(address, packet, WRITE_TIMEOUT),
            EndpointKind::Bulk | EndpointKind::Other => {
                self.handle.write_bulk(address, packet, WRITE_TIMEOUT)
            }
        };
        match written.map_err(broken)? {
            written if written == packet.len() => Ok(()),
            written => Err(io::Error::new(
                io::ErrorKind::TimedOut,
                format!("the device took {written} of {} bytes", packet.len()),
            )),
        }
    }
}

/// The I/O error for a link that broke.
fn broken(error: rusb::Error) -> io::Error {
    let kind = if matches!(error, rusb::Error::NoDevice | rusb::Error::NotFound) {
        io::ErrorKind::NotConnected
    } else if error == rusb::Error::Timeout {
        io::ErrorKind::TimedOut
    } else {
        io::ErrorKind::BrokenPipe
    };
    io::Error::new(kind, error)
}

#[cfg(test)]
#[path = "usb_tests.rs"]
mod tests;
