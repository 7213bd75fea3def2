//! The data of a run's report, computed from its recording.

mod comparisons;
mod frames;
pub(crate) mod log;
mod presses;
mod response;
mod summary;

use std::path::Path;

use tactus_model::Array;
use tactus_record::{Completeness, RecordError, Timeline, meter};

pub use comparisons::{Comparisons, Directions, Ladder, PlaceMap, PressCurve};
pub use frames::{FrameLoss, Intervals, Timing, Trace};
pub use log::LoggedEvent;
pub use presses::{Baseline, DwellSummary, PressSummary, PressWay};
pub use response::{ElementCurve, RespondsTo, ResponseCurves, UnresponsiveElement};
pub use summary::RunSummary;

use frames::FrameStatistics;
use presses::Presses;

/// The data of a run's report.
#[derive(Debug, Clone, PartialEq)]
pub struct RunReport {
    /// Identity, settings and outcome of the run.
    pub summary: RunSummary,
    /// Sentences about what is missing, damaged or left out.
    pub notes: Vec<String>,
    /// The sensor's array.
    pub array: Array,
    /// The presses in order, without those that were repeated.
    pub presses: Vec<PressSummary>,
    /// Source of the baseline that was subtracted.
    pub baseline: Baseline,
    /// The response curves; `None` unless elements were pressed at their centres at several depths.
    pub response: Option<ResponseCurves>,
    /// What the presses show when they are compared.
    pub comparisons: Comparisons,
    /// Depth and signal over time.
    pub trace: Trace,
    /// Gaps in the sequence of frames.
    pub losses: Vec<FrameLoss>,
    /// The time between frames.
    pub timing: Timing,
    /// All events of the run and of the safety supervisor, in order of time.
    pub events: Vec<LoggedEvent>,
}

/// Why a report cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The recording cannot be read, or does not name its run and rig.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A read of the recording failed.
    #[error("cannot read {}: {source}", path.display())]
    Io {
        /// Path of the recording.
        path: std::path::PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
}

/// Reads a recording, complete or damaged, and computes the report's data.
///
/// # Errors
/// If the file cannot be read, or does not name its run and rig. Anything else that is missing is listed in
/// [`RunReport::notes`].
pub fn run_report(recording: &Path) -> Result<RunReport, ReportError> {
    // For the motion of the stage, then for the frames.
    meter::will_read(recording, &[1.0, 1.0]);
    let timeline = Timeline::read(recording)?;
    let frames = FrameStatistics::read(recording, &timeline)?;
    let presses = Presses::of(&timeline, &frames);
    let response = ResponseCurves::of(timeline.rig(), &presses.done);
    let summary = RunSummary::of(&timeline, &presses);
    let notes = notes(&timeline, &presses, &summary);
    Ok(RunReport {
        summary,
        notes,
        array: timeline.rig().array.clone(),
        response,
        comparisons: Comparisons::of(&presses.done, &frames.rest),
        trace: frames.trace(&timeline, &presses),
        timing: frames.timing(&timeline),
        events: log::events(&timeline, &frames),
        losses: frames.losses,
        presses: presses.done,
        baseline: presses.baseline,
    })
}

fn notes(timeline: &Timeline, presses: &Presses, summary: &RunSummary) -> Vec<String> {
    let mut notes = Vec::new();
    match timeline.completeness() {
        Completeness::Complete => {}
        Completeness::Truncated { at_byte, reason } => notes.push(format!(
            "The file is readable up to byte {at_byte} only ({reason}); this report covers the part before it."
        )),
        damaged @ Completeness::Damaged(_) => {
            notes.push(format!("The file is {damaged}. This report covers what is intact."));
        }
    }
    match timeline.tally().frames_missing() {
        0 => {}
        missing => notes.push(format!("{missing} frames were received and are missing in the recording.")),
    }
    match timeline.tally().finished() {
        None => notes.push("The recording was never closed: how the run ended is not known.".into()),
        Some(finished) if finished.frames > summary.frames => notes.push(format!(
            "The run counted {} frames, but the recording holds {}.",
            finished.frames, summary.frames
        )),
        Some(_) => {}
    }
    if timeline.started().is_none() {
        notes.push("The run's first event is missing: seed, script hash and plan are not known.".into());
    }
    if summary.frames == 0 {
        notes.push("No frame was recorded: there is no signal and no timing to show.".into());
    }
    if timeline.stage().is_empty() {
        notes.push("The stage never reported its position.".into());
    }
    if summary.dwells == 0 {
        notes.push("No dwell was done: there are no response curves and no images.".into());
    }
    if let Some([planned_presses, planned_dwells]) = summary.planned
        && (summary.presses < planned_presses || summary.dwells < planned_dwells)
    {
        notes.push(format!(
            "{} of {planned_presses} planned presses and {} of {planned_dwells} planned dwells were done.",
            summary.presses, summary.dwells
        ));
    }
    if !presses.void.is_empty() {
        let list: Vec<String> = presses.void.iter().map(ToString::to_string).collect();
        notes.push(format!(
            "Interrupted, repeated, and therefore left out of this report: press {}.",
            list.join(", ")
        ));
    }
    if presses.malformed_dwells > 0 {
        notes.push(format!(
            "{} dwells are left out, because they do not have one finite number per element.",
            presses.malformed_dwells
        ));
    }
    if summary.dwells > 0 {
        match presses.baseline {
            Baseline::Tare => {}
            Baseline::FirstFrames(frames) => notes.push(format!(
                "Some presses had no tare before them: their baseline is the mean of the first {frames} frames."
            )),
            Baseline::RigFile => notes.push(
                "There was no tare and no frame before the first press: the baseline is the rig file's.".into(),
            ),
        }
    }
    notes
}
