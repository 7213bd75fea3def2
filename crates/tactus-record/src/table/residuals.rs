//! Writes the residuals of each frame under two models.

use std::{fs::File, path::PathBuf};

use parquet::{
    data_type::{BoolType, FloatType},
    errors::ParquetError,
    file::writer::SerializedRowGroupWriter,
};
use tactus_schema::{
    Rig,
    table::{RIG_METADATA_KEY, RowView},
};

use super::{
    TableError,
    part_file::{FrameColumns, GROUP_ROWS, PartFile, column, repetition},
};

/// Key of the file metadata that is `true` if no physical sensor was read, else `false`.
const SIMULATED_METADATA_KEY: &str = "tactus.simulated";

const SCHEMA: &str = "
    message tactus {
        required binary run (STRING);
        required int32 press;
        required binary phase (STRING);
        required int64 t_ns;
        required double x_mm;
        required double y_mm;
        required double z_mm;
        required boolean held_out;
        required group residual_before (LIST) { repeated group list { required float element; } }
        required group residual_after (LIST) { repeated group list { required float element; } }
    }";

/// A table of residuals being written: measured minus predicted, in counts, frame by frame, for a model before and
/// after effects were added to it, and whether the frame was held out of both fits. The other columns are those of the
/// measurement table.
///
/// Until [`ResidualWriter::finish`] the rows are in a file beside `path` with the suffix `.part`.
pub struct ResidualWriter {
    part: PartFile,
    group: RowGroup,
}

impl ResidualWriter {
    /// Begins a table of measurements of one rig.
    ///
    /// # Errors
    /// If the file cannot be created.
    pub fn create(path: impl Into<PathBuf>, rig: &Rig, simulated: bool) -> Result<Self, TableError> {
        let mut part = PartFile::create(path.into(), SCHEMA)?;
        part.metadata(RIG_METADATA_KEY, rig.to_json());
        part.metadata(SIMULATED_METADATA_KEY, simulated.to_string());
        Ok(Self { part, group: RowGroup::default() })
    }

    /// Adds a frame and the predictions of both models, one value per element.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn push(
        &mut self,
        row: &RowView<'_>,
        held_out: bool,
        before: &[f32],
        after: &[f32],
    ) -> Result<(), TableError> {
        self.group.push(row, held_out, before, after);
        if self.group.frames.rows() >= GROUP_ROWS { self.close_group() } else { Ok(()) }
    }

    /// Closes the table and moves it to its path.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn finish(mut self) -> Result<(), TableError> {
        self.close_group()?;
        self.part.finish()
    }

    fn close_group(&mut self) -> Result<(), TableError> {
        if self.group.frames.rows() == 0 {
            return Ok(());
        }
        let group = std::mem::take(&mut self.group);
        self.part.group(|writer| group.write(writer))
    }
}

impl std::fmt::Debug for ResidualWriter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ResidualWriter").field("path", self.part.path()).finish_non_exhaustive()
    }
}

/// The columns of the current row group.
#[derive(Default)]
struct RowGroup {
    frames: FrameColumns,
    held_out: Vec<bool>,
    /// Before and after, frame by frame, element by element.
    residuals: [Vec<f32>; 2],
    /// 0 where a frame's list begins.
    repeated: Vec<i16>,
}

impl RowGroup {
    fn push(&mut self, row: &RowView<'_>, held_out: bool, before: &[f32], after: &[f32]) {
        self.frames.push(row);
        self.held_out.push(held_out);
        for (column, predicted) in self.residuals.iter_mut().zip([before, after]) {
            column.extend(row.counts.iter().zip(predicted).map(|(measured, predicted)| measured - predicted));
        }
        self.repeated.extend(repetition(row.counts.len()));
    }

    fn write(&self, writer: &mut SerializedRowGroupWriter<'_, File>) -> Result<(), ParquetError> {
        self.frames.write(writer)?;
        column::<BoolType>(writer, &self.held_out, None, None)?;
        let defined = vec![1; self.repeated.len()];
        for residuals in &self.residuals {
            column::<FloatType>(writer, residuals, Some(&defined), Some(&self.repeated))?;
        }
        Ok(())
    }
}
