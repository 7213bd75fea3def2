//! The table of runs, from the heads of the files.

use std::sync::Arc;

use arrow::{
    array::{
        ArrayRef, BooleanArray, Int64Array, ListBuilder, RecordBatch, StringBuilder, StringViewArray,
        TimestampMicrosecondArray,
    },
    compute::cast,
    datatypes::{DataType, Field, Schema, SchemaRef, TimeUnit},
};
use async_trait::async_trait;
use datafusion::{
    catalog::{Session, TableProvider},
    datasource::memory::MemorySourceConfig,
    error::{DataFusionError, Result},
    logical_expr::{Expr, TableType},
    physical_plan::ExecutionPlan,
};

use crate::{Place, run_head::Described};

/// One row for each run. The ends of all files are read when a query wants it.
#[derive(Debug)]
pub(crate) struct Runs {
    place: Place,
    schema: SchemaRef,
}

impl Runs {
    pub(crate) fn new(place: Place) -> Self {
        let required = |name: &str, kind| Field::new(name, kind, false);
        let optional = |name: &str, kind| Field::new(name, kind, true);
        let schema = Schema::new(vec![
            required("rig", DataType::Utf8View),
            required("date", DataType::Date32),
            required("run", DataType::Utf8View),
            optional("started", DataType::Timestamp(TimeUnit::Microsecond, None)),
            required("simulated", DataType::Boolean),
            optional("experiment", DataType::Utf8View),
            optional("script", DataType::Utf8View),
            optional("who", DataType::Utf8View),
            optional("continues", DataType::Utf8View),
            optional("continued_by", DataType::Utf8View),
            required("frames", DataType::Int64),
            required("bytes", DataType::Int64),
            required("warnings", DataType::List(Arc::new(Field::new_list_field(DataType::Utf8, true)))),
            required("description", DataType::Utf8View),
        ]);
        Self { place, schema: Arc::new(schema) }
    }

    #[cfg(feature = "cluster")]
    pub(crate) fn place(&self) -> &Place {
        &self.place
    }

    fn rows(&self, runs: &[Described]) -> Result<RecordBatch> {
        let text = |of: fn(&Described) -> Option<&str>| {
            Arc::new(runs.iter().map(of).collect::<StringViewArray>()) as ArrayRef
        };
        let dates = text(|run| Some(&run.head.date));
        let started = runs.iter().map(|run| run.head.started_ns.map(|ns| ns.div_euclid(1000)));
        let simulated: BooleanArray = runs.iter().map(|run| Some(run.head.simulated)).collect();
        let mut warnings = ListBuilder::new(StringBuilder::new());
        for run in runs {
            warnings.append_value(run.head.warnings.iter().map(Some));
        }
        let columns: Vec<ArrayRef> = vec![
            text(|run| Some(&run.head.rig)),
            cast(&dates, &DataType::Date32)?,
            text(|run| Some(&run.head.run)),
            Arc::new(started.collect::<TimestampMicrosecondArray>()),
            Arc::new(simulated),
            text(|run| run.head.experiment.as_deref()),
            text(|run| run.head.script.as_deref()),
            text(|run| run.head.who.as_deref()),
            text(|run| run.head.continues.as_deref()),
            text(|run| run.head.continued_by.as_deref()),
            Arc::new(runs.iter().map(|run| Some(run.frames)).collect::<Int64Array>()),
            Arc::new(runs.iter().map(|run| i64::try_from(run.bytes).ok()).collect::<Int64Array>()),
            Arc::new(warnings.finish()),
            text(|run| Some(&run.rig_json)),
        ];
        Ok(RecordBatch::try_new(Arc::clone(&self.schema), columns)?)
    }
}

#[async_trait]
impl TableProvider for Runs {
    fn schema(&self) -> SchemaRef {
        Arc::clone(&self.schema)
    }

    fn table_type(&self) -> TableType {
        TableType::Base
    }

    async fn scan(
        &self,
        _: &dyn Session,
        columns: Option<&Vec<usize>>,
        _: &[Expr],
        _: Option<usize>,
    ) -> Result<Arc<dyn ExecutionPlan>> {
        let runs =
            Described::all(&self.place).await.map_err(|error| DataFusionError::External(error.into()))?;
        let mut rows = self.rows(&runs)?;
        // A cluster sends them: descriptions are long.
        if let Some(columns) = columns {
            rows = rows.project(columns)?;
        }
        let schema = rows.schema();
        Ok(MemorySourceConfig::try_new_exec(&[vec![rows]], schema, None)?)
    }
}
