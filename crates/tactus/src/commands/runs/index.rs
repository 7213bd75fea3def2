//! The runs of a folder. A file beside them keeps what was read, so that only new and changed recordings are read again. It is a cache:
//! the recordings alone say what is true, and whoever deletes it loses only time.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use anyhow::Context;
use serde::{Deserialize, Serialize};
use tactus_record::{Completeness, Info};

/// Name of the cache in the folder.
pub(super) const INDEX: &str = ".tactus-runs.json";

/// Name of the cache's form; another one is not read.
const SCHEMA: &str = "tactus.runs/1";

/// Folders below the folder of recordings that are searched: `runs/<set>/<run id>`.
const DEPTH_MAX: usize = 3;

/// What is listed of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct RunEntry {
    pub(super) path: PathBuf,
    pub(super) run_id: String,
    pub(super) experiment: String,
    pub(super) rig: String,
    pub(super) who: String,
    pub(super) simulated: bool,
    pub(super) continues: Option<String>,
    pub(super) started: String,
    pub(super) duration_s: f64,
    /// `None` while the run is in progress, or if its recording was never closed.
    pub(super) exit_status: Option<String>,
    pub(super) message: String,
    pub(super) frames: u64,
    pub(super) frames_lost: u64,
    pub(super) frames_missing: u64,
    pub(super) presses: u32,
    pub(super) dwells: u32,
    /// False if the file is cut off or damaged.
    pub(super) is_whole: bool,
}

#[derive(Debug, Default, Serialize, Deserialize)]
struct Index {
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

/// All runs whose recordings can be read, in the order of their start; the others are named on standard error.
pub(super) fn entries(folder: &Path) -> anyhow::Result<Vec<RunEntry>> {
    let path = folder.join(INDEX);
    let before: Index = fs::read(&path)
        .ok()
        .and_then(|bytes| serde_json::from_slice(&bytes).ok())
        .filter(|index: &Index| index.schema == SCHEMA)
        .unwrap_or_default();
    let mut files = Vec::new();
    search(folder, DEPTH_MAX, &mut files)?;
    let mut now = Index { schema: SCHEMA.to_owned(), recordings: BTreeMap::new() };
    let mut is_news = false;
    for file in files {
        let key = file.strip_prefix(folder).unwrap_or(&file).to_owned();
        let Some((bytes, modified_ns)) = state_of(&file) else { continue };
        let known = before.recordings.get(&key);
        let known = known.filter(|known| (known.bytes, known.modified_ns) == (bytes, modified_ns)).cloned();
        let known = if let Some(Known { entry, .. }) = known {
            Known { bytes, modified_ns, entry: RunEntry { path: file, ..entry } }
        } else {
            is_news = true;
            match tactus_record::info(&file) {
                Ok(info) => Known { bytes, modified_ns, entry: RunEntry::of(file, info) },
                Err(error) => {
                    eprintln!("tactus: {error}");
                    continue;
                }
            }
        };
        now.recordings.insert(key, known);
    }
    if is_news || now.recordings.len() != before.recordings.len() {
        keep(&path, &now);
    }
    let mut entries: Vec<RunEntry> = now.recordings.into_values().map(|known| known.entry).collect();
    entries.sort_by(|one, other| (&one.started, &one.run_id).cmp(&(&other.started, &other.run_id)));
    Ok(entries)
}

/// Without it everything is read again, so a folder that cannot be written costs only time.
fn keep(path: &Path, index: &Index) {
    let Ok(text) = serde_json::to_string(index) else { return };
    let beside = path.with_extension(format!("{}.part", std::process::id()));
    let kept = fs::write(&beside, text).and_then(|()| fs::rename(&beside, path));
    if let Err(error) = kept {
        tracing::debug!(%error, path = %path.display(), "the index of runs is not kept");
        drop(fs::remove_file(&beside));
    }
}

/// Recordings in a folder and those below it.
fn search(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) -> anyhow::Result<()> {
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let entry = entry.with_context(|| folder.display().to_string())?;
        let (path, kind) = (entry.path(), entry.file_type()?);
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
