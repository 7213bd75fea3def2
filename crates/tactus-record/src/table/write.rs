//! Writes a measurement table.

use std::{
    fs::{self, File},
    path::PathBuf,
    sync::Arc,
};

use parquet::{
    basic::{Compression, ZstdLevel},
    data_type::{ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int32Type, Int64Type},
    errors::ParquetError,
    file::{
        metadata::KeyValue,
        properties::WriterProperties,
        writer::{SerializedFileWriter, SerializedRowGroupWriter},
    },
    schema::{parser::parse_message_type, types::ColumnPath},
};
use tactus_schema::{Rig, table::RIG_METADATA_KEY};

use super::{RowView, TableError, check::Checker};

/// Rows of a row group: half an hour of one sensor, some 10 MB in memory.
const GROUP_ROWS: usize = 65_536;

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

/// A measurement table being written. Rows that break the contract are refused, so what it makes is valid.
///
/// Until [`TableWriter::finish`] the rows stand in a file beside `path` with the ending `.part`.
pub struct TableWriter {
    path: PathBuf,
    part: PathBuf,
    file: SerializedFileWriter<File>,
    checker: Checker,
    rows: u64,
    group: Group,
}

impl TableWriter {
    /// Begins a table of measurements of one rig, given as it shall stand in the file.
    ///
    /// # Errors
    /// If `rig_json` is not a rig or the file cannot be created.
    pub fn create(path: impl Into<PathBuf>, rig_json: &str) -> Result<Self, TableError> {
        let path = path.into();
        let rig = match Rig::from_json(rig_json) {
            Ok(rig) => rig,
            Err(source) => return Err(TableError::Rig { path, source }),
        };
        let mut part = path.clone().into_os_string();
        part.push(".part");
        let part = PathBuf::from(part);
        let sink = match File::create(&part) {
            Ok(sink) => sink,
            Err(source) => return Err(TableError::Io { action: "create", path: part, source }),
        };
        let begun = properties().and_then(|properties| {
            let schema = Arc::new(parse_message_type(SCHEMA)?);
            SerializedFileWriter::new(sink, schema, Arc::new(properties))
        });
        let mut file = match begun {
            Ok(file) => file,
            Err(source) => return Err(TableError::Parquet { path: part, source }),
        };
        file.append_key_value_metadata(KeyValue::new(RIG_METADATA_KEY.into(), rig_json.to_owned()));
        Ok(Self { path, part, file, checker: Checker::new(&rig), rows: 0, group: Group::default() })
    }

    /// Adds a row.
    ///
    /// # Errors
    /// If it breaks the contract or cannot be written.
    pub fn push(&mut self, row: RowView<'_>) -> Result<(), TableError> {
        self.checker.check(&row).map_err(|fault| fault.at(&self.path, self.rows))?;
        self.put(row)
    }

    /// Adds a row that has passed already.
    pub(crate) fn put(&mut self, row: RowView<'_>) -> Result<(), TableError> {
        self.group.push(&row);
        self.rows += 1;
        if self.group.t_ns.len() >= GROUP_ROWS { self.close_group() } else { Ok(()) }
    }

    /// Adds a pair of file metadata.
    pub fn metadata(&mut self, key: &str, value: String) {
        self.file.append_key_value_metadata(KeyValue::new(key.into(), value));
    }

    /// Closes the table and puts it in its place; the number of rows.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn finish(mut self) -> Result<u64, TableError> {
        self.close_group()?;
        let Self { path, part, file, rows, .. } = self;
        let file = match file.into_inner() {
            Ok(file) => file,
            Err(source) => return Err(TableError::Parquet { path: part, source }),
        };
        let placed = file.sync_all().and_then(|()| fs::rename(&part, &path));
        placed.map_err(|source| TableError::Io { action: "write", path, source })?;
        Ok(rows)
    }

    /// Removes what was written so far.
    pub(crate) fn abandon(self) {
        // The error at hand says more than one that follows from it.
        drop(fs::remove_file(&self.part));
    }

    fn close_group(&mut self) -> Result<(), TableError> {
        if self.group.t_ns.is_empty() {
            return Ok(());
        }
        let group = std::mem::take(&mut self.group);
        let written = self.file.next_row_group().and_then(|writer| group.write(writer));
        written.map_err(|source| TableError::Parquet { path: self.part.clone(), source })
    }
}

