//! The file of one run, until it is whole and in the fleet.

use std::io::{self, Read as _, Seek as _, SeekFrom};

use arrow::error::ArrowError;
use object_store::buffered::BufWriter;
use parquet::{
    arrow::ArrowWriter,
    basic::{Compression, ZstdLevel},
    errors::ParquetError,
    file::{metadata::KeyValue, properties::WriterProperties},
};
use tactus_schema::{
    Rig,
    table::{RIG_METADATA_KEY, RowView},
};
use tempfile::SpooledTempFile;
use tokio::{io::AsyncWriteExt as _, runtime::Handle};

use super::FailedFile;
use crate::{
    Place, RunHead,
    columns::{Rows, SCHEMA},
};

/// Rows of a batch.
const BATCH_ROWS: usize = 4096;

/// Rows of a row group: a quarter of an hour at 30 Hz, 6 MB of counts of 48 elements.
const GROUP_ROWS: usize = 32 * 1024;

/// Size up to which a file that is being written stays in memory.
const IN_MEMORY_BYTES: usize = 32 << 20;

/// Size of the parts in which a file goes into the store.
const PART_BYTES: usize = 8 << 20;

/// What became of a run.
#[derive(Debug)]
pub(super) enum Written {
    /// It was there already.
    Kept,
    /// It is not taken from this file.
    Refused(FailedFile),
    /// It is there now.
    New { rig: String, run: String, rows: u64, bytes: u64, warnings: Vec<String> },
}

/// Why a run's file could not be written.
#[derive(Debug, thiserror::Error)]
pub(super) enum WriteError {
    #[error(
        "nobody knows when run {run:?} was made: its id does not begin with a date. Give one with --date"
    )]
    NoDate { run: String },
    #[error("run {run:?} cannot be written as Parquet: {source}")]
    Parquet { run: String, source: ParquetError },
    #[error("run {run:?} cannot be written to the temporary folder: {source}")]
    Temporary { run: String, source: io::Error },
    #[error("run {run:?} cannot be written to {place}: {source}")]
    Upload { run: String, place: String, source: io::Error },
}

/// The file of one run.
pub(super) struct RunWriter {
    head: RunHead,
    rows: Rows,
    rows_all: u64,
    /// Times of the first row and of the last.
    from_to_ns: Option<[i64; 2]>,
    /// `Err` has what becomes of a run whose rows are passed over.
    file: Result<ArrowWriter<SpooledTempFile>, Written>,
}

impl RunWriter {
    pub(super) fn begin(head: RunHead, rig: &Rig, passed_over: Option<Written>) -> Result<Self, WriteError> {
        let file = match passed_over {
            Some(written) => Err(written),
            None => Ok(begun(&head, rig)?),
        };
        Ok(Self { head, rows: Rows::new(), rows_all: 0, from_to_ns: None, file })
    }

    pub(super) fn run(&self) -> &str {
        &self.head.run
    }

    pub(super) fn push(&mut self, row: RowView<'_>) -> Result<(), WriteError> {
        if self.file.is_err() {
            return Ok(());
        }
        let [from_ns, _] = self.from_to_ns.unwrap_or([row.t_ns; 2]);
        self.from_to_ns = Some([from_ns, row.t_ns]);
        self.rows.push(row);
        self.rows_all += 1;
        if self.rows.len() >= BATCH_ROWS { self.write_batch() } else { Ok(()) }
    }

    fn write_batch(&mut self) -> Result<(), WriteError> {
        let Ok(file) = &mut self.file else { return Ok(()) };
        let batch = self.rows.take(&self.head).map_err(|source| of_arrow(&self.head.run, source))?;
        file.write(&batch).map_err(|source| WriteError::Parquet { run: self.head.run.clone(), source })
    }

    /// Closes the file and puts it into the fleet as a whole.
    pub(super) fn finish(
        mut self,
        runtime: &Handle,
        place: &Place,
        warnings: Vec<String>,
    ) -> Result<Written, WriteError> {
        self.write_batch()?;
        let Self { mut head, rows_all: rows, from_to_ns, file, .. } = self;
        let mut file = match file {
            Ok(file) => file,
            Err(written) => return Ok(written),
        };
        head.warnings.clone_from(&warnings);
        head.frames_ns = from_to_ns.map(|[from_ns, to_ns]| to_ns.saturating_sub(from_ns));
        let run = head.run.clone();
        let in_parquet = |source| WriteError::Parquet { run: run.clone(), source };
        let pair = head.to_metadata().map_err(|error| in_parquet(ParquetError::External(error.into())))?;
        file.append_key_value_metadata(pair);
        let mut file = file.into_inner().map_err(in_parquet)?;
        let path = place.of_run(&head.rig, &head.date, &head.run);
        let temporary = |source| WriteError::Temporary { run: run.clone(), source };
        file.seek(SeekFrom::Start(0)).map_err(temporary)?;
        let upload = |source| WriteError::Upload { run: run.clone(), place: place.url().to_string(), source };
        let mut to = BufWriter::with_capacity(place.store().clone(), path, PART_BYTES);
        let mut part = vec![0; PART_BYTES / 8];
        let mut bytes = 0;
        loop {
            let read = file.read(&mut part).map_err(temporary)?;
            if read == 0 {
                break;
            }
            runtime.block_on(to.write_all(&part[..read])).map_err(upload)?;
            bytes += read as u64;
        }
        runtime.block_on(to.shutdown()).map_err(upload)?;
        Ok(Written::New { rig: head.rig, run: head.run, rows, bytes, warnings })
    }
}

fn begun(head: &RunHead, rig: &Rig) -> Result<ArrowWriter<SpooledTempFile>, WriteError> {
    let properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(ZstdLevel::default()))
        .set_max_row_group_row_count(Some(GROUP_ROWS))
        .set_key_value_metadata(Some(vec![KeyValue::new(RIG_METADATA_KEY.to_owned(), rig.to_json())]))
        .build();
    let file = SpooledTempFile::new(IN_MEMORY_BYTES);
    ArrowWriter::try_new(file, SCHEMA.clone(), Some(properties))
        .map_err(|source| WriteError::Parquet { run: head.run.clone(), source })
}

fn of_arrow(run: &str, error: ArrowError) -> WriteError {
    WriteError::Parquet { run: run.to_owned(), source: error.into() }
}
