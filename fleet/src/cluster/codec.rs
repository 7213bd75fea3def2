//! How what is Tactus' own in a plan goes over the network: the table of runs as the fleet's address, predictions with their model. The rest is
//! Ballista's.

use std::sync::Arc;

use arrow::datatypes::SchemaRef;
use ballista_core::serde::{BallistaLogicalExtensionCodec, BallistaPhysicalExtensionCodec};
use datafusion::{
    catalog::TableProvider,
    common::{TableReference, exec_datafusion_err},
    datasource::file_format::FileFormatFactory,
    error::{DataFusionError, Result},
    execution::TaskContext,
    logical_expr::{Extension, LogicalPlan, ScalarUDF},
    physical_plan::ExecutionPlan,
};
use datafusion_proto::{
    logical_plan::LogicalExtensionCodec,
    physical_plan::{PhysicalExtensionCodec, PhysicalProtoConverterExtension},
};

use crate::{
    Place,
    query::{Prediction, Runs},
};

/// Before the fleet's address in the bytes of a table of runs.
const RUNS: &[u8] = b"tactus.runs:";

#[derive(Debug, Default)]
pub(super) struct Codec {
    logical: BallistaLogicalExtensionCodec,
    physical: BallistaPhysicalExtensionCodec,
}

fn encode_function(function: &ScalarUDF, bytes: &mut Vec<u8>) {
    if let Some(prediction) = function.inner().downcast_ref::<Prediction>() {
        bytes.extend(prediction.model_file().join("\n").as_bytes());
    }
}

fn decode_function(name: &str, bytes: &[u8]) -> Result<Arc<ScalarUDF>> {
    let text = (name == Prediction::NAME).then(|| std::str::from_utf8(bytes).ok()).flatten();
    let (path, model) = text
        .and_then(|text| text.split_once('\n'))
        .ok_or_else(|| exec_datafusion_err!("this build has no function {name}()"))?;
    let prediction = Prediction::new(path.to_owned(), model.to_owned())?;
    Ok(Arc::new(ScalarUDF::new_from_impl(prediction)))
}

impl LogicalExtensionCodec for Codec {
    fn try_decode(&self, bytes: &[u8], inputs: &[LogicalPlan], context: &TaskContext) -> Result<Extension> {
        self.logical.try_decode(bytes, inputs, context)
    }

    fn try_encode(&self, node: &Extension, bytes: &mut Vec<u8>) -> Result<()> {
        self.logical.try_encode(node, bytes)
    }

    fn try_decode_table_provider(
        &self,
        bytes: &[u8],
        table: &TableReference,
        schema: SchemaRef,
        context: &TaskContext,
    ) -> Result<Arc<dyn TableProvider>> {
        match bytes.strip_prefix(RUNS) {
            Some(url) => {
                let place = Place::at(&String::from_utf8_lossy(url));
                Ok(Arc::new(Runs::new(place.map_err(|error| DataFusionError::External(error.into()))?)))
            }
            None => self.logical.try_decode_table_provider(bytes, table, schema, context),
        }
    }

    fn try_encode_table_provider(
        &self,
        table: &TableReference,
        provider: Arc<dyn TableProvider>,
        bytes: &mut Vec<u8>,
    ) -> Result<()> {
        match provider.downcast_ref::<Runs>() {
            Some(runs) => {
                bytes.extend(RUNS);
                bytes.extend(runs.place().url().as_str().as_bytes());
                Ok(())
            }
            None => self.logical.try_encode_table_provider(table, provider, bytes),
        }
    }

    fn try_decode_file_format(
        &self,
        bytes: &[u8],
        context: &TaskContext,
    ) -> Result<Arc<dyn FileFormatFactory>> {
        self.logical.try_decode_file_format(bytes, context)
    }

    fn try_encode_file_format(&self, bytes: &mut Vec<u8>, format: Arc<dyn FileFormatFactory>) -> Result<()> {
        self.logical.try_encode_file_format(bytes, format)
    }

    fn try_decode_udf(&self, name: &str, bytes: &[u8]) -> Result<Arc<ScalarUDF>> {
        decode_function(name, bytes)
    }

    fn try_encode_udf(&self, function: &ScalarUDF, bytes: &mut Vec<u8>) -> Result<()> {
        encode_function(function, bytes);
        Ok(())
    }
}

impl PhysicalExtensionCodec for Codec {
    fn try_decode(
        &self,
        bytes: &[u8],
        inputs: &[Arc<dyn ExecutionPlan>],
        context: &TaskContext,
        converter: &dyn PhysicalProtoConverterExtension,
    ) -> Result<Arc<dyn ExecutionPlan>> {
        self.physical.try_decode(bytes, inputs, context, converter)
    }

    fn try_encode(
        &self,
        node: Arc<dyn ExecutionPlan>,
        bytes: &mut Vec<u8>,
        converter: &dyn PhysicalProtoConverterExtension,
    ) -> Result<()> {
        self.physical.try_encode(node, bytes, converter)
    }

    fn try_decode_udf(&self, name: &str, bytes: &[u8]) -> Result<Arc<ScalarUDF>> {
        decode_function(name, bytes)
    }

    fn try_encode_udf(&self, function: &ScalarUDF, bytes: &mut Vec<u8>) -> Result<()> {
        encode_function(function, bytes);
        Ok(())
    }
}
