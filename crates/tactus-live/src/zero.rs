//! The zero that every viewer sees rises against.

use serde_json::{Value, json};
use tactus_schema::pb::{self, run_event::Event};

/// Frames that a zero taken here averages: half a second at 30 Hz.
pub const TAKEN_FRAMES: usize = 15;

/// Where a zero comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ZeroSource {
    /// The rig file's `baseline_counts`: nothing was measured yet.
    RigFile,
    /// The reading at rest that a run takes before anything else.
    Reference,
    /// A run's `tare()`.
    Tare,
    /// Somebody asked for it here, with the tip up and no run in progress.
    Taken,
}

/// A zero that was measured.
#[derive(Debug, Clone, PartialEq)]
struct Measured {
    source: ZeroSource,
    counts: Vec<f32>,
    /// Empty if it was taken here.
    run_id: String,
    t_wall_ns: i64,
}

/// The zero in force. A run's own zero replaces any other; a sensor that connects anew voids what was measured.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Zero {
    rig_file: Vec<f32>,
    measured: Option<Measured>,
}

impl ZeroSource {
    /// The word for it, for viewers.
    pub const fn word(self) -> &'static str {
        match self {
            Self::RigFile => "rig file",
            Self::Reference => "reference",
            Self::Tare => "tare",
            Self::Taken => "taken here",
        }
    }
}

impl Zero {
    /// Takes up the rig file's baseline.
    #[expect(clippy::cast_possible_truncation, reason = "counts need no more than a float's digits")]
    pub fn describe(&mut self, description: &pb::RigDescription) {
        self.rig_file = description.baseline_counts.iter().map(|&counts| counts as f32).collect();
    }

    /// Takes up the zero that a run has measured, if the event tells one.
    pub fn on_event(&mut self, event: &pb::RunEvent) {
        let (source, counts) = match &event.event {
            Some(Event::ReferenceDone(done)) => (ZeroSource::Reference, &done.mean_counts),
            Some(Event::TareDone(done)) => (ZeroSource::Tare, &done.baseline_counts),
            Some(_) | None => return,
        };
        self.measured = Some(Measured {
            source,
            counts: counts.clone(),
            run_id: event.run_id.clone(),
            t_wall_ns: event.t_wall_ns,
        });
    }

    /// Takes the mean of frames as the zero.
    pub fn take(&mut self, counts: Vec<f32>, last: &pb::Frame) {
        self.measured = Some(Measured {
            source: ZeroSource::Taken,
            counts,
            run_id: String::new(),
            t_wall_ns: last.t_wall_ns,
        });
    }

    /// Looks at a frame: the zeros of a sensor that connected anew, or of a service that `has_restarted`, may be others. True if a
    /// zero is void now.
    pub fn on_frame(&mut self, frame: &pb::Frame, has_restarted: bool) -> bool {
        let is_new = has_restarted || frame.flags & pb::FrameFlag::NewEpoch as u32 != 0;
        // A zero that is younger than the frame was told before it.
        let is_void = is_new && self.measured.as_ref().is_some_and(|zero| zero.t_wall_ns < frame.t_wall_ns);
        if is_void {
            self.measured = None;
        }
        is_void
    }

    /// The counts in force; empty if there is no zero at all.
    pub fn counts(&self) -> &[f32] {
        self.measured.as_ref().map_or(&self.rig_file, |zero| &zero.counts)
    }

    /// Where they come from.
    pub fn source(&self) -> ZeroSource {
        self.measured.as_ref().map_or(ZeroSource::RigFile, |zero| zero.source)
    }

    /// JSON for the page; null if there is no zero at all.
    pub fn json(&self) -> Value {
        match &self.measured {
            Some(zero) => json!({
                "counts": zero.counts,
                "source": zero.source.word(),
                "run_id": zero.run_id,
                "t_wall_ms": zero.t_wall_ns / 1_000_000,
            }),
            None if self.rig_file.is_empty() => Value::Null,
            None => json!({
                "counts": self.rig_file,
                "source": ZeroSource::RigFile.word(),
                "run_id": "",
                "t_wall_ms": null,
            }),
        }
    }
}

#[cfg(test)]
#[path = "zero_tests.rs"]
mod tests;
