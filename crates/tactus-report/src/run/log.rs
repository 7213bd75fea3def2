//! The event log as lines of text.

use tactus_record::Timeline;
use tactus_schema::{
    MonoTime,
    pb::{self, run_event::Event},
    table::Phase,
};

use super::frames::{FrameStatistics, seconds};

/// One line of the event log.
#[derive(Debug, Clone, PartialEq)]
pub struct LoggedEvent {
    /// Time since the start of the run.
    pub at_s: f64,
    /// Name of the kind of event, such as `dwell`.
    pub kind: &'static str,
    /// The event's fields as text.
    pub detail: String,
    /// True for events that occur many times in every run: steps, phases, dwells and reads.
    pub routine: bool,
}

/// All events of the run and of the safety supervisor, in order of time.
pub(super) fn events(timeline: &Timeline, frames: &FrameStatistics) -> Vec<LoggedEvent> {
    let logged = |event: &pb::RunEvent| {
        let at_s = seconds(timeline, MonoTime::from_ns(event.t_mono_ns));
        let (kind, detail) = in_words(event);
        let routine = matches!(kind, "step" | "step done" | "phase" | "dwell" | "read");
        LoggedEvent { at_s, kind, detail, routine }
    };
    let supervised = frames.safety.iter().map(|event| LoggedEvent {
        at_s: seconds(timeline, MonoTime::from_ns(event.t_mono_ns)),
        kind: "safety",
        detail: format!("{}: {} {}", verdict(event.verdict()), event.rule, event.detail),
        routine: false,
    });
    let mut events: Vec<LoggedEvent> = timeline.events().iter().map(logged).chain(supervised).collect();
    events.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
    events
}

/// Name of the kind of an event, and its fields as text.
pub(crate) fn in_words(event: &pb::RunEvent) -> (&'static str, String) {
    event.event.as_ref().map_or(("unknown", String::new()), describe)
}

fn describe(event: &Event) -> (&'static str, String) {
    match event {
        Event::Started(e) => {
            let continues = e
                .taken_over
                .as_ref()
                .map(|taken| format!(", continues {}: {} presses taken over", taken.run_id, taken.presses));
            let continues = continues.unwrap_or_default();
            ("started", format!("{} on {} by {}, seed {}{continues}", e.experiment, e.rig, e.who, e.seed))
        }
        Event::StepStarted(e) => ("step", format!("{}: {} ({})", e.step, e.what, e.at)),
        Event::StepDone(e) => ("step done", e.step.to_string()),
        Event::PhaseChanged(e) => {
            let phase = Phase::try_from(e.phase()).map_or("unknown", Phase::name);
            ("phase", if e.press < 0 { phase.into() } else { format!("{phase}, press {}", e.press) })
        }
        Event::DwellDone(e) => (
            "dwell",
            format!(
                "press {}, dwell {}: ({:.3}, {:.3}) mm, depth {:.3} mm, {} frames",
                e.press, e.dwell, e.x_mm, e.y_mm, e.depth_mm, e.frames
            ),
        ),
        Event::ReadDone(e) => ("read", format!("{} frames", e.frames)),
        Event::ReferenceDone(e) => ("reference", format!("{} frames", e.frames)),
        Event::TareDone(e) => ("tare", format!("{} frames", e.frames)),
        Event::Log(e) => ("log", e.message.clone()),
        Event::Gap(e) => (
            "gap",
            format!("{} frames lost between {} and {}: {}", e.frames_lost, e.after_seq, e.next_seq, e.reason),
        ),
        Event::Paused(e) => ("paused", author(&e.by)),
        Event::Resumed(e) => ("resumed", author(&e.by)),
        Event::LeaseTaken(e) => ("lease taken", format!("by {} from {}: {}", e.by, e.from, e.reason)),
        Event::StopRequested(e) => {
            (if e.abort { "abort" } else { "stop" }, format!("by {}: {}", e.by, e.reason))
        }
        Event::PressRepeated(e) => ("press void", format!("press {}: {}", e.press, e.reason)),
        Event::CoveringChanged(e) => ("covering", format!("{} mm", e.covering_mm)),
        Event::Cleanup(e) => {
            let retracted = if e.retracted { "retracted" } else { "NOT retracted" };
            ("clean-up", format!("{retracted}, z = {:.3} mm {}", e.z_mm, e.detail))
        }
        Event::Finished(e) => ("finished", format!("{} {}", e.exit_status().word(), e.message)),
    }
}

fn verdict(verdict: pb::SafetyVerdict) -> &'static str {
    match verdict {
        pb::SafetyVerdict::Unspecified => "unspecified",
        pb::SafetyVerdict::Clear => "clear",
        pb::SafetyVerdict::Refused => "refused",
        pb::SafetyVerdict::Stopped => "stopped",
    }
}

/// Recordings before version 0.2 do not say who paused.
fn author(by: &str) -> String {
    if by.is_empty() { String::new() } else { format!("by {by}") }
}
