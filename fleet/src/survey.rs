//! Calibration and discovery of every run of a fleet, and what their results say together.
//!
//! The result of each run is a file of its own in the output folder. Workers of one folder share the runs ([`tactus_work`]). A run is done
//! again if its file in the fleet has changed or could not be read, or another version of the program did it. Memory holds one run for each
//! thread.

mod calibrated;
mod discovered;
mod findings;
mod surveyed_run;
mod trend;

use std::{
    any::Any,
    fs, io,
    marker::PhantomData,
    panic::catch_unwind,
    path::{Path, PathBuf},
};

use anyhow::Context as _;
use futures::TryStreamExt as _;
use object_store::{ObjectMeta, ObjectStoreExt as _};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use tactus_work::{Now, Stop, Work, Worked, Worker, work, write_whole};
use tempfile::NamedTempFile;
use tokio::{io::AsyncWriteExt as _, runtime::Handle};

use crate::Place;

pub(crate) use calibrated::Calibrated;
pub(crate) use discovered::Discovered;
pub(crate) use findings::findings;
pub(crate) use surveyed_run::SurveyedRun;

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
    /// CRC-32 of its last 64 KiB; none if they could not be read.
    end_crc32: Option<u32>,
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
    /// Why its file could not be read; the next survey tries again.
    Unread(String),
}

const SCHEMA: &str = "tactus.fleet.result/2";
const VERSION: &str = env!("CARGO_PKG_VERSION");

impl<T> RunResult<T> {
    fn of(run: &SurveyedRun, outcome: Outcome<T>) -> Self {
        Self {
            schema: SCHEMA.to_owned(),
            version: VERSION.to_owned(),
            run: run.run.clone(),
            rig: run.rig.clone(),
            date: run.date.clone(),
            started_ns: run.started_ns,
            simulated: run.simulated,
            bytes: run.file.size,
            end_crc32: run.end_crc32.as_ref().ok().copied(),
            outcome,
        }
    }

    /// True if this program made it of the run's file as it is now.
    fn is_current(&self, run: &SurveyedRun) -> bool {
        self.schema == SCHEMA
            && self.version == VERSION
            && self.bytes == run.file.size
            && self.end_crc32 == run.end_crc32.as_ref().ok().copied()
    }
}

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
            end_crc32: None,
            outcome,
        }
    }
}

/// Analyses every run that has no result in `out` yet, with the other workers of that folder.
pub(crate) fn survey<T: Analysis>(
    runtime: &Handle,
    place: &Place,
    runs: &[SurveyedRun],
    out: &Path,
    worker: &Worker,
    progress: &(dyn Fn(Now) + Sync),
) -> anyhow::Result<Worked> {
    let survey = Survey { runtime, place, out, analysis: PhantomData::<fn() -> T> };
    work(&survey, runs, worker, &|_, now| progress(now))
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
    type Piece = SurveyedRun;
    type Made = RunResult<T>;
    type Error = anyhow::Error;

    fn name(&self, run: &SurveyedRun) -> String {
        self.place.in_fleet(&run.file.location).join("/")
    }

    fn size(&self, run: &SurveyedRun) -> u64 {
        run.file.size
    }

    fn is_done(&self, run: &SurveyedRun) -> anyhow::Result<bool> {
        let known = current::<T>(self.out, self.place, run)?;
        Ok(known.is_some_and(|known| !matches!(known.outcome, Outcome::Unread(_))))
    }

    fn make(&self, run: &SurveyedRun, stop: &Stop) -> anyhow::Result<Option<RunResult<T>>> {
        let table = match &run.end_crc32 {
            Ok(_) => self.runtime.block_on(fetched(self.place, &run.file)),
            Err(problem) => Err(anyhow::Error::msg(problem.clone())),
        };
        let outcome = match table {
            Err(problem) => Outcome::Unread(format!("{problem:#}")),
            Ok(table) => {
                let path = table.path().to_owned();
                let Some(outcome) = stop.unless_set(move || analysed(&path)) else { return Ok(None) };
                outcome
            }
        };
        Ok(Some(RunResult::of(run, outcome)))
    }

    fn keep(&self, run: &SurveyedRun, result: RunResult<T>) -> anyhow::Result<()> {
        let path = result_path::<T>(self.out, self.place, &run.file);
        let text = serde_json::to_vec_pretty(&result)?;
        write_whole(&path, &text).with_context(|| path.display().to_string())
    }
}

/// Analyses a run's file. A defect of the analysis costs this run, not the survey.
fn analysed<T: Analysis>(table: &Path) -> Outcome<T> {
    match catch_unwind(|| T::of(table)) {
        Ok(Ok(found)) => Outcome::Found(found),
        Ok(Err(lacking)) => Outcome::Refused(lacking),
        Err(panic) => Outcome::Refused(format!("a defect of this program: {}", said(panic.as_ref()))),
    }
}

/// What a panic said.
fn said(panic: &(dyn Any + Send)) -> &str {
    let owned = panic.downcast_ref::<String>().map(String::as_str);
    owned.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("a panic without words")
}

/// Where the result of a run is: as its file in the fleet, in the folder of the analysis.
fn result_path<T: Analysis>(out: &Path, place: &Place, file: &ObjectMeta) -> PathBuf {
    let mut path = out.join(T::NAME);
    path.extend(place.in_fleet(&file.location));
    path.set_extension("json");
    path
}

/// The result of a run; `None` if there is none, or one of another file or of another version of the program.
fn current<T: Analysis>(
    out: &Path,
    place: &Place,
    run: &SurveyedRun,
) -> anyhow::Result<Option<RunResult<T>>> {
    let path = result_path::<T>(out, place, &run.file);
    match fs::read(&path) {
        Ok(text) => {
            let known = serde_json::from_slice::<RunResult<T>>(&text).ok();
            Ok(known.filter(|known| known.is_current(run)))
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error).with_context(|| path.display().to_string()),
    }
}

/// The results of those of the runs that have one.
pub(crate) fn results<T: Analysis>(
    place: &Place,
    runs: &[SurveyedRun],
    out: &Path,
) -> anyhow::Result<Vec<RunResult<T>>> {
    runs.iter().filter_map(|run| current(out, place, run).transpose()).collect()
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

#[cfg(test)]
#[path = "survey_tests.rs"]
mod tests;
