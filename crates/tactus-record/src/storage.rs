//! Where a recording is written: a file that always ends with a whole record, and disk space in reserve for its end.

use std::{
    fs::{self, File, OpenOptions, TryLockError},
    io::{self, Seek as _, SeekFrom, Write as _},
    os::unix::fs::MetadataExt as _,
    path::{Path, PathBuf},
};

use rustix::{
    fs::{FallocateFlags, fallocate},
    io::Errno,
};

use crate::{RecordError, space::free_bytes};

/// The reserve grows by this much at a time.
const RESERVE_STEP_BYTES: u64 = 1024 * 1024;

/// What a recording is written to.
pub trait Storage: Send {
    /// Appends all of the bytes or none of them: after an error it ends where it ended before.
    ///
    /// # Errors
    /// The system's.
    fn append(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Keeps at least this much space free for the end of the recording.
    ///
    /// # Errors
    /// The system's, if there is not so much space.
    fn keep_reserve(&mut self, bytes: u64) -> io::Result<()>;

    /// Gives up the reserve: the next bytes may use it.
    fn release_reserve(&mut self);

    /// A handle that makes durable what was appended, for another thread.
    ///
    /// # Errors
    /// The system's.
    fn sync_handle(&self) -> io::Result<Box<dyn SyncHandle>>;

    /// Returns once everything is durable and the storage is closed; gives its size in bytes.
    ///
    /// # Errors
    /// The system's, or that the recording is not where it was any more.
    fn close(&mut self) -> Result<u64, RecordError>;
}

/// Makes durable what was appended to a [`Storage`]. It may wait for the disk while others append.
pub trait SyncHandle: Send {
    /// Returns once everything that was appended before is durable.
    ///
    /// # Errors
    /// The system's, or that the recording is not where it was any more.
    fn sync(&mut self) -> Result<(), RecordError>;

    /// Free space, without the reserve.
    ///
    /// # Errors
    /// The system's.
    fn free_bytes(&self) -> io::Result<u64>;
}

/// A file, locked while it is open.
#[derive(Debug)]
pub struct FileStorage {
    place: Place,
    file: File,
    /// Size up to the last whole append.
    bytes: u64,
    /// True if a failed append may have left something behind.
    frayed: bool,
    reserve: Option<File>,
    reserve_bytes: u64,
}

/// A file and the path at which it must stay.
#[derive(Debug, Clone)]
struct Place {
    path: PathBuf,
    device: u64,
    inode: u64,
}

struct FileSync {
    place: Place,
    file: File,
}

impl FileStorage {
    /// Creates the file, and makes its entry in the folder durable. An existing file is never overwritten.
    ///
    /// # Errors
    /// If the file exists or cannot be created.
    pub fn create(path: &Path) -> Result<Self, RecordError> {
        let error = |action| move |source| RecordError::Io { action, path: path.to_owned(), source };
        let file = OpenOptions::new().write(true).create_new(true).open(path).map_err(error("create"))?;
        lock(&file).map_err(error("lock"))?;
        let metadata = file.metadata().map_err(error("look at"))?;
        let place = Place { path: path.to_owned(), device: metadata.dev(), inode: metadata.ino() };
        sync_folder_of(path).map_err(error("sync the folder of"))?;
        Ok(Self { place, file, bytes: 0, frayed: false, reserve: None, reserve_bytes: 0 })
    }

    /// Removes what a failed append left behind.
    fn trim(&mut self) -> io::Result<()> {
        if self.frayed {
            self.file.set_len(self.bytes)?;
            self.file.seek(SeekFrom::Start(self.bytes))?;
            self.frayed = false;
        }
        Ok(())
    }
}

impl Storage for FileStorage {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.trim()?;
        self.frayed = true;
        if let Err(error) = self.file.write_all(bytes) {
            // The next append tries again what fails here.
            drop(self.trim());
            return Err(error);
        }
        self.frayed = false;
        self.bytes += bytes.len() as u64;
        Ok(())
    }

