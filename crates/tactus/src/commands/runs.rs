//! `runs`, `rerun`: finds, marks, compares and repeats recorded runs.

mod compare;
mod index;
mod notes;

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use serde_json::{Value, json};
use tactus_plan::{Arguments, Script};
use tactus_record::Timeline;

use super::run::{self, Subject};
use crate::cli::{Common, LeaseArgs, RerunArgs, RunArgs, RunSubject, RunsArgs, RunsCommand};
use crate::exit::{Exit, Failure};
use crate::output::{duration, print_fields, print_table, say};
use index::RunEntry;
use notes::Notes;

/// Where the installed service records.
const INSTALLED: &str = "/var/lib/tactus/runs";

/// A run and what people wrote about it.
struct ListedRun {
    entry: RunEntry,
    notes: Notes,
}

pub(crate) fn runs(common: &Common, args: &RunsArgs) -> anyhow::Result<Exit> {
    let folder = &args.runs;
    match &args.command {
        None => list(common, args),
        Some(RunsCommand::Tag { run, tags, remove }) => {
            let found = find(folder, run)?;
            let notes = notes::change(&found.entry.path, |notes| {
                notes.tags.retain(|tag| !tags.contains(tag));
                if !remove {
                    notes.tags.extend(tags.iter().cloned());
                    notes.tags.sort();
                    notes.tags.dedup();
                }
            })?;
            Ok(told(common, &ListedRun { notes, ..found }))
        }
        Some(RunsCommand::Note { run, text }) => {
            let found = find(folder, run)?;
            let notes = notes::change(&found.entry.path, |notes| notes.note.clone_from(text))?;
            Ok(told(common, &ListedRun { notes, ..found }))
        }
        Some(RunsCommand::Compare { ids }) => {
            let found = ids.iter().map(|run| find(folder, run)).collect::<anyhow::Result<Vec<_>>>()?;
            compare::compare(common, &found)
        }
    }
}

fn list(common: &Common, args: &RunsArgs) -> anyhow::Result<Exit> {
    let mut all = read(&args.runs)?;
    let total = all.len();
    all.retain(|run| args.words.iter().all(|word| run.contains(word)));
    all.retain(|run| args.tag.iter().all(|tag| run.notes.tags.contains(tag)));
    if common.json {
        say(&json!({ "runs": all.iter().map(ListedRun::to_json).collect::<Vec<_>>() }).to_string());
        return Ok(Exit::Done);
    }
    let header = ["RUN", "EXPERIMENT", "RIG", "DURATION", "STATUS", "PRESSES", "LOST", "TAGS", "NOTE"];
    print_table(&header, &all.iter().map(row).collect::<Vec<_>>());
    say(&format!("{} of {total} runs in {}", all.len(), args.runs.display()));
    if let Some(last) = all.last() {
        let (id, file) = (&last.entry.run_id, last.entry.path.display());
        say(&format!(
            "`tactus runs note {id} TEXT` writes a note, `tactus rerun {id}` repeats it, `tactus record info {file}` says all"
        ));
    }
    Ok(Exit::Done)
}

fn row(ListedRun { entry, notes }: &ListedRun) -> Vec<String> {
    let simulated = if entry.simulated { " (SIMULATED)" } else { "" };
    vec![
        entry.run_id.clone(),
        entry.experiment.clone(),
        format!("{}{simulated}", entry.rig),
        duration(entry.duration_s),
        entry.exit_status.clone().unwrap_or_else(|| "open".to_owned()),
        entry.presses.to_string(),
        (entry.frames_lost + entry.frames_missing).to_string(),
        notes.tags.join(" "),
        notes.note.lines().next().unwrap_or_default().to_owned(),
    ]
}

fn told(common: &Common, run: &ListedRun) -> Exit {
    if common.json {
        say(&run.to_json().to_string());
    } else {
        print_fields(&[
            ("run", run.entry.run_id.clone()),
            ("tags", run.notes.tags.join(" ")),
            ("note", run.notes.note.clone()),
            ("file", notes::beside(&run.entry.path).display().to_string()),
        ]);
    }
    Exit::Done
}

impl ListedRun {
    /// True if a word stands in anything that is known of the run, whatever its case.
    fn contains(&self, word: &str) -> bool {
        let word = word.to_lowercase();
        let Self { entry, notes } = self;
        let status = entry.exit_status.as_deref().unwrap_or("open");
        let texts = [
            &*entry.run_id,
            &entry.experiment,
            &entry.rig,
            &entry.who,
            &entry.started,
            &entry.message,
            status,
            &notes.note,
        ];
        let tags = notes.tags.iter().map(String::as_str);
        texts.into_iter().chain(tags).any(|text| text.to_lowercase().contains(&word))
    }

