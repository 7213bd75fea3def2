//! The indentation stage.

mod driven;
mod driver;
mod grbl;
mod stop;
mod zaber;

use futures_util::future::BoxFuture;
use tactus_schema::pb;
use tactus_schema::rig::{GrblAxes, ZaberAxes};
use tactus_wire::stage::Direction;
use tokio::sync::watch;

use crate::DeviceError;

pub use driven::{Connection, DrivenStage, StageOptions};

/// A place to go, robot frame, and how fast.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// x, y, z in mm; z = 0 is the covering's nominal surface.
    pub position_mm: [f64; 3],
    /// Speed along the straight line to it.
    pub speed_mm_per_s: f64,
}

/// A stage that can be commanded from several tasks at once.
pub trait Stage: Send + Sync {
    /// The latest report; changes with each.
    fn state(&self) -> watch::Receiver<pb::StageState>;

    /// Finds the reference position. The state is [`pb::StageStatus::Idle`] after it.
    fn home(&self) -> BoxFuture<'_, Result<(), StageError>>;

    /// Goes to a place in a straight line and returns the position reached.
    ///
    /// Done means: the controller says idle and the reported position is within tolerance. A target
    /// equal to the present position is done at once. One move at a time.
    fn move_to(&self, target: Target) -> BoxFuture<'_, Result<[f64; 3], StageError>>;

    /// Stops motion now. Never waits and is never queued: a move in hand ends as [`StageError::Stopped`].
    /// Further moves are accepted once the stage stands.
    fn stop(&self);

    /// Clears an alarm so that the stage accepts moves again. The position is suspect until homed.
    fn clear_alarm(&self) -> BoxFuture<'_, Result<(), StageError>>;
}

/// Why a command to the stage did not do what was asked.
#[derive(Debug, thiserror::Error)]
pub enum StageError {
    /// [`Stage::stop`] ended the move.
    #[error("the move was stopped at {position_mm:?} mm")]
    Stopped {
        /// Where the stage stands, as last reported.
        position_mm: [f64; 3],
    },
    /// The controller refused the command.
    #[error("the stage refused {command:?}: {reason}")]
    Refused {
        /// What was asked.
        command: String,
        /// The controller's reason in words.
        reason: String,
    },
    /// The controller went into alarm.
    #[error("the stage is in alarm {name}: {meaning}; see to it, then `tactus reset`")]
    Alarm {
        /// The controller's number.
        code: u32,
        /// The controller's short name for it: the number, or the axis and its flag.
        name: String,
        /// What the number means.
        meaning: String,
    },
    /// Someone else moved the stage during the move, by a knob or from another host; it was stopped.
    #[error(
        "{axis} was moved by someone else ({meaning}); the stage was stopped at {position_mm:?} mm: leave its knob \
         alone and end other programs that command it"
    )]
    Interrupted {
        /// Which axis.
        axis: String,
        /// What the controller says of it.
        meaning: String,
        /// Where the stage stands.
        position_mm: [f64; 3],
    },
    /// The position is not known: the stage has not been homed since it started, reset or stepped out.
    #[error("the stage's position is not known: `tactus reset` homes it")]
    Unhomed,
    /// The controller says idle, but stands elsewhere.
    #[error("the stage says it has arrived at {target_mm:?} mm, but stands at {position_mm:?} mm")]
    NotThere {
        /// Where it was sent.
        target_mm: [f64; 3],
        /// Where it says it is.
        position_mm: [f64; 3],
    },
    /// The move took longer than it can.
    #[error(
        "the move to {target_mm:?} mm was not done after {waited_s:.1} s; the stage was stopped at {position_mm:?} mm"
    )]
    Overdue {
        /// Where it was sent.
        target_mm: [f64; 3],
        /// Where it says it is.
        position_mm: [f64; 3],
        /// How long was waited.
        waited_s: f64,
    },
    /// The link or the device failed.
    #[error(transparent)]
    Device(#[from] DeviceError),
}

/// What a rig says of a stage that speaks `grbl`, as its session takes it. A virtual stage needs the same.
pub fn grbl_config(axes: &GrblAxes, tolerance_mm: f64) -> tactus_wire::grbl::Config {
    grbl::config(axes, tolerance_mm)
}

/// What a rig says of a stage that speaks `zaber-ascii`, as its session takes it. A virtual stage needs the same.
pub fn zaber_config(axes: &ZaberAxes, tolerance_mm: f64) -> tactus_wire::zaber::Config {
    zaber::config(axes, tolerance_mm)
}

fn direction(is_forward: bool) -> Direction {
    if is_forward { Direction::Positive } else { Direction::Negative }
}
