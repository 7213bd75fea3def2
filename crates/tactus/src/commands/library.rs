//! The lab's own library: a folder of drafts, one `.toml` file each.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use tactus_model::Array;
use tactus_model::effect::Draft;
use tactus_report::discovery::LabEffect;
use tactus_runner::state;
use tactus_schema::DraftFile;

use crate::cli::LibraryOption;
use crate::exit::{Exit, Failure};
use crate::sha256;

/// Name of the library's folder in the state directory.
const FOLDER: &str = "effects";

/// A draft and its file.
pub(crate) struct Held {
    pub(crate) path: PathBuf,
    pub(crate) draft: DraftFile,
}

/// A file of the library that is no draft of it.
pub(crate) struct Refused {
    pub(crate) path: PathBuf,
    pub(crate) problem: String,
}

/// What the library's folder holds.
#[derive(Default)]
pub(crate) struct Library {
    /// The drafts, in order of their files' names.
    pub(crate) held: Vec<Held>,
    /// Files that cannot be read, are no drafts, or have the name of an earlier one.
    pub(crate) refused: Vec<Refused>,
}

impl LibraryOption {
    /// The library's folder: the named one, else that in the state directory; `None` without either.
    pub(crate) fn folder(&self) -> Option<PathBuf> {
        self.library.clone().or_else(|| state::folder().map(|state| state.join(FOLDER)))
    }

    /// What is in the library; nothing if its folder is not there.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub(crate) fn read(&self) -> anyhow::Result<Library> {
        self.folder()
            .filter(|folder| folder.exists())
            .map_or_else(|| Ok(Library::default()), |folder| read(&folder))
    }

    /// A warning if somebody named a folder that is not there.
    pub(crate) fn is_missing(&self) -> Option<String> {
        let folder = self.library.as_ref().filter(|folder| !folder.exists())?;
        Some(format!("the library {} is not there, so no draft of it was tried", folder.display()))
    }

    /// The drafts that are in use: neither refuted nor retired.
    ///
    /// # Errors
    /// If the folder or a file of it cannot be read, if a file is no draft, or if two drafts have one name.
    pub(crate) fn in_use(&self) -> anyhow::Result<Vec<Held>> {
        let Library { mut held, refused } = self.read()?;
        if let Some(Refused { path, problem }) = refused.first() {
            let folder = path.parent().unwrap_or(path).display();
            let what = format!("{}: {problem}; correct it or move it out of {folder}", path.display());
            return Err(Failure::new(Exit::Usage, what).into());
        }
        held.retain(|one| one.draft.status.is_in_use());
        Ok(held)
    }

    /// Puts a draft into the library, whose folder is made if it is not there.
    ///
    /// # Errors
    /// If the file is no draft, if the library has a draft or a file of its name, or if the file cannot be written.
    pub(crate) fn add(&self, file: &Path) -> anyhow::Result<Held> {
        let draft = draft_of(file)?;
        let name = draft.draft.name.clone();
        let held = self.read()?.held;
        if let Some(other) = held.iter().find(|other| other.draft.draft.name == name) {
            let problem = format!(
                "the library has a draft {name:?} already: {}; give that one another name first: `tactus effects rename {name} NEW`",
                other.path.display()
            );
            return Err(Failure::new(Exit::Usage, problem).into());
        }
        let folder =
            self.folder().ok_or_else(|| anyhow!("no folder for the library: name one with --library"))?;
        let path = folder.join(format!("{name}.toml"));
        if path.exists() {
            let problem =
                format!("{} is there already and is no draft {name:?}: move it away", path.display());
            return Err(Failure::new(Exit::Usage, problem).into());
        }
        fs::create_dir_all(&folder).with_context(|| format!("{} cannot be made", folder.display()))?;
        let held = Held { path, draft };
        held.write()?;
        Ok(held)
    }
}

fn read(folder: &Path) -> anyhow::Result<Library> {
    let entries = fs::read_dir(folder).with_context(|| format!("{} cannot be read", folder.display()))?;
    let mut paths = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>, std::io::Error>>()?;
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    paths.sort();
    let mut library = Library::default();
    for path in paths {
        let of_name = |name: &str| library.held.iter().find(|other| other.draft.draft.name == name);
        match parsed(&path) {
            Err(problem) => library.refused.push(Refused { path, problem }),
            Ok(draft) => match of_name(&draft.draft.name) {
                Some(other) => {
                    let name = &draft.draft.name;
                    let problem = format!("{} has a draft {name:?}, too", other.path.display());
                    library.refused.push(Refused { path, problem });
                }
                None => library.held.push(Held { path, draft }),
            },
        }
    }
    Ok(library)
}

fn draft_of(path: &Path) -> anyhow::Result<DraftFile> {
    let refused = |problem| Failure::new(Exit::Usage, format!("{}: {problem}", path.display()));
    Ok(parsed(path).map_err(refused)?)
}

/// The draft of a file.
///
/// # Errors
/// What is wrong, without the file's name.
fn parsed(path: &Path) -> Result<DraftFile, String> {
    let bytes = fs::read(path).map_err(|error| format!("cannot be read: {error}"))?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let intact = error.utf8_error().valid_up_to();
        let line = 1 + String::from_utf8_lossy(&error.as_bytes()[..intact]).matches('\n').count();
        format!("line {line}: no text (UTF-8)")
    })?;
    DraftFile::from_toml(&text).map_err(|error| error.to_string())
}

/// The version of a draft: a checksum of what it is, without its name and what became of it.
///
/// # Errors
/// If the draft holds values that no file can.
pub(crate) fn version(draft: &Draft) -> anyhow::Result<String> {
    Ok(sha256::of_text(&DraftFile::versioned(draft).with_context(|| draft.name.clone())?))
}

impl Held {
    /// The draft as a report names it.
    ///
    /// # Errors
    /// If the draft holds values that no file can.
    pub(crate) fn for_report(&self) -> anyhow::Result<LabEffect> {
        let DraftFile { draft, status, .. } = &self.draft;
        Ok(LabEffect { name: draft.name.clone(), status: *status, version: version(draft)? })
    }

    /// A warning if the draft is of another array than the data.
    pub(crate) fn of_another_array(&self, array: &Array) -> Option<String> {
        let error = self.draft.draft.fits(array).err()?;
        Some(format!("{}: {error}; it is of another array, and was not tried", self.path.display()))
    }

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

#[cfg(test)]
#[path = "library_tests.rs"]
mod tests;
