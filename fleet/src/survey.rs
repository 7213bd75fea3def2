//! Calibration and discovery of every run of a fleet, and what their results say together.
//!
//! Threads take one run after the other. The result of each is a file of its own in the output folder, so an interrupted survey goes on
//! where it ended; a run whose file in the fleet has changed is done again. Memory holds one run for each thread.

mod calibrated;
mod discovered;
mod findings;
mod trend;

use std::{
    fs, io,
    num::NonZeroUsize,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use anyhow::Context as _;
use futures::TryStreamExt as _;
use object_store::{ObjectMeta, ObjectStoreExt as _};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use tempfile::NamedTempFile;
use tokio::{io::AsyncWriteExt as _, runtime::Handle};

use crate::{Place, RunHead, progress::Now, threads::for_each};

pub(crate) use calibrated::Calibrated;
pub(crate) use discovered::Discovered;
pub(crate) use findings::findings;

/// What a survey does with each run.
pub(crate) trait Analysis: Serialize + DeserializeOwned + Send {
    /// Name of the folder of its results.
    const NAME: &'static str;

    /// Analyses a run's file, a measurement table. The error says what the run lacks.
    fn of(table: &Path) -> Result<Self, String>;
}

/// The result of one run.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound(deserialize = "T: DeserializeOwned"))]
pub(crate) struct RunResult<T> {
    schema: String,
    pub(crate) run: String,
    pub(crate) rig: String,
    pub(crate) date: String,
    pub(crate) started_ns: Option<i64>,
    pub(crate) simulated: bool,
    /// Size of the run's file in the fleet.
    bytes: u64,
    pub(crate) outcome: Outcome<T>,
}

/// What became of one run.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", bound(deserialize = "T: DeserializeOwned"))]
pub(crate) enum Outcome<T> {
    /// Its result.
    Found(T),
    /// Why it has none.
    Refused(String),
}

const SCHEMA: &str = "tactus.fleet.result/1";

#[cfg(test)]
impl<T> RunResult<T> {
    /// A result for tests of what results say together.
    pub(crate) fn new(run: &str, rig: &str, outcome: Outcome<T>) -> Self {
        Self {
            schema: SCHEMA.to_owned(),
            run: run.to_owned(),
            rig: rig.to_owned(),
            date: "2026-03-25".to_owned(),
            started_ns: None,
            simulated: true,
            bytes: 0,
            outcome,
        }
    }
}

/// What a survey did.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub(crate) struct Surveyed {
    pub(crate) runs_analysed: u64,
    pub(crate) runs_kept: u64,
}

/// Analyses every run that has no result in `out` yet.
pub(crate) fn survey<T: Analysis>(
    runtime: &Handle,
    place: &Place,
    out: &Path,
    threads: NonZeroUsize,
    progress: &(dyn Fn(Now) + Sync),
) -> anyhow::Result<Surveyed> {
    let files = runtime.block_on(place.files())?;
    let now = Now {
        files: 0,
        files_all: files.len(),
        bytes: 0,
        bytes_all: files.iter().map(|file| file.size).sum(),
    };
    let state = Mutex::new((now, Surveyed::default(), None::<anyhow::Error>));
    let failed = || state.lock().unwrap_or_else(PoisonError::into_inner).2.is_some();
    for_each(threads, &files, |file| {
        // Nothing more is begun after a failure.
        if failed() {
            return;
        }
        let done = one::<T>(runtime, place, out, file);
        let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
        let (now, surveyed, error) = &mut *state;
        match done {
            Ok(true) => surveyed.runs_analysed += 1,
            Ok(false) => surveyed.runs_kept += 1,
            Err(failed) => *error = Some(failed),
        }
        now.files += 1;
        now.bytes += file.size;
        progress(*now);
    });
    match state.into_inner().unwrap_or_else(PoisonError::into_inner) {
        (_, _, Some(error)) => Err(error),
        (_, surveyed, None) => Ok(surveyed),
    }
}

/// Analyses one run, unless its result is there; true if it did.
fn one<T: Analysis>(runtime: &Handle, place: &Place, out: &Path, file: &ObjectMeta) -> anyhow::Result<bool> {
    let path = result_path::<T>(out, place, file);
    if read::<T>(&path)?.is_some_and(|known| known.bytes == file.size) {
        return Ok(false);
    }
    let head = runtime.block_on(RunHead::read(place, file))?;
    let table = runtime.block_on(fetched(place, file)).with_context(|| file.location.to_string())?;
    let result = RunResult {
        schema: SCHEMA.to_owned(),
        run: head.run,
        rig: head.rig,
        date: head.date,
        started_ns: head.started_ns,
        simulated: head.simulated,
        bytes: file.size,
        outcome: T::of(table.path()).map_or_else(Outcome::Refused, Outcome::Found),
    };
    write(&path, &result).with_context(|| path.display().to_string())?;
    Ok(true)
}

/// Where the result of a run is: as its file in the fleet, in the folder of the analysis.
fn result_path<T: Analysis>(out: &Path, place: &Place, file: &ObjectMeta) -> PathBuf {
    let mut path = out.join(T::NAME);
    path.extend(place.in_fleet(&file.location));
    path.set_extension("json");
    path
}

/// The result of a run; `None` if there is none, or one of another form.
fn read<T: Analysis>(path: &Path) -> anyhow::Result<Option<RunResult<T>>> {
    match fs::read(path) {
        Ok(text) => {
            Ok(serde_json::from_slice(&text).ok().filter(|result: &RunResult<T>| result.schema == SCHEMA))
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error).with_context(|| path.display().to_string()),
    }
}

/// The results of all runs that are in the fleet now.
pub(crate) fn results<T: Analysis>(
    runtime: &Handle,
    place: &Place,
    out: &Path,
) -> anyhow::Result<Vec<RunResult<T>>> {
    let mut results = Vec::new();
    for file in runtime.block_on(place.files())? {
        results.extend(read(&result_path::<T>(out, place, &file))?);
    }
    Ok(results)
}

/// Writes a result, which appears as a whole.
fn write<T: Analysis>(path: &Path, result: &RunResult<T>) -> anyhow::Result<()> {
    let folder = path.parent().context("a result has a folder")?;
    fs::create_dir_all(folder)?;
    let mut part = NamedTempFile::new_in(folder)?;
    serde_json::to_writer_pretty(&mut part, result)?;
    part.persist(path)?;
    Ok(())
}

/// A run's file on the local disk, until it is dropped.
async fn fetched(place: &Place, file: &ObjectMeta) -> anyhow::Result<NamedTempFile> {
    let local = NamedTempFile::new()?;
    let mut to = tokio::fs::File::from_std(local.reopen()?);
    let mut parts = place.store().get(&file.location).await?.into_stream();
    while let Some(part) = parts.try_next().await? {
        to.write_all(&part).await?;
    }
    to.flush().await?;
    Ok(local)
}
