//! Measured rows from recordings and measurement tables.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
    time::Duration,
};

use tactus_calibrate::{Readings, ReadingsBuilder};
use tactus_schema::{
    Frame, MonoTime, Rig,
    pb::{self, run_event::Event},
    table::RowView,
};

use crate::{
    Completeness, Entry, Message, RowsError, Sampling, Timeline, meter,
    reader::{first_bytes, io_error, is_mcap, read, read_run},
    rig_groups::{RigGroups, differences},
    table::{Checker, TableReader},
};

/// The first bytes of a Parquet file.
const PARQUET_MAGIC: &[u8] = b"PAR1";

/// Where rows came from.
#[derive(Debug, Clone)]
pub struct Source {
    /// The measured rig as the first file describes it; each row has its own covering and tool.
    pub rig: Rig,
    /// Names that the files give the rig, each once.
    pub names: Vec<String>,
    /// The runs, in the order of their rows.
    pub runs: Vec<RunSource>,
    /// Warnings for readers of the rows, a sentence each.
    pub warnings: Vec<String>,
    /// What was left out although nothing is wrong, a sentence each.
    pub notes: Vec<String>,
}

impl Source {
    /// A warning if the files give the rig several names.
    pub fn renamed(&self) -> Option<String> {
        let (first, others) = self.names.split_first().filter(|(_, others)| !others.is_empty())?;
        Some(format!(
            "the files name the rig {first:?} and {}: they are read as one rig, because array, place and tools agree",
            others.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ")
        ))
    }
}

/// Where the rows of one run came from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunSource {
    /// Run id.
    pub run: String,
    /// The recording or table.
    pub path: PathBuf,
    /// True if no physical sensor was read.
    pub simulated: bool,
}

/// Calls `take` for every row of recordings and measurement tables, with the rig as the row's file describes it; file after
/// file, in the order given.
///
/// The first bytes of a file decide its kind, not its name. The rows of a recording, complete or damaged, are those that
/// [`export`](crate::export()) writes. Each row is checked before `take` sees it. Memory holds no more than a few dozen
/// bytes per frame of one recording, or one row group of one table.
///
/// The files must be of one array at one place with the same tools. Name, spread, sensitivities and baselines of the rig may differ:
/// a lab calibrates it again between runs.
///
/// If a recording goes on with the run of another one here, the presses that it did again are left out of the other one.
///
/// # Errors
/// If a file is neither, cannot be read, was made with another sensor, place or tools or holds a run of a file before; if a recording
/// holds no stage position; or if a row breaks the table's contract. `take` has then seen the rows before it.
pub fn visit<P: AsRef<Path>>(
    paths: &[P],
    mut take: impl FnMut(&Rig, RowView<'_>),
) -> Result<Source, RowsError> {
    announce(paths);
    let mut sources = RowSources::of(paths)?;
    let mut take = |rig: &Rig, row: RowView<'_>| {
        take(rig, row);
        Ok(())
    };
    for path in paths.iter().map(AsRef::as_ref) {
        sources.file(path, &mut take).map_err(|error| error.with_groups(paths, is_one_sensor))?;
    }
    sources.into_source()
}

/// Says what [`visit`] will read: recordings for the motion of the stage, then for the frames; tables once.
fn announce<P: AsRef<Path>>(paths: &[P]) {
    for path in paths.iter().map(AsRef::as_ref) {
        let is_recording = first_bytes(path).is_ok_and(|start| is_mcap(&start));
        meter::will_read(path, if is_recording { &[1.0, 1.0] } else { &[1.0] });
    }
}

/// The presses in recordings and measurement tables, for a calibration.
///
/// # Errors
/// As [`visit`].
pub fn readings<P: AsRef<Path>>(paths: &[P]) -> Result<(Source, Readings), RowsError> {
    let mut builder = None;
    let source = visit(paths, |rig, row| {
        builder.get_or_insert_with(|| ReadingsBuilder::new(&rig.array)).take(row);
    })?;
    let readings = builder.unwrap_or_else(|| ReadingsBuilder::new(&source.rig.array)).finish();
    Ok((source, readings))
}

