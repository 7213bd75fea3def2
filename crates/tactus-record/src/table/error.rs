//! What can be wrong with a measurement table.

use std::{io, path::PathBuf};

use parquet::errors::ParquetError;
use tactus_schema::{RigError, table::RIG_METADATA_KEY};

/// Why a file is not a measurement table, or could not be written as one. Rows count from 0.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The file system refused.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// What was tried, such as `open`.
        action: &'static str,
        /// On which file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Not Parquet, or damaged.
    #[error("{}: {source}", path.display())]
    Parquet {
        /// The file.
        path: PathBuf,
        /// What the Parquet library said.
        source: ParquetError,
    },
    /// The file does not say which rig was measured.
    #[error("{}: no file metadata {RIG_METADATA_KEY:?}: a measurement table holds its rig as JSON there", path.display())]
    RigMissing {
        /// The file.
        path: PathBuf,
    },
    /// The rig in the file is not a rig.
    #[error("{}: file metadata {RIG_METADATA_KEY:?}: {source}", path.display())]
    Rig {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: RigError,
    },
    /// A column of the contract is not there.
    #[error("{}: column {column}: missing; expected {expected}", path.display())]
    ColumnMissing {
        /// The file.
        path: PathBuf,
        /// The column.
        column: &'static str,
        /// Its type.
        expected: &'static str,
    },
    /// A column has another type.
    #[error("{}: column {column}: {found}; expected {expected}", path.display())]
    ColumnType {
        /// The file.
        path: PathBuf,
        /// The column.
        column: &'static str,
        /// The type in the file.
        found: String,
        /// The type of the contract.
        expected: &'static str,
    },
    /// Two columns of a row group have different numbers of rows.
    #[error("{}: column {column}: {found} rows in row group {group}, which has {expected}", path.display())]
    ColumnLength {
        /// The file.
        path: PathBuf,
        /// The column.
        column: &'static str,
        /// Index of the row group.
        group: usize,
        /// Rows of the column.
        found: usize,
        /// Rows of the group.
        expected: usize,
    },
    /// A value breaks the contract.
    #[error("{}: row {row}, column {column}: {problem}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// The row, from 0.
        row: u64,
        /// The column.
        column: &'static str,
        /// What is wrong, and what would be right.
        problem: String,
    },
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
