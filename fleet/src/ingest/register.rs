//! Which file each run comes from: a rig has each run once.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
};

use object_store::{ObjectMeta, path::Path as StorePath};
use tokio::runtime::Handle;

use super::{FailedFile, run_writer::Written};
use crate::{
    Place, PlaceError, RunHead,
    output::number_of,
    twice::{collected_too, not_cut},
};

/// The runs that the fleet has, and those that the files of this ingest give.
pub(super) struct Register<'a> {
    runtime: &'a Handle,
    place: &'a Place,
    /// Files of the fleet when the ingest began, of each run by date. An older program may have written one under several dates.
    there: BTreeMap<[String; 2], BTreeMap<String, ObjectMeta>>,
    /// The file that gives each run.
    given: Mutex<BTreeMap<Key, PathBuf>>,
    /// Runs that were written.
    written: Mutex<BTreeSet<Key>>,
}

/// A rig and a run of it.
type Key = (String, String);

/// Why a run is not taken from a file, although the file is in order.
#[derive(Debug, thiserror::Error)]
enum Refusal {
    #[error("its run {run:?} of rig {rig} is also in {}: of both files only that one is ingested", first.display())]
    AlsoIn { run: String, rig: String, first: PathBuf },
    #[error(
        "its run {run:?} of rig {rig} is in the fleet as it was recorded, which a table does not replace"
    )]
    Recorded { run: String, rig: String },
    #[error(
        "its run {run:?} of rig {rig} is in the fleet up to the presses that run {by:?} did again: give it together with the recording of that run"
    )]
    Cut { run: String, rig: String, by: String },
    #[error(
        "its run {run:?} of rig {rig} is in the fleet under {there}, and would be there a second time under {date}. If it is the same run, give --date {there} or delete that file first; else give it another name"
    )]
    OtherDate { run: String, rig: String, there: String, date: String },
}

impl<'a> Register<'a> {
    /// # Errors
    /// If the fleet cannot be read.
    pub(super) fn of(runtime: &'a Handle, place: &'a Place) -> Result<Self, PlaceError> {
        let files = runtime.block_on(place.files())?;
        let mut there: BTreeMap<_, BTreeMap<_, _>> = BTreeMap::new();
        for file in files {
            if let Some(([rig, run], date)) = parts(place, &file.location) {
                there.entry([rig, run]).or_default().insert(date, file);
            }
        }
        Ok(Self { runtime, place, there, given: Mutex::default(), written: Mutex::default() })
    }

    /// From now on the run comes from this file, unless another one gave it before; the file that gives it.
    pub(super) fn give(&self, rig: &str, run: &str, source: &Path) -> PathBuf {
        let key = (rig.to_owned(), run.to_owned());
        self.given().entry(key).or_insert_with(|| source.to_owned()).clone()
    }

    /// What becomes of a run without its rows being written; `None` if they are to be written.
    pub(super) fn passed_over(&self, head: &RunHead, source: &Path) -> Option<Written> {
        match self.needs_writing(head, source) {
            Ok(true) => None,
            Ok(false) => Some(Written::Kept),
            Err(refusal) => {
                let (path, problem) = (source.to_owned(), refusal.to_string());
                Some(Written::Refused(FailedFile { path, problem }))
            }
        }
    }

    /// False if the fleet has the run from the same file.
    fn needs_writing(&self, head: &RunHead, source: &Path) -> Result<bool, Refusal> {
        let (run, rig) = (head.run.clone(), head.rig.clone());
        let first = self.give(&rig, &run, source);
        if first != source {
            return Err(Refusal::AlsoIn { run, rig, first });
        }
        let Some(file) = self.file(head)? else { return Ok(true) };
        // A file that is no longer readable is written again.
        let Ok(known) = self.runtime.block_on(RunHead::read(self.place, file)) else { return Ok(true) };
        if known.is_recorded() && !head.is_recorded() {
            return Err(Refusal::Recorded { run, rig });
        }
        match (known.is_same_source(head), &known.continued_by, &head.continued_by) {
            (true, _, None) => Ok(false),
            (true, known, given) => Ok(known != given),
            (false, Some(by), None) => Err(Refusal::Cut { run, rig, by: by.clone() }),
            (false, _, _) => Ok(true),
        }
    }

