//! Makes a measurement table of recordings.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    time::Duration,
};

use serde::Serialize;
use tactus_schema::{Frame, MonoTime, Rig};

use crate::{
    Completeness, Entry, EpochClock, ExportError, Message, Sampling, Timeline,
    reader::{io_error, read_run},
    table::{RowView, TableWriter},
};

/// Key of the file metadata that holds the clock estimates, as JSON.
const CLOCK_METADATA_KEY: &str = "tactus.clock";

/// Name of that JSON's form.
const CLOCK_SCHEMA: &str = "tactus.clock/1";

/// What an export made.
#[derive(Debug, Clone, Serialize)]
pub struct ExportSummary {
    /// The table.
    pub path: PathBuf,
    /// Rows in it: one a frame.
    pub rows: u64,
    /// Runs in it.
    pub runs: u64,
    /// The device clocks it rests on.
    pub clocks: Vec<RunClocks>,
    /// What a reader of the table should know, a sentence each.
    pub warnings: Vec<String>,
}

/// The device clock of each connection of a run, as it stands in the table's metadata.
#[derive(Debug, Clone, Serialize)]
pub struct RunClocks {
    /// Run id.
    pub run: String,
    /// Connections whose clock could be estimated.
    pub epochs: Vec<EpochClock>,
    /// Connections whose frames are dated by their arrival.
    pub by_arrival: Vec<u32>,
}

/// Writes the frames of the recordings as one measurement table, a row each, run after run.
///
/// A row's time is its sampling time by the device's clock ([`EpochClock`]), its place and phase are the stage's at
/// that time. Damaged recordings give what can be read of them, with a warning. The table is checked as it is
/// written, and stands at `out` only when it is whole.
///
/// # Errors
/// If a recording cannot be read, has another rig or the same run as one before, or holds no stage position; if a
/// frame breaks the table's contract; or if the table cannot be written.
pub fn export<P: AsRef<Path>>(
    recordings: &[P],
    out: impl Into<PathBuf>,
) -> Result<ExportSummary, ExportError> {
    let out = out.into();
    let [first, rest @ ..] = recordings else { return Err(ExportError::Nothing) };
    let first = Timeline::read(first)?;
    let mut table = TableWriter::create(&out, first.rig_json())?;
    let mut export = Export::of(&first);
    let filled = export
        .add(&mut table, &first)
        .and_then(|()| rest.iter().try_for_each(|path| export.add(&mut table, &Timeline::read(path)?)));
    if let Err(error) = filled {
        table.abandon();
        return Err(error);
    }
    let Export { clocks, warnings, .. } = export;
    table.metadata(
        CLOCK_METADATA_KEY,
        serde_json::json!({ "schema": CLOCK_SCHEMA, "runs": clocks }).to_string(),
    );
    let rows = table.finish()?;
    Ok(ExportSummary { path: out, rows, runs: clocks.len() as u64, clocks, warnings })
}

struct Export {
    rig: Rig,
    rig_from: PathBuf,
    runs: BTreeSet<String>,
    clocks: Vec<RunClocks>,
    warnings: Vec<String>,
}

impl Export {
    fn of(first: &Timeline) -> Self {
        Self {
            rig: permanent(first.rig()),
            rig_from: first.path().to_owned(),
            runs: BTreeSet::new(),
            clocks: Vec::new(),
            warnings: Vec::new(),
        }
    }

    fn add(&mut self, table: &mut TableWriter, timeline: &Timeline) -> Result<(), ExportError> {
        let path = timeline.path();
        let run = timeline.run().run_id.as_str();
        if permanent(timeline.rig()) != self.rig {
            return Err(ExportError::RigsDiffer { first: self.rig_from.clone(), path: path.to_owned() });
        }
        if !self.runs.insert(run.to_owned()) {
            return Err(ExportError::RunTwice { path: path.to_owned(), run: run.to_owned() });
        }
        if timeline.stage().is_empty() {
            return Err(ExportError::NoStage { path: path.to_owned() });
        }
        let mut rows = RunRows { timeline, last: None, moved: 0, by_arrival: 0 };
        let (_, mut reader) = read_run(path)?;
        for entry in reader.by_ref() {
            let entry = entry.map_err(|source| io_error(path, source))?;
            if let Entry::Message { message: Message::Frame(frame), .. } = entry {
                rows.push(table, &frame)?;
            }
        }
        let (moved, by_arrival) = (rows.moved, rows.by_arrival);
        self.clocks.push(clocks(timeline));
        self.warn(timeline, moved, by_arrival);
        Ok(())
    }

    fn warn(&mut self, timeline: &Timeline, moved: u64, by_arrival: u64) {
        let run = &timeline.run().run_id;
        if let Completeness::Truncated { at_byte, reason } = timeline.completeness() {
            self.warnings
                .push(format!("run {run}: the recording is readable up to byte {at_byte} only: {reason}"));
        }
        for (epoch, clock) in timeline.clocks() {
            if let Err(absent) = clock {
                let dated = "its frames are dated by their arrival";
                self.warnings.push(format!("run {run}, connection {epoch}: {absent}; {dated}"));
            }
        }
        if by_arrival > 0 {
            self.warnings.push(format!("run {run}: {by_arrival} frames are dated by their arrival"));
        }
        if moved > 0 {
            self.warnings
                .push(format!("run {run}: {moved} frames did not come after the one before; moved to do so"));
        }
    }
}

/// Turns the frames of one run into rows.
struct RunRows<'a> {
    timeline: &'a Timeline,
    last: Option<MonoTime>,
    /// Frames whose sampling time was not after the one before.
    moved: u64,
    by_arrival: u64,
}

impl RunRows<'_> {
    fn push(&mut self, table: &mut TableWriter, frame: &Frame) -> Result<(), ExportError> {
        let timeline = self.timeline;
        let sampling = timeline.sampling(frame);
        self.by_arrival += u64::from(matches!(sampling, Sampling::Arrival(_)));
        let mut at = sampling.time();
        if let Some(last) = self.last.filter(|last| at <= *last) {
            at = last.after(Duration::from_nanos(1));
            self.moved += 1;
        }
        self.last = Some(at);
        let position_mm = timeline.position_mm(at);
        let position_mm =
            position_mm.ok_or_else(|| ExportError::NoStage { path: timeline.path().to_owned() })?;
        let (phase, press) = timeline.phase(at);
        table.push(RowView {
            run: &timeline.run().run_id,
            press,
            phase,
            t_ns: at.ns(),
            position_mm,
            covering_mm: timeline.covering_mm(at),
            indenter: timeline.indenter(),
            temperature_c: None,
            counts: &frame.counts,
        })?;
        Ok(())
    }
}

/// What must be the same in all runs of a table; covering and tool stand in its rows.
fn permanent(rig: &Rig) -> Rig {
    Rig { covering: rig.sensitivity_reference.covering, indenter: String::new(), ..rig.clone() }
}

fn clocks(timeline: &Timeline) -> RunClocks {
    let clocks = timeline.clocks();
    RunClocks {
        run: timeline.run().run_id.clone(),
        epochs: clocks.values().filter_map(|clock| clock.ok()).collect(),
        by_arrival: clocks.iter().filter(|(_, clock)| clock.is_err()).map(|(epoch, _)| *epoch).collect(),
    }
}
