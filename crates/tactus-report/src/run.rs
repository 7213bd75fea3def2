//! What is to be said about one run, computed from its recording.

mod frames;
mod log;
mod presses;
mod response;
mod summary;

use std::path::Path;

use tactus_model::Array;
use tactus_record::{Completeness, RecordError, Timeline};

pub use frames::{FrameLoss, Intervals, Timing, Trace};
pub use log::LoggedEvent;
pub use presses::{Baseline, DwellSummary, PressSummary};
pub use response::{ElementCurve, ResponseCurves, UnresponsiveElement};
pub use summary::RunSummary;

use frames::FrameStatistics;
use presses::Presses;

/// Everything that a report says of one run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunReport {
    /// What run it was, and what it came to.
    pub summary: RunSummary,
    /// What is missing, damaged or left out; a sentence each.
    pub notes: Vec<String>,
    /// The elements.
    pub array: Array,
    /// The presses that count, in order, each with its dwells.
    pub presses: Vec<PressSummary>,
    /// What the rises of the dwells are against.
    pub baseline: Baseline,
    /// The response curves, if elements were pressed at their centres through several depths.
    pub response: Option<ResponseCurves>,
    /// Depth and signal over time.
    pub trace: Trace,
    /// Where frames are missing.
    pub losses: Vec<FrameLoss>,
    /// The time between frames.
    pub timing: Timing,
    /// All events of the run and acts of the safety supervisor, in order of time.
    pub events: Vec<LoggedEvent>,
}

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The recording cannot be read, or does not say which run and rig it is of.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// Reading failed on the way.
    #[error("cannot read {}: {source}", path.display())]
    Io {
        /// The recording.
        path: std::path::PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
}

/// Reads a recording, whole or damaged, and computes what is to be reported.
///
/// # Errors
/// If the file cannot be read, or is not so much of a recording that it says which run and which rig it is of. What
/// is missing beyond that is no error: [`RunReport::notes`] says it.
pub fn run_report(recording: &Path) -> Result<RunReport, ReportError> {
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
    if let Completeness::Truncated { at_byte, reason } = timeline.completeness() {
        notes.push(format!(
            "The file is readable up to byte {at_byte} only ({reason}): this report is of what stands before it."
        ));
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
        notes.push("The stage never said where it was.".into());
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
            "Broken off, begun again, and left out of all that follows: press {}.",
            list.join(", ")
        ));
    }
    if presses.malformed_dwells > 0 {
        notes.push(format!(
            "{} dwells are left out, because they do not hold one finite number per element.",
            presses.malformed_dwells
        ));
    }
    if summary.dwells > 0 {
        match presses.baseline {
            Baseline::Tare => {}
            Baseline::FirstFrames(frames) => notes.push(format!(
                "Before some presses nothing was tared: their baseline is the mean of the first {frames} frames."
            )),
            Baseline::RigFile => notes.push(
                "Nothing was tared and no frame came before the first press: the baseline is the rig file's.".into(),
            ),
        }
    }
    notes
}
