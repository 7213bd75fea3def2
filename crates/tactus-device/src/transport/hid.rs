//! A human interface device (HID), read and written in reports.
//!
//! Each report is one packet of the stream. If a device numbers its reports, the number is the first byte and is kept.
//! The first byte of a written report is always the number, 0 for a device without numbers.
//!
//! The kernel queues 63 reports for a program that does not read, and then drops further ones silently. A reader that is
//! too slow therefore gets an error instead of a hidden gap.

use std::ffi::{CString, OsStr};
use std::fmt;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use hidapi::{BusType, HidApi, HidDevice, HidError};
use rustix::fs::{FlockOperation, flock};
use rustix::io::Errno;
use tactus_schema::rig::{HidLink, MAX_REPORT_BYTES, UsbIdentity};

use super::identity::{ABSENT, Candidate, permission, the_one};
use super::packets::{LastReader, PacketSink, PacketSource, PacketStream, StillOpen, open_apart, stream_of};
use super::{ByteStream, Connect};
use crate::{DeviceError, ErrorKind};

/// How long a read waits, in ms, before the thread checks whether it should end.
const PATIENCE_MS: i32 = 100;

/// Reports that the kernel queues. It drops those that come when the queue is full.
const KEPT_BY_THE_SYSTEM: usize = 63;

/// Opens a human interface device. Other programs of Tactus then find it busy; foreign programs can still read it.
#[derive(Debug, Clone)]
pub struct HidConnector {
    link: HidLink,
    last: LastReader,
}

impl HidConnector {
    /// A connector that searches for the device by its identity at each connection.
    pub fn new(link: HidLink) -> Self {
        Self { link, last: LastReader::default() }
    }

    fn open(&self) -> Result<PacketStream, DeviceError> {
        self.last.wait().map_err(|StillOpen| self.error(ErrorKind::Busy, "this program holds it already"))?;
        let nodes = nodes().map_err(|error| {
            let what = format!("human interface devices cannot be listed: {error}");
            DeviceError::from_io(self, ErrorKind::DeviceFault, what, error)
        })?;
        let node = choose(self, &self.link, nodes)?;
        let writer = open_alone(&node.path).map_err(|error| explain(self, &node, error))?;
        let reader = open(&node.path).map_err(|error| explain(self, &node, error))?;
        tracing::info!(device = %self, node = %node.path.display(), interface = ?node.interface, "opened");
        let source = HidSource::new(reader, self.link.report_bytes.unwrap_or(MAX_REPORT_BYTES));
        stream_of(self, source, Some(Box::new(HidSink(writer))), &self.last)
    }

    fn error(&self, kind: ErrorKind, what: impl Into<String>) -> DeviceError {
        DeviceError::new(self, kind, what)
    }
}

impl Connect for HidConnector {
    fn connect(&self) -> BoxFuture<'_, Result<Box<dyn ByteStream>, DeviceError>> {
        let connector = self.clone();
        open_apart(self, move || connector.open()).boxed()
    }
}

impl fmt::Display for HidConnector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.link.fmt(f)
    }
}

/// A human interface device that the kernel lists.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct HidNode {
    pub(crate) path: PathBuf,
    pub(crate) vid: u16,
    pub(crate) pid: u16,
    pub(crate) serial: Option<String>,
    pub(crate) product: Option<String>,
    /// Number of the USB interface; `None` if it is not on USB.
    pub(crate) interface: Option<u8>,
    /// Usage page and usage number of each of its collections.
    pub(crate) usages: Vec<(u16, u16)>,
}

/// Lists all human interface devices, sorted by path, without opening them.
pub(crate) fn nodes() -> io::Result<Vec<HidNode>> {
    let api = HidApi::new().map_err(broken)?;
    let mut nodes: Vec<HidNode> = Vec::new();
    for info in api.device_list() {
        let path = PathBuf::from(OsStr::from_bytes(info.path().to_bytes()));
        let usage = (info.usage_page(), info.usage());
        // The library lists a device once for each usage.
        if let Some(node) = nodes.iter_mut().find(|node| node.path == path) {
            node.usages.push(usage);
            continue;
        }
        let said =
            |text: Option<&str>| text.map(str::trim).filter(|text| !text.is_empty()).map(str::to_owned);
        let on_usb = matches!(info.bus_type(), BusType::Usb);
        nodes.push(HidNode {
            path,
            vid: info.vendor_id(),
            pid: info.product_id(),
            serial: said(info.serial_number()),
            product: said(info.product_string()),
            interface: u8::try_from(info.interface_number()).ok().filter(|_| on_usb),
            usages: vec![usage],
        });
    }
    nodes.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(nodes)
}

impl Candidate for HidNode {
    fn vid_pid(&self) -> (u16, u16) {
        (self.vid, self.pid)
    }

    fn serial(&self) -> Option<&str> {
        self.serial.as_deref()
    }

    fn place(&self) -> String {
        match self.interface {
            Some(number) => format!("{} (interface {number})", self.path.display()),
            None => self.path.display().to_string(),
        }
    }
}

const APART: &str = "Name the serial number in the rig file, and the interface of a device that has several";

