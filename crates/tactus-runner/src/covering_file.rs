//! The covering in place, kept in a file beyond the end of the service.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tactus_engine::CoveringMemory;

/// Format of the file, in its key `schema`.
const SCHEMA: &str = "tactus.covering/1";

/// A TOML file that holds the thickness of the covering in place.
#[derive(Debug, Clone)]
pub struct CoveringFile {
    path: PathBuf,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Content {
    schema: String,
    thickness_mm: f64,
}

impl CoveringFile {
    /// The file of a rig, in the folder of its recordings.
    pub fn of(rig: &str, recordings: &Path) -> Self {
        Self { path: recordings.join(format!("{rig}.covering.toml")) }
    }

    fn invalid(&self, why: impl std::fmt::Display) -> io::Error {
        io::Error::new(io::ErrorKind::InvalidData, format!("{}: {why}", self.path.display()))
    }
}

impl CoveringMemory for CoveringFile {
    fn recall(&self) -> io::Result<Option<f64>> {
        let text = match fs::read_to_string(&self.path) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => {
                return Err(io::Error::new(error.kind(), format!("{}: {error}", self.path.display())));
            }
        };
        let content: Content = toml::from_str(&text).map_err(|error| self.invalid(error))?;
        if content.schema != SCHEMA || !(content.thickness_mm > 0.0 && content.thickness_mm.is_finite()) {
            return Err(self.invalid(format!("not a {SCHEMA} with a positive thickness_mm")));
        }
        Ok(Some(content.thickness_mm))
    }

    /// Writes another file and renames it: a crash leaves the old thickness or the new one.
    fn remember(&self, thickness_mm: f64) -> io::Result<()> {
        let content = Content { schema: SCHEMA.into(), thickness_mm };
        let text = toml::to_string(&content).map_err(|error| self.invalid(error))?;
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
