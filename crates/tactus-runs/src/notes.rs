//! What people write about a run: tags and a note, in a file beside its recording, which is never changed.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::RunsError;

/// Name of the file beside the recording.
const NOTES: &str = "notes.toml";

/// Tags and note of a run.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Notes {
    /// Single words, sorted, each once.
    pub tags: Vec<String>,
    /// Any text.
    pub note: String,
}

impl Notes {
    /// Puts these tags in the place of all.
    pub fn set_tags(&mut self, mut tags: Vec<String>) {
        tags.sort();
        tags.dedup();
        self.tags = tags;
    }
}

/// The file of a recording.
pub fn beside(recording: &Path) -> PathBuf {
    recording.with_file_name(NOTES)
}

/// The notes of a recording; none if nobody wrote any.
pub(crate) fn read(recording: &Path) -> Result<Notes, RunsError> {
    let path = beside(recording);
    let text = match fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Notes::default()),
        Err(source) => return Err(RunsError::Io { action: "read", path, source }),
    };
    toml::from_str(&text).map_err(|source| RunsError::Notes { path, source })
}

/// Changes the notes of a recording, and returns them.
pub(crate) fn change(recording: &Path, change: impl FnOnce(&mut Notes)) -> Result<Notes, RunsError> {
    let mut notes = read(recording)?;
    change(&mut notes);
    let path = beside(recording);
    let text = match toml::to_string(&notes) {
        Ok(text) => text,
        Err(source) => return Err(RunsError::Unwritable { path, source }),
    };
    crate::replace(&path, &text).map_err(|source| RunsError::Io { action: "write", path, source })?;
    Ok(notes)
}

/// Refuses what is no tag: it must be found again.
///
/// # Errors
/// What a tag is.
pub fn tag(text: &str) -> Result<String, String> {
    let is_plain = !text.is_empty() && !text.chars().any(|c| c.is_whitespace() || c.is_control());
    if is_plain { Ok(text.to_owned()) } else { Err("a tag is one word".to_owned()) }
}
