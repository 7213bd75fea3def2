//! A data set: the measurement table of a simulated experiment, and its label.

use std::path::Path;

use tactus_record::table::{RowView, TableError, TableWriter};
use tactus_schema::Rig;
use tactus_schema::table::Phase;

use crate::label::Label;

/// A measurement table in memory, and the truth about it.
#[derive(Debug, Clone)]
pub struct DataSet {
    /// The declared rig.
    pub rig: Rig,
    /// In order of time.
    pub runs: Vec<SetRun>,
    /// Counts of all frames of all runs, frame by frame, one value per element.
    pub counts: Vec<f32>,
    /// The truth, which is not in the table.
    pub label: Label,
}

/// One run of a data set.
#[derive(Debug, Clone)]
pub struct SetRun {
    /// Run id, unique in the set.
    pub id: String,
    /// Thickness of the covering.
    pub covering_mm: f64,
    /// In order of time.
    pub frames: Vec<FrameContext>,
}

/// A row of the measurement table without what the run and the counts give.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameContext {
    /// Press index; -1 outside a press.
    pub press: i32,
    /// What the stage is doing.
    pub phase: Phase,
    /// Time of sampling since the start of the run.
    pub t_ns: i64,
    /// Stage position, robot frame.
    pub position_mm: [f64; 3],
    /// Temperature, if the rig measures it.
    pub temperature_c: Option<f64>,
}

impl DataSet {
    /// Writes the measurement table.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), TableError> {
        let mut table = TableWriter::create(path.as_ref(), &self.rig.to_json())?;
        let mut counts = self.counts.chunks_exact(self.rig.array.elements());
        for run in &self.runs {
            for (row, counts) in run.frames.iter().zip(&mut counts) {
                let &FrameContext { press, phase, t_ns, position_mm, temperature_c } = row;
                table.push(RowView {
                    run: &run.id,
                    press,
                    phase,
                    t_ns,
                    position_mm,
                    covering_mm: run.covering_mm,
                    indenter: &self.rig.indenter,
                    temperature_c,
                    counts,
                })?;
            }
        }
        table.finish().map(drop)
    }
}
