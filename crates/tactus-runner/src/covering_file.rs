//! The covering in place, kept in a file beyond the end of the service. It is not among the recordings: people move those.

use std::env;
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tactus_engine::CoveringMemory;

/// Format of the file, in its key `schema`.
const SCHEMA: &str = "tactus.covering/1";

/// The files' folder in the state directory.
const FOLDER: &str = "coverings";

/// A TOML file that holds the thickness of the covering in place.
#[derive(Debug, Clone)]
pub struct CoveringFile {
    path: PathBuf,
    /// Where an earlier version kept it. It counts as long as there is no file at `path`.
    earlier: Option<PathBuf>,
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
        Self { path: folder.join(name(rig)), earlier: None }
    }

    /// The file of a rig in `coverings` in the state directory: `$STATE_DIRECTORY` of a service, else `$XDG_STATE_HOME/tactus`, else
    /// `~/.local/state/tactus`. Without any it is in the folder of the recordings, where earlier versions kept it.
    pub fn in_state(rig: &str, recordings: &Path) -> Self {
        let of = |variable: &str| env::var_os(variable).filter(|value| !value.is_empty()).map(PathBuf::from);
        let of_user = || of("XDG_STATE_HOME").map(|state| state.join("tactus"));
        let of_home = || of("HOME").map(|home| home.join(".local/state/tactus"));
        match of("STATE_DIRECTORY").or_else(of_user).or_else(of_home) {
            Some(state) => Self::of(rig, &state.join(FOLDER)).moved_from(recordings),
            None => Self::of(rig, recordings),
        }
    }

    /// The same file, which an earlier version kept in another folder.
    #[must_use]
    pub fn moved_from(self, folder: &Path) -> Self {
        let earlier = self.path.file_name().map(|name| folder.join(name));
        Self { earlier, ..self }
    }
}

fn name(rig: &str) -> String {
    format!("{rig}.covering.toml")
}

fn invalid(path: &Path, why: impl std::fmt::Display) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, format!("{}: {why}", path.display()))
}

/// The thickness in a file; `None` if there is no file.
fn read(path: &Path) -> io::Result<Option<f64>> {
    let text = match fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(io::Error::new(error.kind(), format!("{}: {error}", path.display()))),
    };
    let content: Content = toml::from_str(&text).map_err(|error| invalid(path, error))?;
    if content.schema != SCHEMA || !(content.thickness_mm > 0.0 && content.thickness_mm.is_finite()) {
        return Err(invalid(path, format!("not a {SCHEMA} with a positive thickness_mm")));
    }
    Ok(Some(content.thickness_mm))
}

impl CoveringMemory for CoveringFile {
    /// What only an earlier version's place holds is remembered here, before somebody moves that.
    fn recall(&self) -> io::Result<Option<f64>> {
        if let Some(thickness_mm) = read(&self.path)? {
            return Ok(Some(thickness_mm));
        }
        let earlier_mm = self.earlier.as_deref().map_or(Ok(None), read)?;
        if let Some(thickness_mm) = earlier_mm {
            self.remember(thickness_mm)?;
        }
        Ok(earlier_mm)
    }

    /// Writes another file and renames it: a crash leaves the old thickness or the new one.
    fn remember(&self, thickness_mm: f64) -> io::Result<()> {
        let content = Content { schema: SCHEMA.into(), thickness_mm };
        let text = toml::to_string(&content).map_err(|error| invalid(&self.path, error))?;
        let folder = self.path.parent().unwrap_or(Path::new("."));
        fs::create_dir_all(folder)?;
        let new = self.path.with_extension("toml.new");
        let mut file = File::create(&new)?;
        file.write_all(text.as_bytes())?;
        file.sync_all()?;
        fs::rename(&new, &self.path)?;
        File::open(folder)?.sync_all()
    }
}

#[cfg(test)]
#[path = "covering_file_tests.rs"]
mod tests;
