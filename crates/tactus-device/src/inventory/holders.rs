//! Which programs hold which devices, as `/proc` tells it.
//!
//! Two traces are read, and neither touches a device: locks, which everybody sees, and which our serial ports and
//! human interface devices have; and open files, which a user sees of own processes only, and root of all.

use std::collections::HashMap;
use std::fs;
use std::ops::RangeInclusive;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use rustix::fs::{major, minor};

/// A program that holds a device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Holder {
    /// Its process id.
    pub pid: u32,
    /// Its name, as far as the system keeps it; empty if it has just ended.
    pub name: String,
}

/// Who holds what.
#[derive(Debug)]
pub(super) struct Holders {
    proc: PathBuf,
    /// Process ids by the file's device and number, as the system writes them.
    locks: HashMap<String, u32>,
    /// Process ids by what their open files are.
    open: HashMap<Open, u32>,
}

impl Holders {
    /// What `/proc` tells.
    pub(super) fn read(proc: &Path) -> Self {
        let locks = fs::read_to_string(proc.join("locks")).unwrap_or_default();
        let pids = fs::read_dir(proc).into_iter().flatten().flatten();
        let open = pids.filter_map(|entry| entry.file_name().to_str()?.parse().ok()).flat_map(|pid: u32| {
            let files = fs::read_dir(proc.join(pid.to_string()).join("fd")).into_iter().flatten().flatten();
            files.filter_map(move |file| {
                fs::read_link(file.path()).ok().filter(|node| node.starts_with("/dev"))?;
                Some((Open::at(&file.path())?, pid))
            })
        });
        Self { proc: proc.to_owned(), locks: locks.lines().filter_map(lock).collect(), open: open.collect() }
    }

    /// The program that holds the device at a node, if one is seen to.
    pub(super) fn of(&self, node: &Path) -> Option<Holder> {
        let pid = self.locks.get(&key(node)?).or_else(|| self.open.get(&Open::at(node)?))?;
        let name = fs::read_to_string(self.proc.join(pid.to_string()).join("comm")).unwrap_or_default();
        Some(Holder { pid: *pid, name: name.trim().to_owned() })
    }
}

/// A device as its nodes tell it, of which a container may have its own.
#[derive(Debug, PartialEq, Eq, Hash)]
struct Open {
    device: u64,
    /// Of a pseudo-terminal: each container counts them anew.
    file_system: Option<u64>,
}

impl Open {
    /// `None` for what is no device. Looking at a node does not open it.
    fn at(node: &Path) -> Option<Self> {
        let file = fs::metadata(node).ok()?;
        let device = file.rdev();
        let is_pseudo = PSEUDO_TERMINALS.contains(&major(device));
        (device != 0).then_some(Self { device, file_system: is_pseudo.then_some(file.dev()) })
    }
}

/// Their major numbers.
const PSEUDO_TERMINALS: RangeInclusive<u32> = 136..=143;

/// `1: FLOCK  ADVISORY  WRITE 1234 00:06:567 0 EOF`
fn lock(line: &str) -> Option<(String, u32)> {
    let mut words = line.split_whitespace().skip(1);
    (words.next()? == "FLOCK").then_some(())?;
    let pid = words.nth(2)?.parse().ok()?;
    Some((words.next()?.to_owned(), pid))
}

/// A file as `/proc/locks` tells it.
fn key(node: &Path) -> Option<String> {
    let file = fs::metadata(node).ok()?;
    Some(format!("{:02x}:{:02x}:{}", major(file.dev()), minor(file.dev()), file.ino()))
}

#[cfg(test)]
#[path = "holders_tests.rs"]
mod tests;
