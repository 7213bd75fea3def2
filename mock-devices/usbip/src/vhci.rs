//! The kernel's virtual host controller: where devices without hardware are plugged in.
//!
//! It takes a socket whose other end answers USB/IP. Nobody asks what kind of socket: one end of a pair does, and
//! then there is neither a network nor a tool. The kernel holds the socket for itself; when our end closes, the
//! device is unplugged.
//!
//! # Source
//! The Linux kernel's `drivers/usb/usbip/vhci_sysfs.c`: the files `status` and `attach`.

use std::fs;
use std::io;
use std::os::fd::{AsFd, AsRawFd};
use std::path::PathBuf;
use std::time::Duration;

use tokio::net::UnixStream;
use tokio::time::{Instant, sleep};

use crate::descriptor::Speed;

const FOLDER: &str = "/sys/devices/platform/vhci_hcd.0";

/// State of a port with nothing in it, in `status`.
const FREE: &str = "004";

/// The kernel frees a port some time after a device has gone; it tells nobody when.
const FREED_WITHIN: Duration = Duration::from_secs(10);
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// Why a device cannot be plugged in.
#[derive(Debug, thiserror::Error)]
pub enum VhciError {
    /// The driver is not there.
    #[error(
        "{FOLDER} is not there: load the kernel's virtual host controller with `modprobe vhci-hcd`, as root; \
         kernels for clouds have none, a machine with one is what `just vm` makes"
    )]
    Absent,
    /// It refused.
    #[error("{file} of the virtual host controller: {source}; only root may plug in virtual devices")]
    Refused {
        /// The file.
        file: &'static str,
        /// What the system said.
        source: io::Error,
    },
    /// No port in time.
    #[error("no port of the virtual host controller is free; `cat {FOLDER}/status` shows them")]
    Full,
}

/// Where a device is to go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PortChoice {
    /// Anywhere.
    Any,
    /// Into this port.
    Port(u32),
    /// Anywhere but this port.
    NotPort(u32),
}

/// The virtual host controller.
#[derive(Debug, Clone)]
pub struct Vhci {
    folder: PathBuf,
}

impl Vhci {
    /// The first one of this machine.
    ///
    /// # Errors
    /// If there is none.
    pub fn open() -> Result<Self, VhciError> {
        let folder = PathBuf::from(FOLDER);
        if folder.join("attach").exists() { Ok(Self { folder }) } else { Err(VhciError::Absent) }
    }

    /// Plugs a device in; gives the port, and our end of its cable.
    ///
    /// # Errors
    /// If the system refuses, or no such port becomes free in time.
    pub(crate) async fn plug_in(
        &self,
        wish: PortChoice,
        speed: Speed,
    ) -> Result<(u32, UnixStream), VhciError> {
        let refused = |file| move |source| VhciError::Refused { file, source };
        let (ours, kernels) = UnixStream::pair().map_err(refused("attach"))?;
        let deadline = Instant::now() + FREED_WITHIN;
        loop {
            let status = fs::read_to_string(self.folder.join("status")).map_err(refused("status"))?;
            let port = free_ports(&status).find(|port| match wish {
                PortChoice::Any => true,
                PortChoice::Port(wanted) => *port == wanted,
                PortChoice::NotPort(unwanted) => *port != unwanted,
            });
            if let Some(port) = port {
                let order = attach_order(port, kernels.as_fd().as_raw_fd(), speed);
                match fs::write(self.folder.join("attach"), order) {
                    Ok(()) => return Ok((port, ours)),
                    // Somebody else was faster.
                    Err(error) if error.kind() == io::ErrorKind::ResourceBusy => {}
                    Err(error) => return Err(refused("attach")(error)),
                }
            }
            if Instant::now() > deadline {
                return Err(VhciError::Full);
            }
            sleep(LOOK_EVERY).await;
        }
    }
}

/// What is written to `attach`: port, socket, a number for the device, speed.
fn attach_order(port: u32, socket: i32, speed: Speed) -> String {
    // Bus 1, and a device number of the port's own: only people read it, in `status`.
    let device = 1 << 16 | (port + 1);
    format!("{port} {socket} {device} {}", speed as u32)
}

/// Ports for devices up to high speed in which nothing is plugged.
fn free_ports(status: &str) -> impl Iterator<Item = u32> {
    status.lines().filter_map(|line| {
        let mut fields = line.split_whitespace();
        match (fields.next()?, fields.next()?, fields.next()?) {
            ("hs", port, FREE) => port.parse().ok(),
            _ => None,
        }
    })
}

#[cfg(test)]
#[path = "vhci_tests.rs"]
mod tests;
