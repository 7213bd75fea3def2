//! What carries a device's bytes: a serial port, a serial server, or memory.
//!
//! Later transports (USB, HID) stand beside these, each with its `Connect`.

use std::fmt;

use futures_util::future::BoxFuture;
use tokio::io::{AsyncRead, AsyncWrite};

use crate::DeviceError;

pub mod memory;
pub mod serial;
pub mod tcp;

/// A stream of bytes to and from a device.
pub trait ByteStream: AsyncRead + AsyncWrite + Unpin + Send {}

impl<T: AsyncRead + AsyncWrite + Unpin + Send> ByteStream for T {}

/// A way to reach a device, again and again.
pub trait Connect: fmt::Display + Send + Sync {
    /// Opens the device.
    fn connect(&self) -> BoxFuture<'_, Result<Box<dyn ByteStream>, DeviceError>>;
}
