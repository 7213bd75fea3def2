//! The folder of a discovery, which appears as a whole or not at all.

use std::path::{Path, PathBuf};
use std::{fs, process};

use anyhow::{Context, ensure};

use crate::interrupt::Unfinished;

/// A folder that takes the place of another once its files are complete. Until then nothing of it is in the other.
pub(super) struct UnfinishedFolder {
    /// Where the files belong.
    out: PathBuf,
    beside: Unfinished,
}

impl UnfinishedFolder {
    /// Makes the folder `OUT.partial-<pid>`. If `out` exists, it is `partial-<pid>` in there: `out` may be a file system of its own.
    pub(super) fn create(out: &Path) -> anyhow::Result<Self> {
        ensure!(!out.exists() || out.is_dir(), "{} is not a folder", out.display());
        let name = format!("partial-{}", process::id());
        let beside = if out.is_dir() { out.join(name) } else { with_extension(out, &name) };
        let beside = Unfinished::create(beside.clone()).with_context(|| beside.display().to_string())?;
        Ok(Self { out: out.to_owned(), beside })
    }

    pub(super) fn path(&self) -> &Path {
        self.beside.path()
    }

    /// Moves the files to where they belong; replaces those of an earlier discovery. Of its files that this one lacks, `is_stale` tells by
    /// their names which are removed.
    pub(super) fn finish(self, is_stale: impl Fn(&str) -> bool) -> anyhow::Result<()> {
        let Self { out, beside } = &self;
        beside
            .finish(|beside| {
                if !out.exists() {
                    return fs::rename(beside, out);
                }
                let mut new = Vec::new();
                for file in fs::read_dir(beside)? {
                    let file = file?;
                    fs::rename(file.path(), out.join(file.file_name()))?;
                    new.push(file.file_name());
                }
                for file in fs::read_dir(out)? {
                    let file = file?;
                    let name = file.file_name();
                    if !new.contains(&name) && name.to_str().is_some_and(&is_stale) {
                        fs::remove_file(file.path())?;
                    }
                }
                fs::remove_dir(beside)
            })
            .with_context(|| out.display().to_string())
    }
}

/// The same path with `.extension` at its end.
fn with_extension(path: &Path, extension: &str) -> PathBuf {
    // Without a slash at the end.
    let mut longer = path.components().as_path().as_os_str().to_owned();
    longer.push(".");
    longer.push(extension);
    longer.into()
}

#[cfg(test)]
#[path = "unfinished_tests.rs"]
mod tests;