    /// Notes which runs were written.
    pub(super) fn take<'w>(&self, all: impl Iterator<Item = &'w Written>) {
        let new = all.filter_map(|written| match written {
            Written::New { rig, run, .. } => Some((rig.clone(), run.clone())),
            Written::Kept | Written::Refused(_) => None,
        });
        self.written.lock().unwrap_or_else(PoisonError::into_inner).extend(new);
    }

    /// What readers of the runs of this ingest must know, a sentence each, now that all are written.
    ///
    /// # Errors
    /// If the fleet cannot be read.
    pub(super) fn warnings(&self) -> Result<Vec<String>, PlaceError> {
        let given: BTreeSet<Key> = self.given().keys().cloned().collect();
        let heads = self.heads_of_rigs(given.iter().map(|(rig, _)| rig.as_str()))?;
        let mut warnings = not_cut_in_words(&heads, &given);
        let written = self.written.lock().unwrap_or_else(PoisonError::into_inner);
        warnings.extend(collected_too_in_words(&heads, &written));
        Ok(warnings)
    }

    /// What the fleet's files of these rigs say now.
    fn heads_of_rigs<'r>(&self, rigs: impl Iterator<Item = &'r str>) -> Result<Vec<RunHead>, PlaceError> {
        let folders: BTreeSet<_> = rigs.filter_map(|rig| folder_of_rig(self.place, rig)).collect();
        if folders.is_empty() {
            return Ok(Vec::new());
        }
        let mut files = self.runtime.block_on(self.place.files())?;
        files.retain(|file| {
            self.place.in_fleet(&file.location).first().is_some_and(|folder| folders.contains(folder))
        });
        Ok(self.runtime.block_on(RunHead::readable(self.place, files)))
    }

    /// The fleet's file of a run, which must not be under another date only.
    fn file(&self, head: &RunHead) -> Result<Option<&ObjectMeta>, Refusal> {
        let path = self.place.of_run(&head.rig, &head.date, &head.run);
        let Some((key, date)) = parts(self.place, &path) else { return Ok(None) };
        let Some(dates) = self.there.get(&key) else { return Ok(None) };
        match (dates.get(&date), dates.keys().next()) {
            (None, Some(there)) => Err(Refusal::OtherDate {
                run: head.run.clone(),
                rig: head.rig.clone(),
                there: there.clone(),
                date,
            }),
            (file, _) => Ok(file),
        }
    }

    fn given(&self) -> MutexGuard<'_, BTreeMap<Key, PathBuf>> {
        self.given.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Warns of presses that were done again, if a run of them was given.
fn not_cut_in_words(heads: &[RunHead], given: &BTreeSet<Key>) -> Vec<String> {
    let told = not_cut(heads).filter(|&(earlier, later)| is_among(given, earlier) || is_among(given, later));
    let in_words = |(earlier, later): (&RunHead, &RunHead)| {
        format!(
            "run {} of rig {} goes on with run {}, which is in the fleet with the presses that were done again: ingest the recordings of both together",
            later.run, later.rig, earlier.run
        )
    };
    told.map(in_words).collect()
}

/// Warns of collections that have frames of a run, if one of both was written; a sentence for each rig.
fn collected_too_in_words(heads: &[RunHead], written: &BTreeSet<Key>) -> Vec<String> {
    let mut by_rig: BTreeMap<&str, Vec<(&RunHead, &RunHead)>> = BTreeMap::new();
    for (collection, run) in collected_too(heads) {
        if is_among(written, collection) || is_among(written, run) {
            by_rig.entry(&collection.rig).or_default().push((collection, run));
        }
    }
    let in_words = |(rig, pairs): (&str, Vec<(&RunHead, &RunHead)>)| {
        let files = number_of(pairs.len() as u64, "file");
        let (collection, run) = pairs.first()?;
        Some(format!(
            "rig {rig}: frames are in the fleet twice, in runs and in {files} of `tactus collect`, such as those of {} in {}. Surveys leave these files out; queries do with WHERE experiment IS DISTINCT FROM 'collect'",
            run.run, collection.run
        ))
    };
    by_rig.into_iter().filter_map(in_words).collect()
}

fn is_among(keys: &BTreeSet<Key>, head: &RunHead) -> bool {
    keys.contains(&(head.rig.clone(), head.run.clone()))
}

/// Name of the folder that a rig's files are in.
fn folder_of_rig(place: &Place, rig: &str) -> Option<String> {
    place.in_fleet(&place.of_run(rig, "", "")).into_iter().next()
}

/// Rig and run of a file in the fleet, as its path has them, and the date.
fn parts(place: &Place, path: &StorePath) -> Option<([String; 2], String)> {
    let [rig, date, run] = <[String; 3]>::try_from(place.in_fleet(path)).ok()?;
    let date = date.strip_prefix("date=")?.to_owned();
    Some(([rig, run], date))
}