    fn to_json(&self) -> Value {
        let mut value = json!(self.entry);
        value["tags"] = json!(self.notes.tags);
        value["note"] = json!(self.notes.note);
        value
    }
}

/// All runs of a folder, in the order of their start.
fn read(folder: &Path) -> anyhow::Result<Vec<ListedRun>> {
    if !folder.is_dir() {
        let what = format!(
            "no folder {}: name the folder of the recordings with --runs DIR; the installed service records in {INSTALLED}",
            folder.display()
        );
        return Err(Failure::new(Exit::Usage, what).into());
    }
    let mut runs = Vec::new();
    for entry in index::entries(folder)? {
        let notes = notes::read(&entry.path)?;
        runs.push(ListedRun { entry, notes });
    }
    Ok(runs)
}

/// The run with this id, or the only one whose id contains it.
fn find(folder: &Path, id: &str) -> anyhow::Result<ListedRun> {
    let mut found = read(folder)?;
    if let Some(exact) = found.iter().position(|run| run.entry.run_id == id) {
        return Ok(found.swap_remove(exact));
    }
    found.retain(|run| !id.is_empty() && run.entry.run_id.contains(id));
    let ids: Vec<_> = found.iter().map(|run| run.entry.run_id.clone()).collect();
    match (found.pop(), found.is_empty()) {
        (Some(run), true) => Ok(run),
        (None, _) => {
            let what = format!("no run {id:?} in {}: `tactus runs` lists them", folder.display());
            Err(Failure::new(Exit::Usage, what).into())
        }
        (Some(_), false) => {
            Err(Failure::new(Exit::Usage, format!("{id:?} is one of {}: which?", ids.join(", "))).into())
        }
    }
}

/// Makes the experiment of an earlier run again: all of it, with its script, parameters and seed.
pub(crate) fn rerun(common: &Common, args: &RerunArgs) -> anyhow::Result<Exit> {
    let found = find(&args.runs, &args.run)?;
    let subject = subject(&found.entry.path)?;
    if !common.json {
        let RunEntry { run_id, rig, .. } = &found.entry;
        say(&format!("again {run_id}, which was on rig {rig:?}: its script, parameters and seed"));
    }
    let RerunArgs { embedded, rig_file, truth, real_time, out, who, no_report, lease, .. } = args.clone();
    let lease: LeaseArgs = lease;
    let subject_args =
        RunSubject { experiment: None, parameters: Vec::new(), seed: None, continue_run: None };
    let args =
        RunArgs { subject: subject_args, embedded, rig_file, truth, real_time, out, who, no_report, lease };
    run::run_subject(common, &args, subject)
}

fn subject(recording: &Path) -> anyhow::Result<Subject> {
    let timeline = Timeline::read(recording)?;
    let file = &timeline.run().script;
    let lacks = |what: &str| format!("{}: the recording lacks its {what}", recording.display());
    let source = timeline.attachment(file).with_context(|| lacks("script"))?;
    let source = std::str::from_utf8(source).with_context(|| lacks("script as text"))?;
    let started = timeline.started().with_context(|| lacks("start, with parameters and seed"))?;
    if timeline.run().simulated && timeline.attachment("rig.toml").is_none() {
        eprintln!(
            "tactus: the run was simulated with a --truth: give the same file again, or its readings will differ"
        );
    }
    let script = Script::parse(file, source).map_err(|error| Failure::new(Exit::Failed, error))?;
    let arguments = Arguments::from_json(&started.parameters_json);
    let arguments = arguments.map_err(|error| Failure::new(Exit::Failed, error))?;
    Ok(Subject::Experiment { script, arguments, seed: Some(started.seed) })
}

/// Refuses what is no tag: it must be found again by `--tag`.
pub(crate) fn tag(text: &str) -> Result<String, String> {
    let is_plain = !text.is_empty() && !text.chars().any(|c| c.is_whitespace() || c.is_control());
    if is_plain { Ok(text.to_owned()) } else { Err("a tag is one word".to_owned()) }
}

/// At least two.
fn several(runs: &[ListedRun]) -> anyhow::Result<Vec<PathBuf>> {
    if runs.len() < 2 {
        bail!("it takes two runs to compare");
    }
    Ok(runs.iter().map(|run| run.entry.path.clone()).collect())
}

#[cfg(test)]
#[path = "runs_tests.rs"]
mod tests;
