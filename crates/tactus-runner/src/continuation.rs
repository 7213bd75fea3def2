//! What an earlier run has done, for a run that goes on with it.

mod mean;
mod recorded;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use tactus_engine::EarlierRun;
use tactus_plan::{Arguments, Evaluate, Script, ScriptError};
use tactus_record::RecordError;
use tactus_schema::{Rig, RigError, pb};

use crate::crashed;
use crate::order::RunRequest;
use recorded::RecordedRun;

/// Longest id of a run that is looked for.
const RUN_ID_MAX_BYTES: usize = 200;

/// Most bytes that the readings of an earlier run may take in memory.
const READINGS_MAX_BYTES: usize = 256 << 20;

/// A request for the rest of an earlier run.
#[derive(Debug, Clone)]
pub struct Continuation {
    /// The earlier run's script, parameters and seed, and the steps that need not be done again.
    pub request: RunRequest,
    /// True if the earlier run was simulated with a truth that its recording does not contain.
    pub hides_truth: bool,
}

/// Who wants to go on with which run.
#[derive(Debug, Clone)]
pub struct Wish<'a> {
    /// Id of the earlier run.
    pub run_id: &'a str,
    /// The folder with the folders of runs; no other is looked at.
    pub folder: &'a Path,
    /// The person or program that requests the run.
    pub who: String,
    /// Where the script is evaluated.
    pub evaluator: Arc<dyn Evaluate>,
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
    /// The recording has no end, and could not be closed.
    #[error(
        "run {run_id} is not over, or its recording could not be closed: wait for its end, or see the log and `tactus recover`"
    )]
    Open { run_id: String },
    /// The run was done.
    #[error("run {run_id} is done: there is nothing to continue")]
    Done { run_id: String },
    /// The run was aborted.
    #[error("run {run_id} was aborted: its data are not to be used, so start the experiment anew")]
    Aborted { run_id: String },
    /// The recording lacks something.
    #[error("the recording of run {run_id} lacks {what}: it cannot be continued")]
    Lacks { run_id: String, what: String },
    /// The rig is another one than then.
    #[error(
        "run {run_id} was of another rig: `{field}` of the rig file has changed since. Restore it, or start the experiment anew"
    )]
    OtherRig { run_id: String, field: &'static str },
    /// The rig in the recording is invalid.
    #[error("the rig of run {run_id}: {source}")]
    Rig { run_id: String, source: RigError },
    /// The recorded script or its parameters have an error.
    #[error(transparent)]
    Script(#[from] ScriptError),
    /// The readings do not fit into memory.
    #[error("the readings of run {run_id} take more than {} MiB: it cannot be continued", READINGS_MAX_BYTES >> 20)]
    TooLong { run_id: String },
    /// It was stopped.
    #[error("stopped")]
    Stopped,
}

/// Reads what is needed to go on with a run on `rig`. A recording whose program died is closed first. Blocks; ends early once
/// `stopped` is true.
///
/// # Errors
/// [`ContinuationError`] if there is no such run, if it is not over, if nothing of it is left to do, or if the rig is not
/// described as then. Links, limits, motion and the covering may have changed.
pub fn of_run(
    wish: Wish<'_>,
    rig: &Rig,
    stopped: &dyn Fn() -> bool,
) -> Result<Continuation, ContinuationError> {
    let mut runs = chain(&wish, rig, stopped)?;
    let mut left_bytes = READINGS_MAX_BYTES;
    for run in &mut runs {
        run.read_means(&mut left_bytes, stopped)?;
    }
    let (Some(last), Some(first)) = (runs.first(), runs.last()) else {
        return Err(wish.unknown(wish.run_id));
    };
    let (name, source) = last.script.as_ref().ok_or_else(|| last.lacks("its script"))?;
    let parameters = last.parameters.as_ref().ok_or_else(|| last.lacks("its parameters"))?;
    let started = last.started()?;
    let (script, arguments) = (Script::parse(name, source)?, Arguments::from_json(parameters)?);
    let mut earlier = EarlierRun {
        run_id: last.run_id.clone(),
        covering_mm: first.started()?.covering_mm,
        steps: Vec::new(),
        next_press: 0,
    };
    for run in runs.iter().rev() {
        run.add_to(&mut earlier)?;
    }
    let request = RunRequest {
        script,
        arguments,
        seed: Some(started.seed),
        who: wish.who,
        evaluator: wish.evaluator,
        earlier: Some(Arc::new(earlier)),
    };
    Ok(Continuation { request, hides_truth: last.hides_truth })
}

/// The run, which can be continued on `rig`; the one that it goes on with, and so on.
fn chain(
    wish: &Wish<'_>,
    rig: &Rig,
    stopped: &dyn Fn() -> bool,
) -> Result<Vec<RecordedRun>, ContinuationError> {
    let mut runs: Vec<RecordedRun> = Vec::new();
    let mut next = Some(wish.run_id.to_owned());
    while let Some(run_id) = next {
        let path = wish.path_of(&run_id)?;
        crashed::close_one(&path);
        let run = RecordedRun::read(path, &run_id, stopped)?;
        if runs.is_empty() {
            run.check_ended()?;
            run.check_rig(rig)?;
        }
        next = run.taken_over().map(|taken| taken.run_id.clone());
        // No run begins before itself; a recording that says so is damaged.
        if next.as_ref().is_some_and(|next| *next == run_id || runs.iter().any(|run| run.run_id == *next)) {
            return Err(run.lacks("the run that it continues"));
        }
        runs.push(run);
    }
    Ok(runs)
}

impl Wish<'_> {
    /// The recording of a run. An id that is no plain name leads nowhere.
    fn path_of(&self, run_id: &str) -> Result<PathBuf, ContinuationError> {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        let is_name = !run_id.is_empty() && run_id.len() <= RUN_ID_MAX_BYTES && run_id.chars().all(is_plain);
        let path = self.folder.join(run_id).join("recording.mcap");
        if is_name && path.is_file() { Ok(path) } else { Err(self.unknown(run_id)) }
    }

    fn unknown(&self, run_id: &str) -> ContinuationError {
        let run_id = run_id.chars().take(RUN_ID_MAX_BYTES).collect();
        ContinuationError::Unknown { run_id, folder: self.folder.to_owned() }
    }
}

impl Continuation {
    /// What who asks should know of the script: it is the recorded one, whatever has become of the file.
    pub fn note(&self, present: Option<&Script>) -> Option<String> {
        let script = &self.request.script;
        let has_changed = present.is_some_and(|present| present.sha256() != script.sha256());
        has_changed.then(|| {
            format!("the script {:?} has changed since: the run goes on with the recorded one", script.name())
        })
    }

    /// What the new run takes over.
    pub fn taken_over(&self) -> pb::TakenOver {
        self.request.earlier.as_ref().map(|earlier| earlier.taken_over()).unwrap_or_default()
    }
}
