//! The runs of a folder. A file beside them keeps what was read, so that only new and changed recordings are read again. It is a cache:
//! the recordings alone say what is true, and whoever deletes it loses only time.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use serde::{Deserialize, Serialize};
use tactus_record::{Completeness, Info, meter};

use crate::RunsError;

/// Name of the cache in the folder.
pub(crate) const INDEX: &str = ".tactus-runs.json";

/// Name of the cache's form; another one is not read.
const SCHEMA: &str = "tactus.runs/1";

/// Folders below the folder of recordings that are searched: `runs/<set>/<run id>`.
const DEPTH_MAX: usize = 3;

/// What is listed of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunEntry {
    /// Its recording.
    pub path: PathBuf,
    /// Id of the run.
    pub run_id: String,
    /// Name of the experiment.
    pub experiment: String,
    /// Name of the rig.
    pub rig: String,
    /// Who started it.
    pub who: String,
    /// True if no physical sensor was read.
    pub simulated: bool,
    /// The earlier run that it goes on with.
    pub continues: Option<String>,
    /// When it began, RFC 3339, UTC.
    pub started: String,
    /// From the first message to the last.
    pub duration_s: f64,
    /// `None` while the run is in progress, or if its recording was never closed.
    pub exit_status: Option<String>,
    /// The run's final message.
    pub message: String,
    /// Frames in the recording.
    pub frames: u64,
    /// Frames that never arrived.
    pub frames_lost: u64,
    /// Frames that arrived and are not in the recording.
    pub frames_missing: u64,
    /// Completed presses.
    pub presses: u32,
    /// Completed dwells.
    pub dwells: u32,
    /// False if the file is cut off or damaged.
    pub is_whole: bool,
}

/// The recordings of a folder, as they were when they were read.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(crate) struct Index {
    schema: String,
    /// By path relative to the folder.
    recordings: BTreeMap<PathBuf, Known>,
}

/// A recording as it was when it was read.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Known {
    bytes: u64,
    modified_ns: u128,
    entry: RunEntry,
}

impl Index {
    /// The cache in a folder; empty if there is none that can be read.
    pub(crate) fn kept(folder: &Path) -> Self {
        let bytes = fs::read(folder.join(INDEX)).ok();
        bytes
            .and_then(|bytes| serde_json::from_slice(&bytes).ok())
            .filter(|index: &Self| index.schema == SCHEMA)
            .unwrap_or_default()
    }

    /// The same for what is in the folder now, kept there too, and a sentence for each recording that cannot be read.
    pub(crate) fn renewed(&self, folder: &Path) -> Result<(Self, Vec<String>), RunsError> {
        let (mut files, mut unreadable) = (Vec::new(), Vec::new());
        search(folder, DEPTH_MAX, &mut files)?;
        let mut now = Self { schema: SCHEMA.to_owned(), recordings: BTreeMap::new() };
        let mut changed = Vec::new();
        for file in files {
            let Some(state) = state_of(&file) else { continue };
            let key = file.strip_prefix(folder).unwrap_or(&file).to_owned();
            let known = self.recordings.get(&key);
            if let Some(known) = known.filter(|known| (known.bytes, known.modified_ns) == state).cloned() {
                let entry = RunEntry { path: file, ..known.entry };
                now.recordings.insert(key, Known { entry, ..known });
            } else {
                meter::will_read(&file, &[1.0]);
                changed.push((key, file, state));
            }
        }
        let is_news = !changed.is_empty();
        for (key, file, (bytes, modified_ns)) in changed {
            match tactus_record::info(&file) {
                Ok(info) => {
                    let entry = RunEntry::of(file, info);
                    now.recordings.insert(key, Known { bytes, modified_ns, entry });
                }
                Err(error) => unreadable.push(error.to_string()),
            }
        }
        if is_news || now.recordings.len() != self.recordings.len() {
            keep(&folder.join(INDEX), &now);
        }
        Ok((now, unreadable))
    }

    /// The runs in the order of their start.
    pub(crate) fn entries(&self) -> Vec<RunEntry> {
        let mut entries: Vec<RunEntry> = self.recordings.values().map(|known| known.entry.clone()).collect();
        entries.sort_by(|one, other| (&one.started, &one.run_id).cmp(&(&other.started, &other.run_id)));
        entries
    }
}

/// Without it everything is read again, so a folder that cannot be written costs only time.
fn keep(path: &Path, index: &Index) {
    let Ok(text) = serde_json::to_string(index) else { return };
    if let Err(error) = crate::replace(path, &text) {
        tracing::debug!(%error, path = %path.display(), "the index of runs is not kept");
    }
}

/// Ids of the runs of a folder, as their own folders are named; none if it cannot be read. No recording is opened.
pub fn ids(folder: &Path) -> Vec<String> {
    let mut files = Vec::new();
    if search(folder, DEPTH_MAX, &mut files).is_err() {
        return Vec::new();
    }
    let names = files.iter().filter_map(|file| file.parent()?.file_name());
    names.map(|name| name.to_string_lossy().into_owned()).collect()
}

/// Recordings in a folder and those below it.
fn search(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) -> Result<(), RunsError> {
    let failed = |source| RunsError::Io { action: "read", path: folder.to_owned(), source };
    for entry in fs::read_dir(folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let (path, kind) = (entry.path(), entry.file_type().map_err(failed)?);
        if kind.is_dir() && depth > 0 {
            search(&path, depth - 1, found)?;
        } else if kind.is_file() && path.extension().is_some_and(|extension| extension == "mcap") {
            found.push(path);
        }
    }
    Ok(())
}

/// Size and time of the last change.
fn state_of(file: &Path) -> Option<(u64, u128)> {
    let metadata = fs::metadata(file).ok()?;
    let modified = metadata.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
    Some((metadata.len(), modified.as_nanos()))
}

impl RunEntry {
    fn of(path: PathBuf, info: Info) -> Self {
        Self {
            path,
            is_whole: info.completeness == Completeness::Complete,
            run_id: info.run_id,
            experiment: info.experiment,
            rig: info.rig,
            who: info.who,
            simulated: info.simulated,
            continues: info.continues,
            started: info.started,
            duration_s: info.duration_s,
            exit_status: info.exit_status.map(str::to_owned),
            message: info.message,
            frames: info.frames,
            frames_lost: info.frames_lost,
            frames_missing: info.frames_missing,
            presses: info.presses,
            dwells: info.dwells,
        }
    }
}
