//! Calibration and discovery of every run of a fleet, and what their results say together.
//!
//! The result of each run is a file of its own in the output folder. Workers of one folder share the runs ([`tactus_work`]). A run is done
//! again if its file in the fleet has changed, or another version of the program did it. Memory holds one run for each thread.

mod calibrated;
mod discovered;
mod findings;
mod trend;

use std::{
    fs, io,
    marker::PhantomData,
    path::{Path, PathBuf},
};

use anyhow::Context as _;
use futures::TryStreamExt as _;
use object_store::{ObjectMeta, ObjectStoreExt as _};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use tactus_work::{Now, Stop, Work, Worked, Worker, work, write_whole};
use tempfile::NamedTempFile;
use tokio::{io::AsyncWriteExt as _, runtime::Handle};

use crate::{Place, RunHead};

pub(crate) use calibrated::Calibrated;
pub(crate) use discovered::Discovered;
pub(crate) use findings::findings;

/// What a survey does with each run.
pub(crate) trait Analysis: Serialize + DeserializeOwned + Send + 'static {
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
    /// Of the program that made it: two versions may see one sensor a little differently, which would look like a drift.
    version: String,
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
const VERSION: &str = env!("CARGO_PKG_VERSION");

#[cfg(test)]
impl<T> RunResult<T> {
    /// A result for tests of what results say together.
    pub(crate) fn new(run: &str, rig: &str, outcome: Outcome<T>) -> Self {
        Self {
            schema: SCHEMA.to_owned(),
            version: VERSION.to_owned(),
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

/// Analyses every run that has no result in `out` yet, with the other workers of that folder.
pub(crate) fn survey<T: Analysis>(
    runtime: &Handle,
    place: &Place,
    out: &Path,
    worker: &Worker,
    progress: &(dyn Fn(Now) + Sync),
) -> anyhow::Result<Worked> {
    let files = runtime.block_on(place.files())?;
    let survey = Survey { runtime, place, out, analysis: PhantomData::<fn() -> T> };
    work(&survey, &files, worker, &|_, now| progress(now))
}

/// Folder of the claims of an analysis.
pub(crate) fn claims<T: Analysis>(out: &Path) -> PathBuf {
    out.join("claims").join(T::NAME)
}

/// The work on all runs.
struct Survey<'a, T> {
    runtime: &'a Handle,
    place: &'a Place,
    out: &'a Path,
    analysis: PhantomData<fn() -> T>,
}

impl<T: Analysis> Work for Survey<'_, T> {
    type Piece = ObjectMeta;
    type Made = RunResult<T>;
    type Error = anyhow::Error;

    fn name(&self, file: &ObjectMeta) -> String {
        self.place.in_fleet(&file.location).join("/")
    }

    fn size(&self, file: &ObjectMeta) -> u64 {
        file.size
    }

    fn is_done(&self, file: &ObjectMeta) -> anyhow::Result<bool> {
        let known = read::<T>(&result_path::<T>(self.out, self.place, file))?;
        Ok(known.is_some_and(|known| known.bytes == file.size))
    }

    fn make(&self, file: &ObjectMeta, stop: &Stop) -> anyhow::Result<Option<RunResult<T>>> {
        let head = self.runtime.block_on(RunHead::read(self.place, file))?;
        let table = self.runtime.block_on(fetched(self.place, file));
        let table = table.with_context(|| file.location.to_string())?;
        let path = table.path().to_owned();
        let Some(found) = stop.unless_set(move || T::of(&path)) else { return Ok(None) };
        Ok(Some(RunResult {
            schema: SCHEMA.to_owned(),
            version: VERSION.to_owned(),
            run: head.run,
            rig: head.rig,
            date: head.date,
            started_ns: head.started_ns,
            simulated: head.simulated,
            bytes: file.size,
            outcome: found.map_or_else(Outcome::Refused, Outcome::Found),
        }))
    }

    fn keep(&self, file: &ObjectMeta, result: RunResult<T>) -> anyhow::Result<()> {
        let path = result_path::<T>(self.out, self.place, file);
        let text = serde_json::to_vec_pretty(&result)?;
        write_whole(&path, &text).with_context(|| path.display().to_string())
    }
}

/// Where the result of a run is: as its file in the fleet, in the folder of the analysis.
fn result_path<T: Analysis>(out: &Path, place: &Place, file: &ObjectMeta) -> PathBuf {
    let mut path = out.join(T::NAME);
    path.extend(place.in_fleet(&file.location));
    path.set_extension("json");
    path
}

/// The result of a run; `None` if there is none, or one of another form or of another version of the program.
fn read<T: Analysis>(path: &Path) -> anyhow::Result<Option<RunResult<T>>> {
    match fs::read(path) {
        Ok(text) => {
            let is_ours = |result: &RunResult<T>| result.schema == SCHEMA && result.version == VERSION;
            Ok(serde_json::from_slice(&text).ok().filter(is_ours))
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
