//! `runs`, `rerun`: finds, marks, compares and repeats recorded runs.

use std::path::Path;

use serde_json::{Map, Value, json};
use tactus_plan::{Arguments, Script};
use tactus_runs::{Comparison, ListedRun, RunEntry, Runs, RunsError, RunsFolder, again, beside, mark};

use super::run::{self, Subject};
use crate::cli::{Common, LeaseArgs, RerunArgs, RunArgs, RunSubject, RunsArgs, RunsCommand};
use crate::exit::{Exit, Failure};
use crate::output::{duration, print_fields, print_table, say};
use crate::progress::Busy;

pub(crate) fn runs(common: &Common, args: &RunsArgs) -> anyhow::Result<Exit> {
    let folder = &args.runs;
    if args.command.is_some() && !(args.words.is_empty() && args.tag.is_empty()) {
        let error = "words and --tag search the list: leave them out with tag, note and compare, or write `--` before words";
        return Err(Failure::new(Exit::Usage, error).into());
    }
    match &args.command {
        None => list(common, args),
        Some(RunsCommand::Tag { run, tags, remove }) => {
            let marked = mark(found(folder, run)?, |notes| {
                let mut kept = std::mem::take(&mut notes.tags);
                kept.retain(|tag| !tags.contains(tag));
                if !remove {
                    kept.extend(tags.iter().cloned());
                }
                notes.set_tags(kept);
            })?;
            Ok(told(common, &marked))
        }
        Some(RunsCommand::Note { run, text }) => {
            let marked = mark(found(folder, run)?, |notes| notes.note.clone_from(text))?;
            Ok(told(common, &marked))
        }
        Some(RunsCommand::Compare { ids }) => {
            Ok(compared(common, &RunsFolder::new(folder).compare(ids).map_err(failure)?))
        }
    }
}

/// The only run with this id.
fn found(folder: &Path, id: &str) -> anyhow::Result<ListedRun> {
    RunsFolder::new(folder).find(id).map_err(failure)
}

/// Runs that cannot be found are told as a wrong use.
fn failure(error: RunsError) -> anyhow::Error {
    if error.is_usage() { Failure::new(Exit::Usage, error).into() } else { error.into() }
}

fn list(common: &Common, args: &RunsArgs) -> anyhow::Result<Exit> {
    let listed =
        Busy::with("reading new recordings", common.json).reads(|| RunsFolder::new(&args.runs).runs());
    let Runs { runs: mut all, unreadable } = listed.map_err(failure)?;
    for error in unreadable {
        eprintln!("tactus: {error}");
    }
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
            ("file", beside(&run.entry.path).display().to_string()),
        ]);
    }
    Exit::Done
}

/// A row for each setting and result; the runs' values in their order.
fn compared(common: &Common, comparison: &Comparison) -> Exit {
    let Comparison { runs, facts } = comparison;
    if common.json {
        let values = |wanted: bool| {
            let facts = facts.iter().filter(|fact| fact.differs == wanted);
            facts.map(|fact| (fact.name.clone(), json!(fact.values))).collect::<Map<String, Value>>()
        };
        say(&json!({ "runs": runs, "differ": values(true), "same": values(false) }).to_string());
        return Exit::Done;
    }
    let different = facts.iter().filter(|fact| fact.differs);
    let different: Vec<Vec<String>> =
        different.map(|fact| [vec![fact.name.clone()], fact.values.clone()].concat()).collect();
    let header: Vec<&str> = std::iter::once("DIFFERENT").chain(runs.iter().map(String::as_str)).collect();
    print_table(&header, &different);
    let same = facts.iter().filter(|fact| !fact.differs);
    let same: Vec<String> = same
        .map(|fact| format!("{} {}", fact.name, fact.values.first().map_or("-", String::as_str)))
        .collect();
    say(&format!("the same: {}", same.join(", ")));
    Exit::Done
}

/// Makes the experiment of an earlier run again: all of it, with its script, parameters and seed.
pub(crate) fn rerun(common: &Common, args: &RerunArgs) -> anyhow::Result<Exit> {
    let found = found(&args.runs, &args.run)?;
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
    let again = again(recording)?;
    if again.had_truth {
        eprintln!(
            "tactus: the run was simulated with a --truth: give the same file again, or its readings will differ"
        );
    }
    let script = Script::parse(&again.script, &again.source);
    let script = script.map_err(|error| Failure::new(Exit::Failed, error))?;
    let arguments = Arguments::from_json(&again.parameters_json);
    let arguments = arguments.map_err(|error| Failure::new(Exit::Failed, error))?;
    Ok(Subject::Experiment { script, arguments, seed: Some(again.seed) })
}
