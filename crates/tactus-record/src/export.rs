//! Makes a measurement table from recordings.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::{
    EpochClock, RowsError, Timeline, meter,
    rows::{RowSources, is_one_calibration},
    table::{FormatWriter, TableFormat},
};

/// Key of the file metadata that holds the clock estimates, as JSON.
const CLOCK_METADATA_KEY: &str = "tactus.clock";

/// Name of that JSON's form.
const CLOCK_SCHEMA: &str = "tactus.clock/1";

/// The result of an export.
#[derive(Debug, Clone, Serialize)]
pub struct ExportSummary {
    /// Path of the table.
    pub path: PathBuf,
    /// Number of rows: one per frame.
    pub rows: u64,
    /// Number of runs.
    pub runs: u64,
    /// The device clocks from which sampling times were computed.
    pub clocks: Vec<RunClocks>,
    /// Warnings for readers of the table, a sentence each.
    pub warnings: Vec<String>,
    /// What was left out although nothing is wrong, a sentence each.
    pub notes: Vec<String>,
}

/// The device clock of each connection of a run, as in the table's metadata.
#[derive(Debug, Clone, Serialize)]
pub struct RunClocks {
    /// Run id.
    pub run: String,
    /// Connections whose clock could be estimated.
    pub epochs: Vec<EpochClock>,
    /// Connections without a clock: their frames' sampling times are the times of arrival.
    pub by_arrival: Vec<u32>,
}

/// Writes the frames of the recordings as one measurement table, one row per frame, run after run.
///
/// A row's time is the sampling time by the device's clock ([`EpochClock`]); position and phase are the stage's at that
/// time. Of damaged recordings the readable part is exported, with a warning. The table is checked while it is written,
/// and appears at `out` only when it is complete.
///
/// The table is Parquet: see [`export_as`].
///
/// # Errors
/// If a recording cannot be read, has another rig or the same run as one before, or holds no stage position; if a
/// frame breaks the table's contract; or if the table cannot be written.
pub fn export<P: AsRef<Path>>(recordings: &[P], out: impl Into<PathBuf>) -> Result<ExportSummary, RowsError> {
    export_as(recordings, out, TableFormat::Parquet)
}

/// As [`export`], in any format.
///
/// # Errors
/// As [`export`].
pub fn export_as<P: AsRef<Path>>(
    recordings: &[P],
    out: impl Into<PathBuf>,
    format: TableFormat,
) -> Result<ExportSummary, RowsError> {
    let out = out.into();
    let [first, rest @ ..] = recordings else { return Err(RowsError::Nothing) };
    for path in recordings {
        // For the motion of the stage, then to write the rows.
        meter::will_read(path, &[1.0, 2.0]);
    }
    let first = Timeline::read(first)?;
    let mut table = FormatWriter::create(format, out.clone(), first.rig_json())?;
    let mut sources = RowSources::of(recordings)?;
    let mut clocks = Vec::new();
    let mut add = |timeline: &Timeline| {
        clocks.push(RunClocks::of(timeline));
        // A table describes one rig.
        sources.one_calibration(timeline.path(), timeline.rig())?;
        sources.recording(timeline, |_, row| Ok(table.put(row)?))
    };
    let filled = add(&first).and_then(|()| rest.iter().try_for_each(|path| add(&Timeline::read(path)?)));
    let source = match filled.and_then(|()| sources.into_source()) {
        Ok(source) => source,
        Err(error) => {
            table.abandon();
            return Err(error.with_groups(recordings, is_one_calibration));
        }
    };
    table.metadata(
        CLOCK_METADATA_KEY,
        serde_json::json!({ "schema": CLOCK_SCHEMA, "runs": clocks }).to_string(),
    );
    let rows = table.finish()?;
    let runs = source.runs.len() as u64;
    Ok(ExportSummary { path: out, rows, runs, clocks, warnings: source.warnings, notes: source.notes })
}

impl RunClocks {
    fn of(timeline: &Timeline) -> Self {
        let clocks = timeline.clocks();
        Self {
            run: timeline.run().run_id.clone(),
            epochs: clocks.values().filter_map(|clock| clock.ok()).collect(),
            by_arrival: clocks.iter().filter(|(_, clock)| clock.is_err()).map(|(epoch, _)| *epoch).collect(),
        }
    }
}
