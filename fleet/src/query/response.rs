//! `response(image, zeros)`.

use std::sync::Arc;

use arrow::{
    array::{Float64Builder, ListBuilder},
    datatypes::DataType,
};
use datafusion::{
    common::{exec_err, plan_err},
    error::Result,
    logical_expr::{ColumnarValue, ScalarFunctionArgs, ScalarUDFImpl, Signature, Volatility},
};

use super::lists::{Lists, list_type, one_list};

/// How far each element is above its zero, in the unit of the lists: `image - zeros`.
#[derive(Debug, PartialEq, Eq, Hash)]
pub(super) struct Response {
    signature: Signature,
}

impl Response {
    pub(super) fn new() -> Self {
        Self { signature: Signature::user_defined(Volatility::Immutable) }
    }
}

impl ScalarUDFImpl for Response {
    fn name(&self) -> &'static str {
        "response"
    }

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn coerce_types(&self, arguments: &[DataType]) -> Result<Vec<DataType>> {
        let [image, zeros] = arguments else {
            return plan_err!("response() takes two lists: response(image, zeros)");
        };
        Ok([
            one_list(self.name(), std::slice::from_ref(image))?,
            one_list(self.name(), std::slice::from_ref(zeros))?,
        ]
        .concat())
    }

    fn return_type(&self, _: &[DataType]) -> Result<DataType> {
        Ok(list_type())
    }

    fn invoke_with_args(&self, args: ScalarFunctionArgs) -> Result<ColumnarValue> {
        let columns = ColumnarValue::values_to_arrays(&args.args)?;
        let (images, zeros) = (Lists::of(&columns[0])?, Lists::of(&columns[1])?);
        let mut responses = ListBuilder::new(Float64Builder::new());
        for both in images.iter().zip(zeros.iter()) {
            let (Some(image), Some(zeros)) = both else {
                responses.append_null();
                continue;
            };
            if image.len() != zeros.len() {
                return exec_err!("response() of {} elements and {} zeros", image.len(), zeros.len());
            }
            responses.append_value(image.iter().zip(zeros).map(|(counts, zero)| Some(counts - zero)));
        }
        Ok(ColumnarValue::Array(Arc::new(responses.finish())))
    }
}
