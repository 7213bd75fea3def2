//! A human interface device: reports in, reports out.
//!
//! Each report is one packet of the stream. Where a device numbers its reports, the number is the first byte, and is
//! kept; of a report that is written the first byte is always the number, 0 where there is none.
//!
//! The system keeps 63 reports for a program that does not read, and then drops them without a word. So whoever reads
//! too slowly gets an error instead of a gap that nobody sees.

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

/// How long a read waits before the thread looks whether it is still wanted, in milliseconds.
const PATIENCE_MS: i32 = 100;

/// Reports that the system keeps: it drops what comes when so many wait.
const KEPT_BY_THE_SYSTEM: usize = 63;

/// Opens a human interface device. Others of our programs that want it find it busy; strangers may read along.
#[derive(Debug, Clone)]
pub struct HidConnector {
    link: HidLink,
    last: LastReader,
}

impl HidConnector {
    /// The device is looked for by its identity at each connection.
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

/// A human interface device that the system knows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct HidNode {
    pub(crate) path: PathBuf,
    pub(crate) vid: u16,
    pub(crate) pid: u16,
    pub(crate) serial: Option<String>,
    pub(crate) product: Option<String>,
    /// Of a USB device.
    pub(crate) interface: Option<u8>,
    /// What it is for: page and number of its usages.
    pub(crate) usages: Vec<(u16, u16)>,
}

/// All of them, by path; nothing is opened for it.
pub(crate) fn nodes() -> io::Result<Vec<HidNode>> {
    let api = HidApi::new().map_err(broken)?;
    let mut nodes: Vec<HidNode> = Vec::new();
    for info in api.device_list() {
        let path = PathBuf::from(OsStr::from_bytes(info.path().to_bytes()));
        let usage = (info.usage_page(), info.usage());
        // Listed once for each of its usages.
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

/// The node that the rig file means.
fn choose(name: impl fmt::Display, link: &HidLink, nodes: Vec<HidNode>) -> Result<HidNode, DeviceError> {
    let HidLink { identity, interface, .. } = link;
    let is_it = |node: &HidNode| identity.is_of(node.vid, node.pid, node.serial.as_deref());
    if let Some(number) = interface
        && nodes.iter().any(is_it)
        && !nodes.iter().any(|node| is_it(node) && node.interface == Some(*number))
    {
        let there: Vec<_> = nodes.iter().filter(|node| is_it(node)).map(Candidate::place).collect();
        let what = format!(
            "its interface {number} is no human interface device, but {}: put interface right in the rig file",
            there.join(", ")
        );
        return Err(DeviceError::new(name, ErrorKind::WrongDevice, what));
    }
    // Those of other interfaces are not meant; those of other serial numbers say what is there instead.
    let nodes = nodes
        .into_iter()
        .filter(|node| !is_it(node) || interface.is_none() || node.interface == *interface)
        .collect();
    the_one(name, identity, nodes, APART)
}

/// For writing; it also holds the lock by which others of our programs see that the device is taken, and whose
/// errors, unlike the library's, have a kind.
fn open_alone(path: &Path) -> io::Result<File> {
    let file = OpenOptions::new().read(true).write(true).open(path)?;
    flock(&file, FlockOperation::NonBlockingLockExclusive)?;
    Ok(file)
}

/// For reading.
fn open(path: &Path) -> io::Result<HidDevice> {
    let name = CString::new(path.as_os_str().as_bytes())?;
    HidApi::new().and_then(|api| api.open_path(&name)).map_err(broken)
}

/// Why a device could not be opened.
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

/// What gives reports.
trait Reports: Send + 'static {
    /// Length of the next one, 0 if none came in time.
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
    /// One byte longer than the longest report, so that a longer one is seen.
    report: Box<[u8]>,
    /// Reports that had been waiting, since the reading was held up; `None` if nothing waits.
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
    /// What tells it from others, with its serial number if it has one.
    pub(crate) fn identity(&self) -> UsbIdentity {
        UsbIdentity { vid: self.vid, pid: self.pid, serial: self.serial.clone() }
    }
}

#[cfg(test)]
#[path = "hid_tests.rs"]
mod tests;