/// The one node that matches the rig file.
fn choose(name: impl fmt::Display, link: &HidLink, nodes: Vec<HidNode>) -> Result<HidNode, DeviceError> {
    let HidLink { identity, interface, .. } = link;
    let is_it = |node: &HidNode| identity.is_of(node.vid, node.pid, node.serial.as_deref());
    if let Some(number) = interface
        && nodes.iter().any(is_it)
        && !nodes.iter().any(|node| is_it(node) && node.interface == Some(*number))
    {
        let there: Vec<_> = nodes.iter().filter(|node| is_it(node)).map(Candidate::place).collect();
        let what = format!(
            "its interface {number} is not a HID interface, but {}: correct `interface` in the rig file",
            there.join(", ")
        );
        return Err(DeviceError::new(name, ErrorKind::WrongDevice, what));
    }
    // Drop other interfaces of the right device. Keep other serial numbers: the error lists them.
    let nodes = nodes
        .into_iter()
        .filter(|node| !is_it(node) || interface.is_none() || node.interface == *interface)
        .collect();
    the_one(name, identity, nodes, APART)
}

/// Opens a node for writing, with a lock that tells other programs of Tactus that the device is in use. Unlike the
/// library's errors, its errors have a kind.
fn open_alone(path: &Path) -> io::Result<File> {
    let file = OpenOptions::new().read(true).write(true).open(path)?;
    flock(&file, FlockOperation::NonBlockingLockExclusive)?;
    Ok(file)
}

/// Opens a node for reading.
fn open(path: &Path) -> io::Result<HidDevice> {
    let name = CString::new(path.as_os_str().as_bytes())?;
    HidApi::new().and_then(|api| api.open_path(&name)).map_err(broken)
}

/// The error for a device that could not be opened.
fn explain(name: impl fmt::Display, node: &HidNode, error: io::Error) -> DeviceError {
    let (kind, what) = match error.raw_os_error().map(Errno::from_raw_os_error) {
        Some(Errno::ACCESS | Errno::PERM) => {
            let HidNode { vid, pid, .. } = node;
            let rule = format!(
                "KERNEL==\"hidraw*\", ATTRS{{idVendor}}==\"{vid:04x}\", ATTRS{{idProduct}}==\"{pid:04x}\""
            );
            (ErrorKind::Permission, permission(node.path.display(), &rule))
        }
        Some(Errno::WOULDBLOCK | Errno::BUSY) => (
            ErrorKind::Busy,
            format!("another program holds it: end it; `fuser -v {}` shows it", node.path.display()),
        ),
        Some(Errno::NOENT | Errno::NODEV | Errno::NXIO) => (ErrorKind::Absent, ABSENT.to_owned()),
        _ => (
            ErrorKind::DeviceFault,
            "it is there and cannot be opened: unplug it and plug it in again".to_owned(),
        ),
    };
    DeviceError::from_io(name, kind, format!("{what} ({error})"), error)
}

/// A source of reports.
trait Reports: Send + 'static {
    /// Reads the next report and returns its length in bytes; 0 if none came in time.
    fn read(&mut self, report: &mut [u8], timeout_ms: i32) -> io::Result<usize>;
}

impl Reports for HidDevice {
    fn read(&mut self, report: &mut [u8], timeout_ms: i32) -> io::Result<usize> {
        match self.read_timeout(report, timeout_ms).map_err(broken) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => Ok(0),
            read => read,
        }
    }
}

struct HidSource<R> {
    reports: R,
    /// One byte longer than the longest report, so that a longer one is noticed.
    report: Box<[u8]>,
    /// Queued reports read since reading was delayed; `None` when the queue is empty.
    backlog: Option<usize>,
}

impl<R: Reports> HidSource<R> {
    fn new(reports: R, report_bytes: usize) -> Self {
        Self { reports, report: vec![0; report_bytes + 1].into(), backlog: None }
    }
}

impl<R: Reports> PacketSource for HidSource<R> {
    fn next(&mut self) -> io::Result<Option<Vec<u8>>> {
        let timeout_ms = if self.backlog.is_some() { 0 } else { PATIENCE_MS };
        let length = self.reports.read(&mut self.report, timeout_ms)?;
        if length == 0 {
            self.backlog = None;
            return Ok(None);
        }
        if length == self.report.len() {
            let what = format!("a report is longer than the {} bytes of report_bytes", length - 1);
            return Err(io::Error::new(io::ErrorKind::InvalidData, what));
        }
        if let Some(backlog) = &mut self.backlog {
            *backlog += 1;
            if *backlog >= KEPT_BY_THE_SYSTEM {
                return Err(io::Error::other(
                    "reports were read too slowly, and the system has dropped some",
                ));
            }
        }
        Ok(self.report.get(..length).map(<[u8]>::to_vec))
    }

    fn was_held_up(&mut self) {
        self.backlog.get_or_insert(0);
    }
}

struct HidSink(File);

impl PacketSink for HidSink {
    fn send(&mut self, report: &[u8]) -> io::Result<()> {
        match self.0.write(report)? {
            written if written == report.len() => Ok(()),
            written => Err(io::Error::other(format!("the device took {written} of {} bytes", report.len()))),
        }
    }
}

fn broken(error: HidError) -> io::Error {
    if let HidError::IoError { error } = error {
        error
    } else {
        io::Error::new(io::ErrorKind::BrokenPipe, error)
    }
}

impl HidNode {
    /// What identifies it; includes the serial number if it has one.
    pub(crate) fn identity(&self) -> UsbIdentity {
        UsbIdentity { vid: self.vid, pid: self.pid, serial: self.serial.clone() }
    }
}

#[cfg(test)]
#[path = "hid_tests.rs"]
mod tests;
