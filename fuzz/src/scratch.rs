//! Files for what only reads files. `just fuzz` puts them where the system keeps files in memory, and removes them.

use std::path::PathBuf;
use std::{env, fs, process};

/// A folder of this process for files that each input writes anew.
#[derive(Debug)]
pub struct Scratch(PathBuf);

impl Scratch {
    /// Makes the folder, empty.
    ///
    /// # Panics
    /// If it cannot be made.
    pub fn new() -> Self {
        let folder = env::temp_dir().join(format!("tactus-fuzz-{}", process::id()));
        // Of a process before with this number.
        drop(fs::remove_dir_all(&folder));
        fs::create_dir_all(&folder).expect("a folder for files");
        Self(folder)
    }

    /// A path in it where nothing is.
    pub fn free(&self, name: &str) -> PathBuf {
        let path = self.0.join(name);
        drop(fs::remove_file(&path));
        path
    }

    /// A file with these bytes.
    ///
    /// # Panics
    /// If it cannot be written.
    pub fn file(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, bytes).expect("room for a file");
        path
    }
}

impl Default for Scratch {
    fn default() -> Self {
        Self::new()
    }
}
