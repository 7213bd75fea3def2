//! The covering in place, kept in a file beyond the end of the service: among the recordings, and in the state directory, because people move
//! recordings.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tactus_engine::CoveringMemory;
use tactus_schema::Rig;

use crate::state;

/// Format of the file, in its key `schema`.
const SCHEMA: &str = "tactus.covering/1";

/// The files' folder in the state directory.
const FOLDER: &str = "coverings";

/// A TOML file that holds the thickness of the covering in place, and perhaps a copy of it. The thinner of the two counts.
#[derive(Debug, Clone)]
pub struct CoveringFile {
    path: PathBuf,
    copy: Option<PathBuf>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Content {
    schema: String,
    thickness_mm: f64,
}

impl CoveringFile {
    /// The file of a rig, in a folder.
    pub fn of(rig: &str, folder: &Path) -> Self {
        Self { path: folder.join(format!("{rig}.covering.toml")), copy: None }
    }

    /// The same with a copy in another folder, if there is one.
    #[must_use]
    pub fn with_copy(self, folder: Option<&Path>) -> Self {
        let copy = folder.zip(self.path.file_name()).map(|(folder, name)| folder.join(name));
        Self { copy: copy.filter(|copy| *copy != self.path), ..self }
    }

    /// The file of a rig among its recordings, with a copy in `coverings` in the [state directory](state::folder). That of a simulated rig has none: it
    /// may have the name of a real one.
    pub fn of_rig(rig: &Rig, recordings: &Path) -> Self {
        let state = state::folder().filter(|_| !rig.simulated).map(|state| state.join(FOLDER));
        Self::of(&rig.name, recordings).with_copy(state.as_deref())
    }

    fn write_copy(&self, thickness_mm: f64) {
        let Some(copy) = &self.copy else { return };
        if let Err(error) = write(copy, thickness_mm) {
            let path = copy.display();
            tracing::warn!(%path, %error, "the copy of the covering in place cannot be written: an older one may still count");
        }
    }
}

fn invalid(path: &Path, why: impl std::fmt::Display) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, format!("{}: {why}", path.display()))
}

/// The thickness in a file; `None` if there is no file.
fn read(path: &Path) -> io::Result<Option<f64>> {
    let text = match fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => {
            return Ok(None);
        }
        Err(error) => return Err(io::Error::new(error.kind(), format!("{}: {error}", path.display()))),
    };
    let content: Content = toml::from_str(&text).map_err(|error| invalid(path, error))?;
    if content.schema != SCHEMA || !(content.thickness_mm > 0.0 && content.thickness_mm.is_finite()) {
        return Err(invalid(path, format!("not a {SCHEMA} with a positive thickness_mm")));
    }
    Ok(Some(content.thickness_mm))
}

/// Writes another file and renames it: a crash leaves the old thickness or the new one.
fn write(path: &Path, thickness_mm: f64) -> io::Result<()> {
    let content = Content { schema: SCHEMA.into(), thickness_mm };
    let text = toml::to_string(&content).map_err(|error| invalid(path, error))?;
    let folder = path.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder)?;
    let new = path.with_extension("toml.new");
    let mut file = File::create(&new)?;
    file.write_all(text.as_bytes())?;
    file.sync_all()?;
    fs::rename(&new, path)?;
    File::open(folder)?.sync_all()
}

impl CoveringMemory for CoveringFile {
    /// A thickness that only the file has is copied: recordings may be moved.
    fn recall(&self) -> io::Result<Option<f64>> {
        let [own_mm, copy_mm] = [read(&self.path)?, self.copy.as_deref().map_or(Ok(None), read)?];
        let Some(own_mm) = own_mm else { return Ok(copy_mm) };
        if copy_mm.is_none() {
            self.write_copy(own_mm);
        }
        Ok(Some(copy_mm.map_or(own_mm, |copy_mm| copy_mm.min(own_mm))))
    }

    fn remember(&self, thickness_mm: f64) -> io::Result<()> {
        write(&self.path, thickness_mm)?;
        self.write_copy(thickness_mm);
        Ok(())
    }
}

#[cfg(test)]
#[path = "covering_file_tests.rs"]
mod tests;
