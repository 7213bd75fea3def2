//! Signals that would end the program: they stop the runs in progress. Without a run they remove what is unfinished and end the
//! program.

use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::{fs, process, thread};

use anyhow::Context;
use tactus_engine::{Engine, StopOrder};
use tactus_runner::signals::{Ending, EndingSignals};

use crate::progress::RunProgress;

/// The runs that this process prepares or makes now. Signals belong to the process, and so does this.
static RUNS: Mutex<Runs> = Mutex::new(Runs { latest: 0, each: BTreeMap::new(), came: None });

struct Runs {
    /// Number of the run that was prepared last.
    latest: u64,
    each: BTreeMap<u64, Run>,
    /// The signal that came since there are any.
    came: Option<Ending>,
}

struct Run {
    progress: Arc<RunProgress>,
    /// Its engine, once it has begun.
    engine: Option<Engine>,
}

impl Run {
    fn stop(&self, ending: Ending) {
        if let Some(engine) = &self.engine {
            engine.stop(StopOrder { by: "signal".into(), reason: ending.name.into(), abort: false });
            self.progress.say(&format!("{}: stopping and retracting", ending.name));
        }
    }
}

fn runs() -> MutexGuard<'static, Runs> {
    RUNS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// While it lives, signals stop a run instead of ending the program.
#[must_use = "signals end the program once this is dropped"]
#[derive(Debug)]
pub(crate) struct StopsRun(u64);

impl StopsRun {
    /// Listens from here on.
    ///
    /// # Errors
    /// If the system gives no runtime, handler or thread.
    pub(crate) fn prepare(progress: Arc<RunProgress>) -> anyhow::Result<Self> {
        let stops = {
            let mut runs = runs();
            runs.latest += 1;
            let number = runs.latest;
            runs.each.insert(number, Run { progress, engine: None });
            Self(number)
        };
        listen()?;
        Ok(stops)
    }

    /// True once a signal came, which is for all runs of this process.
    pub(crate) fn is_asked() -> bool {
        runs().came.is_some()
    }

    /// The run begins: from here on a signal stops its engine, also one that came before.
    pub(crate) fn begin(&self, engine: Engine) {
        let mut runs = runs();
        let came = runs.came;
        if let Some(run) = runs.each.get_mut(&self.0) {
            run.engine = Some(engine);
            if let Some(ending) = came {
                run.stop(ending);
            }
        }
    }
}

impl Drop for StopsRun {
    fn drop(&mut self) {
        let mut runs = runs();
        runs.each.remove(&self.0);
        if runs.each.is_empty() {
            runs.came = None;
        }
    }
}

/// More than the files of any folder here.
const REMOVALS_MAX: usize = 16;

/// A folder of this process whose files are not complete yet.
static UNFINISHED: Mutex<Option<PathBuf>> = Mutex::new(None);

fn unfinished() -> MutexGuard<'static, Option<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A folder that is removed with this, or when a signal ends the program. A process has one at a time.
#[must_use = "the folder is removed once this is dropped"]
#[derive(Debug)]
pub(crate) struct Unfinished(PathBuf);

impl Unfinished {
    /// Makes the folder.
    ///
    /// # Errors
    /// If the system gives no folder, runtime, handler or thread.
    pub(crate) fn create(path: PathBuf) -> anyhow::Result<Self> {
        listen()?;
        let mut unfinished = unfinished();
        fs::create_dir_all(&path)?;
        *unfinished = Some(path.clone());
        Ok(Self(path))
    }

    pub(crate) fn path(&self) -> &Path {
        &self.0
    }

    /// Moves the complete folder by `rename`. A signal waits for that.
    ///
    /// # Errors
    /// Those of `rename`.
    pub(crate) fn finish(&self, rename: impl FnOnce(&Path) -> io::Result<()>) -> io::Result<()> {
        let mut unfinished = unfinished();
        rename(&self.0)?;
        *unfinished = None;
        Ok(())
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        if let Some(folder) = unfinished().take() {
            remove(&folder);
        }
    }
}

/// Removes a folder with its files, also if another thread is just adding one.
fn remove(folder: &Path) {
    for _ in 0..REMOVALS_MAX {
        // Other errors leave the folder, and its name says what it is.
        if !fs::remove_dir_all(folder).is_err_and(|error| error.kind() == ErrorKind::DirectoryNotEmpty) {
            return;
        }
    }
}

/// Starts the thread that listens, once for all runs: a run in virtual time occupies the thread that makes it.
fn listen() -> anyhow::Result<()> {
    static IS_LISTENING: Mutex<bool> = Mutex::new(false);
    let mut is_listening = IS_LISTENING.lock().unwrap_or_else(PoisonError::into_inner);
    if *is_listening {
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
                let mut runs = runs();
                if runs.each.is_empty() {
                    // Held to the end, so that nobody makes or finishes anything meanwhile.
                    let unfinished = unfinished();
                    unfinished.iter().for_each(|folder| remove(folder));
                    process::exit(ending.exit_code())
                }
                runs.came = Some(ending);
                runs.each.values().for_each(|run| run.stop(ending));
            }
        })
    };
    thread::Builder::new().name("signals".into()).spawn(listening)?;
    *is_listening = true;
    Ok(())
}
