//! A data set: the measurement table of a simulated experiment, and its label.

use std::path::Path;

use tactus_record::table::{TableError, TableWriter};
use tactus_schema::Rig;
use tactus_schema::table::Row;

use crate::label::Label;

/// A measurement table in memory, and the truth about it.
#[derive(Debug, Clone)]
pub struct DataSet {
    /// The declared rig.
    pub rig: Rig,
    /// The rows of all runs, run after run.
    pub rows: Vec<Row>,
    /// The truth, which is not in the table.
    pub label: Label,
}

impl DataSet {
    /// Writes the measurement table.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), TableError> {
        let mut table = TableWriter::create(path.as_ref(), &self.rig.to_json())?;
        for row in &self.rows {
            table.push(row.into())?;
        }
        table.finish().map(drop)
    }
}
