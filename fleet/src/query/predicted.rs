//! `predicted('model.toml')`: frames with what a model predicts.

use std::{
    fs,
    hash::{Hash, Hasher},
    sync::Arc,
};

use arrow::{
    array::{Array as _, ArrayRef, AsArray as _, Float64Array, Float64Builder, ListBuilder, StringViewArray},
    datatypes::{DataType, Float64Type},
};
use datafusion::{
    catalog::{TableFunctionArgs, TableFunctionImpl, TableProvider},
    common::{Column, JoinType, exec_datafusion_err, plan_datafusion_err, plan_err},
    datasource::{ViewTable, provider_as_source},
    error::Result,
    logical_expr::{
        ColumnarValue, Expr, LogicalPlanBuilder, ScalarFunctionArgs, ScalarUDF, ScalarUDFImpl, Signature,
        Volatility,
    },
    scalar::ScalarValue,
};
use tactus_model::{Array, Covering, Effect, ForwardModel, Moment, Pipeline, Simulator};
use tactus_schema::{Model, Rig};

use super::{lists::list_type, response::Response};
use crate::output::number_of;

/// The frames, each with two more lists: `prediction`, the counts that a model gives for the frame's tool, position and covering, and
/// `residual`, the frame's counts minus these.
///
/// The sensor lies where the rig's description in the frame's file says, with its surface at z = 0.
#[derive(Debug)]
pub(super) struct Predicted {
    frames: Arc<dyn TableProvider>,
    runs: Arc<dyn TableProvider>,
}

impl Predicted {
    pub(super) fn new(frames: Arc<dyn TableProvider>, runs: Arc<dyn TableProvider>) -> Self {
        Self { frames, runs }
    }
}

impl TableFunctionImpl for Predicted {
    fn call_with_args(&self, args: TableFunctionArgs<'_, '_>) -> Result<Arc<dyn TableProvider>> {
        let [Expr::Literal(ScalarValue::Utf8(Some(path)), _)] = args.exprs() else {
            return plan_err!("predicted() takes the path of a model: predicted('model.toml')");
        };
        let prediction = ScalarUDF::new_from_impl(Prediction::of(path)?);
        let of_frames = |column: &str| Expr::Column(Column::new(Some("frames"), column));
        let of_runs = |column: &str| Expr::Column(Column::new(Some("runs"), column));
        let frames = LogicalPlanBuilder::scan("frames", provider_as_source(Arc::clone(&self.frames)), None)?;
        let runs = LogicalPlanBuilder::scan("runs", provider_as_source(Arc::clone(&self.runs)), None)?
            .project(["rig", "date", "run", "description"].map(of_runs))?;
        let keys = |table: &str| ["rig", "date", "run"].map(|key| Column::new(Some(table), key)).to_vec();
        let columns = self.frames.schema();
        let columns = columns.fields().iter().map(|column| of_frames(column.name()));
        let tip = ["indenter", "x_mm", "y_mm", "z_mm", "covering_mm"].map(of_frames);
        let given = [of_runs("description")].into_iter().chain(tip).collect();
        let columns = columns.chain([prediction.call(given).alias("prediction")]);
        let with_prediction =
            frames.join(runs.build()?, JoinType::Inner, (keys("frames"), keys("runs")), None)?;
        let with_prediction = with_prediction.project(columns)?;
        let residual = ScalarUDF::new_from_impl(Response::new())
            .call(vec![of_frames("counts"), Expr::Column(Column::new_unqualified("prediction"))]);
        let all = with_prediction.schema().columns().into_iter().map(Expr::Column).collect::<Vec<_>>();
        let plan = with_prediction.project(all.into_iter().chain([residual.alias("residual")]))?;
        Ok(Arc::new(ViewTable::new(plan.build()?, None)))
    }
}

/// Counts that a model gives for a rig's description, a tool, a position and a covering.
#[derive(Debug)]
pub(crate) struct Prediction {
    path: String,
    /// The model file, for those to whom the function is sent.
    #[cfg_attr(not(feature = "cluster"), expect(dead_code, reason = "only a cluster sends functions"))]
    text: String,
    model: ForwardModel,
    effects: Vec<Effect>,
    signature: Signature,
}

/// Centres that differ by no more are written in other digits, not made otherwise.
const CENTRES_AGREE_MM: f64 = 1e-6;

/// The path tells models of one query apart.
impl PartialEq for Prediction {
    fn eq(&self, other: &Self) -> bool {
        self.path == other.path
    }
}

impl Eq for Prediction {}

impl Hash for Prediction {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.path.hash(state);
    }
}

impl Prediction {
    /// Its name in plans; queries cannot call it by it.
    pub(crate) const NAME: &'static str = "prediction";

    fn of(path: &str) -> Result<Self> {
        let text = fs::read_to_string(path).map_err(|error| plan_datafusion_err!("{path}: {error}"))?;
        Self::new(path.to_owned(), text)
    }

