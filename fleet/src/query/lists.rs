//! Columns of lists as slices of numbers.

use std::sync::Arc;

use arrow::{
    array::{Array as _, ArrayRef, AsArray as _, Float64Array},
    buffer::{NullBuffer, OffsetBuffer},
    compute::cast,
    datatypes::{DataType, Field, Float64Type},
};
use datafusion::{
    common::plan_err,
    error::{DataFusionError, Result},
};

/// A list of numbers.
pub(super) fn list_type() -> DataType {
    DataType::List(Arc::new(Field::new_list_field(DataType::Float64, true)))
}

/// The type of the only argument of a function that takes a list of numbers.
pub(super) fn one_list(function: &str, arguments: &[DataType]) -> Result<Vec<DataType>> {
    match arguments {
        [list @ DataType::List(numbers)] if numbers.data_type().is_numeric() => Ok(vec![list.clone()]),
        [DataType::Null] => Ok(vec![list_type()]),
        arguments => {
            let given: Vec<String> = arguments.iter().map(ToString::to_string).collect();
            plan_err!("{function}() takes one list of numbers, not ({})", given.join(", "))
        }
    }
}

/// The lists of a column.
pub(super) struct Lists {
    numbers: Float64Array,
    offsets: OffsetBuffer<i32>,
    missing: Option<NullBuffer>,
}

impl Lists {
    pub(super) fn of(column: &ArrayRef) -> Result<Self> {
        let lists = column.as_list_opt::<i32>().ok_or_else(|| {
            DataFusionError::Internal(format!("{} where a list is expected", column.data_type()))
        })?;
        let offsets = lists.offsets();
        // A part of a column has the numbers of all of it.
        let (first, end) = (offsets[0], offsets[offsets.len() - 1]);
        let used = lists.values().slice(usize_of(first), usize_of(end - first));
        let numbers = cast(&used, &DataType::Float64)?.as_primitive::<Float64Type>().clone();
        // A missing number is none.
        let numbers = if numbers.null_count() > 0 {
            numbers.iter().map(|number| number.or(Some(f64::NAN))).collect()
        } else {
            numbers
        };
        let offsets = OffsetBuffer::new(offsets.iter().map(|offset| offset - first).collect());
        Ok(Self { numbers, offsets, missing: lists.nulls().cloned() })
    }

    /// Each list; `None` where there is none.
    pub(super) fn iter(&self) -> impl Iterator<Item = Option<&[f64]>> {
        self.offsets.windows(2).enumerate().map(|(row, ends)| {
            let is_there = self.missing.as_ref().is_none_or(|missing| missing.is_valid(row));
            is_there.then(|| &self.numbers.values()[usize_of(ends[0])..usize_of(ends[1])])
        })
    }
}

/// Offsets are not negative.
fn usize_of(offset: i32) -> usize {
    usize::try_from(offset).unwrap_or_default()
}
