//! The lab's own library: a folder of drafts, one `.toml` file each.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use tactus_model::effect::Definition;
use tactus_report::discovery::LabEffect;
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

impl LibraryOption {
    /// The library's folder: the named one, else that in the state directory; `None` without either.
    pub(crate) fn folder(&self) -> Option<PathBuf> {
        let of = |variable: &str| env::var_os(variable).filter(|value| !value.is_empty()).map(PathBuf::from);
        let of_service = || of("STATE_DIRECTORY");
        let of_user = || of("XDG_STATE_HOME").map(|state| state.join("tactus"));
        let of_home = || of("HOME").map(|home| home.join(".local/state/tactus"));
        let state = || of_service().or_else(of_user).or_else(of_home);
        self.library.clone().or_else(|| state().map(|state| state.join(FOLDER)))
    }

    /// All drafts of the library, in order of their files' names; none if nobody named a folder and the default is not there.
    ///
    /// # Errors
    /// If the folder or a file cannot be read, if a file is no draft, or if two drafts have one name.
    pub(crate) fn read(&self) -> anyhow::Result<Vec<Held>> {
        match self.folder() {
            Some(folder) if self.library.is_some() || folder.is_dir() => read(&folder),
            _ => Ok(Vec::new()),
        }
    }

    /// The drafts that are in use: neither refuted nor retired.
    ///
    /// # Errors
    /// As [`LibraryOption::read`].
    pub(crate) fn in_use(&self) -> anyhow::Result<Vec<(LabEffect, &'static Definition)>> {
        let in_use = self.read()?.into_iter().filter(|one| one.draft.status.is_in_use());
        let of = |one: Held| {
            let sha256 = sha256::of_file(&one.path)?;
            let effect = LabEffect { name: one.draft.draft.name.clone(), status: one.draft.status, sha256 };
            Ok((effect, one.draft.define()?))
        };
        in_use.map(of).collect()
    }

    /// Puts a draft into the library, whose folder is made if it is the default.
    ///
    /// # Errors
    /// If the file is no draft, if the library has a draft of its name, or if the file cannot be written.
    pub(crate) fn add(&self, file: &Path) -> anyhow::Result<Held> {
        let draft = draft_of(file)?;
        let name = draft.draft.name.clone();
        if let Some(other) = self.read()?.into_iter().find(|other| other.draft.draft.name == name) {
            let problem = format!(
                "the library has a draft {name:?} already: {}; rename that one with `tactus effects rename {name} NEW`, or retire it",
                other.path.display()
            );
            return Err(Failure::new(Exit::Usage, problem).into());
        }
        let folder =
            self.folder().ok_or_else(|| anyhow!("no folder for the library: name one with --library"))?;
        fs::create_dir_all(&folder).with_context(|| format!("{} cannot be made", folder.display()))?;
        let held = Held { path: folder.join(format!("{name}.toml")), draft };
        held.write()?;
        Ok(held)
    }
}

fn read(folder: &Path) -> anyhow::Result<Vec<Held>> {
    let entries = fs::read_dir(folder).with_context(|| format!("{} cannot be read", folder.display()))?;
    let mut paths = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>, std::io::Error>>()?;
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    paths.sort();
    let mut held: Vec<Held> = Vec::new();
    for path in paths {
        let draft = draft_of(&path)?;
        if let Some(other) = held.iter().find(|other| other.draft.draft.name == draft.draft.name) {
            let problem = format!(
                "{}: {} has a draft {:?}, too",
                path.display(),
                other.path.display(),
                draft.draft.name
            );
            return Err(Failure::new(Exit::Usage, problem).into());
        }
        held.push(Held { path, draft });
    }
    Ok(held)
}

fn draft_of(path: &Path) -> anyhow::Result<DraftFile> {
    let text = fs::read_to_string(path).with_context(|| format!("{} cannot be read", path.display()))?;
    let refused = |error| Failure::new(Exit::Usage, format!("{}: {error}", path.display()));
    Ok(DraftFile::from_toml(&text).map_err(refused)?)
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
