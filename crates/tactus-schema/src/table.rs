//! The measurement table: the Parquet columns that analysis reads.
//!
//! | column | type | meaning |
//! |---|---|---|
//! | run | string | run id; rows of one run are contiguous and in time order |
//! | press | int32 | press index in the run; -1 outside a press |
//! | phase | string | idle, approach, load, hold, unload, retract |
//! | t_ns | int64 | time of the frame's sampling, monotonic within a run |
//! | x_mm, y_mm, z_mm | float64 | stage position at t_ns, robot frame |
//! | covering_mm | float64 | covering thickness |
//! | indenter | string | id of an indenter in the rig description |
//! | temperature_c | float64, null allowed | |
//! | counts | `list<float32>` | raw counts, row-major, one per element |

pub use tactus_model::Phase;

use crate::pb;

/// Key of the file metadata that holds the rig as JSON (`tactus.rig/1`).
pub const RIG_METADATA_KEY: &str = "tactus.rig";

/// Names of the columns, in order.
pub const COLUMNS: [&str; 11] = [
    "run",
    "press",
    "phase",
    "t_ns",
    "x_mm",
    "y_mm",
    "z_mm",
    "covering_mm",
    "indenter",
    "temperature_c",
    "counts",
];

/// One row, owned; the fields are the table's columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Run id.
    pub run: String,
    /// Press index in the run; -1 outside a press.
    pub press: i32,
    /// What the stage was doing.
    pub phase: Phase,
    /// Time of the frame's sampling, monotonic within a run.
    pub t_ns: i64,
    /// Stage position at `t_ns`, robot frame.
    pub position_mm: [f64; 3],
    /// Thickness of the covering in place.
    pub covering_mm: f64,
    /// Id of an indenter in the rig description.
    pub indenter: String,
    /// Temperature, if it was measured.
    pub temperature_c: Option<f64>,
    /// Raw counts, row-major, one per element.
    pub counts: Vec<f32>,
}

/// A borrowed [`Row`]: what readers, writers and analyses of the table pass on frame by frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowView<'a> {
    /// As [`Row::run`].
    pub run: &'a str,
    /// As [`Row::press`].
    pub press: i32,
    /// As [`Row::phase`].
    pub phase: Phase,
    /// As [`Row::t_ns`].
    pub t_ns: i64,
    /// As [`Row::position_mm`].
    pub position_mm: [f64; 3],
    /// As [`Row::covering_mm`].
    pub covering_mm: f64,
    /// As [`Row::indenter`].
    pub indenter: &'a str,
    /// As [`Row::temperature_c`].
    pub temperature_c: Option<f64>,
    /// As [`Row::counts`].
    pub counts: &'a [f32],
}

impl<'a> From<&'a Row> for RowView<'a> {
    fn from(row: &'a Row) -> Self {
        let Row { run, press, phase, t_ns, position_mm, covering_mm, indenter, temperature_c, counts } = row;
        Self {
            run,
            press: *press,
            phase: *phase,
            t_ns: *t_ns,
            position_mm: *position_mm,
            covering_mm: *covering_mm,
            indenter,
            temperature_c: *temperature_c,
            counts,
        }
    }
}

impl From<RowView<'_>> for Row {
    fn from(view: RowView<'_>) -> Self {
        let RowView { run, press, phase, t_ns, position_mm, covering_mm, indenter, temperature_c, counts } =
            view;
        Self {
            run: run.to_owned(),
            press,
            phase,
            t_ns,
            position_mm,
            covering_mm,
            indenter: indenter.to_owned(),
            temperature_c,
            counts: counts.to_vec(),
        }
    }
}

impl From<Phase> for pb::Phase {
    fn from(phase: Phase) -> Self {
        match phase {
            Phase::Idle => Self::Idle,
            Phase::Approach => Self::Approach,
            Phase::Load => Self::Load,
            Phase::Hold => Self::Hold,
            Phase::Unload => Self::Unload,
            Phase::Retract => Self::Retract,
        }
    }
}

impl TryFrom<pb::Phase> for Phase {
    type Error = ();

    fn try_from(phase: pb::Phase) -> Result<Self, ()> {
        match phase {
            pb::Phase::Unspecified => Err(()),
            pb::Phase::Idle => Ok(Self::Idle),
            pb::Phase::Approach => Ok(Self::Approach),
            pb::Phase::Load => Ok(Self::Load),
            pb::Phase::Hold => Ok(Self::Hold),
            pb::Phase::Unload => Ok(Self::Unload),
            pb::Phase::Retract => Ok(Self::Retract),
        }
    }
}
