//! Signals that would end the program: they stop the run in progress. Without a run they end the program.

use std::process;
use std::sync::{Arc, Mutex, MutexGuard, Once, PoisonError};
use std::thread;

use anyhow::Context;
use tactus_engine::{Engine, StopOrder};
use tactus_runner::signals::{Ending, EndingSignals};

use crate::progress::RunProgress;

/// The run that this process prepares or makes now. Signals belong to the process, and so does this.
static RUN: Mutex<Option<Run>> = Mutex::new(None);

struct Run {
    progress: Arc<RunProgress>,
    /// The signal that came during the preparation.
    came: Option<Ending>,
    /// Its engine, once it has begun.
    engine: Option<Engine>,
}

impl Run {
    fn stop(&self) {
        if let (Some(engine), Some(ending)) = (&self.engine, self.came) {
            engine.stop(StopOrder { by: "signal".into(), reason: ending.name.into(), abort: false });
            self.progress.say(&format!("{}: stopping and retracting", ending.name));
        }
    }
}

fn run() -> MutexGuard<'static, Option<Run>> {
    RUN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// While it lives, signals stop a run instead of ending the program.
#[must_use = "signals end the program once this is dropped"]
#[derive(Debug)]
pub(crate) struct StopsRun(());

impl StopsRun {
    /// Listens from here on.
    ///
    /// # Errors
    /// If the system gives no runtime, handler or thread.
    pub(crate) fn prepare(progress: Arc<RunProgress>) -> anyhow::Result<Self> {
        *run() = Some(Run { progress, came: None, engine: None });
        let stops = Self(());
        listen()?;
        Ok(stops)
    }

    /// True once a signal came.
    pub(crate) fn is_asked() -> bool {
        run().as_ref().is_some_and(|run| run.came.is_some())
    }

    /// The run begins: from here on a signal stops its engine, also one that came before.
    pub(crate) fn begin(engine: Engine) {
        if let Some(run) = &mut *run() {
            run.engine = Some(engine);
            run.stop();
        }
    }
}

impl Drop for StopsRun {
    fn drop(&mut self) {
        *run() = None;
    }
}

/// Starts the thread that listens, once for all runs: a run in virtual time occupies the thread that makes it.
fn listen() -> anyhow::Result<()> {
    static LISTENING: Once = Once::new();
    if LISTENING.is_completed() {
        return Ok(());
    }
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let mut signals = {
        let _inside = runtime.enter();
        EndingSignals::listen().context("no signals")?
    };
    let listening = move || -> ! {
        runtime.block_on(async {
            loop {
                let ending = signals.next().await;
                match &mut *run() {
                    Some(run) => {
                        run.came = Some(ending);
                        run.stop();
                    }
                    None => process::exit(ending.exit_code()),
                }
            }
        })
    };
    thread::Builder::new().name("signals".into()).spawn(listening)?;
    LISTENING.call_once(|| {});
    Ok(())
}
