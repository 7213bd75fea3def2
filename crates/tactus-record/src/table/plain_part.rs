//! Writes any file beside its path until it is complete.

use std::{
    fs::{self, File},
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use super::TableError;

/// A file that has the suffix `.part` until it is complete.
pub(super) struct PlainPart {
    path: PathBuf,
    beside: PathBuf,
    file: BufWriter<File>,
}

impl PlainPart {
    pub(super) fn create(path: PathBuf) -> Result<Self, TableError> {
        let mut beside = path.clone().into_os_string();
        beside.push(".part");
        let beside = PathBuf::from(beside);
        match File::create(&beside) {
            Ok(file) => Ok(Self { path, beside, file: BufWriter::new(file) }),
            Err(source) => Err(TableError::Io { action: "create", path: beside, source }),
        }
    }

    /// The path of the complete file.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn write(
        &mut self,
        write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
    ) -> Result<(), TableError> {
        write(&mut self.file).map_err(|source| TableError::Io {
            action: "write",
            path: self.beside.clone(),
            source,
        })
    }

    /// Closes the file and moves it to its path.
    pub(super) fn finish(mut self) -> Result<(), TableError> {
        self.write(|file| file.flush().and_then(|()| file.get_ref().sync_all()))?;
        let Self { path, beside, .. } = self;
        fs::rename(&beside, &path).map_err(|source| TableError::Io { action: "write", path, source })
    }

    /// Removes what was written so far.
    pub(super) fn abandon(self) {
        // An error of the removal would hide the one that matters.
        drop(fs::remove_file(&self.beside));
    }
}
