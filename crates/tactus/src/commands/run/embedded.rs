//! A run on the embedded simulated rig.

use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use tactus_engine::Engine;
use tactus_plan::Evaluate;
use tactus_runner::config;
use tactus_runner::continuation::{self, ContinuationError, Wish};
use tactus_runner::embedded::{self, EmbeddedError, Finished, Pace, TruthError, TruthFile};
use tactus_runner::experiments;
use tactus_runner::order::RunRequest;
use tactus_runner::script_process::ScriptProcesses;
use tactus_runner::twin::{Attend, SoFar};
use tactus_schema::Rig;
use tactus_schema::pb::{self, RunState};
use tokio::sync::watch;

use super::{RunSummary, Subject, Told, taken_over_in_words};
use crate::cli::RunArgs;
use crate::exit::{Exit, Failure};
use crate::interrupt::StopsRun;
use crate::progress::RunProgress;

/// How often the progress is drawn.
const REDRAW: Duration = Duration::from_millis(100);

pub(super) fn run(args: &RunArgs, subject: Subject, why: &str, told: Told<'_>) -> anyhow::Result<RunSummary> {
    let files = match &args.rig_file {
        Some(path) => config::load_rig(path).map_err(|error| Failure::new(Exit::Usage, error))?,
        None => embedded::simulated_rig()?,
    };
    let rig = &files.rig;
    if !rig.simulated {
        let error = format!("rig {:?} is not simulated: real devices need the service, `tactusd`", rig.name);
        return Err(Failure::new(Exit::Usage, error).into());
    }
    let truth = args.truth.as_deref().map(read_truth).transpose()?;
    let pace = if args.real_time { Pace::Real } else { Pace::Virtual };
    if told.has_words() {
        let time = if args.real_time { "real time" } else { "virtual time" };
        let hidden = args.truth.as_ref().map(|path| format!("; true physics from {}", path.display()));
        let hidden = hidden.unwrap_or_default();
        println!("SIMULATED: running on the embedded simulated rig {:?} ({why}; {time}{hidden})", rig.name);
    }
    let simulated = rig.simulated;
    let progress = Arc::new(told.progress());
    let stops_run = StopsRun::prepare(Arc::clone(&progress))?;
    let mut attending = None;
    let stopped = StopsRun::is_asked;
    let request = request(args, subject, rig, &stopped)?;
    let taken_over = request.earlier.as_ref().map(|earlier| earlier.taken_over());
    let waiting = Waiting(&progress);
    let done = embedded::run(&files, truth.as_ref(), request, &args.out, pace, &waiting, |engine, order| {
        stops_run.begin(engine.clone());
        if let Some(taken) = taken_over.as_ref().filter(|_| told.has_words()) {
            progress.say(&taken_over_in_words(taken, order.planned.map_or(0, |planned| planned.presses)));
        }
        attending = attend(engine, &progress, pace);
    });
    drop(stops_run);
    if let Some((over, attending)) = attending {
        drop(over);
        // A panic in the thread has printed its own message.
        drop(attending.join());
    }
    progress.clear();
    let Finished { outcome, recording } = done.map_err(|error| match error {
        EmbeddedError::NotPossible(plan) => {
            let refused = plan.outcome.exit_status == pb::ExitStatus::Refused;
            let exit = if refused { Exit::Refused } else { Exit::Failed };
            anyhow::Error::from(Failure::new(exit, format!("nothing was moved: {}", plan.outcome.message)))
        }
        EmbeddedError::Script(error) => Failure::new(Exit::Usage, error).into(),
        EmbeddedError::Truth(error) => {
            wrong_truth(args.truth.as_deref().unwrap_or(Path::new("--truth")), &error)
        }
        error @ EmbeddedError::NotEmbedded { .. } => Failure::new(Exit::Usage, error).into(),
        error @ (EmbeddedError::Rig(_)
        | EmbeddedError::Engine(_)
        | EmbeddedError::Twin(_)
        | EmbeddedError::Record(_)
        | EmbeddedError::System(_)) => error.into(),
    })?;
    Ok(RunSummary {
        run_id: outcome.run_id,
        experiment: outcome.experiment,
        exit_status: outcome.exit_status,
        message: outcome.message,
        simulated,
        embedded: true,
        frames: outcome.frames,
        frames_lost: outcome.frames_lost,
        presses: outcome.presses,
        dwells: outcome.dwells,
        duration_s: outcome.duration_s,
        recording: std::path::absolute(recording)?,
        taken_over,
    })
}

/// A person who waits for the dry run, and may end it by Ctrl-C.
struct Waiting<'a>(&'a RunProgress);

impl Attend for Waiting<'_> {
    fn stops(&self) -> bool {
        StopsRun::is_asked()
    }

    fn sees(&self, so_far: SoFar) {
        self.0.sees(so_far);
    }
}

