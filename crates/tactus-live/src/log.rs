//! What happened, with its time and its run: events of runs, safety news, connections.

use std::collections::VecDeque;

use serde_json::{Value, json};
use tactus_schema::pb::{self, run_event::Event};
use tactus_schema::with_message;

/// Entries that are kept; the oldest are dropped.
const ENTRIES_MAX: usize = 400;
/// Runs whose times are kept, the oldest dropped. More than the service keeps events of.
const RUNS_MAX: usize = 2_048;
/// Longest text of an entry, in bytes; a script may log 4 KiB.
const TEXT_BYTES_MAX: usize = 500;

/// How much an entry matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weight {
    /// Something was done.
    Note,
    /// Something was lost, refused or paused.
    Warning,
    /// A stop, a fault, a failure.
    Stop,
}

/// The last entries, in the order in which they came.
#[derive(Debug, Default)]
pub struct Log {
    entries: VecDeque<Entry>,
    next: u64,
    runs: VecDeque<RunTimes>,
    /// Time and number of the last safety event.
    safety: Option<(i64, u64)>,
}

/// Something that happened.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Counts all entries of a log.
    pub number: u64,
    /// UTC since 1970.
    pub t_wall_ns: i64,
    /// Its run; empty if it belongs to none.
    pub run_id: String,
    /// Where it comes from, such as `run`, `safety` or `sensor`.
    pub kind: &'static str,
    /// How much it matters.
    pub weight: Weight,
    /// What happened.
    pub text: String,
}

#[derive(Debug)]
struct RunTimes {
    run_id: String,
    who: String,
    started_wall_ns: i64,
    /// Number of the last event that was seen: after a new connection the service tells all events again.
    last_seq: u64,
}

impl Weight {
    /// The word for it, in JSON.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Stop => "stop",
        }
    }
}

impl Log {
    /// An event of a run. Steps, phases and dwells are left out; the run's progress shows them. False if it was told before.
    pub fn on_event(&mut self, event: &pb::RunEvent) -> bool {
        match self.runs.iter_mut().rev().find(|run| run.run_id == event.run_id) {
            Some(run) if event.seq <= run.last_seq => return false,
            Some(run) => run.last_seq = event.seq,
            None => {
                if self.runs.len() == RUNS_MAX {
                    self.runs.pop_front();
                }
                let who = match &event.event {
                    Some(Event::Started(started)) => started.who.clone(),
                    Some(_) | None => String::new(),
                };
                self.runs.push_back(RunTimes {
                    run_id: event.run_id.clone(),
                    who,
                    started_wall_ns: event.t_wall_ns,
                    last_seq: event.seq,
                });
            }
        }
        if let Some((weight, text)) = event.event.as_ref().and_then(in_words) {
            self.push(event.t_wall_ns, &event.run_id, "run", weight, &text);
        }
        true
    }

    /// Safety news; the run is the last one that had started by then.
    pub fn on_safety(&mut self, event: &pb::SafetyEvent) {
        let this = (event.t_wall_ns, event.seq);
        if self.safety.replace(this) == Some(this) {
            return;
        }
        let run_id = self.run_at(event.t_wall_ns).to_owned();
        let text = format!("{} by {}: {}", event.verdict().word(), event.rule, event.detail);
        self.push(event.t_wall_ns, &run_id, "safety", Weight::Stop, &text);
    }

    /// What this program itself knows, such as a connection that ended.
    pub fn note(&mut self, t_wall_ns: i64, kind: &'static str, weight: Weight, text: &str) {
        self.push(t_wall_ns, "", kind, weight, text);
    }

    /// The run that had started last at a time; empty if none had.
    pub fn run_at(&self, t_wall_ns: i64) -> &str {
        let before = self.runs.iter().filter(|run| run.started_wall_ns <= t_wall_ns);
        before.max_by_key(|run| run.started_wall_ns).map_or("", |run| &run.run_id)
    }

    /// Who started a run; empty if that is not known.
    pub fn who(&self, run_id: &str) -> &str {
        self.runs.iter().find(|run| run.run_id == run_id).map_or("", |run| &run.who)
    }

