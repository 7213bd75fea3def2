//! Signals that would end the program: they stop the run in progress. Without a run they end the program.

use std::process;
use std::sync::{Arc, Mutex, MutexGuard, Once, PoisonError};
use std::thread;

use anyhow::Context;
use tactus_engine::{Engine, StopOrder};
use tactus_runner::signals::EndingSignals;

use crate::progress::RunProgress;

/// The run that this process makes now. Signals belong to the process, and so does this.
static RUNNING: Mutex<Option<Running>> = Mutex::new(None);

struct Running {
    engine: Engine,
    progress: Arc<RunProgress>,
}

fn running() -> MutexGuard<'static, Option<Running>> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Listens from here on, on a thread of its own: a run in virtual time occupies the thread that makes it.
///
/// # Errors
/// If the system gives no runtime, handler or thread.
pub(crate) fn listen() -> anyhow::Result<()> {
    static ONCE: Once = Once::new();
    if ONCE.is_completed() {
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
                match &*running() {
                    Some(Running { engine, progress }) => {
                        let (by, reason) = ("signal".into(), ending.name.into());
                        engine.stop(StopOrder { by, reason, abort: false });
                        progress.say(&format!("{}: stopping and retracting", ending.name));
                    }
                    None => process::exit(ending.exit_code()),
                }
            }
        })
    };
    thread::Builder::new().name("signals".into()).spawn(listening)?;
    ONCE.call_once(|| {});
    Ok(())
}

/// While it lives, signals stop a run instead of ending the program.
#[must_use]
#[derive(Debug)]
pub(crate) struct StopsRun(());

impl StopsRun {
    pub(crate) fn new(engine: Engine, progress: Arc<RunProgress>) -> Self {
        *running() = Some(Running { engine, progress });
        Self(())
    }
}

impl Drop for StopsRun {
    fn drop(&mut self) {
        *running() = None;
    }
}