    pub(crate) fn new(path: String, text: String) -> Result<Self> {
        let model = Model::from_toml(&text).map_err(|error| plan_datafusion_err!("{path}: {error}"))?;
        let effects: Vec<Effect> = model.effects.iter().map(|known| known.effect.clone()).collect();
        if let Some(effect) = effects.iter().find(|effect| effect.acts_in_time()) {
            return plan_err!(
                "{path} has the effect {}, which acts in time, and predicted() sees one frame at a time. Give a model without it",
                effect.name()
            );
        }
        let numbers = vec![DataType::Float64; 4];
        let given = [vec![DataType::Utf8View; 2], numbers].concat();
        Ok(Self {
            model: model.forward().map_err(|error| plan_datafusion_err!("{path}: {error}"))?,
            effects,
            path,
            text,
            signature: Signature::exact(given, Volatility::Immutable),
        })
    }

    /// Path and text of the model file.
    #[cfg(feature = "cluster")]
    pub(crate) fn model_file(&self) -> [&str; 2] {
        [&self.path, &self.text]
    }

    /// The sensor of a rig under one of its tools and a covering.
    fn sensor(&self, description: &str, indenter: &str, covering_mm: f64) -> Result<Pipeline> {
        let rig = Rig::from_json(description)
            .map_err(|error| exec_datafusion_err!("a rig's description is wrong: {error}"))?;
        if let Some([of_rig, of_model]) = difference(&rig.array, self.model.array()) {
            return Err(exec_datafusion_err!(
                "rig {} has {of_rig}, the model {} has {of_model}: restrict the query to rigs that it fits, such as WHERE rig = 'NAME'",
                rig.name,
                self.path
            ));
        }
        let Some(indenter) = rig.indenters.get(indenter) else {
            return Err(exec_datafusion_err!("rig {} has no tool {indenter:?}", rig.name));
        };
        let simulator = Simulator {
            model: self.model.clone(),
            registration: rig.registration,
            surface_mm: 0.0,
            covering: Covering { thickness_mm: covering_mm },
            indenter: indenter.clone(),
            effects: self.effects.clone(),
            noise_rms_counts: 0.0,
        };
        Pipeline::new(&simulator).map_err(|error| exec_datafusion_err!("{}: {error}", self.path))
    }
}

/// Where two arrays have their elements differently: first the number of rows or columns, then a centre. `None` if they do not.
fn difference(one: &Array, other: &Array) -> Option<[String; 2]> {
    let arrays = [one, other];
    differ("row", arrays.map(Array::row_centres_mm))
        .or_else(|| differ("column", arrays.map(Array::col_centres_mm)))
}

fn differ(line: &str, [one, other]: [&[f64]; 2]) -> Option<[String; 2]> {
    if one.len() != other.len() {
        return Some([one, other].map(|centres_mm| number_of(centres_mm.len() as u64, line)));
    }
    let mut pairs = one.iter().zip(other).enumerate();
    let (at, (one_mm, other_mm)) =
        pairs.find(|(_, (one_mm, other_mm))| (**one_mm - **other_mm).abs() > CENTRES_AGREE_MM)?;
    Some([one_mm, other_mm].map(|centre_mm| format!("{line} {at} at {centre_mm} mm")))
}

impl ScalarUDFImpl for Prediction {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn return_type(&self, _: &[DataType]) -> Result<DataType> {
        Ok(list_type())
    }

    fn invoke_with_args(&self, args: ScalarFunctionArgs) -> Result<ColumnarValue> {
        let columns: Vec<ArrayRef> =
            args.args.iter().map(|column| column.to_array(args.number_rows)).collect::<Result<_>>()?;
        let given = Given::of(&columns);
        let mut images = ListBuilder::new(Float64Builder::new());
        let mut last: Option<(SensorKey, Pipeline)> = None;
        for row in 0..args.number_rows {
            if columns.iter().any(|column| column.is_null(row)) {
                images.append_null();
                continue;
            }
            let key = given.sensor_key(row);
            let pipeline = match &mut last {
                Some((known, pipeline)) if *known == key => pipeline,
                last => {
                    let (description, indenter) = (given.descriptions.value(row), given.indenters.value(row));
                    let sensor = self.sensor(description, indenter, given.covering_mm.value(row))?;
                    &mut last.insert((key, sensor)).1
                }
            };
            let tip_mm = given.position_mm.map(|along| along.value(row));
            images.values().append_slice(pipeline.step(Moment::at(0.0), &tip_mm));
            images.append(true);
        }
        Ok(ColumnarValue::Array(Arc::new(images.finish())))
    }
}

/// The arguments of a prediction.
struct Given<'a> {
    descriptions: &'a StringViewArray,
    indenters: &'a StringViewArray,
    position_mm: [&'a Float64Array; 3],
    covering_mm: &'a Float64Array,
}

/// What tells sensors apart: where the texts of description and tool are, and the covering. Equal texts may be at different places; then the
/// same sensor is made again.
type SensorKey = (u128, u128, u64);

impl<'a> Given<'a> {
    fn of(columns: &'a [ArrayRef]) -> Self {
        let number = |at: usize| columns[at].as_primitive::<Float64Type>();
        Self {
            descriptions: columns[0].as_string_view(),
            indenters: columns[1].as_string_view(),
            position_mm: [number(2), number(3), number(4)],
            covering_mm: number(5),
        }
    }

    fn sensor_key(&self, row: usize) -> SensorKey {
        (self.descriptions.views()[row], self.indenters.views()[row], self.covering_mm.value(row).to_bits())
    }
}
