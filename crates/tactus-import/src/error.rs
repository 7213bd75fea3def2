//! Why a file could not be imported.

use std::{io, path::PathBuf};

use tactus_record::table::TableError;
use tactus_schema::RigError;

/// Why a lab's file did not become a measurement table.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum ImportError {
    /// The file system refused.
    #[error("cannot {action} {}: {source}", path.display())]
    Io { action: &'static str, path: PathBuf, source: io::Error },
    /// The mapping is not TOML, or has a key that is not known.
    #[error("{}: {source}", path.display())]
    Toml { path: PathBuf, source: Box<toml::de::Error> },
    /// A key of the mapping is missing or wrong.
    #[error("{}: {key}: {problem}", path.display())]
    Key { path: PathBuf, key: String, problem: String },
    /// The file cannot be read as what its name says.
    #[error("{}: {problem}", path.display())]
    File { path: PathBuf, problem: String },
    /// The mapping names a column that the file does not have.
    #[error("{}: no column {column:?}, which {key} of the mapping names; the file has {known}", path.display())]
    Column { path: PathBuf, key: String, column: String, known: String },
    /// One value cannot be used.
    #[error("{}: {place}, column {column:?}: {problem}", path.display())]
    Value { path: PathBuf, place: String, column: String, problem: String },
    /// What the mapping says is no rig.
    #[error("{}: rig.{source}", path.display())]
    Rig { path: PathBuf, source: Box<RigError> },
    /// The table could not be written.
    #[error(transparent)]
    Table(#[from] Box<TableError>),
}

impl From<TableError> for ImportError {
    fn from(error: TableError) -> Self {
        Self::Table(Box::new(error))
    }
}