/// Calls `take` for the rows of a run that was not recorded, from its timeline and its frames, in order: the rows that its recording
/// would give.
///
/// # Errors
/// [`RowsError::NoStage`] if the stage never told its position.
pub fn visit_frames(
    timeline: &Timeline,
    frames: &[Frame],
    mut take: impl FnMut(RowView<'_>),
) -> Result<(), RowsError> {
    let mut rows = RowMaker::new(timeline, None);
    for frame in frames {
        if let Some(row) = rows.row(frame)? {
            take(row);
        }
    }
    Ok(())
}

/// The files read so far: of one sensor, with each run once.
#[derive(Debug, Default)]
pub(crate) struct RowSources {
    /// The first file, and its rig.
    first: Option<(PathBuf, Rig)>,
    /// Names of the rig, each once.
    names: Vec<String>,
    runs: Vec<RunSource>,
    warnings: Vec<String>,
    notes: Vec<String>,
    /// What later runs took over, by the run that they go on with.
    taken_over: BTreeMap<String, pb::TakenOver>,
}

impl RowSources {
    /// For these files. Recordings are read up to their start.
    pub(crate) fn of<P: AsRef<Path>>(paths: &[P]) -> Result<Self, RowsError> {
        let mut taken_over: BTreeMap<String, pb::TakenOver> = BTreeMap::new();
        for path in paths.iter().map(AsRef::as_ref) {
            let Some(taken) = taken_over_by(path)? else { continue };
            match taken_over.get_mut(&taken.run_id) {
                Some(known) if known.first_press <= taken.first_press => {}
                Some(known) => *known = taken,
                None => drop(taken_over.insert(taken.run_id.clone(), taken)),
            }
        }
        Ok(Self { taken_over, ..Self::default() })
    }

    /// Calls `take` for the rows of a file, whichever kind it is.
    fn file(
        &mut self,
        path: &Path,
        take: &mut impl FnMut(&Rig, RowView<'_>) -> Result<(), RowsError>,
    ) -> Result<(), RowsError> {
        let start = first_bytes(path)?;
        if is_mcap(&start) {
            self.recording(&Timeline::read(path)?, take)
        } else if start.starts_with(PARQUET_MAGIC) {
            self.table(TableReader::open(path)?, take)
        } else if start.is_empty() {
            Err(RowsError::Empty { path: path.to_owned() })
        } else {
            Err(RowsError::Neither { path: path.to_owned() })
        }
    }

    /// Calls `take` for the rows of a recording.
    pub(crate) fn recording(
        &mut self,
        timeline: &Timeline,
        mut take: impl FnMut(&Rig, RowView<'_>) -> Result<(), RowsError>,
    ) -> Result<(), RowsError> {
        let (path, run) = (timeline.path(), timeline.run());
        self.one_sensor(path, timeline.rig())?;
        self.new_run(path, &run.run_id, run.simulated)?;
        if timeline.stage().is_empty() {
            return Err(RowsError::NoStage { path: path.to_owned() });
        }
        let done_again_from = self.taken_over.get(&run.run_id).map(|taken| taken.first_press);
        let mut frames = RowMaker::new(timeline, done_again_from);
        let mut checker = Checker::new(timeline.rig());
        let mut index = 0;
        let (_, reader) = read_run(path)?;
        for entry in reader {
            let entry = entry.map_err(|source| io_error(path, source))?;
            if let Entry::Message { message: Message::Frame(frame), .. } = entry {
                let Some(row) = frames.row(&frame)? else { continue };
                checker.check(&row).map_err(|fault| fault.at(path, index))?;
                take(timeline.rig(), row)?;
                index += 1;
            }
        }
        self.warnings.extend(frames.warnings());
        self.notes.extend(frames.note());
        Ok(())
    }

    /// Calls `take` for the rows of a table.
    fn table(
        &mut self,
        table: TableReader,
        mut take: impl FnMut(&Rig, RowView<'_>) -> Result<(), RowsError>,
    ) -> Result<(), RowsError> {
        let (path, rig) = (table.path().to_owned(), table.head().rig.clone());
        let (simulated, before) = (rig.simulated, self.runs.len());
        self.one_sensor(&path, &rig)?;
        table.visit(|row| {
            if self.runs[before..].last().is_none_or(|last| last.run != row.run) {
                self.new_run(&path, row.run, simulated)?;
            }
            take(&rig, row)
        })?;
        Ok(())
    }

    /// The rig of the first file, the runs and the warnings of all files.
    pub(crate) fn into_source(self) -> Result<Source, RowsError> {
        let Self { first, names, runs, warnings, notes, .. } = self;
        let (_, rig) = first.ok_or(RowsError::Nothing)?;
        Ok(Source { rig, names, runs, warnings, notes })
    }

    fn one_sensor(&mut self, path: &Path, rig: &Rig) -> Result<(), RowsError> {
        let (first, first_rig) = self.first.get_or_insert_with(|| (path.to_owned(), rig.clone()));
        if !is_one_sensor(first_rig, rig) {
            return Err(RowsError::rigs_differ((first, first_rig), (path, rig), FREE_OF_ONE_SENSOR));
        }
        if !self.names.contains(&rig.name) {
            self.names.push(rig.name.clone());
        }
        Ok(())
    }

    /// Refuses files whose rigs differ in more than covering and tool.
    pub(crate) fn one_calibration(&self, path: &Path, rig: &Rig) -> Result<(), RowsError> {
        match &self.first {
            Some((first, known)) if !is_one_calibration(known, rig) => {
                Err(RowsError::rigs_differ((first, known), (path, rig), FREE_OF_ONE_CALIBRATION))
            }
            _ => Ok(()),
        }
    }

    fn new_run(&mut self, path: &Path, run: &str, simulated: bool) -> Result<(), RowsError> {
        let (path, run) = (path.to_owned(), run.to_owned());
        if self.runs.iter().any(|known| known.run == run) {
            return Err(RowsError::RunTwice { path, run });
        }
        self.runs.push(RunSource { run, path, simulated });
        Ok(())
    }
}

/// True if two rigs agree in what must be the same in all runs. Covering and tool are in the rows. Between runs a lab may calibrate or
/// rename its rig.
fn is_one_sensor(first: &Rig, rig: &Rig) -> bool {
    let as_first = Rig {
        name: first.name.clone(),
        psf: first.psf,
        sensitivity_counts_per_mm: first.sensitivity_counts_per_mm.clone(),
        baseline_counts: first.baseline_counts.clone(),
        ..calibrated(rig)
    };
    as_first == calibrated(first)
}

/// Keys of a rig that may differ between the runs of one sensor: see [`is_one_sensor`].
const FREE_OF_ONE_SENSOR: &[&str] =
    &["name", "psf", "sensitivity_counts_per_mm", "baseline_counts", "covering", "indenter"];

/// Keys of a rig that may differ between the runs of one calibration: see [`calibrated`].
const FREE_OF_ONE_CALIBRATION: &[&str] = &["covering", "indenter"];

/// True if two rigs agree in all but covering and tool.
pub(crate) fn is_one_calibration(first: &Rig, rig: &Rig) -> bool {
    calibrated(first) == calibrated(rig)
}

impl RowsError {
    fn rigs_differ((first, first_rig): (&Path, &Rig), (path, rig): (&Path, &Rig), free: &[&str]) -> Self {
        Self::RigsDiffer {
            first: first.to_owned(),
            path: path.to_owned(),
            difference: differences(first_rig, rig, free),
            groups: RigGroups::default(),
        }
    }

    /// Says of rigs that differ which files go together.
    pub(crate) fn with_groups<P: AsRef<Path>>(
        self,
        paths: &[P],
        go_together: impl Fn(&Rig, &Rig) -> bool,
    ) -> Self {
        match self {
            Self::RigsDiffer { first, path, difference, .. } => {
                Self::RigsDiffer { first, path, difference, groups: RigGroups::of(paths, go_together) }
            }
            other @ (Self::Nothing
            | Self::Empty { .. }
            | Self::Neither { .. }
            | Self::Record(_)
            | Self::Table(_)
            | Self::RunTwice { .. }
            | Self::NoStage { .. }) => other,
        }
    }
}

/// A rig without covering and tool.
fn calibrated(rig: &Rig) -> Rig {
    Rig { covering: rig.sensitivity_reference.covering, indenter: String::new(), ..rig.clone() }
}

/// What the run of a recording took over from an earlier one; `None` of other files.
fn taken_over_by(path: &Path) -> Result<Option<pb::TakenOver>, RowsError> {
    if !is_mcap(&first_bytes(path)?) {
        return Ok(None);
    }
    for entry in read(path)? {
        if let Entry::Message { message: Message::Event(event), .. } =
            entry.map_err(|source| io_error(path, source))?
        {
            // The start is the first event.
            let Some(Event::Started(started)) = event.event else { break };
            return Ok(started.taken_over);
        }
    }
    Ok(None)
}

/// Turns the frames of one recording into rows.
struct RowMaker<'a> {
    timeline: &'a Timeline,
    last: Option<MonoTime>,
    /// Frames whose sampling time was not after the one before.
    moved: u64,
    by_arrival: u64,
    /// Elements that were not read in some frames.
    bad_elements: BTreeSet<u32>,
    /// Number of these frames.
    partly_read: u64,
    /// Frames of which nobody knows what the stage did.
    untold: u64,
    /// Presses from this index on were done again by the run that goes on with this one.
    done_again_from: Option<i32>,
    /// Frames of those.
    done_again: u64,
}

impl<'t> RowMaker<'t> {
    fn new(timeline: &'t Timeline, done_again_from: Option<i32>) -> Self {
        Self {
            timeline,
            last: None,
            moved: 0,
            by_arrival: 0,
            bad_elements: BTreeSet::new(),
            partly_read: 0,
            untold: 0,
            done_again_from,
            done_again: 0,
        }
    }

    /// The row of a frame; `None` if it is left out.
    fn row<'a>(&'a mut self, frame: &'a Frame) -> Result<Option<RowView<'a>>, RowsError> {
        let timeline = self.timeline;
        let sampling = timeline.sampling(frame);
        if !timeline.knows_phase(sampling.time()) {
            self.untold += 1;
            return Ok(None);
        }
        let later = |last: MonoTime| sampling.time().max(last.after(Duration::from_nanos(1)));
        let at = self.last.map_or(sampling.time(), later);
        let (phase, press) = timeline.phase(at);
        if self.done_again_from.is_some_and(|first| press >= first) {
            self.done_again += 1;
            return Ok(None);
        }
        self.moved += u64::from(at != sampling.time());
        self.last = Some(at);
        self.by_arrival += u64::from(matches!(sampling, Sampling::Arrival(_)));
        self.bad_elements.extend(frame.bad_elements.iter());
        self.partly_read += u64::from(!frame.bad_elements.is_empty());
        let position_mm = timeline.position_mm(at);
        let position_mm =
            position_mm.ok_or_else(|| RowsError::NoStage { path: timeline.path().to_owned() })?;
        Ok(Some(RowView {
            run: &timeline.run().run_id,
            press,
            phase,
            t_ns: at.ns(),
            position_mm,
            covering_mm: timeline.covering_mm(at),
            indenter: timeline.indenter(),
            temperature_c: frame.temperature_c.map(f64::from),
            counts: &frame.counts,
        }))
    }

    fn note(&self) -> Option<String> {
        let Self { timeline, done_again, .. } = *self;
        let first = self.done_again_from.filter(|_| done_again > 0)?;
        Some(format!(
            "run {}: {done_again} frames of presses from {first} on are left out: the run that goes on with it did them again",
            timeline.run().run_id
        ))
    }

    fn warnings(&self) -> Vec<String> {
        let Self { timeline, moved, by_arrival, partly_read, untold, .. } = *self;
        let mut warnings = Vec::new();
        match timeline.completeness() {
            Completeness::Complete => {}
            incomplete @ (Completeness::Truncated { .. } | Completeness::Damaged(_)) => {
                warnings.push(format!("the recording is {incomplete}"));
            }
        }
        match timeline.tally().frames_missing() {
            0 => {}
            missing => warnings.push(format!("{missing} frames were received and are not in the recording")),
        }
        if untold > 0 {
            warnings.push(format!(
                "{untold} frames are left out: the events that say what the stage did then are lost"
            ));
        }
        if timeline.lacks_events() {
            warnings.push("events are lost: a change of the covering among them would go unnoticed".into());
        }
        for (epoch, clock) in timeline.clocks() {
            if let Err(absent) = clock {
                warnings.push(format!("connection {epoch}: {absent}; its frames are dated by their arrival"));
            }
        }
        if by_arrival > 0 {
            warnings.push(format!("{by_arrival} frames are dated by their arrival"));
        }
        if moved > 0 {
            warnings.push(format!("{moved} frames did not come after the one before; moved to do so"));
        }
        if partly_read > 0 {
            let elements: Vec<String> = self.bad_elements.iter().map(ToString::to_string).collect();
            warnings.push(format!(
                "in {partly_read} frames elements were not read and stand with an earlier reading: {}",
                elements.join(", ")
            ));
        }
        let run = &timeline.run().run_id;
        warnings.into_iter().map(|warning| format!("run {run}: {warning}")).collect()
    }
}
