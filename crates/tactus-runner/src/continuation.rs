//! What an earlier run confirmed, for a run that goes on with it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use tactus_plan::{Arguments, Evaluate, MeanReading, Script, ScriptError};
use tactus_record::{ConfirmedPress, Entry, Message, RecordError, confirmed_presses, read};
use tactus_schema::pb::{self, run_event::Event};
use tactus_schema::{Frame, MonoTime};

use crate::order::RunRequest;

/// The attachment with the parameters as the script saw them.
const PARAMETERS_JSON: &str = "parameters.json";

/// A request for the rest of an earlier run.
#[derive(Debug, Clone)]
pub struct Continuation {
    /// Id of the earlier run.
    pub run_id: String,
    /// Its script, parameters and seed.
    pub request: RunRequest,
    /// The presses that need not be repeated, in order: the script's first ones.
    pub confirmed: Vec<DonePress>,
}

/// A press that was done to its end, with what the script was told.
#[derive(Debug, Clone, PartialEq)]
pub struct DonePress {
    /// Number of the script's step.
    pub step: u64,
    /// Where it was, sensor frame.
    pub at_mm: [f64; 2],
    /// Depths of its dwells, in order.
    pub depths_mm: Vec<f64>,
    /// The mean readings of its dwells, in order, made again from the recorded frames. Their signal is against the last zero
    /// that was recorded before; without one it is empty.
    pub readings: Vec<MeanReading>,
}