/// The request for what is to be run. An earlier run is looked for where the new one will be.
fn request(
    args: &RunArgs,
    subject: Subject,
    rig: &Rig,
    stopped: &dyn Fn() -> bool,
) -> anyhow::Result<RunRequest> {
    let evaluator: Arc<dyn Evaluate> = Arc::new(ScriptProcesses::of_this_program());
    let who = args.who.clone();
    let run_id = match subject {
        Subject::Experiment { script, arguments, seed } => {
            return Ok(RunRequest { script, arguments, seed, who, evaluator, earlier: None });
        }
        Subject::Rest(run_id) => run_id,
    };
    let wish = Wish { run_id: &run_id, folder: &args.out, who, evaluator };
    let continuation = continuation::of_run(wish, rig, stopped).map_err(|error| {
        let exit = match error {
            ContinuationError::Unknown { .. }
            | ContinuationError::Done { .. }
            | ContinuationError::Aborted { .. }
            | ContinuationError::Script(_) => Exit::Usage,
            ContinuationError::OtherRig { .. } => Exit::Refused,
            ContinuationError::Open { .. } => Exit::NotNow,
            ContinuationError::Record(_)
            | ContinuationError::Lacks { .. }
            | ContinuationError::Rig { .. }
            | ContinuationError::TooLong { .. }
            | ContinuationError::Stopped => Exit::Failed,
        };
        Failure::new(exit, error)
    })?;
    let problem = match (continuation.hides_truth, args.truth.is_some()) {
        (true, false) => Some("was simulated with a --truth: give the same file again"),
        (false, true) => Some("was simulated without a --truth: leave it out"),
        (true, true) | (false, false) => None,
    };
    if let Some(problem) = problem {
        return Err(Failure::new(Exit::Usage, format!("run {run_id} {problem}")).into());
    }
    let name = continuation.request.script.name();
    let in_this_folder = experiments::find(&format!("{name}.star"), None);
    let present = in_this_folder.or_else(|_| experiments::named(name, None));
    if let Some(note) = continuation.note(present.as_ref().ok()) {
        eprintln!("tactus: {note}");
    }
    Ok(continuation.request)
}

fn read_truth(path: &Path) -> anyhow::Result<TruthFile> {
    let text = fs::read_to_string(path)
        .map_err(|error| Failure::new(Exit::Usage, format!("{}: {error}", path.display())))?;
    TruthFile::from_toml(&text).map_err(|error| wrong_truth(path, &error))
}

fn wrong_truth(path: &Path, error: &TruthError) -> anyhow::Error {
    Failure::new(Exit::Usage, format!("{}: {error}", path.display())).into()
}

/// Shows the progress of a run on a thread of its own until the sender is dropped. The run may occupy the calling thread.
fn attend(
    engine: &Engine,
    progress: &Arc<RunProgress>,
    pace: Pace,
) -> Option<(SyncSender<()>, JoinHandle<()>)> {
    let (state, progress) = (engine.state(), Arc::clone(progress));
    // Without a message: it only ends.
    let (over, is_over) = sync_channel(0);
    let follow = move || follow(&state, &is_over, &progress, pace);
    // Without a thread there is no progress, but the run goes on.
    let spawned = thread::Builder::new().name("attend".into()).spawn(follow);
    spawned.ok().map(|attending| (over, attending))
}

/// Looks now and then: news of a run in virtual time come by the ten thousands.
fn follow(state: &watch::Receiver<RunState>, is_over: &Receiver<()>, progress: &RunProgress, pace: Pace) {
    let mut pacing = Pacing::default();
    while is_over.recv_timeout(REDRAW) == Err(RecvTimeoutError::Timeout) {
        let mut now = state.borrow().clone();
        if pace == Pace::Virtual {
            now.remaining_s = pacing.left_s(now.remaining_s, Instant::now());
        }
        progress.show(&now);
    }
}

/// The time that is left of a run in virtual time, for a person who waits: from how fast it went so far.
#[derive(Debug, Default)]
struct Pacing {
    /// When the time left was first known, and how long it was then in the rig's time.
    began: Option<(Instant, f64)>,
}

impl Pacing {
    /// In s; below zero while it is not known.
    fn left_s(&mut self, remaining_s: f64, now: Instant) -> f64 {
        if remaining_s < 0.0 {
            return remaining_s;
        }
        let (began, first_s) = *self.began.get_or_insert((now, remaining_s));
        let done_s = first_s - remaining_s;
        if done_s > 0.0 { (now - began).as_secs_f64() * remaining_s / done_s } else { -1.0 }
    }
}

#[cfg(test)]
#[path = "embedded_tests.rs"]
mod tests;
