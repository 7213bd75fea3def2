//! Which programs have which devices open, as `/proc` shows it.
//!
//! Two lists are read, and neither touches a device. Locks are visible to every user; Tactus locks its serial ports and
//! human interface devices. Open files are visible for a user's own processes only, and to root for all.

use std::collections::HashMap;
use std::fs;
use std::ops::RangeInclusive;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use rustix::fs::{major, minor};

/// A program that has a device open.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Holder {
    /// Its process id.
    pub pid: u32,
    /// Its name, which Linux cuts to 15 characters; empty if it has just ended.
    pub name: String,
}

/// The programs that have devices open.
#[derive(Debug)]
pub(super) struct Holders {
    proc: PathBuf,
    /// Process ids by the locked file's device and inode, as `/proc/locks` writes them.
    locks: HashMap<String, u32>,
    /// Process ids by the devices that their open files are.
    open: HashMap<OpenDevice, u32>,
}

impl Holders {
    /// Reads `/proc`; what cannot be read is left out.
    pub(super) fn read(proc: &Path) -> Self {
        let locks = fs::read_to_string(proc.join("locks")).unwrap_or_default();
        let pids = fs::read_dir(proc).into_iter().flatten().flatten();
        let open = pids.filter_map(|entry| entry.file_name().to_str()?.parse().ok()).flat_map(|pid: u32| {
            let files = fs::read_dir(proc.join(pid.to_string()).join("fd")).into_iter().flatten().flatten();
            files.filter_map(move |file| {
                fs::read_link(file.path()).ok().filter(|node| node.starts_with("/dev"))?;
                Some((OpenDevice::at(&file.path())?, pid))
            })
        });
        Self { proc: proc.to_owned(), locks: locks.lines().filter_map(lock).collect(), open: open.collect() }
    }

    /// The program that has the device at a node open, as far as this user can see.
    pub(super) fn of(&self, node: &Path) -> Option<Holder> {
        let pid = self.locks.get(&key(node)?).or_else(|| self.open.get(&OpenDevice::at(node)?))?;
        let name = fs::read_to_string(self.proc.join(pid.to_string()).join("comm")).unwrap_or_default();
        Some(Holder { pid: *pid, name: name.trim().to_owned() })
    }
}

/// A device by its numbers. A container may have nodes of its own for it.
#[derive(Debug, PartialEq, Eq, Hash)]
struct OpenDevice {
    device: u64,
    /// For a pseudo-terminal, whose numbers start again in each container.
    file_system: Option<u64>,
}

impl OpenDevice {
    /// `None` if the node is no device. The node is not opened.
    fn at(node: &Path) -> Option<Self> {
        let file = fs::metadata(node).ok()?;
        let device = file.rdev();
        let is_pseudo = PSEUDO_TERMINALS.contains(&major(device));
        (device != 0).then_some(Self { device, file_system: is_pseudo.then_some(file.dev()) })
    }
}

/// Major device numbers of pseudo-terminals.
const PSEUDO_TERMINALS: RangeInclusive<u32> = 136..=143;

/// Parses a line such as `1: FLOCK  ADVISORY  WRITE 1234 00:06:567 0 EOF`.
fn lock(line: &str) -> Option<(String, u32)> {
    let mut words = line.split_whitespace().skip(1);
    (words.next()? == "FLOCK").then_some(())?;
    let pid = words.nth(2)?.parse().ok()?;
    Some((words.next()?.to_owned(), pid))
}

/// A file's device and inode, in the form of `/proc/locks`.
fn key(node: &Path) -> Option<String> {
    let file = fs::metadata(node).ok()?;
    Some(format!("{:02x}:{:02x}:{}", major(file.dev()), minor(file.dev()), file.ino()))
}

#[cfg(test)]
#[path = "holders_tests.rs"]
mod tests;
