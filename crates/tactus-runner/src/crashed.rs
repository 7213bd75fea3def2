//! Closes the recordings of runs whose service died.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use tactus_record::{Completeness, LastPress, RecordError, Recovery, recover, sync_folder_of, tail};
use tracing::{error, info, warn};

/// A run that was closed as crashed.
#[derive(Debug, Clone)]
pub struct Crashed {
    /// Id of the run.
    pub run_id: String,
    /// Its recording, which is whole now.
    pub recording: PathBuf,
    /// The file as the crash left it, if bytes within it could not be read; otherwise the new one replaces it.
    pub original: Option<PathBuf>,
    /// The last press that was done to its end.
    pub last_press: Option<LastPress>,
    /// The tip as the stage last reported it, robot frame: depth is -z.
    pub tip_mm: Option<[f64; 3]>,
    /// Number of frames in the recording.
    pub frames: u64,
    /// Number of frames that were received and are missing, as far as the others tell.
    pub frames_missing: u64,
}

/// Why a recording could not be closed. It is as it was.
#[derive(Debug, thiserror::Error)]
enum CloseError {
    #[error("cannot {action} {}: {source}", path.display())]
    Io { action: &'static str, path: PathBuf, source: io::Error },
    #[error(transparent)]
    Record(#[from] RecordError),
}

/// Closes as crashed every run below `folder` whose recording has no end, and tells each in the log, with where the tip may
/// stand. A recording that some process writes is left alone, and so is one that cannot be closed; the log says why.
///
/// The recording is replaced only once its closed copy is on disk. If this is interrupted, the next call does the rest.
pub fn close_all(folder: &Path) -> Vec<Crashed> {
    let runs = match fs::read_dir(folder) {
        Ok(runs) => runs,
        // Before the first run.
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Vec::new(),
        Err(error) => {
            error!(folder = %folder.display(), %error, "the recordings were not checked for crashed runs");
            return Vec::new();
        }
    };
    let mut recordings: Vec<PathBuf> =
        runs.flatten().map(|run| run.path().join("recording.mcap")).filter(|path| path.is_file()).collect();
    recordings.sort();
    recordings.iter().filter_map(|path| close_one(path)).collect()
}

/// Closes one recording as [`close_all`] does.
pub(crate) fn close_one(path: &Path) -> Option<Crashed> {
    match close(path) {
        Ok(crashed) => {
            crashed.iter().for_each(tell);
            crashed
        }
        Err(error) => {
            error!(recording = %path.display(), %error, "a run without an end was not closed; `tactus recover` may do it");
            None
        }
    }
}

fn tell(crashed: &Crashed) {
    let last_press = crashed.last_press.map_or_else(|| "none".into(), |press| press.to_string());
    let Crashed { run_id, recording, frames, frames_missing, .. } = crashed;
    let recording = recording.display();
    let tip = crashed.tip_mm.map_or_else(
        || "the stage reported no position".to_owned(),
        |[.., z_mm]| format!("the tip was last reported at z = {z_mm:.3} mm"),
    );
    warn!(
        run = run_id, %recording, frames, frames_missing, last_press,
        "the service died during this run, which is now closed as crashed; {tip}: it MAY STAND IN CONTACT; look at it before \
         `tactus reset`"
    );
}

/// Closes one recording; `None` if it has its end, or if a process is writing it.
fn close(path: &Path) -> Result<Option<Crashed>, CloseError> {
    let error = |action| move |source| CloseError::Io { action, path: path.to_owned(), source };
    if tail::has_end_mark(path)? {
        return Ok(None);
    }
    // For writing, so that a lock over a network is exclusive; nothing is written.
    let file = OpenOptions::new().read(true).write(true).open(path).map_err(error("open"))?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => return Ok(None),
        Err(TryLockError::Error(source)) if source.kind() == io::ErrorKind::Unsupported => {}
        Err(TryLockError::Error(source)) => return Err(error("lock")(source)),
    }
    if tail::run_has_ended(path)? {
        return Ok(None);
    }
    let copy = path.with_extension("closing");
    // Of a closing that was interrupted.
    match fs::remove_file(&copy) {
        Err(source) if source.kind() != io::ErrorKind::NotFound => {
            return Err(error("remove the unfinished copy of")(source));
        }
        _ => {}
    }
    let recovery = match recover(path, &copy) {
        Ok(recovery) => recovery,
        // Its end is there, though the index that leads to it is not.
        Err(RecordError::NothingToRecover { .. }) => return Ok(None),
        Err(unrecovered) => return Err(unrecovered.into()),
    };
    if !recovery.closed {
        info!(recording = %path.display(), damage = %recovery.damage, "a recording is damaged; `tactus recover` repairs it");
        fs::remove_file(&copy).map_err(error("remove the copy of"))?;
        return Ok(None);
    }
    let original = keep_original(path, &recovery)?;
    fs::rename(&copy, path).map_err(error("replace"))?;
    sync_folder_of(path).map_err(error("sync the folder of"))?;
    drop::<File>(file);
    Ok(Some(Crashed {
        run_id: recovery.info.run_id,
        recording: path.to_owned(),
        original,
        last_press: recovery.last_press,
        tip_mm: recovery.tip_mm,
        frames: recovery.info.frames,
        frames_missing: recovery.frames_missing,
    }))
}

/// Keeps a file that is damaged within under a second name. A file that was just cut off holds no more than its copy.
fn keep_original(path: &Path, recovery: &Recovery) -> Result<Option<PathBuf>, CloseError> {
    if !matches!(recovery.damage, Completeness::Damaged(_)) {
        return Ok(None);
    }
    let kept = path.with_extension("damaged.mcap");
    match fs::hard_link(path, &kept) {
        Err(source) if source.kind() != io::ErrorKind::AlreadyExists => {
            Err(CloseError::Io { action: "keep a second name of", path: path.to_owned(), source })
        }
        _ => Ok(Some(kept)),
    }
}

#[cfg(test)]
#[path = "crashed_tests.rs"]
mod tests;
