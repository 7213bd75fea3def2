//! A small disk in the place of recordings.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A disk of 72 MiB, in memory, which needs root. It is unmounted with this.
#[derive(Debug)]
pub struct SmallDisk(PathBuf);

impl SmallDisk {
    /// Mounts one at a folder, which it makes; `None` if this user may not.
    ///
    /// # Panics
    /// If the folder cannot be made.
    pub fn mount(path: PathBuf) -> Option<Self> {
        fs::create_dir_all(&path).expect("a new folder");
        let mounted =
            Command::new("mount").args(["-t", "tmpfs", "-o", "size=72m", "tmpfs"]).arg(&path).status();
        mounted.is_ok_and(|status| status.success()).then_some(Self(path))
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Takes all the space that is left; returns the file that has it.
    ///
    /// # Panics
    /// If the disk does not get full.
    pub fn fill(&self) -> PathBuf {
        let file = self.0.join("fill");
        fs::write(&file, vec![0; 80 << 20]).expect_err("a full disk");
        file
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        drop(Command::new("umount").arg(&self.0).status());
    }
}
