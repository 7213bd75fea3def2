//! Stands in for USB interfaces in a program that was built without the feature `usb`.

use std::fmt;

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use tactus_schema::rig::UsbLink;

use super::{ByteStream, Connect};
use crate::{DeviceError, ErrorKind};

/// Fails at each connection, with an error that names the missing feature.
#[derive(Debug, Clone)]
pub struct UnbuiltConnector {
    link: UsbLink,
}

impl UnbuiltConnector {
    /// Stands in for a connector of this link.
    pub fn new(link: UsbLink) -> Self {
        Self { link }
    }
}

impl Connect for UnbuiltConnector {
    fn connect(&self) -> BoxFuture<'_, Result<Box<dyn ByteStream>, DeviceError>> {
        async move { Err(DeviceError::new(self, ErrorKind::Absent, UNBUILT)) }.boxed()
    }
}

const UNBUILT: &str = "this program was built without USB interfaces: build it with the feature `usb`, or reach the \
    device by another transport";

impl fmt::Display for UnbuiltConnector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.link.fmt(f)
    }
}
