//! Reads one column of one row group.

use std::path::Path;

use parquet::{
    column::reader::{ColumnReaderImpl, get_typed_column_reader},
    data_type::{ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int32Type, Int64Type},
    errors::ParquetError,
    file::reader::RowGroupReader,
    schema::types::ColumnDescriptor,
};

use super::TableError;

/// Rows read at once, so that a wrong number of rows in a damaged file costs no memory.
const BATCH_ROWS: usize = 8192;

/// More values in one column of a row group are refused: a file of a few bytes can claim any number of equal ones.
const GROUP_VALUES_MAX: usize = 1 << 27;

/// Longer texts are refused.
const TEXT_MAX_BYTES: usize = 256;

/// The values of a column, grouped by row.
pub(super) struct Column<T> {
    /// All values that are not null.
    values: Vec<T>,
    /// Where each row's values begin; one more than there are rows.
    starts: Vec<usize>,
    /// Rows that are null, or lists that hold a null or are null, in order.
    null_rows: Vec<usize>,
}

/// Reads columns of one row group; knows the file for errors.
pub(super) struct ColumnReader<'a> {
    pub(super) path: &'a Path,
    pub(super) group: &'a dyn RowGroupReader,
    pub(super) first_row: u64,
}

impl<T> Column<T> {
    pub(super) fn rows(&self) -> usize {
        self.starts.len() - 1
    }

    /// The values of one row: one, or any number of a list; none if it is null.
    pub(super) fn row(&self, row: usize) -> &[T] {
        &self.values[self.starts[row]..self.starts[row + 1]]
    }
}

impl ColumnReader<'_> {
    /// Reads a column of texts; null is an error.
    pub(super) fn texts(&self, leaf: usize, name: &'static str) -> Result<Vec<String>, TableError> {
        let column = self.column::<ByteArrayType>(leaf, name, 1)?;
        self.no_nulls(&column, name)?;
        let text = |(row, bytes): (usize, &ByteArray)| match bytes.as_utf8() {
            Ok(text) if text.len() <= TEXT_MAX_BYTES => Ok(text.to_owned()),
            Ok(text) => Err(self.fault(row, name, format!("{} bytes; at most {TEXT_MAX_BYTES}", text.len()))),
            Err(_) => Err(self.fault(row, name, "not UTF-8".into())),
        };
        column.values.iter().enumerate().map(text).collect()
    }

    /// Reads a column of 32-bit integers; null is an error.
    pub(super) fn int32s(&self, leaf: usize, name: &'static str) -> Result<Vec<i32>, TableError> {
        let column = self.column::<Int32Type>(leaf, name, 1)?;
        self.no_nulls(&column, name)?;
        Ok(column.values)
    }

    /// Reads a column of 64-bit integers; null is an error.
    pub(super) fn int64s(&self, leaf: usize, name: &'static str) -> Result<Vec<i64>, TableError> {
        let column = self.column::<Int64Type>(leaf, name, 1)?;
        self.no_nulls(&column, name)?;
        Ok(column.values)
    }

    /// Reads a column of numbers; null is an error.
    pub(super) fn float64s(&self, leaf: usize, name: &'static str) -> Result<Vec<f64>, TableError> {
        let column = self.column::<DoubleType>(leaf, name, 1)?;
        self.no_nulls(&column, name)?;
        Ok(column.values)
    }

    /// Reads a column of numbers or nulls; a column of Parquet's null type, whatever its physical type, is all null.
    pub(super) fn optional_float64s(
        &self,
        leaf: usize,
        name: &'static str,
        rows: usize,
    ) -> Result<Vec<Option<f64>>, TableError> {
        if self.group.metadata().column(leaf).column_type() != DoubleType::get_physical_type() {
            return Ok(vec![None; rows]);
        }
        let column = self.column::<DoubleType>(leaf, name, 1)?;
        Ok((0..column.rows()).map(|row| column.row(row).first().copied()).collect())
    }

    /// Reads a column of lists of `length` numbers; null lists and null elements are errors.
    pub(super) fn lists(
        &self,
        leaf: usize,
        name: &'static str,
        length: usize,
    ) -> Result<Column<f32>, TableError> {
        let column = self.column::<FloatType>(leaf, name, length)?;
        self.no_nulls(&column, name)?;
        Ok(column)
    }

    pub(super) fn fault(&self, row: usize, column: &'static str, problem: String) -> TableError {
        TableError::Value { path: self.path.to_owned(), row: self.first_row + row as u64, column, problem }
    }

    fn no_nulls<T>(&self, column: &Column<T>, name: &'static str) -> Result<(), TableError> {
        match column.null_rows.first() {
            Some(&row) => Err(self.fault(row, name, "null".into())),
            None => Ok(()),
        }
    }

    /// Reads a column with `per_row` values in each row.
    fn column<T: DataType>(
        &self,
        leaf: usize,
        name: &'static str,
        per_row: usize,
    ) -> Result<Column<T::T>, TableError> {
        let descriptor = self.group.metadata().column(leaf).column_descr_ptr();
        let failed = |source: ParquetError| TableError::Parquet { path: self.path.to_owned(), source };
        self.check_values(leaf, name, per_row).map_err(failed)?;
        let reader = get_typed_column_reader::<T>(self.group.get_column_reader(leaf).map_err(failed)?);
        let levels = Levels::read(reader).map_err(failed)?;
        let column = levels.into_column(DefinitionLevels::of(&descriptor));
        let expected = self.rows();
        if column.rows() == expected {
            return Ok(column);
        }
        let (path, group, found) = (self.path.to_owned(), self.index(), column.rows());
        Err(TableError::ColumnLength { path, column: name, group, found, expected })
    }

    /// Checks how many values the pages claim, before they are decoded: they may be run lengths. Up to twice as many as there
    /// should be are let through, so that the row that is wrong can be named.
    fn check_values(&self, leaf: usize, name: &str, per_row: usize) -> Result<(), ParquetError> {
        let expected = self.rows().saturating_mul(per_row);
        let most = expected.saturating_mul(2).saturating_add(BATCH_ROWS).min(GROUP_VALUES_MAX);
        let mut claimed = 0_usize;
        let mut pages = self.group.get_column_page_reader(leaf)?;
        while let Some(page) = pages.peek_next_page()? {
            claimed = claimed.saturating_add(page.num_levels.unwrap_or(0));
            if claimed > most {
                return Err(ParquetError::General(format!(
                    "row group {}, column {name}: more than {most} values for {} rows; a row group may have \
                     {GROUP_VALUES_MAX} at most",
                    self.index(),
                    self.rows()
                )));
            }
            pages.skip_next_page()?;
        }
        Ok(())
    }

    fn rows(&self) -> usize {
        usize::try_from(self.group.metadata().num_rows()).unwrap_or(0)
    }

    fn index(&self) -> usize {
        usize::try_from(self.group.metadata().ordinal().unwrap_or(0)).unwrap_or(0)
    }
}

