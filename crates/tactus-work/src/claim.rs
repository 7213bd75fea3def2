//! Which worker has a piece.

use std::{
    fs::{self, File},
    io,
    os::unix::fs::FileExt as _,
    path::{Path, PathBuf},
    process,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
        mpsc::{Receiver, RecvTimeoutError},
    },
    time::{Duration, Instant, SystemTime},
};

use serde::{Deserialize, Serialize};

/// The claims of one worker, in a folder that all workers see.
///
/// A claim is a file `PIECE.NUMBER`, which only one worker can create. It writes into the file again and again while it works. A claim whose
/// text stays the same for its lease is that of a dead worker: whoever creates the file of the next number has the piece from then on.
/// Each worker measures the lease by its own clock, so clocks need not agree.
#[derive(Debug)]
pub struct Claims {
    folder: PathBuf,
    worker: String,
    lease: Duration,
    held: Mutex<Vec<Arc<ClaimFile>>>,
}

/// A claim cannot be made, or not be looked at.
#[derive(Debug, thiserror::Error)]
#[error("{}: {source}", path.display())]
pub struct ClaimError {
    /// The file or folder.
    path: PathBuf,
    /// What the system says.
    source: io::Error,
}

/// What a worker gets that asks for a piece.
#[derive(Debug)]
pub(crate) enum Asked<'a> {
    /// The piece is its own.
    Mine(Claim<'a>),
    /// Another worker has it.
    Taken(Seen),
}

/// The claim of another worker.
#[derive(Debug)]
pub(crate) struct Seen {
    number: u32,
    text: Vec<u8>,
    /// Since when the text has been the same.
    since: Instant,
}

/// A piece is this worker's. Dropped, it is anybody's.
#[derive(Debug)]
pub(crate) struct Claim<'a> {
    claims: &'a Claims,
    piece: String,
    file: Arc<ClaimFile>,
}

#[derive(Debug)]
struct ClaimFile {
    path: PathBuf,
    number: u32,
    file: File,
    renewed: AtomicU64,
}

/// What stands in a claim.
#[derive(Debug, Serialize, Deserialize)]
struct Text<'a> {
    worker: &'a str,
    lease_ms: u64,
    renewed: u64,
}

/// The usual lease. Work goes on for so long without a piece after its worker has died.
pub const LEASE_S: u64 = 60;

/// Renewals in a lease, so that a slow disk or network does not cost the claim.
const RENEWALS: u32 = 4;

impl Claims {
    /// For a new worker.
    pub fn new(folder: impl Into<PathBuf>, lease: Duration) -> Self {
        let since_1970 = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let host = rustix::system::uname().nodename().to_string_lossy().into_owned();
        Self {
            folder: folder.into(),
            // Machines may have one name, and containers one number for their processes.
            worker: format!("{host} {} {}", process::id(), since_1970.as_nanos()),
            lease,
            held: Mutex::default(),
        }
    }

