//! Links to devices: serial port, USB interface, human interface device, serial server over TCP, or memory.
//!
//! A USB device is found by its identity, which does not depend on the socket. It is searched for at each connection,
//! without opening any other device. One read of a USB interface or human interface device gives one packet.

use std::fmt;
use std::io::Write;

use futures_util::future::BoxFuture;
use tokio::io::{AsyncRead, AsyncWrite};

use crate::DeviceError;

mod identity;
mod packets;

pub mod hid;
pub mod memory;
pub mod serial;
pub mod tcp;
#[cfg(not(feature = "usb"))]
pub mod unbuilt;
#[cfg(feature = "usb")]
pub mod usb;

/// A stream of bytes to and from a device.
pub trait ByteStream: AsyncRead + AsyncWrite + Unpin + Send {
    /// A second way to write to the device, for another thread; `None` if there is none. It keeps nothing back, and a write
    /// waits 10 ms at most.
    fn second_writer(&self) -> Option<Box<dyn Write + Send>> {
        None
    }
}

/// Opens a device, as often as needed. Its text form is the link's name in messages.
pub trait Connect: fmt::Display + Send + Sync {
    /// Opens the device. An error says what to do.
    fn connect(&self) -> BoxFuture<'_, Result<Box<dyn ByteStream>, DeviceError>>;
}
