//! What can be wrong with a measurement table.

use std::{io, path::PathBuf};

use parquet::errors::ParquetError;
use tactus_schema::{RigError, table::RIG_METADATA_KEY};

/// Why a file is not a measurement table, or could not be written as one. Rows count from 0.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum TableError {
    /// The file system refused.
    #[error("cannot {action} {}: {source}", path.display())]
    Io { action: &'static str, path: PathBuf, source: io::Error },
    /// Not Parquet, or damaged.
    #[error("{}: {source}", path.display())]
    Parquet { path: PathBuf, source: ParquetError },
    /// The file does not say which rig was measured.
    #[error("{}: no file metadata {RIG_METADATA_KEY:?}: a measurement table holds its rig as JSON there", path.display())]
    RigMissing { path: PathBuf },
    /// The rig in the file is not a rig.
    #[error("{}: file metadata {RIG_METADATA_KEY:?}: {source}", path.display())]
    Rig { path: PathBuf, source: RigError },
    /// A column of the contract is not there.
    #[error("{}: column {column}: missing; expected {expected}", path.display())]
    ColumnMissing { path: PathBuf, column: &'static str, expected: &'static str },
    /// A column has another type.
    #[error("{}: column {column}: {found}; expected {expected}", path.display())]
    ColumnType { path: PathBuf, column: &'static str, found: String, expected: &'static str },
    /// Two columns of a row group have different numbers of rows.
    #[error("{}: column {column}: {found} rows in row group {group}, which has {expected}", path.display())]
    ColumnLength { path: PathBuf, column: &'static str, group: usize, found: usize, expected: usize },
    /// A value breaks the contract.
    #[error("{}: row {row}, column {column}: {problem}", path.display())]
    Value { path: PathBuf, row: u64, column: &'static str, problem: String },
}

impl TableError {
    /// The column that is wrong, if it is one.
    pub fn column(&self) -> Option<&'static str> {
        match self {
            Self::ColumnMissing { column, .. }
            | Self::ColumnType { column, .. }
            | Self::ColumnLength { column, .. }
            | Self::Value { column, .. } => Some(column),
            Self::Io { .. } | Self::Parquet { .. } | Self::RigMissing { .. } | Self::Rig { .. } => None,
        }
    }

    /// The row that is wrong, from 0, if it is one.
    pub fn row(&self) -> Option<u64> {
        if let Self::Value { row, .. } = self { Some(*row) } else { None }
    }
}