    /// Number of the next entry.
    pub fn next(&self) -> u64 {
        self.next
    }

    /// All entries, the oldest first.
    pub fn entries(&self) -> impl DoubleEndedIterator<Item = &Entry> + ExactSizeIterator {
        self.entries.iter()
    }

    /// JSON of the entries from a number on.
    pub fn json_from(&self, number: u64) -> Value {
        self.entries_from(number).map(Entry::json).collect()
    }

    /// The entries from a number on.
    pub fn entries_from(&self, number: u64) -> impl Iterator<Item = &Entry> {
        self.entries.iter().filter(move |entry| entry.number >= number)
    }

    fn push(&mut self, t_wall_ns: i64, run_id: &str, kind: &'static str, weight: Weight, text: &str) {
        if self.entries.len() == ENTRIES_MAX {
            self.entries.pop_front();
        }
        let mut text = text.to_owned();
        if text.len() > TEXT_BYTES_MAX {
            text.truncate(text.floor_char_boundary(TEXT_BYTES_MAX));
            text.push_str(" ...");
        }
        let (number, run_id) = (self.next, run_id.to_owned());
        self.next += 1;
        self.entries.push_back(Entry { number, t_wall_ns, run_id, kind, weight, text });
    }
}

impl Entry {
    fn json(&self) -> Value {
        json!({
            "number": self.number,
            "t_wall_ms": self.t_wall_ns / 1_000_000,
            "run_id": self.run_id,
            "kind": self.kind,
            "weight": self.weight.word(),
            "text": self.text,
        })
    }
}

/// The words of an event; `None` for those that happen at every press.
fn in_words(event: &Event) -> Option<(Weight, String)> {
    let note = |text: String| Some((Weight::Note, text));
    let warning = |text: String| Some((Weight::Warning, text));
    let stop = |text: String| Some((Weight::Stop, text));
    match event {
        Event::Started(e) => note(format!("{} started by {}, seed {}", e.experiment, e.who, e.seed)),
        Event::StepStarted(_)
        | Event::StepDone(_)
        | Event::PhaseChanged(_)
        | Event::DwellDone(_)
        | Event::ReadDone(_) => None,
        Event::ReferenceDone(e) => note(format!("reading at rest taken, {} frames", e.frames)),
        Event::TareDone(e) => note(format!("tare: a new zero, {} frames", e.frames)),
        Event::Log(e) => note(e.message.clone()),
        Event::Gap(e) => warning(format!("{} frames lost: {}", e.frames_lost, e.reason)),
        Event::Paused(e) => warning(format!("paused by {}", e.by)),
        Event::Resumed(e) => note(format!("resumed by {}", e.by)),
        Event::LeaseTaken(e) => warning(format!("{} took the lease from {}: {}", e.by, e.from, e.reason)),
        Event::StopRequested(e) => {
            let what = if e.abort { "abort" } else { "STOP" };
            stop(format!("{what} by {}: {}", e.by, e.reason))
        }
        Event::PressRepeated(e) => warning(format!("press {} is repeated: {}", e.press, e.reason)),
        Event::CoveringChanged(e) => note(format!("covering of {} mm in place", e.covering_mm)),
        Event::Cleanup(e) if e.retracted => note(format!("tip retracted to z {:.3} mm", e.z_mm)),
        Event::Cleanup(e) => stop(format!("TIP NOT RETRACTED, z {:.3} mm: {}", e.z_mm, e.detail)),
        Event::Finished(e) => {
            let text = format!("ended: {}", with_message(e.exit_status().word(), &e.message));
            match e.exit_status() {
                pb::ExitStatus::Done => note(text),
                pb::ExitStatus::Degraded => warning(text),
                pb::ExitStatus::Unspecified
                | pb::ExitStatus::Failed
                | pb::ExitStatus::Stopped
                | pb::ExitStatus::Aborted
                | pb::ExitStatus::Refused
                | pb::ExitStatus::Crashed => stop(text),
            }
        }
    }
}

#[cfg(test)]
#[path = "log_tests.rs"]
mod tests;
