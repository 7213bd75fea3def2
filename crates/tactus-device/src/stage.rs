//! The indentation stage.

mod driven;
mod driver;
mod grbl;
mod guard;
mod stop;
mod zaber;

use futures_util::future::BoxFuture;
use tactus_safety::{HomingPermit, Permit, Void};
use tactus_schema::rig::{GrblAxes, ZaberAxes};
use tactus_schema::{MonoTime, pb};
use tactus_wire::stage::Direction;
use tokio::sync::watch;

use crate::DeviceError;

pub use driven::{Connection, DrivenStage, StageOptions};

/// A stage that can be commanded from several tasks at once.
pub trait Stage: Send + Sync {
    /// The latest report; updated with each.
    fn state(&self) -> watch::Receiver<pb::StageState>;

    /// Finds the reference position. The status is [`pb::StageStatus::Idle`] afterwards.
    fn home(&self, permit: HomingPermit) -> BoxFuture<'_, Result<(), StageError>>;

    /// Moves in a straight line to the permitted target, and returns the position reached in mm. If the permit is void when
    /// the driver comes to it, nothing is sent.
    ///
    /// The move is done when the controller is idle and the reported position is within tolerance. A move to the present
    /// position moves nothing; it becomes a [`look`](Self::look). There is one move at a time.
    fn move_to(&self, permit: Permit) -> BoxFuture<'_, Result<[f64; 3], StageError>>;

    /// Asks the controller where it stands now, and returns that position in mm. Moves nothing.
    ///
    /// It fails if the controller does not answer, is in alarm, is not homed or is not idle. The result never comes from an
    /// earlier report.
    fn look(&self) -> BoxFuture<'_, Result<[f64; 3], StageError>>;

    /// Stops motion now. Never waits and is never queued. A move under way ends with [`StageError::Stopped`]. Further moves
    /// are accepted once the stage stands still.
    fn stop(&self);

    /// Says that somebody still watches the stage. A stage that was watched once and is not watched for 80 ms while it
    /// moves is stopped; its command ends with [`StageError::Unwatched`].
    fn watch(&self);

    /// When the driver last gave a sign of life. It gives one at least every quarter of a second, with a stage or without.
    fn driven(&self) -> MonoTime;

    /// Clears an alarm, so that the stage accepts moves again. Its position is suspect until it is homed.
    fn clear_alarm(&self) -> BoxFuture<'_, Result<(), StageError>>;
}

/// Why a command to the stage did not do what was asked.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum StageError {
    /// [`Stage::stop`] ended the move.
    #[error("the move was stopped at {position_mm:?} mm")]
    Stopped {
        /// Where the stage stands, as last reported.
        position_mm: [f64; 3],
    },
    /// The controller refused the command.
    #[error("the stage refused {command:?}: {reason}")]
    Refused { command: String, reason: String },
    /// The controller went into alarm.
    #[error("the stage is in alarm {name}: {meaning}; see to it, then `tactus reset`")]
    Alarm {
        code: u32,
        /// The controller's short name for it: the number, or the axis and its flag.
        name: String,
        meaning: String,
    },
    /// Someone else moved the stage during the move, by a knob or from another host, and the stage was stopped.
    #[error(
        "{axis} was moved by someone else ({meaning}); the stage was stopped at {position_mm:?} mm: leave its knob \
         alone and end other programs that command it"
    )]
    Interrupted { axis: String, meaning: String, position_mm: [f64; 3] },
    /// The position is not known: the stage has not been homed since it started, was reset or lost steps.
    #[error("the stage's position is not known: `tactus reset` homes it")]
    Unhomed,
    /// The stage was asked where it stands, and is not idle.
    #[error(
        "the stage was asked where it stands, and is not idle at {position_mm:?} mm: something else commands it"
    )]
    NotIdle { position_mm: [f64; 3] },
    /// The controller is idle, but not at the target.
    #[error("the stage says it has arrived at {target_mm:?} mm, but stands at {position_mm:?} mm")]
    NotThere { target_mm: [f64; 3], position_mm: [f64; 3] },
    /// A report of the move was off its way, or ahead of its speed, and the stage was stopped.
    #[error(
        "on the way to {target_mm:?} mm the stage was off its way, or too fast, and was stopped at {position_mm:?} mm: \
         a command or a report was damaged on the link, or something else commands the stage"
    )]
    Astray { target_mm: [f64; 3], position_mm: [f64; 3] },
    /// The move took much longer than expected.
    #[error(
        "the move to {target_mm:?} mm was not done after {waited_s:.1} s; the stage was stopped at {position_mm:?} mm"
    )]
    Overdue { target_mm: [f64; 3], position_mm: [f64; 3], waited_s: f64 },
    /// The permit was void before the command was sent.
    #[error(transparent)]
    Void(#[from] Void),
    /// Nobody watched the stage for 80 ms.
    #[error(
        "the stage was stopped at {position_mm:?} mm: the frames and the stage were not watched for 0.08 s"
    )]
    Unwatched { position_mm: [f64; 3] },
    /// No report or reply came during a motion, and the stage was stopped.
    #[error(
        "the stage did not answer for {waited_s:.1} s of {command:?}, and was stopped: this computer is too busy, or the link \
         loses bytes"
    )]
    Unanswered { command: String, waited_s: f64 },
    /// The link or the device failed.
    #[error(transparent)]
    Device(#[from] DeviceError),
}

/// The configuration of a `grbl` session, and of a virtual stage, from a rig's axes.
pub fn grbl_config(axes: &GrblAxes, tolerance_mm: f64) -> tactus_wire::grbl::Config {
    grbl::config(axes, tolerance_mm)
}

/// The configuration of a `zaber-ascii` session, and of a virtual stage, from a rig's axes.
pub fn zaber_config(axes: &ZaberAxes, tolerance_mm: f64) -> tactus_wire::zaber::Config {
    zaber::config(axes, tolerance_mm)
}

fn direction(is_forward: bool) -> Direction {
    if is_forward { Direction::Positive } else { Direction::Negative }
}
