//! One run as its recording tells it: what it was started with, and the steps that it has done.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use tactus_engine::{DoneStep, EarlierRun};
use tactus_plan::{MeanReading, Reply, Step};
use tactus_record::{Attachment, Entry, Message, RecordError, read};
use tactus_schema::pb::{self, run_event::Event};
use tactus_schema::{Frame, Rig};

use super::ContinuationError;
use super::mean::Mean;

/// The attachment with the parameters as the script saw them.
const PARAMETERS_JSON: &str = "parameters.json";
/// The attachment with the rig as it was described.
const RIG_JSON: &str = "rig.json";
/// The attachment with the rig file.
const RIG_TOML: &str = "rig.toml";

/// Three doubles for each element: mean, signal, standard deviation.
const BYTES_PER_ELEMENT: usize = 24;

/// What a recording tells of its run.
#[derive(Debug, Default)]
pub(super) struct RecordedRun {
    pub(super) run_id: String,
    path: PathBuf,
    /// Name and text.
    pub(super) script: Option<(String, String)>,
    pub(super) parameters: Option<String>,
    pub(super) hides_truth: bool,
    rig_json: Option<String>,
    /// Name of the script's attachment.
    script_file: String,
    started: Option<pb::RunStarted>,
    exit_status: Option<pb::ExitStatus>,
    steps: Vec<RecordedStep>,
    means: Vec<Mean>,
    elements: usize,
    // --- where the recording has been read to ---
    /// True after something that is missing.
    is_cut: bool,
    /// True if it does not tell its steps, as before this was possible.
    lacks_steps: bool,
    next_event: u64,
    zero: Option<usize>,
    step: Option<StepInProgress>,
}

/// A step that was done. A reading names its mean, and that of its zero.
#[derive(Debug)]
struct RecordedStep {
    step: Step,
    at: String,
    outcome: Outcome,
}

#[derive(Debug)]
enum Outcome {
    Done,
    Height { height_mm: f64 },
    Reading(Reading),
    Press { index: i32, dwells: Vec<Reading> },
}

#[derive(Debug, Clone, Copy)]
struct Reading {
    mean: usize,
    zero: Option<usize>,
}

#[derive(Debug, Default)]
struct StepInProgress {
    json: String,
    at: String,
    reading: Option<Reading>,
    /// By press: a press that was broken off was begun again under the next index.
    dwells: BTreeMap<i32, Vec<Reading>>,
}

impl RecordedRun {
    /// Reads a recording without its frames.
    pub(super) fn read(
        path: PathBuf,
        run_id: &str,
        stopped: &dyn Fn() -> bool,
    ) -> Result<Self, ContinuationError> {
        let mut run = Self { run_id: run_id.to_owned(), path, hides_truth: true, ..Self::default() };
        visit(&run.path.clone(), stopped, |entry| run.take(entry))?;
        Ok(run)
    }

    /// Makes the means of the readings from the frames. The readings may take `left_bytes`, which is lowered.
    pub(super) fn read_means(
        &mut self,
        left_bytes: &mut usize,
        stopped: &dyn Fn() -> bool,
    ) -> Result<(), ContinuationError> {
        let bytes = self.elements * BYTES_PER_ELEMENT * self.means.len();
        let too_long = || ContinuationError::TooLong { run_id: self.run_id.clone() };
        *left_bytes = left_bytes.checked_sub(bytes).ok_or_else(too_long)?;
        let mut next = 0;
        visit(&self.path.clone(), stopped, |entry| {
            if let Entry::Message { message: Message::Frame(frame), .. } = entry {
                self.frame(&frame, &mut next);
            }
        })
    }

    /// What the run was started with.
    pub(super) fn started(&self) -> Result<&pb::RunStarted, ContinuationError> {
        self.started.as_ref().ok_or_else(|| self.lacks("its start"))
    }

    /// What it took over itself.
    pub(super) fn taken_over(&self) -> Option<&pb::TakenOver> {
        self.started.as_ref().and_then(|started| started.taken_over.as_ref())
    }

    /// An error unless the run ended early.
    pub(super) fn check_ended(&self) -> Result<(), ContinuationError> {
        let run_id = self.run_id.clone();
        match self.exit_status {
            None => Err(ContinuationError::Open { run_id }),
            Some(pb::ExitStatus::Done | pb::ExitStatus::Degraded) => Err(ContinuationError::Done { run_id }),
            Some(pb::ExitStatus::Aborted) => Err(ContinuationError::Aborted { run_id }),
            Some(
                pb::ExitStatus::Unspecified
                | pb::ExitStatus::Failed
                | pb::ExitStatus::Stopped
                | pb::ExitStatus::Refused
                | pb::ExitStatus::Crashed,
            ) => Ok(()),
        }
    }