/// Values and levels as Parquet stores them: a value with a repetition level above 0 belongs to the same row as the one
/// before; a definition level below the greatest means that there is no value.
struct Levels<T> {
    values: Vec<T>,
    definition: Vec<i16>,
    repetition: Vec<i16>,
}

/// What the definition levels of a column mean.
#[derive(Clone, Copy)]
struct DefinitionLevels {
    /// The level of a value; 0 if there can be no nulls.
    defined: i16,
    /// The level of a list without elements; the check of its length reports it.
    empty_list: Option<i16>,
}

impl DefinitionLevels {
    fn of(column: &ColumnDescriptor) -> Self {
        let defined = column.max_def_level();
        let entry = defined - i16::from(column.self_type().is_optional());
        Self { defined, empty_list: (column.max_rep_level() > 0).then_some(entry - 1) }
    }
}

impl<T> Levels<T> {
    fn read<D: DataType<T = T>>(mut reader: ColumnReaderImpl<D>) -> Result<Self, ParquetError> {
        let mut levels = Self { values: Vec::new(), definition: Vec::new(), repetition: Vec::new() };
        loop {
            let Self { values, definition, repetition } = &mut levels;
            let (records, _, _) =
                reader.read_records(BATCH_ROWS, Some(definition), Some(repetition), values)?;
            if records == 0 {
                return Ok(levels);
            }
        }
    }

    fn into_column(self, form: DefinitionLevels) -> Column<T> {
        let Self { values, definition, repetition } = self;
        if form.defined == 0 {
            return Column { starts: (0..=values.len()).collect(), values, null_rows: Vec::new() };
        }
        let (mut starts, mut null_rows, mut taken) = (Vec::new(), Vec::new(), 0);
        for (index, &level) in definition.iter().enumerate() {
            if repetition.get(index).is_none_or(|repeated| *repeated == 0) {
                starts.push(taken);
            }
            let row = starts.len().saturating_sub(1);
            if level == form.defined {
                taken += 1;
            } else if form.empty_list != Some(level) && null_rows.last() != Some(&row) {
                null_rows.push(row);
            }
        }
        starts.push(taken);
        Column { values, starts, null_rows }
    }
}
