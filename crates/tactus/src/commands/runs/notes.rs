//! What people write about a run: tags and a note, in a file beside its recording, which is never changed.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::Context;
use serde::{Deserialize, Serialize};

/// Name of the file beside the recording.
const NOTES: &str = "notes.toml";

/// Tags and note of a run.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Notes {
    /// Single words, sorted, each once.
    pub(super) tags: Vec<String>,
    pub(super) note: String,
}

/// The file of a recording.
pub(super) fn beside(recording: &Path) -> PathBuf {
    recording.with_file_name(NOTES)
}

/// The notes of a recording; none if nobody wrote any.
pub(super) fn read(recording: &Path) -> anyhow::Result<Notes> {
    let path = beside(recording);
    let text = match fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Notes::default()),
        Err(error) => return Err(error).with_context(|| path.display().to_string()),
    };
    toml::from_str(&text).with_context(|| path.display().to_string())
}

/// Changes the notes of a recording, and returns them.
pub(super) fn change(recording: &Path, change: impl FnOnce(&mut Notes)) -> anyhow::Result<Notes> {
    let mut notes = read(recording)?;
    change(&mut notes);
    let path = beside(recording);
    let part = path.with_extension(format!("{}.part", std::process::id()));
    let text = toml::to_string(&notes).context("the notes")?;
    let written = fs::write(&part, text).and_then(|()| fs::rename(&part, &path));
    written.with_context(|| path.display().to_string())?;
    Ok(notes)
}