    /// Asks for a piece. `seen` is what was seen of it before.
    pub(crate) fn ask(&self, piece: &str, seen: Option<Seen>) -> Result<Asked<'_>, ClaimError> {
        let (number, stale) = match self.last(piece, None)? {
            None => (0, None),
            Some((number, text)) => match seen.filter(|seen| seen.number == number && seen.text == text) {
                Some(seen) if seen.since.elapsed() >= self.lease_of(&seen) => (number + 1, Some(seen)),
                Some(seen) => return Ok(Asked::Taken(seen)),
                None => return Ok(Asked::Taken(Seen { number, text, since: Instant::now() })),
            },
        };
        let Some(claim) = self.create(piece, number)? else {
            return Ok(Asked::Taken(Seen { number, text: Vec::new(), since: Instant::now() }));
        };
        // What was there a moment ago may be gone, and another worker may have begun anew.
        if self.last(piece, Some(number))? == stale.map(|stale| (stale.number, stale.text)) {
            Ok(Asked::Mine(claim))
        } else {
            Ok(Asked::Taken(Seen { number, text: Vec::new(), since: Instant::now() }))
        }
    }

    /// Renews all claims until the other end is dropped.
    pub(crate) fn renew_until(&self, over: &Receiver<()>) {
        while over.recv_timeout(self.lease / RENEWALS) == Err(RecvTimeoutError::Timeout) {
            for file in self.held().clone() {
                // While it fails, the claim grows stale, and its worker sees that it has lost the piece.
                drop(self.renew(&file).and_then(|()| file.file.sync_data()));
            }
        }
    }

    /// How often it is worth while to look at the claim of another worker.
    pub(crate) fn look_again(&self) -> Duration {
        (self.lease / RENEWALS).min(Duration::from_secs(1))
    }

    /// A claim of this number; `None` if another worker has it.
    fn create(&self, piece: &str, number: u32) -> Result<Option<Claim<'_>>, ClaimError> {
        let path = self.path(piece, number);
        let folder = path.parent().unwrap_or(&self.folder);
        fs::create_dir_all(folder).map_err(at(folder))?;
        let file = match File::create_new(&path) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => return Ok(None),
            Err(error) => return Err(at(&path)(error)),
        };
        let file = Arc::new(ClaimFile { path, number, file, renewed: AtomicU64::new(0) });
        self.held().push(Arc::clone(&file));
        let claim = Claim { claims: self, piece: piece.to_owned(), file };
        self.renew(&claim.file).map_err(at(&claim.file.path))?;
        Ok(Some(claim))
    }

    /// Writes into the file that was created, wherever it is now: never into that of another worker.
    fn renew(&self, file: &ClaimFile) -> io::Result<()> {
        let renewed = file.renewed.fetch_add(1, Ordering::Relaxed);
        let lease_ms = u64::try_from(self.lease.as_millis()).unwrap_or(u64::MAX);
        let text = serde_json::to_vec(&Text { worker: &self.worker, lease_ms, renewed })?;
        file.file.write_all_at(&text, 0)
    }

    /// The claim of the greatest number, but for that of one number.
    fn last(&self, piece: &str, but: Option<u32>) -> Result<Option<(u32, Vec<u8>)>, ClaimError> {
        let numbers = self.numbers(piece)?;
        let Some(number) = numbers.into_iter().filter(|number| Some(*number) != but).max() else {
            return Ok(None);
        };
        let path = self.path(piece, number);
        match fs::read(&path) {
            Ok(text) => Ok(Some((number, text))),
            // Just released.
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(at(&path)(error)),
        }
    }

    /// The numbers of all claims on a piece.
    fn numbers(&self, piece: &str) -> Result<Vec<u32>, ClaimError> {
        let path = self.folder.join(piece);
        let folder = path.parent().unwrap_or(&self.folder);
        let entries = match fs::read_dir(folder) {
            Ok(entries) => entries,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            Err(error) => return Err(at(folder)(error)),
        };
        let start = format!("{}.", path.file_name().unwrap_or_default().to_string_lossy());
        let mut numbers = Vec::new();
        for entry in entries {
            let name = entry.map_err(at(folder))?.file_name();
            numbers.extend(name.to_str().and_then(|name| name.strip_prefix(&start)?.parse::<u32>().ok()));
        }
        Ok(numbers)
    }

    fn path(&self, piece: &str, number: u32) -> PathBuf {
        self.folder.join(format!("{piece}.{number}"))
    }

    /// The lease that a claim states; this worker's for one that has no text yet.
    fn lease_of(&self, seen: &Seen) -> Duration {
        let text: Option<Text<'_>> = serde_json::from_slice(&seen.text).ok();
        text.map_or(self.lease, |text| Duration::from_millis(text.lease_ms))
    }

    fn held(&self) -> std::sync::MutexGuard<'_, Vec<Arc<ClaimFile>>> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Claim<'_> {
    /// True if another worker has taken the piece over, or has even done it.
    pub(crate) fn is_lost(&self) -> Result<bool, ClaimError> {
        Ok(self.claims.numbers(&self.piece)?.into_iter().max() != Some(self.file.number))
    }

    /// Ends the claim on a piece that is done, with those of workers that died in it.
    pub(crate) fn done(self) -> Result<(), ClaimError> {
        let Self { claims, piece, .. } = &self;
        for number in claims.numbers(piece)?.into_iter().filter(|number| *number < self.file.number) {
            // Another worker that has seen that the piece is done may do the same.
            drop(fs::remove_file(claims.path(piece, number)));
        }
        Ok(())
    }
}

impl Drop for Claim<'_> {
    fn drop(&mut self) {
        self.claims.held().retain(|file| !Arc::ptr_eq(file, &self.file));
        // A file that cannot be removed grows stale.
        drop(fs::remove_file(&self.file.path));
    }
}

fn at(path: &Path) -> impl FnOnce(io::Error) -> ClaimError {
    let path = path.to_owned();
    move |source| ClaimError { path, source }
}

#[cfg(test)]
#[path = "claim_tests.rs"]
mod tests;
