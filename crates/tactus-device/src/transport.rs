//! What carries a device's bytes: a serial port, a USB interface, a human interface device, a serial server, or memory.
//!
//! What is on USB is found by its identity, which stays with it wherever it is plugged in. It is looked for at each
//! connection, without opening anything else. Of USB interfaces and human interface devices one read gives one packet.

use std::fmt;

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
pub trait ByteStream: AsyncRead + AsyncWrite + Unpin + Send {}

impl<T: AsyncRead + AsyncWrite + Unpin + Send> ByteStream for T {}

/// A way to reach a device, again and again.
pub trait Connect: fmt::Display + Send + Sync {
    /// Opens the device.
    fn connect(&self) -> BoxFuture<'_, Result<Box<dyn ByteStream>, DeviceError>>;
}
