//! A set: the measurement table of a simulated experiment, and its label.

use std::path::Path;

use tactus_record::table::{RowView, TableError, TableWriter};
use tactus_schema::Rig;
use tactus_schema::table::Phase;

use crate::label::Label;

/// A measurement table in memory, and the truth about it.
#[derive(Debug, Clone)]
pub struct DataSet {
    /// The rig as declared.
    pub rig: Rig,
    /// The runs, one after the other.
    pub runs: Vec<SetRun>,
    /// Counts of all rows of all runs, one value per element.
    pub counts: Vec<f32>,
    /// The truth, which does not stand in the table.
    pub label: Label,
}

/// One run of a set.
#[derive(Debug, Clone)]
pub struct SetRun {
    /// Its id.
    pub id: String,
    /// Thickness of the covering in place.
    pub covering_mm: f64,
    /// Its rows, in order of time.
    pub rows: Vec<FrameContext>,
}

/// One frame of a run, but for its counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameContext {
    /// Press index; -1 outside a press.
    pub press: i32,
    /// What the stage does.
    pub phase: Phase,
    /// Time of sampling since the run began.
    pub t_ns: i64,
    /// Stage position.
    pub position_mm: [f64; 3],
    /// Temperature, if it is measured.
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
            for (row, counts) in run.rows.iter().zip(&mut counts) {
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
