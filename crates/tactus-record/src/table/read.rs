//! Reads a table row by row, checking each.

use std::{
    collections::BTreeMap,
    fs::File,
    panic::{self, AssertUnwindSafe},
    path::{Path, PathBuf},
};

use parquet::{
    errors::ParquetError,
    file::{
        metadata::ParquetMetaData,
        reader::{FileReader, SerializedFileReader},
    },
};
use tactus_schema::{
    Rig,
    table::{Phase, RIG_METADATA_KEY, RowView},
};

use crate::meter;

use super::{
    TableError, TableHead,
    check::Checker,
    column::{Column, ColumnReader},
    layout::{CONTRACT, find},
};

/// A table whose metadata was read, and whose rows were not read yet.
pub(crate) struct TableReader {
    path: PathBuf,
    file: SerializedFileReader<File>,
    head: TableHead,
    /// Indices of the leaves of the contract's columns, in the contract's order.
    leaves: [usize; CONTRACT.len()],
}

impl TableReader {
    /// Opens a table.
    pub(crate) fn open(path: &Path) -> Result<Self, TableError> {
        let file = File::open(path);
        let file = file.map_err(|source| TableError::Io { action: "open", path: path.to_owned(), source })?;
        let failed = |source| TableError::Parquet { path: path.to_owned(), source };
        let bytes = file
            .metadata()
            .map_err(|source| TableError::Io { action: "read", path: path.to_owned(), source })?
            .len();
        let file = SerializedFileReader::new(file).map_err(failed)?;
        within(file.metadata(), bytes).map_err(failed)?;
        let head = head(path, file.metadata())?;
        let leaves = leaves(path, file.metadata())?;
        Ok(Self { path: path.to_owned(), file, head, leaves })
    }

    /// Path of the table.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The table's metadata.
    pub(crate) fn head(&self) -> &TableHead {
        &self.head
    }

