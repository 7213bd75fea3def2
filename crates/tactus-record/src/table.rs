//! Measurement tables as files: written, read and checked, whichever program wrote them.
//!
//! [`tactus_schema::table`] defines the contract. Types are exact: a column of another type is refused with its
//! name. Physical layout is free: nullable or not, plain or dictionary, any of the ways in which Parquet writes
//! lists, snappy, zstd or no compression, columns in any order, and additional columns (which are ignored).

mod check;
mod column;
mod csv;
mod error;
mod format;
mod layout;
mod npz;
mod part_file;
mod plain_part;
mod read;
mod residuals;
mod write;

use std::{collections::BTreeMap, ops::Range, path::Path, sync::Arc};

use tactus_schema::{
    Rig,
    table::{Phase, RowView},
};

pub use error::TableError;
pub use format::TableFormat;
pub use residuals::ResidualWriter;
pub use write::TableWriter;

pub(crate) use check::Checker;
pub(crate) use format::FormatWriter;
pub(crate) use read::TableReader;

/// A checked measurement table in memory, by columns.
#[derive(Debug, Clone)]
pub struct Table {
    head: TableHead,
    runs: Vec<RunRows>,
    press: Vec<i32>,
    phase: Vec<Phase>,
    t_ns: Vec<i64>,
    position_mm: Vec<[f64; 3]>,
    covering_mm: Vec<f64>,
    indenter: Vec<Arc<str>>,
    temperature_c: Vec<Option<f64>>,
    counts: Vec<f32>,
}

/// The metadata of a table.
#[derive(Debug, Clone)]
pub struct TableHead {
    /// The measured rig.
    pub rig: Rig,
    /// The file's key-value metadata, including the rig's text.
    pub metadata: BTreeMap<String, String>,
}

/// The rows of one run in a [`Table`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunRows {
    /// Run id.
    pub run: Arc<str>,
    /// Indices of its rows, in order of time.
    pub rows: Range<usize>,
}

/// The size of a valid table.
#[derive(Debug, Clone)]
pub struct Validated {
    /// The table's metadata.
    pub head: TableHead,
    /// Number of rows.
    pub rows: u64,
    /// Number of runs.
    pub runs: u64,
}

/// Reads a table into memory and checks it.
///
/// # Errors
/// [`TableError`] names the column, and the row where there is one.
pub fn read(path: impl AsRef<Path>) -> Result<Table, TableError> {
    let mut rows = TableBuilder::default();
    let head = TableReader::open(path.as_ref())?.visit(|row| {
        rows.push(row);
        Ok::<_, TableError>(())
    })?;
    Ok(rows.into_table(head))
}

/// Checks a table without keeping it.
///
/// # Errors
/// As [`read()`].
pub fn validate(path: impl AsRef<Path>) -> Result<Validated, TableError> {
    let (mut rows, mut runs, mut last) = (0, 0, String::new());
    let head = TableReader::open(path.as_ref())?.visit(|row| {
        rows += 1;
        if rows == 1 || last != row.run {
            runs += 1;
            row.run.clone_into(&mut last);
        }
        Ok::<_, TableError>(())
    })?;
    Ok(Validated { head, rows, runs })
}

impl Table {
    /// The table's metadata.
    pub fn head(&self) -> &TableHead {
        &self.head
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.t_ns.len()
    }

    /// True if it has no rows.
    pub fn is_empty(&self) -> bool {
        self.t_ns.is_empty()
    }

    /// The runs, in the table's order.
    pub fn runs(&self) -> &[RunRows] {
        &self.runs
    }

    /// All rows, in order.
    pub fn rows(&self) -> impl Iterator<Item = RowView<'_>> {
        let elements = self.head.rig.array.elements();
        self.runs.iter().flat_map(move |run| {
            run.rows.clone().map(move |row| RowView {
                run: &run.run,
                press: self.press[row],
                phase: self.phase[row],
                t_ns: self.t_ns[row],
                position_mm: self.position_mm[row],
                covering_mm: self.covering_mm[row],
                indenter: &self.indenter[row],
                temperature_c: self.temperature_c[row],
                counts: &self.counts[row * elements..(row + 1) * elements],
            })
        })
    }

    /// Sampling times, one per row.
    pub fn t_ns(&self) -> &[i64] {
        &self.t_ns
    }

    /// Raw counts of all rows, row after row; each row has one per element.
    pub fn counts(&self) -> &[f32] {
        &self.counts
    }
}

/// Collects the rows of a [`Table`].
#[derive(Default)]
struct TableBuilder {
    runs: Vec<RunRows>,
    press: Vec<i32>,
    phase: Vec<Phase>,
    t_ns: Vec<i64>,
    position_mm: Vec<[f64; 3]>,
    covering_mm: Vec<f64>,
    indenter: Vec<Arc<str>>,
    temperature_c: Vec<Option<f64>>,
    counts: Vec<f32>,
}

impl TableBuilder {
    fn push(&mut self, row: RowView<'_>) {
        let index = self.t_ns.len();
        match self.runs.last_mut() {
            Some(last) if *last.run == *row.run => last.rows.end = index + 1,
            _ => self.runs.push(RunRows { run: row.run.into(), rows: index..index + 1 }),
        }
        let indenter = match self.indenter.last() {
            Some(last) if **last == *row.indenter => Arc::clone(last),
            _ => row.indenter.into(),
        };
        self.indenter.push(indenter);
        self.press.push(row.press);
        self.phase.push(row.phase);
        self.t_ns.push(row.t_ns);
        self.position_mm.push(row.position_mm);
        self.covering_mm.push(row.covering_mm);
        self.temperature_c.push(row.temperature_c);
        self.counts.extend_from_slice(row.counts);
    }

    fn into_table(self, head: TableHead) -> Table {
        let Self { runs, press, phase, t_ns, position_mm, covering_mm, indenter, temperature_c, counts } =
            self;
        Table { head, runs, press, phase, t_ns, position_mm, covering_mm, indenter, temperature_c, counts }
    }
}
