//! From recordings and measurement tables to one Parquet file per run.
//!
//! Threads take one job after the other: a table, or a recording with those that go on with its run. A job reads its rows as a stream,
//! and holds one row group of them and 32 MiB of the file at most; what is beyond lies in an unnamed file of the system's temporary folder. A file appears in the
//! fleet only when it is whole, so a killed ingest leaves no half of one, and the next goes on where it ended.

mod found;
mod register;
mod run_writer;

use std::{
    fmt,
    num::NonZeroUsize,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use jiff::civil::Date;
use serde::Serialize;
use tactus_record::{RowsError, rows};
use tactus_schema::{Rig, table::RowView};
use tactus_work::{Now, for_each};
use tokio::runtime::Handle;

use crate::{
    Place, PlaceError,
    output::{in_mb, number_of},
};
use found::{Job, found};
use register::Register;
use run_writer::{RunWriter, WriteError, Written};

/// How runs are ingested.
#[derive(Debug, Clone)]
pub struct Options {
    /// How many jobs are done at a time.
    pub threads: NonZeroUsize,
    /// Date of runs whose files and ids do not tell theirs.
    pub date: Option<Date>,
}

/// What was ingested.
#[derive(Debug, Clone, Serialize)]
pub struct Ingested {
    /// Form of this summary.
    pub schema: &'static str,
    /// The fleet.
    pub to: String,
    /// Runs that were written.
    pub runs_written: u64,
    /// Runs that were there already.
    pub runs_kept: u64,
    /// Rows that were written.
    pub rows: u64,
    /// Bytes that were written.
    pub bytes: u64,
    /// What readers of the rows must know, a sentence each.
    pub warnings: Vec<String>,
    /// Files that could not be ingested, and why. The others are.
    pub failed: Vec<FailedFile>,
}

/// A file or a folder that could not be ingested, or a run of a file.
#[derive(Debug, Clone, Serialize)]
pub struct FailedFile {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub problem: String,
}

/// Why nothing was ingested.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum IngestError {
    /// A path cannot be read.
    #[error("{}: {source}", path.display())]
    Path { path: PathBuf, source: std::io::Error },
    /// There is nothing to ingest.
    #[error("there is no recording (.mcap) in {}", paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", "))]
    Nothing { paths: Vec<PathBuf> },
    /// The fleet cannot be read.
    #[error(transparent)]
    Place(#[from] PlaceError),
}

/// Why a job was not done.
#[derive(Debug, thiserror::Error)]
enum JobError {
    #[error(transparent)]
    Rows(#[from] RowsError),
    #[error(transparent)]
    Write(#[from] WriteError),
    #[error("it holds no frame")]
    NoFrame,
}

const SCHEMA: &str = "tactus.fleet.ingest/1";

/// Writes the runs of recordings and measurement tables into a fleet. Folders are searched for recordings, through links as well. A run that is there already, made
/// of the same file by size and checksum, is kept.
///
/// A rig has each run once. Of two files with one run, one gives it; a table never replaces what was recorded. The other file is among
/// [`Ingested::failed`], with the runs that were not taken from it.
///
/// Recordings that go on with another's run are read with it, if both are given: presses that were done again are left out.
///
/// # Errors
/// If a path or the fleet cannot be read, or there is no recording at all. A file or folder that cannot be read stops no other:
/// [`Ingested::failed`] lists it.
pub fn ingest(
    runtime: &Handle,
    paths: &[PathBuf],
    place: &Place,
    options: &Options,
    progress: &(dyn Fn(Now) + Sync),
) -> Result<Ingested, IngestError> {
    let (jobs, unreadable) = found(paths)?;
    let register = Register::of(runtime, place)?;
    // Before any table is read, so that none takes the place of a recording.
    for (source, run) in jobs.iter().flat_map(Job::recorded) {
        register.give(&run.rig, &run.run_id, &source.path);
    }
    let shared = Shared {
        now: Mutex::new(Now {
            pieces: 0,
            pieces_all: jobs.iter().map(|job| job.sources().count()).sum(),
            size: 0,
            size_all: jobs.iter().map(Job::bytes).sum(),
        }),
        ingested: Mutex::new(Ingested {
            schema: SCHEMA,
            to: place.url().to_string(),
            runs_written: 0,
            runs_kept: 0,
            rows: 0,
            bytes: 0,
            warnings: Vec::new(),
            failed: unreadable,
        }),
    };
    for_each(options.threads, &jobs, |job| {
        let done = JobInProgress {
            runtime,
            place,
            register: &register,
            options,
            job,
            open: None,
            closed: Vec::new(),
        }
        .run();
        register.take(done.iter().flatten());
        shared.take(job, done, progress);
    });
    let mut ingested = shared.ingested.into_inner().unwrap_or_else(PoisonError::into_inner);
    ingested.warnings.extend(register.warnings()?);
    ingested.warnings.sort();
    ingested.failed.sort_by(|one, other| one.path.cmp(&other.path));
    Ok(ingested)
}

/// What the threads share.
struct Shared {
    now: Mutex<Now>,
    ingested: Mutex<Ingested>,
}

impl Shared {
    fn take(&self, job: &Job, done: Result<Vec<Written>, JobError>, progress: &(dyn Fn(Now) + Sync)) {
        {
            let mut ingested = self.ingested.lock().unwrap_or_else(PoisonError::into_inner);
            match done {
                Ok(all) => all.into_iter().for_each(|written| ingested.add(written)),
                Err(error) => ingested.failed.extend(job.failed(&error)),
            }
        }
        let mut now = self.now.lock().unwrap_or_else(PoisonError::into_inner);
        now.pieces += job.sources().count();
        now.size += job.bytes();
        progress(*now);
    }
}

impl Ingested {
    /// True if nothing is missing and nobody needs to be warned.
    pub fn is_whole(&self) -> bool {
        self.failed.is_empty() && self.warnings.is_empty()
    }

    fn add(&mut self, written: Written) {
        match written {
            Written::Kept => self.runs_kept += 1,
            Written::Refused(failed) => self.failed.push(failed),
            Written::New { rig: _, run: _, rows, bytes, warnings } => {
                self.runs_written += 1;
                self.rows += rows;
                self.bytes += bytes;
                self.warnings.extend(warnings);
            }
        }
    }
}

impl fmt::Display for Ingested {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { schema: _, to, runs_written, runs_kept, rows, bytes, warnings, failed } = self;
        writeln!(
            f,
            "{} written ({}, {}), {} kept: {to}",
            number_of(*runs_written, "run"),
            number_of(*rows, "frame"),
            in_mb(*bytes),
            runs_kept
        )?;
        for warning in warnings {
            writeln!(f, "warning: {warning}")?;
        }
        for FailedFile { path, problem } in failed {
            writeln!(f, "not ingested: {}: {problem}", path.display())?;
        }
        Ok(())
    }
}

/// A job with the files that it writes.
struct JobInProgress<'a> {
    runtime: &'a Handle,
    place: &'a Place,
    register: &'a Register<'a>,
    options: &'a Options,
    job: &'a Job,
    /// The file of the run whose rows come now.
    open: Option<RunWriter>,
    /// Files of recordings, which wait for the warnings that come last.
    closed: Vec<RunWriter>,
}

impl JobInProgress<'_> {
    fn run(mut self) -> Result<Vec<Written>, JobError> {
        let mut written = Vec::new();
        let (place, runtime) = (self.place, self.runtime);
        if let Some(passed_over) = self.passed_over() {
            return Ok(passed_over);
        }
        let paths: Vec<&Path> = self.job.sources().map(|source| source.path.as_path()).collect();
        let mut problem = None;
        let source = rows::visit(&paths, |rig, row| {
            if problem.is_none() {
                problem = self.row(rig, row, &mut written).err();
            }
        })?;
        if let Some(problem) = problem {
            return Err(problem.into());
        }
        self.closed.extend(self.open.take());
        if written.is_empty() && self.closed.is_empty() {
            return Err(JobError::NoFrame);
        }
        for writer in self.closed {
            let start = format!("run {}: ", writer.run());
            let warnings =
                source.warnings.iter().filter(|warning| warning.starts_with(&start)).cloned().collect();
            written.push(writer.finish(runtime, place, warnings)?);
        }
        Ok(written)
    }

    /// What becomes of recordings if none has a run to write. Of a table nobody knows its runs before it is read.
    fn passed_over(&self) -> Option<Vec<Written>> {
        if self.job.is_table() {
            return None;
        }
        let recorded = self.job.recorded();
        recorded
            .map(|(source, run)| {
                self.register.passed_over(&self.job.recorded_head(source, run), &source.path)
            })
            .collect()
    }

    fn row(&mut self, rig: &Rig, row: RowView<'_>, written: &mut Vec<Written>) -> Result<(), WriteError> {
        if self.open.as_ref().is_none_or(|open| open.run() != row.run) {
            if let Some(before) = self.open.take() {
                if self.job.is_table() {
                    // A table may have thousands of runs, and gives no warnings.
                    written.push(before.finish(self.runtime, self.place, Vec::new())?);
                } else {
                    self.closed.push(before);
                }
            }
            let (source, head) = self.job.head(rig, row.run, self.options.date)?;
            let passed_over = self.register.passed_over(&head, &source.path);
            self.open = Some(RunWriter::begin(head, rig, passed_over)?);
        }
        match &mut self.open {
            Some(open) => open.push(row),
            None => Ok(()),
        }
    }
}