impl std::fmt::Debug for TableWriter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("TableWriter")
            .field("path", &self.path)
            .field("rows", &self.rows)
            .finish_non_exhaustive()
    }
}

/// Names and indices repeat: dictionaries. Times and positions do not. Counts are whole numbers of a narrow range on
/// most sensors; where they are not, the writer gives the dictionary up by itself.
fn properties() -> Result<WriterProperties, ParquetError> {
    let mut properties = WriterProperties::builder()
        .set_created_by(concat!("tactus-record ", env!("CARGO_PKG_VERSION")).into())
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(3)?));
    for column in ["t_ns", "x_mm", "y_mm", "z_mm"] {
        properties = properties.set_column_dictionary_enabled(ColumnPath::from(column), false);
    }
    Ok(properties.build())
}

/// The columns of the row group in hand.
#[derive(Default)]
struct Group {
    run: Vec<ByteArray>,
    press: Vec<i32>,
    phase: Vec<ByteArray>,
    t_ns: Vec<i64>,
    position_mm: [Vec<f64>; 3],
    covering_mm: Vec<f64>,
    indenter: Vec<ByteArray>,
    temperature_c: Vec<f64>,
    temperature_known: Vec<i16>,
    counts: Vec<f32>,
    counts_repeated: Vec<i16>,
}

impl Group {
    fn push(&mut self, row: &RowView<'_>) {
        self.run.push(text(&self.run, row.run));
        self.press.push(row.press);
        self.phase.push(text(&self.phase, row.phase.name()));
        self.t_ns.push(row.t_ns);
        for (column, mm) in self.position_mm.iter_mut().zip(row.position_mm) {
            column.push(mm);
        }
        self.covering_mm.push(row.covering_mm);
        self.indenter.push(text(&self.indenter, row.indenter));
        self.temperature_c.extend(row.temperature_c);
        self.temperature_known.push(i16::from(row.temperature_c.is_some()));
        self.counts.extend_from_slice(row.counts);
        self.counts_repeated.extend((0..row.counts.len()).map(|index| i16::from(index > 0)));
    }

    fn write(&self, mut writer: SerializedRowGroupWriter<'_, File>) -> Result<(), ParquetError> {
        let [x_mm, y_mm, z_mm] = &self.position_mm;
        column::<ByteArrayType>(&mut writer, &self.run, None, None)?;
        column::<Int32Type>(&mut writer, &self.press, None, None)?;
        column::<ByteArrayType>(&mut writer, &self.phase, None, None)?;
        column::<Int64Type>(&mut writer, &self.t_ns, None, None)?;
        column::<DoubleType>(&mut writer, x_mm, None, None)?;
        column::<DoubleType>(&mut writer, y_mm, None, None)?;
        column::<DoubleType>(&mut writer, z_mm, None, None)?;
        column::<DoubleType>(&mut writer, &self.covering_mm, None, None)?;
        column::<ByteArrayType>(&mut writer, &self.indenter, None, None)?;
        column::<DoubleType>(&mut writer, &self.temperature_c, Some(&self.temperature_known), None)?;
        let defined = vec![1; self.counts.len()];
        column::<FloatType>(&mut writer, &self.counts, Some(&defined), Some(&self.counts_repeated))?;
        writer.close()?;
        Ok(())
    }
}

/// A text; shares the bytes of the one before if they are equal.
fn text(before: &[ByteArray], text: &str) -> ByteArray {
    match before.last() {
        Some(last) if last.data() == text.as_bytes() => last.clone(),
        _ => ByteArray::from(text),
    }
}

fn column<T: DataType>(
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
