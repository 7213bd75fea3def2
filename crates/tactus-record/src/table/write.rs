//! Writes a measurement table.

use std::{fs::File, path::PathBuf};

use parquet::{
    data_type::{ByteArray, ByteArrayType, DoubleType, FloatType},
    errors::ParquetError,
    file::writer::SerializedRowGroupWriter,
};
use tactus_schema::{
    Rig,
    table::{RIG_METADATA_KEY, RowView},
};

use super::{
    TableError,
    check::Checker,
    part_file::{FrameColumns, GROUP_ROWS, PartFile, column, repetition, text},
};

/// The contract's columns as Parquet; pyarrow, pandas and polars read `counts` as a list of 32-bit floats.
const SCHEMA: &str = "
    message tactus {
        required binary run (STRING);
        required int32 press;
        required binary phase (STRING);
        required int64 t_ns;
        required double x_mm;
        required double y_mm;
        required double z_mm;
        required double covering_mm;
        required binary indenter (STRING);
        optional double temperature_c;
        required group counts (LIST) { repeated group list { required float element; } }
    }";

/// A measurement table being written. Rows that break the contract are refused, so the table is valid.
///
/// Until [`TableWriter::finish`] the rows are in a file beside `path` with the suffix `.part`.
pub struct TableWriter {
    part: PartFile,
    checker: Checker,
    rows: u64,
    group: RowGroup,
}

impl TableWriter {
    /// Begins a table of measurements of one rig; `rig_json` goes into the file as it is.
    ///
    /// # Errors
    /// If `rig_json` is not a rig or the file cannot be created.
    pub fn create(path: impl Into<PathBuf>, rig_json: &str) -> Result<Self, TableError> {
        let path = path.into();
        let rig = match Rig::from_json(rig_json) {
            Ok(rig) => rig,
            Err(source) => return Err(TableError::Rig { path, source }),
        };
        let mut part = PartFile::create(path, SCHEMA)?;
        part.metadata(RIG_METADATA_KEY, rig_json.to_owned());
        Ok(Self { part, checker: Checker::new(&rig), rows: 0, group: RowGroup::default() })
    }

    /// Adds a row.
    ///
    /// # Errors
    /// If the row breaks the table's contract or cannot be written.
    pub fn push(&mut self, row: RowView<'_>) -> Result<(), TableError> {
        self.checker.check(&row).map_err(|fault| fault.at(self.part.path(), self.rows))?;
        self.put(row)
    }

    /// Adds a row that was checked already.
    pub(crate) fn put(&mut self, row: RowView<'_>) -> Result<(), TableError> {
        self.group.push(&row);
        self.rows += 1;
        if self.group.frames.rows() >= GROUP_ROWS { self.close_group() } else { Ok(()) }
    }

    /// Adds a pair of file metadata.
    pub fn metadata(&mut self, key: &str, value: String) {
        self.part.metadata(key, value);
    }

    /// Closes the table and moves it to its path; returns the number of rows.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn finish(mut self) -> Result<u64, TableError> {
        self.close_group()?;
        self.part.finish()?;
        Ok(self.rows)
    }

    /// Removes what was written so far.
    pub fn abandon(self) {
        self.part.abandon();
    }

    fn close_group(&mut self) -> Result<(), TableError> {
        if self.group.frames.rows() == 0 {
            return Ok(());
        }
        let group = std::mem::take(&mut self.group);
        self.part.group(|writer| group.write(writer))
    }
}

impl std::fmt::Debug for TableWriter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("TableWriter")
            .field("path", self.part.path())
            .field("rows", &self.rows)
            .finish_non_exhaustive()
    }
}

/// The columns of the current row group.
#[derive(Default)]
struct RowGroup {
    frames: FrameColumns,
    covering_mm: Vec<f64>,
    indenter: Vec<ByteArray>,
    temperature_c: Vec<f64>,
    temperature_known: Vec<i16>,
    counts: Vec<f32>,
    counts_repeated: Vec<i16>,
}

impl RowGroup {
    fn push(&mut self, row: &RowView<'_>) {
        self.frames.push(row);
        self.covering_mm.push(row.covering_mm);
        self.indenter.push(text(&self.indenter, row.indenter));
        self.temperature_c.extend(row.temperature_c);
        self.temperature_known.push(i16::from(row.temperature_c.is_some()));
        self.counts.extend_from_slice(row.counts);
        self.counts_repeated.extend(repetition(row.counts.len()));
    }

    fn write(&self, writer: &mut SerializedRowGroupWriter<'_, File>) -> Result<(), ParquetError> {
        self.frames.write(writer)?;
        column::<DoubleType>(writer, &self.covering_mm, None, None)?;
        column::<ByteArrayType>(writer, &self.indenter, None, None)?;
        column::<DoubleType>(writer, &self.temperature_c, Some(&self.temperature_known), None)?;
        let defined = vec![1; self.counts.len()];
        column::<FloatType>(writer, &self.counts, Some(&defined), Some(&self.counts_repeated))
    }
}
