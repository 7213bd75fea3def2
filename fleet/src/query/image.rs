//! `image(counts)`: the mean image of frames.

use std::{mem::size_of_val, sync::Arc};

use arrow::{
    array::{ArrayRef, AsArray as _, ListArray},
    datatypes::{DataType, Field, FieldRef, Float64Type, UInt64Type},
};
use datafusion::{
    common::exec_err,
    error::Result,
    logical_expr::{
        Accumulator, AggregateUDFImpl, Signature, Volatility,
        function::{AccumulatorArgs, StateFieldsArgs},
        utils::format_state_name,
    },
    scalar::ScalarValue,
};

use super::lists::{Lists, list_type, one_list};

/// The mean of each element over frames, in counts, row-major. Frames without counts do not count.
#[derive(Debug, PartialEq, Eq, Hash)]
pub(super) struct Image {
    signature: Signature,
}

impl Image {
    pub(super) fn new() -> Self {
        Self { signature: Signature::user_defined(Volatility::Immutable) }
    }
}

impl AggregateUDFImpl for Image {
    fn name(&self) -> &'static str {
        "image"
    }

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn coerce_types(&self, arguments: &[DataType]) -> Result<Vec<DataType>> {
        one_list(self.name(), arguments)
    }

    fn return_type(&self, _: &[DataType]) -> Result<DataType> {
        Ok(list_type())
    }

    fn state_fields(&self, args: StateFieldsArgs<'_>) -> Result<Vec<FieldRef>> {
        let field = |name, kind| Arc::new(Field::new(format_state_name(args.name, name), kind, true));
        Ok(vec![field("sums", list_type()), field("frames", DataType::UInt64)])
    }

    fn accumulator(&self, _: AccumulatorArgs<'_>) -> Result<Box<dyn Accumulator>> {
        Ok(Box::new(Sums::default()))
    }
}

/// Sums of each element.
#[derive(Debug, Default)]
struct Sums {
    sums: Vec<f64>,
    frames: u64,
}

impl Sums {
    fn add(&mut self, counts: &[f64], frames: u64) -> Result<()> {
        if self.frames == 0 {
            self.sums = vec![0.0; counts.len()];
        }
        if self.sums.len() != counts.len() {
            return exec_err!(
                "image() of frames with {} and with {} elements: group them by rig",
                self.sums.len(),
                counts.len()
            );
        }
        for (sum, counts) in self.sums.iter_mut().zip(counts) {
            *sum += counts;
        }
        self.frames += frames;
        Ok(())
    }
}

impl Accumulator for Sums {
    fn update_batch(&mut self, columns: &[ArrayRef]) -> Result<()> {
        Lists::of(&columns[0])?.iter().flatten().try_for_each(|counts| self.add(counts, 1))
    }

    fn merge_batch(&mut self, states: &[ArrayRef]) -> Result<()> {
        let frames = states[1].as_primitive::<UInt64Type>();
        let sums = Lists::of(&states[0])?;
        // A state of no frames has no sums.
        sums.iter().zip(frames).try_for_each(|state| match state {
            (Some(sums), Some(frames)) if frames > 0 => self.add(sums, frames),
            _ => Ok(()),
        })
    }

    fn state(&mut self) -> Result<Vec<ScalarValue>> {
        let sums = std::mem::take(&mut self.sums);
        Ok(vec![list_value(sums), ScalarValue::UInt64(Some(self.frames))])
    }

    fn evaluate(&mut self) -> Result<ScalarValue> {
        if self.frames == 0 {
            return ScalarValue::try_from(&list_type());
        }
        Ok(list_value(self.sums.iter().map(|sum| sum / self.frames as f64).collect()))
    }

    fn size(&self) -> usize {
        size_of_val(self) + self.sums.capacity() * size_of::<f64>()
    }
}

fn list_value(numbers: Vec<f64>) -> ScalarValue {
    let numbers = numbers.into_iter().map(Some);
    ScalarValue::List(Arc::new(ListArray::from_iter_primitive::<Float64Type, _, _>([Some(numbers)])))
}
