//! In the place of USB interfaces, in a program that was built without the feature `usb`.

use std::fmt;

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use tactus_schema::rig::UsbLink;

use super::{ByteStream, Connect};
use crate::{DeviceError, ErrorKind};

/// Says at each connection that this program cannot.
#[derive(Debug, Clone)]
pub struct UnbuiltConnector {
    link: UsbLink,
}

impl UnbuiltConnector {
    /// In the place of this link.
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