    /// Checks every row and calls `take` for it, in order; one row group at a time is in memory.
    pub(crate) fn visit<E: From<TableError>>(
        self,
        mut take: impl FnMut(RowView<'_>) -> Result<(), E>,
    ) -> Result<TableHead, E> {
        let Self { path, file, head, leaves } = self;
        let elements = head.rig.array.elements();
        let mut checker = Checker::new(&head.rig);
        let mut first_row = 0;
        for index in 0..file.num_row_groups() {
            let group = file.get_row_group(index);
            let group = group.map_err(|source| TableError::Parquet { path: path.clone(), source })?;
            let source = ColumnReader { path: &path, group: group.as_ref(), first_row };
            let group = undamaged(&path, index, || RowGroup::read(&source, &leaves, elements))?;
            first_row += group.visit(&source, &mut checker, &mut take)?;
            meter::count(u64::try_from(file.metadata().row_group(index).compressed_size()).unwrap_or(0));
        }
        Ok(head)
    }
}

/// Checks that every column lies within the file, which the library takes for granted.
fn within(metadata: &ParquetMetaData, file_bytes: u64) -> Result<(), ParquetError> {
    for (index, group) in metadata.row_groups().iter().enumerate() {
        for column in group.columns() {
            let start = column.dictionary_page_offset().unwrap_or_else(|| column.data_page_offset());
            let end = u64::try_from(start).ok().zip(u64::try_from(column.compressed_size()).ok());
            if end.and_then(|(start, length)| start.checked_add(length)).is_none_or(|end| end > file_bytes) {
                let name = column.column_path().string();
                return Err(ParquetError::EOF(format!(
                    "row group {index}, column {name}: not within the file"
                )));
            }
        }
    }
    Ok(())
}

/// Decodes a row group. The library's decoders panic on some damaged pages (out-of-range slices, a dictionary that is
/// used but not there); nothing outlives the call but the result, so that is turned into the error it should be.
fn undamaged(
    path: &Path,
    index: usize,
    decode: impl FnOnce() -> Result<RowGroup, TableError>,
) -> Result<RowGroup, TableError> {
    panic::catch_unwind(AssertUnwindSafe(decode)).unwrap_or_else(|_| {
        let source = ParquetError::General(format!("row group {index}: its pages are damaged"));
        Err(TableError::Parquet { path: path.to_owned(), source })
    })
}

fn head(path: &Path, metadata: &ParquetMetaData) -> Result<TableHead, TableError> {
    let pairs = metadata.file_metadata().key_value_metadata().into_iter().flatten();
    let metadata: BTreeMap<String, String> =
        pairs.filter_map(|pair| Some((pair.key.clone(), pair.value.clone()?))).collect();
    let json = metadata.get(RIG_METADATA_KEY);
    let json = json.ok_or_else(|| TableError::RigMissing { path: path.to_owned() })?;
    match Rig::from_json(json) {
        Ok(rig) => Ok(TableHead { rig, metadata }),
        Err(source) => Err(TableError::Rig { path: path.to_owned(), source }),
    }
}

fn leaves(path: &Path, metadata: &ParquetMetaData) -> Result<[usize; CONTRACT.len()], TableError> {
    let schema = metadata.file_metadata().schema_descr();
    let mut leaves = [0; CONTRACT.len()];
    for (leaf, (name, kind)) in leaves.iter_mut().zip(CONTRACT) {
        *leaf = find(schema, name, kind).map_err(|misfit| misfit.into_error(path, name, kind.name()))?;
    }
    Ok(leaves)
}

/// One row group in memory.
struct RowGroup {
    run: Vec<String>,
    press: Vec<i32>,
    phase: Vec<String>,
    t_ns: Vec<i64>,
    position_mm: [Vec<f64>; 3],
    covering_mm: Vec<f64>,
    indenter: Vec<String>,
    temperature_c: Vec<Option<f64>>,
    counts: Column<f32>,
}

impl RowGroup {
    fn read(
        source: &ColumnReader<'_>,
        leaves: &[usize; CONTRACT.len()],
        elements: usize,
    ) -> Result<Self, TableError> {
        let [run, press, phase, t_ns, x_mm, y_mm, z_mm, covering_mm, indenter, temperature_c, counts] =
            *leaves;
        let t_ns = source.int64s(t_ns, "t_ns")?;
        Ok(Self {
            run: source.texts(run, "run")?,
            press: source.int32s(press, "press")?,
            phase: source.texts(phase, "phase")?,
            position_mm: [
                source.float64s(x_mm, "x_mm")?,
                source.float64s(y_mm, "y_mm")?,
                source.float64s(z_mm, "z_mm")?,
            ],
            covering_mm: source.float64s(covering_mm, "covering_mm")?,
            indenter: source.texts(indenter, "indenter")?,
            temperature_c: source.optional_float64s(temperature_c, "temperature_c", t_ns.len())?,
            counts: source.lists(counts, "counts", elements)?,
            t_ns,
        })
    }

    /// Checks every row and calls `take` for it; returns the number of rows.
    fn visit<E: From<TableError>>(
        &self,
        source: &ColumnReader<'_>,
        checker: &mut Checker,
        take: &mut impl FnMut(RowView<'_>) -> Result<(), E>,
    ) -> Result<u64, E> {
        for row in 0..self.t_ns.len() {
            let phase = Phase::from_name(&self.phase[row]).ok_or_else(|| {
                let known = Phase::ALL.map(Phase::name).join(", ");
                source.fault(row, "phase", format!("{:?}; one of {known}", self.phase[row]))
            })?;
            let view = RowView {
                run: &self.run[row],
                press: self.press[row],
                phase,
                t_ns: self.t_ns[row],
                position_mm: [self.position_mm[0][row], self.position_mm[1][row], self.position_mm[2][row]],
                covering_mm: self.covering_mm[row],
                indenter: &self.indenter[row],
                temperature_c: self.temperature_c[row],
                counts: self.counts.row(row),
            };
            let number = source.first_row + row as u64;
            checker.check(&view).map_err(|fault| fault.at(source.path, number))?;
            take(view)?;
        }
        Ok(self.t_ns.len() as u64)
    }
}
