//! Keeps the machine awake during a run: a machine that sleeps leaves the tip where it is.

use std::io;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;

use tactus_engine::Engine;
use tactus_schema::pb::RunPhase;
use tokio::sync::watch;
use tokio::task::spawn_blocking;
use tracing::{info, warn};

/// logind's client; the lock holds as long as the command below it runs, here `cat` until its input ends.
const PROGRAM: &str = "systemd-inhibit";
const ARGUMENTS: [&str; 5] =
    ["--what=sleep", "--mode=block", "--who=tactusd", "--why=a run is in progress", "cat"];

/// Counts the runs in progress, of all rigs.
#[derive(Debug, Clone, Default)]
pub(crate) struct Runs(Arc<watch::Sender<usize>>);

/// A run that is counted, while it is kept.
struct Counted<'a>(&'a watch::Sender<usize>);

impl Runs {
    /// Counts an engine's runs until it is dropped.
    pub(crate) async fn count(&self, engine: &Engine) {
        let mut state = engine.state();
        loop {
            if state.wait_for(|state| is_in_progress(state.phase())).await.is_err() {
                return;
            }
            self.0.send_modify(|runs| *runs += 1);
            let _counted = Counted(&self.0);
            if state.wait_for(|state| !is_in_progress(state.phase())).await.is_err() {
                return;
            }
        }
    }
}

impl Drop for Counted<'_> {
    fn drop(&mut self) {
        self.0.send_modify(|runs| *runs -= 1);
    }
}

/// Holds a lock against sleep while a run is in progress, as well as the machine allows. No run waits for it.
pub(crate) async fn keep_awake(runs: Runs) {
    let mut runs = runs.0.subscribe();
    let mut advice = Advice::default();
    loop {
        if runs.wait_for(|runs| *runs > 0).await.is_err() {
            return;
        }
        let lock = spawn_blocking(take).await;
        if runs.wait_for(|runs| *runs == 0).await.is_err() {
            return;
        }
        match lock {
            Ok(Ok(lock)) => {
                if let Ok(Err(problem)) = spawn_blocking(move || release(lock)).await {
                    advice.give(&problem);
                }
            }
            Ok(Err(error)) => advice.give(&format!("{PROGRAM}: {error}")),
            Err(error) => advice.give(&error.to_string()),
        }
    }
}

fn is_in_progress(phase: RunPhase) -> bool {
    match phase {
        RunPhase::Preparing | RunPhase::Running | RunPhase::Paused | RunPhase::Stopping => true,
        RunPhase::Unspecified | RunPhase::Idle | RunPhase::Finished => false,
    }
}

fn take() -> io::Result<Child> {
    Command::new(PROGRAM)
        .args(ARGUMENTS)
        // systemd takes notifications from the service itself only.
        .env_remove("NOTIFY_SOCKET")
        // Its input ends with this process, however that ends.
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .process_group(0)
        .spawn()
}

/// Gives the lock back; an error if it was not held.
fn release(mut lock: Child) -> Result<(), String> {
    if let Ok(Some(status)) = lock.try_wait() {
        return Err(format!("{PROGRAM} ended during the run, {status}"));
    }
    drop(lock.stdin.take());
    lock.wait().map(drop).map_err(|error| format!("{PROGRAM}: {error}"))
}

/// Tells once that the machine can sleep during a run.
#[derive(Debug, Default)]
struct Advice {
    is_given: bool,
}

impl Advice {
    fn give(&mut self, problem: &str) {
        if self.is_given {
            info!(problem, "the machine was not kept awake during the run");
        } else {
            warn!(problem, "the machine can go to sleep during a run: see that it does not");
        }
        self.is_given = true;
    }
}
