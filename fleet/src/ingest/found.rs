//! The files to ingest, and which of them go together.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs::{self, File, Metadata},
    io::{self, Read as _, Seek as _, SeekFrom},
    iter,
    os::unix::fs::MetadataExt as _,
    path::{Path, PathBuf},
};

use jiff::{Timestamp, civil::Date, tz::TimeZone};
use tactus_record::{Entry, RecordError, RunMetadata};
use tactus_schema::Rig;

use super::{FailedFile, IngestError, JobError, run_writer::WriteError};
use crate::{
    RunHead,
    run_head::{END_BYTES, SCHEMA},
};

/// Files that are read together: one table, or recordings that go on with each other's run.
#[derive(Debug)]
pub(super) struct Job {
    first: Source,
    /// Recordings: each goes on with the run of one before.
    later: Vec<Source>,
}

/// A file to ingest.
#[derive(Debug)]
pub(super) struct Source {
    pub(super) path: PathBuf,
    pub(super) bytes: u64,
    /// CRC-32 of its last 64 KiB.
    end_crc32: u32,
    /// The run of a recording; `None` of a table.
    pub(super) run: Option<RunMetadata>,
}

/// The jobs, the largest first, so that no thread ends with a long one alone; and the files that are not readable.
pub(super) fn found(paths: &[PathBuf]) -> Result<(Vec<Job>, Vec<FailedFile>), IngestError> {
    let mut search = Search::default();
    for path in paths {
        let kind = fs::metadata(path).map_err(|source| IngestError::Path { path: path.clone(), source })?;
        search.take(path.clone(), &kind, true);
    }
    let Search { mut files, mut failed, .. } = search;
    files.sort();
    if files.is_empty() && failed.is_empty() {
        return Err(IngestError::Nothing { paths: paths.to_owned() });
    }
    let mut sources = Vec::new();
    for path in files {
        match source(&path) {
            Ok(source) => sources.push(source),
            Err(error) => failed.push(FailedFile { path, problem: error.to_string() }),
        }
    }
    let (mut jobs, doubles) = together(sources);
    failed.extend(doubles);
    jobs.sort_by_key(|job| std::cmp::Reverse(job.bytes()));
    Ok((jobs, failed))
}

/// A search for files, through links as well. What several paths lead to is found once.
#[derive(Default)]
struct Search {
    /// Device and inode of each file and folder that was seen.
    seen: BTreeSet<(u64, u64)>,
    files: Vec<PathBuf>,
    failed: Vec<FailedFile>,
}

impl Search {
    /// Adds a file if it is wanted; of a folder the recordings in it and in the folders in it.
    fn take(&mut self, path: PathBuf, kind: &Metadata, is_wanted: bool) {
        if (!kind.is_dir() && !is_wanted) || !self.seen.insert((kind.dev(), kind.ino())) {
            return;
        }
        if !kind.is_dir() {
            self.files.push(path);
        } else if let Err(error) = self.folder(&path) {
            self.fail(path, &error);
        }
    }

    fn folder(&mut self, folder: &Path) -> io::Result<()> {
        let mut paths = Vec::new();
        for entry in fs::read_dir(folder)? {
            paths.push(entry?.path());
        }
        // So that it does not depend on the file system which of several paths finds a file.
        paths.sort();
        for path in paths {
            let is_recording = path.extension().is_some_and(|extension| extension == "mcap");
            match fs::metadata(&path) {
                Ok(kind) => self.take(path, &kind, is_recording),
                Err(error) => self.fail(path, &error),
            }
        }
        Ok(())
    }

    fn fail(&mut self, path: PathBuf, error: &io::Error) {
        self.failed.push(FailedFile { path, problem: error.to_string() });
    }
}

fn source(path: &Path) -> Result<Source, RecordError> {
    let io_error = |source| RecordError::Io { action: "read", path: path.to_owned(), source };
    let (bytes, end_crc32) = size_and_end(path).map_err(io_error)?;
    let source = |run| Source { path: path.to_owned(), bytes, end_crc32, run };
    let entries = match tactus_record::read(path) {
        Ok(entries) => entries,
        // A table, or neither: whoever reads its rows says so.
        Err(RecordError::NotMcap { .. }) => return Ok(source(None)),
        Err(error) => return Err(error),
    };
    for entry in entries {
        match entry.map_err(io_error)? {
            Entry::Run(run) => return Ok(source(Some(run))),
            Entry::Attachment(_) => {}
            Entry::Message { .. } => break,
        }
    }
    Err(RecordError::NoRun { path: path.to_owned() })
}

/// Size of a file, and CRC-32 of its last 64 KiB.
fn size_and_end(path: &Path) -> io::Result<(u64, u32)> {
    let mut file = File::open(path)?;
    let bytes = file.metadata()?.len();
    file.seek(SeekFrom::Start(bytes.saturating_sub(END_BYTES)))?;
    let mut end = Vec::new();
    file.take(END_BYTES).read_to_end(&mut end)?;
    Ok((bytes, crc32fast::hash(&end)))
}