    /// An error if the rig is not described as in the recording: positions or counts would mean something else.
    pub(super) fn check_rig(&self, rig: &Rig) -> Result<(), ContinuationError> {
        let json = self.rig_json.as_ref().ok_or_else(|| self.lacks("its rig"))?;
        let of_json = |json: &str| {
            let invalid = |source| ContinuationError::Rig { run_id: self.run_id.clone(), source };
            Rig::from_json(json).map_err(invalid)
        };
        // Both as JSON tells them, without links and limits.
        let (then, now) = (of_json(json)?, of_json(&rig.to_json())?);
        let same = [
            ("name", then.name == now.name),
            ("simulated", then.simulated == now.simulated),
            ("array", then.array == now.array),
            ("registration", then.registration == now.registration),
            ("psf", then.psf == now.psf),
            ("sensitivity_counts_per_mm", then.sensitivity_counts_per_mm == now.sensitivity_counts_per_mm),
            ("sensitivity_reference", then.sensitivity_reference == now.sensitivity_reference),
            ("baseline_counts", then.baseline_counts == now.baseline_counts),
            ("indenters", then.indenters == now.indenters),
            ("indenter", then.indenter == now.indenter),
        ];
        match same.into_iter().find(|(_, is_same)| !is_same) {
            Some((field, _)) => Err(ContinuationError::OtherRig { run_id: self.run_id.clone(), field }),
            None => Ok(()),
        }
    }

    /// Adds the steps that it has done to those that it took over.
    pub(super) fn add_to(&self, earlier: &mut EarlierRun) -> Result<(), ContinuationError> {
        if self.lacks_steps {
            return Err(self.lacks("its steps as the script asked for them (an earlier version made it)"));
        }
        if let Some(taken) = self.taken_over() {
            let steps = usize::try_from(taken.steps).unwrap_or(usize::MAX);
            if earlier.steps.len() < steps {
                return Err(self.lacks(&format!("steps of run {}, which it took over", taken.run_id)));
            }
            earlier.steps.truncate(steps);
            earlier.next_press = taken.first_press;
        }
        for step in &self.steps {
            let Some(reply) = self.reply(step) else { break };
            if let Outcome::Press { index, .. } = step.outcome {
                earlier.next_press = index + 1;
            }
            earlier.steps.push(DoneStep { step: step.step.clone(), at: step.at.clone(), reply });
        }
        Ok(())
    }

    /// What the script was told; `None` if frames of a reading are missing.
    fn reply(&self, RecordedStep { step, outcome, .. }: &RecordedStep) -> Option<Reply> {
        Some(match (outcome, step) {
            (Outcome::Press { dwells, .. }, _) => {
                Reply::Pressed(dwells.iter().map(|dwell| self.reading(*dwell)).collect::<Option<_>>()?)
            }
            (Outcome::Reading(reading), _) => Reply::Reading(self.reading(*reading)?),
            (Outcome::Height { height_mm }, Step::Move { to, .. }) => {
                Reply::Position { x_mm: to.x_mm, y_mm: to.y_mm, height_mm: *height_mm }
            }
            (Outcome::Height { .. } | Outcome::Done, _) => Reply::Done,
        })
    }

    fn reading(&self, Reading { mean, zero }: Reading) -> Option<MeanReading> {
        let (mean, zero) = (self.means.get(mean)?, self.means.get(zero?)?);
        let (mean_counts, zero_counts) = (mean.mean_counts()?, zero.mean_counts()?);
        Some(MeanReading {
            signal: mean_counts.iter().zip(zero_counts).map(|(count, zero)| count - zero).collect(),
            mean_counts: mean_counts.to_vec(),
            rms: mean.rms_counts(),
            frames: mean.frames(),
        })
    }

    pub(super) fn lacks(&self, what: &str) -> ContinuationError {
        ContinuationError::Lacks { run_id: self.run_id.clone(), what: what.to_owned() }
    }

    // --- reading ------------------------------------------------------------------------------------------------------

    fn take(&mut self, entry: Entry) {
        match entry {
            Entry::Run(run) => self.script_file = run.script,
            Entry::Attachment(file) => self.attachment(file),
            Entry::Message { message: Message::Event(event), .. } => self.event(*event),
            Entry::Message { .. } => {}
        }
    }

