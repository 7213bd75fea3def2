//! Why a run ends early, and what that means for its outcome.

use tactus_device::StageError;
use tactus_plan::Refusal;
use tactus_safety::{Denied, Violation};
use tactus_schema::pb;

use crate::acquisition::Gone;
use crate::engine::StopOrder;
use crate::envelope::Outside;

/// Why a run was asked to end before its script did.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Ending {
    Stop(StopOrder),
    Safety(Violation),
    FramesLost(u64),
    RecordFailed(String),
    Defect(String),
}

/// Why a step was not done.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Broken {
    #[error("{}", describe(.0))]
    Ended(Ending),
    #[error(transparent)]
    Outside(#[from] Outside),
    #[error(transparent)]
    Stage(#[from] StageError),
    #[error(transparent)]
    Denied(#[from] Denied),
    #[error(transparent)]
    Gone(#[from] Gone),
    #[error("{0} frames were lost during a dwell")]
    FramesLost(u64),
    #[error("the stage did not stand still in its place throughout a dwell")]
    Disturbed,
    #[error("no frame from the sensor for {0:.1} s: is it plugged in and switched on?")]
    SensorSilent(f64),
    #[error("no answer from the stage for {0:.1} s: {1}")]
    StageSilent(f64, StageError),
    #[error("{what} was repeated {times} times, and something was lost each time; the last time: {last}")]
    RepeatedInVain { what: &'static str, times: u32, last: Box<Self> },
    #[error("{0}")]
    Script(String),
    #[error("{0}")]
    Refused(String),
}

impl Ending {
    /// True for a silence of the sensor: the run may continue once frames arrive again.
    pub(crate) fn is_silence(&self) -> bool {
        matches!(self, Self::Safety(violation) if violation.is_silence())
    }
}

fn describe(ending: &Ending) -> String {
    match ending {
        Ending::Stop(order) => {
            let how = if order.abort { "aborted" } else { "stopped" };
            let why = if order.reason.is_empty() { String::new() } else { format!(": {}", order.reason) };
            format!("{how} by {}{why}", order.by)
        }
        Ending::Safety(violation) => format!("safety stop: {violation}"),
        Ending::FramesLost(lost) => {
            format!("{lost} frames were lost, and the rig's policy.on_gap is \"fail\"")
        }
        Ending::RecordFailed(failure) => failure.clone(),
        Ending::Defect(what) => format!("stopped by a defect of Tactus: {what}"),
    }
}

/// What the script is told.
pub(super) fn refusal(broken: &Broken) -> Refusal {
    match broken {
        Broken::Ended(_) => Refusal::Stopped(broken.to_string()),
        Broken::Outside(outside) => Refusal::Outside(outside.to_string()),
        Broken::RepeatedInVain { .. }
        | Broken::Stage(_)
        | Broken::Denied(_)
        | Broken::Gone(_)
        | Broken::FramesLost(_)
        | Broken::Disturbed
        | Broken::SensorSilent(_)
        | Broken::StageSilent(..)
        | Broken::Script(_)
        | Broken::Refused(_) => Refusal::Failed(broken.to_string()),
    }
}

/// The exit status of a run whose script came to its end, and the reason for a person.
pub(super) fn done(frames_lost: u64) -> (pb::ExitStatus, String) {
    match frames_lost {
        0 => (pb::ExitStatus::Done, String::new()),
        lost => (
            pb::ExitStatus::Degraded,
            format!("{lost} frames were lost; the dwells they touched were repeated"),
        ),
    }
}

/// The exit status of a run that ended early, and the reason for a person.
pub(super) fn verdict(broken: &Broken) -> (pb::ExitStatus, String) {
    (exit_status(broken), broken.to_string())
}

fn exit_status(broken: &Broken) -> pb::ExitStatus {
    use pb::ExitStatus;
    match broken {
        Broken::Ended(Ending::Stop(order)) if order.abort => ExitStatus::Aborted,
        Broken::Ended(Ending::Stop(_)) => ExitStatus::Stopped,
        Broken::Ended(ending) if ending.is_silence() => ExitStatus::Failed,
        Broken::Ended(Ending::Safety(_)) | Broken::Outside(_) | Broken::Refused(_) | Broken::Denied(_) => {
            ExitStatus::Refused
        }
        Broken::RepeatedInVain { last, .. } => exit_status(last),
        Broken::Ended(Ending::FramesLost(_) | Ending::RecordFailed(_) | Ending::Defect(_))
        | Broken::Stage(_)
        | Broken::Gone(_)
        | Broken::Disturbed
        | Broken::FramesLost(_)
        | Broken::SensorSilent(_)
        | Broken::StageSilent(..)
        | Broken::Script(_) => ExitStatus::Failed,
    }
}
