//! Errors of devices, classified by what physically happened.

use std::fmt::Display;
use std::io;

/// What physically happened. It decides how to retry and what to tell the user.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ErrorKind {
    /// There is no such device.
    Absent,
    /// Another device than the one in the rig file is connected, or several match.
    WrongDevice,
    /// This user has no permission to open it.
    Permission,
    /// Another process has it open.
    Busy,
    /// It was connected, and the link broke.
    Disconnected,
    /// It is connected, but sends nothing.
    Timeout,
    /// It sends data, but not in this protocol.
    Protocol,
    /// It reports a fault of its own.
    DeviceFault,
}

/// An error of a device: which device, what happened, and what to do.
#[derive(Debug, thiserror::Error)]
#[error("{device}: {what}")]
pub struct DeviceError {
    /// The device: its role and its transport, such as `sensor on /dev/ttyACM0`.
    pub device: String,
    /// What physically happened.
    pub kind: ErrorKind,
    /// What happened and what to do about it.
    pub what: String,
    /// The operating system's error, if there is one.
    #[source]
    pub source: Option<io::Error>,
}

impl DeviceError {
    pub(crate) fn new(device: impl Display, kind: ErrorKind, what: impl Into<String>) -> Self {
        Self { device: device.to_string(), kind, what: what.into(), source: None }
    }

    pub(crate) fn from_io(
        device: impl Display,
        kind: ErrorKind,
        what: impl Into<String>,
        source: io::Error,
    ) -> Self {
        Self { source: Some(source), ..Self::new(device, kind, what) }
    }

    /// An error of a link that was open and broke.
    pub(crate) fn disconnected(device: impl Display, source: Option<io::Error>) -> Self {
        Self {
            source,
            ..Self::new(device, ErrorKind::Disconnected, "the link broke; it is being looked for again")
        }
    }
}