    fn attachment(&mut self, file: Attachment) {
        let Ok(text) = String::from_utf8(file.data) else { return };
        match file.name.as_str() {
            PARAMETERS_JSON => self.parameters = Some(text),
            RIG_JSON => self.rig_json = Some(text),
            RIG_TOML => self.hides_truth = false,
            name if name == self.script_file => {
                self.script = Some((name.strip_suffix(".star").unwrap_or(name).to_owned(), text));
            }
            _ => {}
        }
    }

    fn event(&mut self, event: pb::RunEvent) {
        // Of a step with lost events, and of those after it, nobody knows whether they are the script's next ones.
        self.is_cut |= event.seq != self.next_event;
        self.next_event = event.seq + 1;
        match event.event {
            Some(Event::Started(started)) => self.started = Some(started),
            Some(Event::Finished(finished)) => self.exit_status = Some(finished.exit_status()),
            event if !self.is_cut => self.step_event(event),
            _ => {}
        }
    }

    fn step_event(&mut self, event: Option<Event>) {
        match event {
            Some(Event::StepStarted(pb::StepStarted { step, at, step_json: json, .. })) => {
                self.is_cut = step != self.taken_steps() + self.steps.len() as u64;
                self.step = Some(StepInProgress { json, at, ..StepInProgress::default() });
            }
            Some(Event::ReferenceDone(done)) => {
                self.zero =
                    Some(self.mean(&done.mean_counts, done.frames, done.from_mono_ns, done.to_mono_ns));
            }
            Some(Event::TareDone(done)) => {
                let mean = self.mean(&done.baseline_counts, done.frames, done.from_mono_ns, done.to_mono_ns);
                self.zero = Some(mean);
                self.read_in_step(mean);
            }
            Some(Event::ReadDone(done)) => {
                let mean = self.mean(&done.mean_counts, done.frames, done.from_mono_ns, done.to_mono_ns);
                self.read_in_step(mean);
            }
            Some(Event::DwellDone(done)) => {
                let mean = self.mean(&done.mean_counts, done.frames, done.from_mono_ns, done.to_mono_ns);
                let zero = self.zero;
                if let Some(step) = &mut self.step {
                    step.dwells.entry(done.press).or_default().push(Reading { mean, zero });
                }
            }
            Some(Event::PressRepeated(repeated)) => {
                if let Some(step) = &mut self.step {
                    step.dwells.remove(&repeated.press);
                }
            }
            Some(Event::StepDone(done)) => self.step_done(done),
            _ => {}
        }
    }

    fn step_done(&mut self, done: pb::StepDone) {
        let Some(StepInProgress { json, at, reading, mut dwells }) = self.step.take() else { return };
        let Ok(step) = serde_json::from_str(&json) else {
            self.lacks_steps = true;
            self.is_cut = true;
            return;
        };
        let outcome = match (dwells.pop_last(), reading, done.height_mm) {
            (Some((index, dwells)), _, _) => Outcome::Press { index, dwells },
            (None, Some(reading), _) => Outcome::Reading(reading),
            (None, None, Some(height_mm)) => Outcome::Height { height_mm },
            (None, None, None) => Outcome::Done,
        };
        self.steps.push(RecordedStep { step, at, outcome });
    }

    /// Keeps a mean to be made, and returns its index.
    fn mean(&mut self, counts: &[f32], frames: u32, from_mono_ns: i64, to_mono_ns: i64) -> usize {
        self.elements = self.elements.max(counts.len());
        self.means.push(Mean::over(frames, from_mono_ns, to_mono_ns));
        self.means.len() - 1
    }

    fn read_in_step(&mut self, mean: usize) {
        if let Some(step) = &mut self.step {
            step.reading = Some(Reading { mean, zero: self.zero });
        }
    }

    /// The means are in order of time, and do not overlap.
    fn frame(&mut self, frame: &Frame, next: &mut usize) {
        while self.means.get(*next).is_some_and(|mean| mean.is_before(frame.received.mono)) {
            *next += 1;
        }
        if let Some(mean) = self.means.get_mut(*next) {
            mean.take(frame);
        }
    }

    fn taken_steps(&self) -> u64 {
        self.taken_over().map_or(0, |taken| taken.steps)
    }
}

/// Reads a recording to its end.
fn visit(
    path: &Path,
    stopped: &dyn Fn() -> bool,
    mut take: impl FnMut(Entry),
) -> Result<(), ContinuationError> {
    let unread = |source: io::Error| RecordError::Io { action: "read", path: path.to_owned(), source };
    for entry in read(path)? {
        if stopped() {
            return Err(ContinuationError::Stopped);
        }
        take(entry.map_err(unread)?);
    }
    Ok(())
}
