//! Position and phase of the stage at any time of a run.

mod builder;
mod press_numbers;
mod stage_path;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use builder::TimelineBuilder;
use tactus_schema::{
    Frame, MonoTime, Rig,
    pb::{self, run_event::Event},
    table::Phase,
};

use crate::{
    Completeness, EpochClock, Message, NoClock, RecordError, RunMetadata, Tally,
    reader::{io_error, read_run},
};

/// A recording without the counts of its frames, in order of time.
///
/// It holds a few dozen bytes per frame. A second pass over the recording can then treat the frames one by one.
#[derive(Debug, Clone)]
pub struct Timeline {
    path: PathBuf,
    run: RunMetadata,
    rig: Rig,
    rig_json: String,
    attachments: BTreeMap<String, Vec<u8>>,
    clocks: BTreeMap<u32, Result<EpochClock, NoClock>>,
    stage: Vec<StageReport>,
    phases: Vec<(MonoTime, Phase, i32)>,
    /// Where events are lost, so that the phase is not known: from, until.
    untold: Vec<(MonoTime, MonoTime)>,
    coverings: Vec<(MonoTime, f64)>,
    events: Vec<pb::RunEvent>,
    tally: Tally,
    completeness: Completeness,
}

/// A reported position of the stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageReport {
    /// When it was reported.
    pub at: MonoTime,
    /// The tip in the robot's frame.
    pub position_mm: [f64; 3],
    /// True if the stage reported that it does not move.
    pub stands: bool,
}

/// When a frame was sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sampling {
    /// By the device's clock.
    Device(MonoTime),
    /// The time of arrival, because there is no usable device clock.
    Arrival(MonoTime),
}

impl Sampling {
    /// The time of either kind.
    pub fn time(self) -> MonoTime {
        match self {
            Self::Device(at) | Self::Arrival(at) => at,
        }
    }
}

impl Timeline {
    /// Reads a recording, complete or damaged.
    ///
    /// # Errors
    /// If it cannot be read, does not say which run it is, or holds no valid rig.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, RecordError> {
        let path = path.as_ref();
        let (run, mut reader) = read_run(path)?;
        let mut builder = TimelineBuilder::default();
        for entry in reader.by_ref() {
            builder.take(entry.map_err(|source| io_error(path, source))?);
        }
        let completeness = reader.completeness().cloned().unwrap_or(Completeness::Complete);
        builder.into_timeline(path, run, completeness)
    }

    /// The timeline of a run that was not recorded, such as a rehearsal, from the messages that its recording would hold. Its path is
    /// the run's id.
    pub fn of_messages(run: RunMetadata, rig: Rig, messages: impl IntoIterator<Item = Message>) -> Self {
        let mut builder = TimelineBuilder::default();
        for message in messages {
            builder.message(message);
        }
        let rig_json = rig.to_json();
        let path = PathBuf::from(&run.run_id);
        builder.finish(&path, run, (rig, rig_json), Completeness::Complete)
    }

    /// Path of the recording.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The run's metadata.
    pub fn run(&self) -> &RunMetadata {
        &self.run
    }

    /// The rig it ran on.
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// The same as the JSON text in the recording.
    pub fn rig_json(&self) -> &str {
        &self.rig_json
    }

    /// Contents of an attached file.
    pub fn attachment(&self, name: &str) -> Option<&[u8]> {
        self.attachments.get(name).map(Vec::as_slice)
    }

    /// The run's events, in order; their presses are counted as [`Timeline::phase`] counts them.
    pub fn events(&self) -> &[pb::RunEvent] {
        &self.events
    }

    /// Totals over the whole recording.
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    /// How much of the file could be read.
    pub fn completeness(&self) -> &Completeness {
        &self.completeness
    }

    /// Estimated device clocks, by connection.
    pub fn clocks(&self) -> &BTreeMap<u32, Result<EpochClock, NoClock>> {
        &self.clocks
    }

    /// The stage's reports, in order of time.
    pub fn stage(&self) -> &[StageReport] {
        &self.stage
    }

    /// When a frame of this recording was sampled.
    pub fn sampling(&self, frame: &Frame) -> Sampling {
        match (self.clocks.get(&frame.epoch), frame.device_tick) {
            (Some(Ok(clock)), Some(tick)) => Sampling::Device(clock.sampled(tick, frame.received.mono)),
            _ => Sampling::Arrival(frame.received.mono),
        }
    }

    /// Position of the tip in the robot's frame. Between two reports it follows from the speeds before and after them; before
    /// the first and after the last it is theirs. `None` without reports.
    pub fn position_mm(&self, at: MonoTime) -> Option<[f64; 3]> {
        stage_path::position_mm(&self.stage, at)
    }

    /// Phase of the stage, and index of the press, -1 outside one; idle before the run began. In a collection of several runs the presses
    /// of a later run are counted on after those before.
    pub fn phase(&self, at: MonoTime) -> (Phase, i32) {
        let next = self.phases.partition_point(|(from, _, _)| *from <= at);
        let now = next.checked_sub(1).and_then(|index| self.phases.get(index));
        now.map_or((Phase::Idle, -1), |(_, phase, press)| (*phase, *press))
    }

    /// False where events are lost: from the last one before to the next one that says the phase.
    pub fn knows_phase(&self, at: MonoTime) -> bool {
        !self.untold.iter().any(|(from, until)| (from..until).contains(&&at))
    }

    /// True if events of the run are lost, as their numbers tell.
    pub fn lacks_events(&self) -> bool {
        !self.untold.is_empty()
    }

    /// Thickness of the covering in place at a time.
    pub fn covering_mm(&self, at: MonoTime) -> f64 {
        let next = self.coverings.partition_point(|(from, _)| *from <= at);
        let now = next.checked_sub(1).or(Some(0)).and_then(|index| self.coverings.get(index));
        now.map_or(self.rig.covering.thickness_mm, |(_, thickness_mm)| *thickness_mm)
    }

    /// Id of the tool on the stage.
    pub fn indenter(&self) -> &str {
        self.started()
            .map(|started| started.indenter.as_str())
            .filter(|id| !id.is_empty())
            .unwrap_or(&self.rig.indenter)
    }

    /// The event that the run started, if it was recorded.
    pub fn started(&self) -> Option<&pb::RunStarted> {
        self.events.iter().find_map(|event| match &event.event {
            Some(Event::Started(started)) => Some(started),
            _ => None,
        })
    }
}
