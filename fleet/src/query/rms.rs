//! `rms(list)`.

use std::sync::Arc;

use arrow::{array::Float64Array, datatypes::DataType};
use datafusion::{
    error::Result,
    logical_expr::{ColumnarValue, ScalarFunctionArgs, ScalarUDFImpl, Signature, Volatility},
};

use super::lists::{Lists, one_list};

/// Root mean square of a list's numbers, in their unit.
#[derive(Debug, PartialEq, Eq, Hash)]
pub(super) struct Rms {
    signature: Signature,
}

impl Rms {
    pub(super) fn new() -> Self {
        Self { signature: Signature::user_defined(Volatility::Immutable) }
    }
}

impl ScalarUDFImpl for Rms {
    fn name(&self) -> &'static str {
        "rms"
    }

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn coerce_types(&self, arguments: &[DataType]) -> Result<Vec<DataType>> {
        one_list(self.name(), arguments)
    }

    fn return_type(&self, _: &[DataType]) -> Result<DataType> {
        Ok(DataType::Float64)
    }

    fn invoke_with_args(&self, args: ScalarFunctionArgs) -> Result<ColumnarValue> {
        let columns = ColumnarValue::values_to_arrays(&args.args)?;
        let lists = Lists::of(&columns[0])?;
        let rms = |numbers: &[f64]| {
            (numbers.iter().map(|number| number * number).sum::<f64>() / numbers.len() as f64).sqrt()
        };
        let values: Float64Array = lists.iter().map(|numbers| numbers.map(rms)).collect();
        Ok(ColumnarValue::Array(Arc::new(values)))
    }
}
