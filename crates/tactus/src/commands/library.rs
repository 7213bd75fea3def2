//! The lab's own library: a folder of drafts, one `.toml` file each.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;
use tactus_model::effect::Definition;
use tactus_schema::DraftFile;

use crate::exit::{Exit, Failure};

/// A draft and its file.
pub(crate) struct Held {
    pub(crate) path: PathBuf,
    pub(crate) draft: DraftFile,
}

/// All drafts of a folder, in order of their files' names.
///
/// # Errors
/// If the folder or a file cannot be read, if a file is no draft, or if two drafts have one name.
pub(crate) fn read(folder: &Path) -> anyhow::Result<Vec<Held>> {
    let entries = fs::read_dir(folder).with_context(|| format!("{} cannot be read", folder.display()))?;
    let mut paths = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>, std::io::Error>>()?;
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    paths.sort();
    let mut held: Vec<Held> = Vec::new();
    for path in paths {
        let text = fs::read_to_string(&path).with_context(|| format!("{} cannot be read", path.display()))?;
        let refused = |problem: String| Failure::new(Exit::Usage, format!("{}: {problem}", path.display()));
        let draft = DraftFile::from_toml(&text).map_err(|error| refused(error.to_string()))?;
        if let Some(other) = held.iter().find(|other| other.draft.draft.name == draft.draft.name) {
            let problem = format!("{} has a draft {:?}, too", other.path.display(), draft.draft.name);
            return Err(refused(problem).into());
        }
        held.push(Held { path, draft });
    }
    Ok(held)
}

/// The drafts of a folder that are in use: neither refuted nor retired.
///
/// # Errors
/// As [`read`].
pub(crate) fn in_use(folder: &Path) -> anyhow::Result<Vec<&'static Definition>> {
    let held = read(folder)?;
    let in_use = held.iter().filter(|one| one.draft.status.is_in_use());
    Ok(in_use.map(|one| one.draft.define()).collect::<Result<_, _>>()?)
}

impl Held {
    /// Writes the draft, first beside its place, so that the file is never half of one.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub(crate) fn write(&self) -> anyhow::Result<()> {
        let beside = self.path.with_extension("toml.new");
        let text = self.draft.to_toml().context("the draft")?;
        fs::write(&beside, text).with_context(|| format!("{} cannot be written", beside.display()))?;
        fs::rename(&beside, &self.path).with_context(|| format!("{} cannot be written", self.path.display()))
    }
}
