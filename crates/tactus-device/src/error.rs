//! What can go wrong with a device, by what physically happened.

use std::fmt::Display;
use std::io;

/// What physically happened; the retry policy and the remedy follow from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ErrorKind {
    /// There is no such device.
    Absent,
    /// What is there is another device than the rig file tells, or one of several.
    WrongDevice,
    /// It is there, but this user may not open it.
    Permission,
    /// Somebody else holds it.
    Busy,
    /// It was there and has gone.
    Disconnected,
    /// It is there and silent.
    Timeout,
    /// It speaks, but not this protocol.
    Protocol,
    /// It reports a fault of its own.
    DeviceFault,
}

/// An error of a device, with where and what to do.
#[derive(Debug, thiserror::Error)]
#[error("{device}: {what}")]
pub struct DeviceError {
    /// The device: its role and its transport, such as `sensor on /dev/ttyACM0`.
    pub device: String,
    /// What physically happened.
    pub kind: ErrorKind,
    /// What happened and what to do about it, for a person.
    pub what: String,
    /// The system's own error, where there is one.
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

    /// Of a link that was open and broke.
    pub(crate) fn disconnected(device: impl Display, source: Option<io::Error>) -> Self {
        Self {
            source,
            ..Self::new(device, ErrorKind::Disconnected, "the link broke; it is being looked for again")
        }
    }
}