/// Joins recordings that go on with each other. Of two recordings of one run the second is left out.
fn together(sources: Vec<Source>) -> (Vec<Job>, Vec<FailedFile>) {
    let mut jobs = Vec::new();
    let mut failed = Vec::new();
    let mut recordings: BTreeMap<String, Source> = BTreeMap::new();
    for source in sources {
        let Some(run) = &source.run else {
            jobs.push(Job::alone(source));
            continue;
        };
        if let Some(first) = recordings.get(&run.run_id) {
            let problem =
                format!("its run {:?} is also in {}, which was ingested", run.run_id, first.path.display());
            failed.push(FailedFile { path: source.path, problem });
        } else {
            recordings.insert(run.run_id.clone(), source);
        }
    }
    // From each run that goes on with none of these, along those that go on with it.
    let goes_on = |source: &Source| source.run.as_ref().and_then(|run| run.continues.clone());
    let mut later: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut firsts = Vec::new();
    for (id, source) in &recordings {
        match goes_on(source).filter(|earlier| earlier != id && recordings.contains_key(earlier)) {
            Some(earlier) => later.entry(earlier).or_default().push(id.clone()),
            None => firsts.push(id.clone()),
        }
    }
    for first in firsts {
        let mut order = vec![first];
        let mut at = 0;
        while let Some(id) = order.get(at) {
            let next = later.remove(id).unwrap_or_default();
            order.extend(next);
            at += 1;
        }
        let mut sources = order.iter().filter_map(|id| recordings.remove(id));
        jobs.extend(sources.next().map(|first| Job { first, later: sources.collect() }));
    }
    // What is left goes on with each other in a circle, which no service writes.
    jobs.extend(recordings.into_values().map(Job::alone));
    (jobs, failed)
}

impl Job {
    fn alone(source: Source) -> Self {
        Self { first: source, later: Vec::new() }
    }

    /// Its files, in the order in which they are read.
    pub(super) fn sources(&self) -> impl Iterator<Item = &Source> {
        iter::once(&self.first).chain(&self.later)
    }

    /// Size of its files.
    pub(super) fn bytes(&self) -> u64 {
        self.sources().map(|source| source.bytes).sum()
    }

    /// True if its rows come from a measurement table.
    pub(super) fn is_table(&self) -> bool {
        self.first.run.is_none()
    }

    /// Its recordings with their runs.
    pub(super) fn recorded(&self) -> impl Iterator<Item = (&Source, &RunMetadata)> {
        self.sources().filter_map(|source| Some((source, source.run.as_ref()?)))
    }

    /// The file and the head of a run whose first row has come.
    pub(super) fn head(
        &self,
        rig: &Rig,
        run: &str,
        date: Option<Date>,
    ) -> Result<(&Source, RunHead), WriteError> {
        if let Some((source, metadata)) = self.recorded().find(|(_, metadata)| metadata.run_id == run) {
            return Ok((source, self.recorded_head(source, metadata)));
        }
        let table = &self.first;
        let date = date_of_id(run).or(date).ok_or_else(|| WriteError::NoDate { run: run.to_owned() })?;
        let head = RunHead {
            schema: SCHEMA.to_owned(),
            run: run.to_owned(),
            rig: rig.name.clone(),
            date: date.to_string(),
            started_ns: None,
            frames_ns: None,
            simulated: rig.simulated,
            experiment: None,
            script: None,
            who: None,
            continues: None,
            continued_by: None,
            source_bytes: table.bytes,
            source_end_crc32: Some(table.end_crc32),
            warnings: Vec::new(),
        };
        Ok((table, head))
    }

    /// The head of a recorded run.
    pub(super) fn recorded_head(&self, source: &Source, run: &RunMetadata) -> RunHead {
        let goes_on_with = |(_, other): &(_, &RunMetadata)| other.continues.as_ref() == Some(&run.run_id);
        RunHead {
            schema: SCHEMA.to_owned(),
            run: run.run_id.clone(),
            rig: run.rig.clone(),
            date: day(run.started.ns()).to_string(),
            started_ns: Some(run.started.ns()),
            frames_ns: None,
            simulated: run.simulated,
            experiment: Some(run.experiment.clone()),
            script: Some(run.script.clone()),
            who: Some(run.who.clone()),
            continues: run.continues.clone(),
            continued_by: self.recorded().find(goes_on_with).map(|(_, other)| other.run_id.clone()),
            source_bytes: source.bytes,
            source_end_crc32: Some(source.end_crc32),
            warnings: Vec::new(),
        }
    }

    /// Its files, for a problem that one of them has.
    pub(super) fn failed(&self, error: &JobError) -> Vec<FailedFile> {
        let failed = |source: &Source| FailedFile { path: source.path.clone(), problem: error.to_string() };
        self.sources().map(failed).collect()
    }
}

/// The day of a time, UTC.
fn day(wall_ns: i64) -> Date {
    Timestamp::from_second(wall_ns.div_euclid(1_000_000_000))
        .map_or(Date::constant(1970, 1, 1), |at| at.to_zoned(TimeZone::UTC).date())
}

/// The date with which the ids of runs begin: `20260325-100000-image-5e1f`.
fn date_of_id(run: &str) -> Option<Date> {
    let digits = run.get(..8).filter(|start| start.bytes().all(|byte| byte.is_ascii_digit()))?;
    let (year, month, day) = (digits.get(..4)?, digits.get(4..6)?, digits.get(6..8)?);
    Date::new(year.parse().ok()?, month.parse().ok()?, day.parse().ok()?).ok()
}
