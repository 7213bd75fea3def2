//! The formats in which a measurement table can be written.

use std::path::{Path, PathBuf};

use tactus_schema::table::RowView;

use super::{TableError, TableWriter, csv::CsvWriter, npz::NpzWriter};

/// A format of measurement tables. Tactus reads Parquet only; the others are for programs that do not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableFormat {
    /// The contract's own, with types and the rig.
    Parquet,
    /// Text: a column for each element (`counts_0`, ...). The metadata are in a file beside it.
    Csv,
    /// An archive of `NumPy` arrays, one per column; `run`, `phase` and `indenter` are indices into `runs`, `phases` and
    /// `indenters`, and the metadata are texts (`tactus.rig`, ...).
    Npz,
}

impl TableFormat {
    /// All formats.
    pub const ALL: [Self; 3] = [Self::Parquet, Self::Csv, Self::Npz];

    /// Its name, which is also how its files end.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Parquet => "parquet",
            Self::Csv => "csv",
            Self::Npz => "npz",
        }
    }

    /// The format of a file by its name; `None` if the name does not say it.
    pub fn of_path(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?;
        Self::ALL.into_iter().find(|format| format.name().eq_ignore_ascii_case(extension))
    }
}

/// A table being written in one of the formats. It appears at its path when it is complete.
pub(crate) enum FormatWriter {
    Parquet(TableWriter),
    Csv(CsvWriter),
    Npz(NpzWriter),
}

impl FormatWriter {
    pub(crate) fn create(format: TableFormat, path: PathBuf, rig_json: &str) -> Result<Self, TableError> {
        Ok(match format {
            TableFormat::Parquet => Self::Parquet(TableWriter::create(path, rig_json)?),
            TableFormat::Csv => Self::Csv(CsvWriter::create(path, rig_json)?),
            TableFormat::Npz => Self::Npz(NpzWriter::create(path, rig_json)?),
        })
    }

    /// Adds a row that was checked already.
    pub(crate) fn put(&mut self, row: RowView<'_>) -> Result<(), TableError> {
        match self {
            Self::Parquet(table) => table.put(row),
            Self::Csv(table) => table.put(&row),
            Self::Npz(table) => table.put(&row),
        }
    }

    pub(crate) fn metadata(&mut self, key: &str, value: String) {
        match self {
            Self::Parquet(table) => table.metadata(key, value),
            Self::Csv(table) => table.metadata(key, value),
            Self::Npz(table) => table.metadata(key, value),
        }
    }

    /// Returns the number of rows.
    pub(crate) fn finish(self) -> Result<u64, TableError> {
        match self {
            Self::Parquet(table) => table.finish(),
            Self::Csv(table) => table.finish(),
            Self::Npz(table) => table.finish(),
        }
    }

    /// Removes what was written so far.
    pub(crate) fn abandon(self) {
        match self {
            Self::Parquet(table) => table.abandon(),
            Self::Csv(table) => table.abandon(),
            Self::Npz(table) => table.abandon(),
        }
    }
}
