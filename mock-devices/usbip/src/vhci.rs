//! The kernel's virtual host controller, into which devices without hardware are plugged.
//!
//! It takes a socket whose other end answers USB/IP. Any kind of socket will do: one end of a socket pair needs neither a
//! network nor a tool. The kernel keeps its end of the socket; when our end closes, the device is unplugged.
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

/// State of a free port in `status`.
const FREE: &str = "004";

/// The kernel frees a port some time after a device has gone, without notice.
const FREED_WITHIN: Duration = Duration::from_secs(10);
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// Why a device cannot be plugged in.
#[derive(Debug, thiserror::Error)]
pub enum VhciError {
    /// The driver is not loaded.
    #[error(
        "{FOLDER} does not exist: load the kernel's virtual host controller with `modprobe vhci-hcd`, as root; \
         cloud kernels lack it, and `just vm` starts a machine that has it"
    )]
    Absent,
    /// The controller refused.
    #[error("{file} of the virtual host controller: {source}; only root may plug in virtual devices")]
    #[expect(missing_docs, reason = "the message says what each field is")]
    Refused { file: &'static str, source: io::Error },
    /// No port became free in time.
    #[error("no port of the virtual host controller is free; `cat {FOLDER}/status` shows them")]
    Full,
}

/// The port for a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PortChoice {
    /// Any port.
    Any,
    /// This port.
    Port(u32),
    /// Any other port than this.
    NotPort(u32),
}

/// The virtual host controller.
#[derive(Debug, Clone)]
pub struct Vhci {
    folder: PathBuf,
}

impl Vhci {
    /// The first controller of this machine.
    ///
    /// # Errors
    /// If there is none.
    pub fn open() -> Result<Self, VhciError> {
        let folder = PathBuf::from(FOLDER);
        if folder.join("attach").exists() { Ok(Self { folder }) } else { Err(VhciError::Absent) }
    }

    /// Plugs a device in. Returns the port, and our end of the socket pair.
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
                    // Another program took the port first.
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

/// The line for `attach`: port, socket, device number, speed.
fn attach_order(port: u32, socket: i32, speed: Speed) -> String {
    // Bus 1 and a number derived from the port; it is only shown in `status`.
    let device = 1 << 16 | (port + 1);
    format!("{port} {socket} {device} {}", speed as u32)
}

/// Free ports for devices up to high speed.
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
