//! The columns of a run's file, and its rows as Arrow batches.
//!
//! The first eleven are those of the measurement table ([`tactus_schema::table`]), the rest is what queries need besides. Rig and date
//! are in the file's path.

use std::sync::{Arc, LazyLock};

use arrow::{
    array::{
        ArrayRef, BooleanArray, Float32Builder, Float64Builder, Int32Builder, Int64Builder, ListBuilder,
        RecordBatch, StringArray, StringBuilder, TimestampMicrosecondArray,
    },
    datatypes::{DataType, Field, Schema, SchemaRef, TimeUnit},
    error::ArrowError,
};
use tactus_schema::table::RowView;

use crate::RunHead;

/// The columns of every file.
pub(crate) static SCHEMA: LazyLock<SchemaRef> = LazyLock::new(|| {
    let required = |name: &str, kind| Field::new(name, kind, false);
    let optional = |name: &str, kind| Field::new(name, kind, true);
    Arc::new(Schema::new(vec![
        required("run", DataType::Utf8),
        required("press", DataType::Int32),
        required("phase", DataType::Utf8),
        required("t_ns", DataType::Int64),
        required("x_mm", DataType::Float64),
        required("y_mm", DataType::Float64),
        required("z_mm", DataType::Float64),
        required("covering_mm", DataType::Float64),
        required("indenter", DataType::Utf8),
        optional("temperature_c", DataType::Float64),
        required("counts", DataType::List(element())),
        optional("started", DataType::Timestamp(TimeUnit::Microsecond, None)),
        required("simulated", DataType::Boolean),
        optional("experiment", DataType::Utf8),
        optional("script", DataType::Utf8),
    ]))
});

fn element() -> Arc<Field> {
    Arc::new(Field::new("element", DataType::Float32, false))
}

/// Rows of one run, by columns.
#[derive(Debug)]
pub(crate) struct Rows {
    filled: usize,
    press: Int32Builder,
    phase: StringBuilder,
    t_ns: Int64Builder,
    position_mm: [Float64Builder; 3],
    covering_mm: Float64Builder,
    indenter: StringBuilder,
    temperature_c: Float64Builder,
    counts: ListBuilder<Float32Builder>,
}

impl Rows {
    pub(crate) fn new() -> Self {
        Self {
            filled: 0,
            press: Int32Builder::new(),
            phase: StringBuilder::new(),
            t_ns: Int64Builder::new(),
            position_mm: Default::default(),
            covering_mm: Float64Builder::new(),
            indenter: StringBuilder::new(),
            temperature_c: Float64Builder::new(),
            counts: ListBuilder::new(Float32Builder::new()).with_field(element()),
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.filled
    }

    pub(crate) fn push(&mut self, row: RowView<'_>) {
        self.filled += 1;
        self.press.append_value(row.press);
        self.phase.append_value(row.phase.name());
        self.t_ns.append_value(row.t_ns);
        for (builder, along) in self.position_mm.iter_mut().zip(row.position_mm) {
            builder.append_value(along);
        }
        self.covering_mm.append_value(row.covering_mm);
        self.indenter.append_value(row.indenter);
        self.temperature_c.append_option(row.temperature_c);
        self.counts.values().append_slice(row.counts);
        self.counts.append(true);
    }

    /// The rows so far, which are then forgotten; `head` is that of their run.
    pub(crate) fn take(&mut self, head: &RunHead) -> Result<RecordBatch, ArrowError> {
        let rows = std::mem::take(&mut self.filled);
        let text = |value: Option<&str>| Arc::new(StringArray::from(vec![value; rows])) as ArrayRef;
        let started_us = head.started_ns.map(|ns| ns.div_euclid(1000));
        let [x_mm, y_mm, z_mm] = &mut self.position_mm;
        RecordBatch::try_new(
            Arc::clone(&SCHEMA),
            vec![
                text(Some(&head.run)),
                Arc::new(self.press.finish()),
                Arc::new(self.phase.finish()),
                Arc::new(self.t_ns.finish()),
                Arc::new(x_mm.finish()),
                Arc::new(y_mm.finish()),
                Arc::new(z_mm.finish()),
                Arc::new(self.covering_mm.finish()),
                Arc::new(self.indenter.finish()),
                Arc::new(self.temperature_c.finish()),
                Arc::new(self.counts.finish()),
                Arc::new(TimestampMicrosecondArray::from(vec![started_us; rows])),
                Arc::new(BooleanArray::from(vec![head.simulated; rows])),
                text(head.experiment.as_deref()),
                text(head.script.as_deref()),
            ],
        )
    }
}
