//! The recorded runs of a folder: listed and searched, marked with tags and a note, compared, and made again.
//!
//! The recordings alone say what is true. The index beside them is a cache ([`RunsFolder`] makes it), and what people write of a run stands in
//! `notes.toml` beside its recording, which is never changed. The command line and the dashboard have the same runs from here.
//!
//! Everything here blocks.

mod again;
mod compare;
mod error;
mod index;
mod notes;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde_json::{Value, json};

use index::Index;

pub use again::{Again, again};
pub use compare::{Comparison, Fact};
pub use error::RunsError;
pub use index::{RunEntry, ids};
pub use notes::{Notes, beside, tag};

/// Where the installed service records.
pub const INSTALLED: &str = "/var/lib/tactus/runs";

/// A run and what people wrote about it.
#[derive(Debug, Clone, PartialEq)]
pub struct ListedRun {
    /// What its recording says.
    pub entry: RunEntry,
    /// Tags and note.
    pub notes: Notes,
}

/// The runs of a folder.
#[derive(Debug, Default)]
pub struct Runs {
    /// In the order of their start.
    pub runs: Vec<ListedRun>,
    /// Recordings that cannot be read, a sentence each.
    pub unreadable: Vec<String>,
}

/// A folder of recordings. It remembers what it has read, and keeps it in the folder if it may write there.
#[derive(Debug)]
pub struct RunsFolder {
    path: PathBuf,
    known: Mutex<Option<Index>>,
}

impl RunsFolder {
    /// The recordings in a folder and those below it.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Self { path: path.into(), known: Mutex::new(None) }
    }

    /// Reads the runs; those that have not changed since the last time are not read again.
    ///
    /// # Errors
    /// If there is no such folder, or it or the notes of a run cannot be read.
    pub fn runs(&self) -> Result<Runs, RunsError> {
        let folder = &self.path;
        if !folder.is_dir() {
            return Err(RunsError::NoFolder { folder: folder.clone() });
        }
        // What a panic left is a cache, too.
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let before = known.take().unwrap_or_else(|| Index::kept(folder));
        let (now, unreadable) = before.renewed(folder)?;
        let entries = known.insert(now).entries();
        let with_notes = |entry: RunEntry| Ok(ListedRun { notes: notes::read(&entry.path)?, entry });
        Ok(Runs { runs: entries.into_iter().map(with_notes).collect::<Result<_, RunsError>>()?, unreadable })
    }

    /// The run with this id, or the only one whose id contains it.
    ///
    /// # Errors
    /// As [`Self::runs`], and if no run or several have this id.
    pub fn find(&self, id: &str) -> Result<ListedRun, RunsError> {
        self.among(&self.runs()?.runs, id).cloned()
    }

    /// Compares the settings and results of runs, each named as in [`Self::find`].
    ///
    /// # Errors
    /// As [`Self::find`], and if there are fewer than two, or one cannot be read.
    pub fn compare(&self, ids: &[String]) -> Result<Comparison, RunsError> {
        let Runs { runs, .. } = self.runs()?;
        let recording = |id: &String| self.among(&runs, id).map(|run| &run.entry.path);
        compare::compare(&ids.iter().map(recording).collect::<Result<Vec<_>, _>>()?)
    }

    fn among<'a>(&self, runs: &'a [ListedRun], id: &str) -> Result<&'a ListedRun, RunsError> {
        if let Some(exact) = runs.iter().find(|run| run.entry.run_id == id) {
            return Ok(exact);
        }
        let found: Vec<&ListedRun> =
            runs.iter().filter(|run| !id.is_empty() && run.entry.run_id.contains(id)).collect();
        match found[..] {
            [run] => Ok(run),
            [] => Err(RunsError::Unknown { id: id.to_owned(), folder: self.path.clone() }),
            _ => {
                let ids = found.iter().map(|run| run.entry.run_id.clone()).collect();
                Err(RunsError::Several { id: id.to_owned(), ids })
            }
        }
    }
}

/// Puts a text in the place of a file at once. A failure leaves the file as it was.
fn replace(path: &Path, text: &str) -> io::Result<()> {
    let part = path.with_extension(format!("{}.part", std::process::id()));
    fs::write(&part, text).and_then(|()| fs::rename(&part, path)).inspect_err(|_| {
        // An error of the removal would hide the one that matters.
        drop(fs::remove_file(&part));
    })
}

/// Changes the tags and the note of a run.
///
/// # Errors
/// If the file beside the recording cannot be read or written.
pub fn mark(run: ListedRun, change: impl FnOnce(&mut Notes)) -> Result<ListedRun, RunsError> {
    let notes = notes::change(&run.entry.path, change)?;
    Ok(ListedRun { notes, ..run })
}

impl ListedRun {
    /// True if a word stands in anything that is known of the run, whatever its case.
    pub fn contains(&self, word: &str) -> bool {
        let word = word.to_lowercase();
        let Self { entry, notes } = self;
        let status = entry.exit_status.as_deref().unwrap_or("open");
        let texts = [
            &*entry.run_id,
            &entry.experiment,
            &entry.rig,
            &entry.who,
            &entry.started,
            &entry.message,
            status,
            &notes.note,
        ];
        let tags = notes.tags.iter().map(String::as_str);
        texts.into_iter().chain(tags).any(|text| text.to_lowercase().contains(&word))
    }

    /// The run as JSON.
    pub fn to_json(&self) -> Value {
        let mut value = json!(self.entry);
        value["tags"] = json!(self.notes.tags);
        value["note"] = json!(self.notes.note);
        value
    }
}

#[cfg(test)]
#[path = "lib_tests.rs"]
mod tests;
