//! Selects the device that a rig file identifies.

use std::fmt::Display;

use tactus_schema::rig::UsbIdentity;

use crate::{DeviceError, ErrorKind};

/// A connected device that may match an identity.
pub(super) trait Candidate {
    /// Vendor and product id.
    fn vid_pid(&self) -> (u16, u16);

    /// The serial number, if it has one.
    fn serial(&self) -> Option<&str>;

    /// Its node in `/dev`, for messages.
    fn place(&self) -> String;
}

/// The only candidate with this identity. The error for several ends with `apart`, which says how to distinguish them.
pub(super) fn the_one<T: Candidate>(
    device: impl Display,
    identity: &UsbIdentity,
    candidates: Vec<T>,
    apart: &str,
) -> Result<T, DeviceError> {
    let (alike, others): (Vec<T>, Vec<T>) = candidates.into_iter().partition(|candidate| {
        let (vid, pid) = candidate.vid_pid();
        identity.is_of(vid, pid, candidate.serial())
    });
    let list = |candidates: &[T]| {
        let names = candidates.iter().map(|candidate| match candidate.serial() {
            Some(serial) => format!("serial number {serial:?} at {}", candidate.place()),
            None => format!("no serial number at {}", candidate.place()),
        });
        names.collect::<Vec<_>>().join("; ")
    };
    if alike.len() > 1 {
        let what = format!("{} devices are {identity}: {}. {apart}", alike.len(), list(&alike));
        return Err(DeviceError::new(device, ErrorKind::WrongDevice, what));
    }
    alike.into_iter().next().ok_or_else(|| {
        let UsbIdentity { vid, pid, .. } = *identity;
        let others: Vec<T> = others.into_iter().filter(|other| other.vid_pid() == (vid, pid)).collect();
        if others.is_empty() {
            return DeviceError::new(device, ErrorKind::Absent, ABSENT);
        }
        let what = format!(
            "{vid:04x}:{pid:04x} is there, but with another serial number: {}. Is it the right device? Then put \
             the serial number right in the rig file",
            list(&others)
        );
        DeviceError::new(device, ErrorKind::WrongDevice, what)
    })
}

pub(super) const ABSENT: &str =
    "there is no such device: is it plugged in and switched on? `tactus devices` shows what is there";

/// Advice for a node of `/dev` that this user may not open. `rule` is the udev rule that matches the device.
pub(super) fn permission(node: impl Display, rule: &str) -> String {
    format!(
        "this user may not open {node}: the rules of Tactus, /etc/udev/rules.d/70-tactus.rules, need the line \
         `{rule}, MODE=\"0660\", GROUP=\"dialout\", TAG+=\"uaccess\"`; load them as root with \
         `udevadm control --reload && udevadm trigger`, and be a member of that group or log in at the machine itself"
    )
}

#[cfg(test)]
#[path = "identity_tests.rs"]
mod tests;