/// Why a run cannot be continued.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum ContinuationError {
    /// There is no such run.
    #[error("no run {run_id:?} in {}: `ls` shows the ids of the runs there", folder.display())]
    Unknown { run_id: String, folder: PathBuf },
    /// The recording cannot be read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The recording has no end yet.
    #[error("run {run_id} is not over, or its service died: the service closes such runs at its start")]
    Open { run_id: String },
    /// The run was done.
    #[error("run {run_id} is done: there is nothing to continue")]
    Done { run_id: String },
    /// The recording lacks what the run was started with.
    #[error("the recording of run {run_id} lacks its {what}: it cannot be continued")]
    Lacks { run_id: String, what: &'static str },
    /// The recorded script or its parameters have an error.
    #[error(transparent)]
    Script(#[from] ScriptError),
}

/// Reads what is needed to go on with a run whose recording is below `folder`.
///
/// # Errors
/// [`ContinuationError`] if there is no such run, if it is not over, or if nothing of it is left to do.
pub fn of_run(
    folder: &Path,
    run_id: &str,
    who: String,
    evaluator: Arc<dyn Evaluate>,
) -> Result<Continuation, ContinuationError> {
    let unknown = || ContinuationError::Unknown { run_id: run_id.to_owned(), folder: folder.to_owned() };
    let is_name = !run_id.is_empty() && run_id.chars().all(|c| c.is_ascii_alphanumeric() || "-_".contains(c));
    let path = folder.join(run_id).join("recording.mcap");
    if !is_name || !path.is_file() {
        return Err(unknown());
    }
    let lacks = |what| ContinuationError::Lacks { run_id: run_id.to_owned(), what };
    let start = Start::read(&path)?;
    match start.exit_status {
        None => return Err(ContinuationError::Open { run_id: run_id.to_owned() }),
        Some(pb::ExitStatus::Done | pb::ExitStatus::Degraded) => {
            return Err(ContinuationError::Done { run_id: run_id.to_owned() });
        }
        Some(_) => {}
    }
    let (name, source) = start.script.ok_or_else(|| lacks("script"))?;
    let request = RunRequest {
        script: Script::parse(&name, &source)?,
        arguments: Arguments::from_json(&start.parameters.ok_or_else(|| lacks("parameters"))?)?,
        seed: Some(start.seed.ok_or_else(|| lacks("seed"))?),
        who,
        evaluator,
    };
    let presses = confirmed_presses(&path)?;
    let confirmed = readings(&path, &presses, &start.zeros)?;
    Ok(Continuation { run_id: run_id.to_owned(), request, confirmed })
}

/// What a run was started with, and its zeros.
#[derive(Default)]
struct Start {
    script_name: String,
    script: Option<(String, String)>,
    parameters: Option<String>,
    seed: Option<u64>,
    /// When each was taken.
    zeros: Vec<(MonoTime, Vec<f32>)>,
    exit_status: Option<pb::ExitStatus>,
}

impl Start {
    fn read(path: &Path) -> Result<Self, RecordError> {
        let mut start = Self::default();
        for entry in read(path)? {
            start.take(entry.map_err(|source| unread(path, source))?);
        }
        Ok(start)
    }

    fn take(&mut self, entry: Entry) {
        match entry {
            Entry::Run(run) => self.script_name = run.script,
            Entry::Attachment(file) => {
                let Ok(text) = String::from_utf8(file.data) else { return };
                if file.name == self.script_name {
                    let name = file.name.strip_suffix(".star").unwrap_or(&file.name).to_owned();
                    self.script = Some((name, text));
                } else if file.name == PARAMETERS_JSON {
                    self.parameters = Some(text);
                }
            }
            Entry::Message { message: Message::Event(event), .. } => match event.event {
                Some(Event::Started(started)) => self.seed = Some(started.seed),
                Some(Event::TareDone(tare)) => {
                    self.zeros.push((MonoTime::from_ns(event.t_mono_ns), tare.baseline_counts));
                }
                Some(Event::Finished(finished)) => self.exit_status = Some(finished.exit_status()),
                _ => {}
            },
            Entry::Message { .. } => {}
        }
    }
}

/// The presses with their readings, up to the first whose frames are not all there.
fn readings(
    path: &Path,
    presses: &[ConfirmedPress],
    zeros: &[(MonoTime, Vec<f32>)],
) -> Result<Vec<DonePress>, RecordError> {
    let mut averages: Vec<Average> =
        presses.iter().flat_map(|press| &press.dwells).map(|dwell| Average::over(dwell, zeros)).collect();
    averages.sort_by_key(|average| average.from);
    let mut next = 0;
    for entry in read(path)? {
        let entry = entry.map_err(|source| unread(path, source))?;
        let Entry::Message { message: Message::Frame(frame), .. } = entry else { continue };
        while averages.get(next).is_some_and(|average| frame.received.mono > average.until) {
            next += 1;
        }
        if let Some(average) = averages.get_mut(next).filter(|average| frame.received.mono >= average.from) {
            average.add(&frame);
        }
    }
    let mut averages = averages.into_iter();
    let whole = presses.iter().map_while(|press| {
        let readings: Option<Vec<MeanReading>> =
            press.dwells.iter().map(|dwell| averages.next()?.reading(dwell.frames)).collect();
        let first = press.dwells.first()?;
        Some(DonePress {
            step: press.step,
            at_mm: [first.x_mm, first.y_mm],
            depths_mm: press.dwells.iter().map(|dwell| dwell.depth_mm).collect(),
            readings: readings?,
        })
    });
    Ok(whole.collect())
}

/// The mean of a dwell, as the engine made it (Welford 1962).
struct Average {
    from: MonoTime,
    until: MonoTime,
    zero: Vec<f32>,
    mean: Vec<f64>,
    squares: Vec<f64>,
    frames: u32,
}

impl Average {
    fn over(dwell: &pb::DwellDone, zeros: &[(MonoTime, Vec<f32>)]) -> Self {
        let from = MonoTime::from_ns(dwell.from_mono_ns);
        let zero = zeros.iter().rev().find(|(at, _)| *at < from);
        Self {
            from,
            until: MonoTime::from_ns(dwell.to_mono_ns),
            zero: zero.map(|(_, counts)| counts.clone()).unwrap_or_default(),
            mean: vec![0.0; dwell.mean_counts.len()],
            squares: vec![0.0; dwell.mean_counts.len()],
            frames: 0,
        }
    }

    fn add(&mut self, frame: &Frame) {
        self.frames += 1;
        for ((mean, squares), count) in self.mean.iter_mut().zip(&mut self.squares).zip(frame.counts.iter()) {
            let deviation = f64::from(*count) - *mean;
            *mean += deviation / f64::from(self.frames);
            *squares += deviation * (f64::from(*count) - *mean);
        }
    }

    /// `None` if frames of the dwell are missing.
    fn reading(self, frames: u32) -> Option<MeanReading> {
        if self.frames != frames || frames == 0 {
            return None;
        }
        let freedom = f64::from((frames - 1).max(1));
        Some(MeanReading {
            signal: self.mean.iter().zip(&self.zero).map(|(mean, zero)| mean - f64::from(*zero)).collect(),
            rms: self.squares.iter().map(|squares| (squares / freedom).sqrt()).collect(),
            mean_counts: self.mean,
            frames,
        })
    }
}

fn unread(path: &Path, source: std::io::Error) -> RecordError {
    RecordError::Io { action: "read", path: path.to_owned(), source }
}