    fn keep_reserve(&mut self, bytes: u64) -> io::Result<()> {
        if bytes <= self.reserve_bytes {
            return Ok(());
        }
        let bytes = bytes.next_multiple_of(RESERVE_STEP_BYTES);
        let file = match self.reserve.take() {
            Some(file) => file,
            None => nameless(&self.place.path.with_extension("reserve"))?,
        };
        let allocated = allocate(&file, self.reserve_bytes, bytes);
        // What there was before stays in reserve.
        self.reserve = Some(file);
        allocated?;
        self.reserve_bytes = bytes;
        Ok(())
    }

    fn release_reserve(&mut self) {
        self.reserve = None;
        self.reserve_bytes = 0;
    }

    fn sync_handle(&self) -> io::Result<Box<dyn SyncHandle>> {
        Ok(Box::new(FileSync { place: self.place.clone(), file: self.file.try_clone()? }))
    }

    fn close(&mut self) -> Result<u64, RecordError> {
        self.release_reserve();
        let path = &self.place.path;
        self.place.check()?;
        let synced = self.file.sync_all().and_then(|()| sync_folder_of(path));
        synced.map_err(|source| RecordError::Io { action: "sync", path: path.clone(), source })?;
        Ok(self.bytes)
    }
}

impl SyncHandle for FileSync {
    fn sync(&mut self) -> Result<(), RecordError> {
        self.place.check()?;
        let Self { place: Place { path, .. }, file } = self;
        file.sync_data().map_err(|source| RecordError::Io { action: "sync", path: path.clone(), source })
    }

    fn free_bytes(&self) -> io::Result<u64> {
        free_bytes(
            self.place
                .path
                .parent()
                .filter(|folder| !folder.as_os_str().is_empty())
                .unwrap_or(Path::new(".")),
        )
    }
}

impl Place {
    /// Checks that the path still leads to the file.
    fn check(&self) -> Result<(), RecordError> {
        let path = self.path.clone();
        match fs::symlink_metadata(&self.path) {
            Ok(found) if (found.dev(), found.ino()) == (self.device, self.inode) => Ok(()),
            Ok(_) => Err(RecordError::Vanished { path }),
            Err(error) if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => {
                Err(RecordError::Vanished { path })
            }
            Err(source) => Err(RecordError::Io { action: "look at", path, source }),
        }
    }
}

/// Marks the file as being written. A file system without locks cannot: then nobody can tell, and nobody waits for it.
fn lock(file: &File) -> io::Result<()> {
    match file.try_lock() {
        Ok(()) => Ok(()),
        Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => Ok(()),
        Err(TryLockError::Error(error)) => Err(error),
        Err(TryLockError::WouldBlock) => Err(io::ErrorKind::WouldBlock.into()),
    }
}

/// Makes the file's name durable: syncs its folder.
///
/// # Errors
/// The system's.
pub fn sync_folder_of(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    File::open(folder.unwrap_or(Path::new(".")))?.sync_all()
}

/// A file that has no name any more: the system frees its space when it is closed, even if the process is killed.
fn nameless(path: &Path) -> io::Result<File> {
    let file = OpenOptions::new().write(true).create(true).truncate(true).open(path)?;
    fs::remove_file(path)?;
    Ok(file)
}

/// Takes the space from one size to the other, on file systems that cannot by writing to it.
fn allocate(mut file: &File, from_bytes: u64, to_bytes: u64) -> io::Result<()> {
    match fallocate(file, FallocateFlags::empty(), from_bytes, to_bytes - from_bytes) {
        Err(Errno::OPNOTSUPP | Errno::NOSYS) => {
            let size = usize::try_from(RESERVE_STEP_BYTES).unwrap_or(usize::MAX);
            // Not zeros: some file systems store those in no space.
            let block: Vec<u8> = (1..=251).cycle().take(size).collect();
            file.seek(SeekFrom::Start(from_bytes))?;
            (from_bytes..to_bytes).step_by(size).try_for_each(|_| file.write_all(&block))
        }
        allocated => allocated.map_err(io::Error::from),
    }
}
