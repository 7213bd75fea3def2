//! Writes a Parquet file beside its path until it is complete.

use std::{
    fs::{self, File},
    path::PathBuf,
    sync::Arc,
};

use parquet::{
    basic::{Compression, ZstdLevel},
    data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int32Type, Int64Type},
    errors::ParquetError,
    file::{
        metadata::KeyValue,
        properties::WriterProperties,
        writer::{SerializedFileWriter, SerializedRowGroupWriter},
    },
    schema::{parser::parse_message_type, types::ColumnPath},
};
use tactus_schema::table::RowView;

use super::TableError;

/// Rows of a row group: half an hour of one sensor, some 10 MB in memory.
pub(super) const GROUP_ROWS: usize = 65_536;

/// A Parquet file that has the suffix `.part` until it is complete.
pub(super) struct PartFile {
    path: PathBuf,
    beside: PathBuf,
    file: SerializedFileWriter<File>,
}

impl PartFile {
    /// Begins a file of this schema.
    pub(super) fn create(path: PathBuf, schema: &str) -> Result<Self, TableError> {
        let mut beside = path.clone().into_os_string();
        beside.push(".part");
        let beside = PathBuf::from(beside);
        let sink = match File::create(&beside) {
            Ok(sink) => sink,
            Err(source) => return Err(TableError::Io { action: "create", path: beside, source }),
        };
        let begun = properties().and_then(|properties| {
            let schema = Arc::new(parse_message_type(schema)?);
            SerializedFileWriter::new(sink, schema, Arc::new(properties))
        });
        match begun {
            Ok(file) => Ok(Self { path, beside, file }),
            Err(source) => Err(TableError::Parquet { path: beside, source }),
        }
    }

    /// The path of the complete file.
    pub(super) fn path(&self) -> &PathBuf {
        &self.path
    }

    /// Adds a pair of file metadata.
    pub(super) fn metadata(&mut self, key: &str, value: String) {
        self.file.append_key_value_metadata(KeyValue::new(key.into(), value));
    }

    /// Adds a row group; `write` gives its columns in the schema's order.
    pub(super) fn group(
        &mut self,
        write: impl FnOnce(&mut SerializedRowGroupWriter<'_, File>) -> Result<(), ParquetError>,
    ) -> Result<(), TableError> {
        let written = self.file.next_row_group().and_then(|mut writer| {
            write(&mut writer)?;
            writer.close().map(drop)
        });
        written.map_err(|source| TableError::Parquet { path: self.beside.clone(), source })
    }

    /// Closes the file and moves it to its path.
    pub(super) fn finish(self) -> Result<(), TableError> {
        let Self { path, beside, file } = self;
        let file = match file.into_inner() {
            Ok(file) => file,
            Err(source) => return Err(TableError::Parquet { path: beside, source }),
        };
        let placed = file.sync_all().and_then(|()| fs::rename(&beside, &path));
        placed.map_err(|source| TableError::Io { action: "write", path, source })
    }

    /// Removes what was written so far.
    pub(super) fn abandon(self) {
        // An error of the removal would hide the one that matters.
        drop(fs::remove_file(&self.beside));
    }
}

/// The first columns of every table of frames, from the run to the position, in the current row group.
#[derive(Default)]
pub(super) struct FrameColumns {
    run: Vec<ByteArray>,
    press: Vec<i32>,
    phase: Vec<ByteArray>,
    t_ns: Vec<i64>,
    position_mm: [Vec<f64>; 3],
}

impl FrameColumns {
    /// Rows so far.
    pub(super) fn rows(&self) -> usize {
        self.t_ns.len()
    }

    pub(super) fn push(&mut self, row: &RowView<'_>) {
        self.run.push(text(&self.run, row.run));
        self.press.push(row.press);
        self.phase.push(text(&self.phase, row.phase.name()));
        self.t_ns.push(row.t_ns);
        for (column, mm) in self.position_mm.iter_mut().zip(row.position_mm) {
            column.push(mm);
        }
    }

    pub(super) fn write(&self, writer: &mut SerializedRowGroupWriter<'_, File>) -> Result<(), ParquetError> {
        column::<ByteArrayType>(writer, &self.run, None, None)?;
        column::<Int32Type>(writer, &self.press, None, None)?;
        column::<ByteArrayType>(writer, &self.phase, None, None)?;
        column::<Int64Type>(writer, &self.t_ns, None, None)?;
        for column_mm in &self.position_mm {
            column::<DoubleType>(writer, column_mm, None, None)?;
        }
        Ok(())
    }
}

/// Repetition levels of a list of this many elements: 0 at its first element, then 1.
pub(super) fn repetition(elements: usize) -> impl Iterator<Item = i16> {
    (0..elements).map(|index| i16::from(index > 0))
}

/// A text; shares the bytes of the one before if they are equal.
pub(super) fn text(before: &[ByteArray], text: &str) -> ByteArray {
    match before.last() {
        Some(last) if last.data() == text.as_bytes() => last.clone(),
        _ => ByteArray::from(text),
    }
}

/// Writes the next column.
pub(super) fn column<T: DataType>(
    writer: &mut SerializedRowGroupWriter<'_, File>,
    values: &[T::T],
    defined: Option<&[i16]>,
    repeated: Option<&[i16]>,
) -> Result<(), ParquetError> {
    let missing = || ParquetError::General("the schema has fewer columns than are written".into());
    let mut column = writer.next_column()?.ok_or_else(missing)?;
    column.typed::<T>().write_batch(values, defined, repeated)?;
    column.close()
}

/// Names and indices repeat, so they have dictionaries; times, positions and residuals do not. Counts of most sensors are whole
/// numbers in a narrow range; otherwise the writer drops their dictionary by itself.
fn properties() -> Result<WriterProperties, ParquetError> {
    let mut properties = WriterProperties::builder()
        .set_created_by(concat!("tactus-record ", env!("CARGO_PKG_VERSION")).into())
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(3)?));
    for column in ["t_ns", "x_mm", "y_mm", "z_mm"] {
        properties = properties.set_column_dictionary_enabled(ColumnPath::from(column), false);
    }
    for column in ["residual_before", "residual_after"] {
        let path = [column, "list", "element"].map(String::from).to_vec();
        properties = properties.set_column_dictionary_enabled(ColumnPath::from(path), false);
    }
    Ok(properties.build())
}
