//! `run`: runs one experiment on the service or on the embedded simulated rig, and writes a report.

mod embedded;
mod served;

use std::path::{Path, PathBuf};

use anyhow::Context;
use serde_json::json;
use tactus_plan::{Arguments, Script};
use tactus_runner::experiments::{self, ExperimentError};
use tactus_schema::{pb, with_message};

use crate::cli::{Common, RunArgs};
use crate::connection;
use crate::exit::{Exit, Failure, at_source, in_words};
use crate::output::{duration, print_fields, say};
use crate::progress::{Busy, RunProgress};

/// How a run ended.
pub(super) struct RunSummary {
    pub(super) run_id: String,
    pub(super) experiment: String,
    pub(super) exit_status: pb::ExitStatus,
    pub(super) message: String,
    pub(super) simulated: bool,
    pub(super) embedded: bool,
    pub(super) frames: u64,
    pub(super) frames_lost: u64,
    pub(super) presses: u32,
    pub(super) dwells: u32,
    pub(super) duration_s: f64,
    pub(super) recording: PathBuf,
    /// What it took over from the earlier run that it goes on with. The counts above are without it.
    pub(super) taken_over: Option<pb::TakenOver>,
}

/// What is to be run.
#[expect(clippy::large_enum_variant, reason = "there is one of it")]
pub(super) enum Subject {
    Experiment {
        script: Script,
        arguments: Arguments,
        seed: Option<u64>,
    },
    /// The rest of the run with this id.
    Rest(String),
}

pub(crate) fn run(common: &Common, args: &RunArgs) -> anyhow::Result<Exit> {
    run_subject(common, args, Subject::of(args)?)
}

/// Runs, writes the report, and says how it ended.
pub(super) fn run_subject(common: &Common, args: &RunArgs, subject: Subject) -> anyhow::Result<Exit> {
    let summary = execute_at_source(common, args, subject, None)?;
    let report = if args.no_report {
        None
    } else {
        Busy::with("writing the report", common.json).reads(|| make_report(&summary, &args.out))
    };
    if common.json {
        say(&to_json(&summary, report.as_deref()).to_string());
    } else {
        print(&summary, report.as_deref());
    }
    Ok(Exit::of_run(summary.exit_status))
}

/// Runs the experiment as a part of something greater, on the service if there is one, else embedded. A person sees its progress
/// under the title `part`, and nothing else.
pub(super) fn execute_part(common: &Common, args: &RunArgs, part: &str) -> anyhow::Result<RunSummary> {
    execute_at_source(common, args, Subject::of(args)?, Some(part))
}

/// An error in the script is told with its line.
fn execute_at_source(
    common: &Common,
    args: &RunArgs,
    subject: Subject,
    part: Option<&str>,
) -> anyhow::Result<RunSummary> {
    let script = match &subject {
        Subject::Experiment { script, .. } => Some((script.name().to_owned(), script.source().to_owned())),
        Subject::Rest(_) => None,
    };
    let told = Told { is_silent: common.json, part };
    execute_subject(common, args, subject, told).map_err(|error| match &script {
        Some((name, source)) => at_source(&error, name, source),
        None => error,
    })
}

fn execute_subject(
    common: &Common,
    args: &RunArgs,
    subject: Subject,
    told: Told<'_>,
) -> anyhow::Result<RunSummary> {
    if args.embedded || args.rig_file.is_some() {
        return embedded::run(args, subject, "as asked", told);
    }
    let runtime = connection::runtime()?;
    match runtime.block_on(connection::find(common))? {
        Some(_) if args.truth.is_some() => {
            let error = format!(
                "--truth is for the embedded rig; the service at {} has devices of its own: add --embedded",
                common.endpoint
            );
            Err(Failure::new(Exit::Usage, error).into())
        }
        Some(client) => runtime.block_on(served::run(client, args, subject, told)),
        None => embedded::run(args, subject, &format!("no service at {}", common.endpoint), told),
    }
}

/// What a person is told while it runs.
#[derive(Debug, Clone, Copy)]
struct Told<'a> {
    /// Nothing: a program reads.
    is_silent: bool,
    /// Only the progress, under this title.
    part: Option<&'a str>,
}

impl Told<'_> {
    fn has_words(self) -> bool {
        !self.is_silent && self.part.is_none()
    }

    fn progress(self) -> RunProgress {
        RunProgress::new(self.is_silent, &self.part.map_or_else(String::new, |part| format!("{part}  ")))
    }
}

impl Subject {
    fn of(args: &RunArgs) -> anyhow::Result<Self> {
        let subject = &args.subject;
        match (&subject.continue_run, &subject.experiment) {
            (Some(run_id), _) => Ok(Self::Rest(run_id.clone())),
            (None, Some(name)) => {
                let (script, arguments) = experiment(name, &subject.parameters)?;
                Ok(Self::Experiment { script, arguments, seed: subject.seed })
            }
            (None, None) => Err(Failure::new(Exit::Usage, "name an experiment").into()),
        }
    }
}

/// The script and its parameters from the command line.
pub(super) fn experiment(name: &str, parameters: &[String]) -> anyhow::Result<(Script, Arguments)> {
    let script = experiments::find(name, None).map_err(|error| unusable(name, error))?;
    let mut arguments = Arguments::default();
    for parameter in parameters {
        arguments.set(parameter).map_err(|error| Failure::new(Exit::Usage, error))?;
    }
    Ok((script, arguments))
}

/// Why there is no such script: with its line, if it has an error.
fn unusable(name: &str, error: ExperimentError) -> anyhow::Error {
    let is_of_script = matches!(error, ExperimentError::Script(_));
    let error = Failure::new(Exit::Usage, error).into();
    let path = Path::new(name);
    match (path.file_stem(), std::fs::read_to_string(path)) {
        (Some(stem), Ok(source)) if is_of_script => at_source(&error, &stem.to_string_lossy(), &source),
        _ => error,
    }
}

/// Writes the report of a run: beside the recording of the embedded rig; for a run on a service into the run's folder in `out`,
/// because a client writes to no path that came over the bus.
fn make_report(summary: &RunSummary, out: &Path) -> Option<PathBuf> {
    let recording = &summary.recording;
    let made = if summary.embedded {
        write_report(recording, &recording.with_file_name("report.html"))
    } else {
        folder_of(&summary.run_id, out).and_then(|folder| {
            anyhow::ensure!(recording.is_file(), "the recording is not on this machine");
            std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
            write_report(recording, &folder.join("report.html"))
        })
    };
    match made {
        Ok(path) => Some(path),
        Err(error) => {
            let (why, file) = (in_words(&error), recording.display());
            eprintln!("tactus: no report was written: {why}; try `tactus report {file}`");
            None
        }
    }
}

/// The folder of a run in `out`.
///
/// # Errors
/// If the run's id is no plain file name.
fn folder_of(run_id: &str, out: &Path) -> anyhow::Result<PathBuf> {
    let plain = |c: char| !c.is_control() && c != '/' && c != '\\';
    let is_plain = !run_id.is_empty() && !run_id.starts_with('.') && run_id.chars().all(plain);
    anyhow::ensure!(is_plain, "the service names the run {run_id:?}, which is no name for a folder");
    Ok(out.join(run_id))
}

/// Writes the report of a recording and returns its absolute path.
pub(super) fn write_report(recording: &Path, path: &Path) -> anyhow::Result<PathBuf> {
    let report = tactus_report::run_report(recording)?;
    std::fs::write(path, tactus_report::render_html(&report)).with_context(|| path.display().to_string())?;
    Ok(std::path::absolute(path)?)
}

fn to_json(summary: &RunSummary, report: Option<&Path>) -> serde_json::Value {
    json!({
        "run_id": summary.run_id,
        "experiment": summary.experiment,
        "exit_status": summary.exit_status.word(),
        "message": summary.message,
        "simulated": summary.simulated,
        "embedded": summary.embedded,
        "frames": summary.frames,
        "frames_lost": summary.frames_lost,
        "presses": summary.presses,
        "dwells": summary.dwells,
        "duration_s": summary.duration_s,
        "recording": summary.recording,
        "report": report,
        "continues": summary.taken_over.as_ref().map(|taken| &taken.run_id),
        "presses_taken_over": summary.taken_over.as_ref().map(|taken| taken.presses),
        "dwells_taken_over": summary.taken_over.as_ref().map(|taken| taken.dwells),
    })
}

/// The line that says what a run takes over; `planned` presses are left.
fn taken_over_in_words(taken: &pb::TakenOver, planned: u32) -> String {
    let pb::TakenOver { run_id, presses, .. } = taken;
    format!("continues {run_id}, {presses} of {} presses taken over", presses.saturating_add(planned))
}

fn print(summary: &RunSummary, report: Option<&Path>) {
    let simulated = if summary.simulated { " (SIMULATED)" } else { "" };
    let mut fields = vec![
        ("run", format!("{}{simulated}", summary.run_id)),
        ("ended", with_message(summary.exit_status.word(), &summary.message)),
        ("presses", presses_in_words(summary)),
        ("frames", format!("{}, {} lost", summary.frames, summary.frames_lost)),
        ("duration", duration(summary.duration_s)),
        ("recording", summary.recording.display().to_string()),
    ];
    if let Some(taken) = &summary.taken_over {
        fields.insert(1, ("continues", taken.run_id.clone()));
    }
    if let Some(report) = report {
        fields.push(("report", report.display().to_string()));
    }
    if let Some(next) = next_command(summary) {
        fields.push(("next", next));
    }
    print_fields(&fields);
}

/// The command that a person is likely to want after the run.
fn next_command(summary: &RunSummary) -> Option<String> {
    let recording = summary.recording.display();
    match summary.exit_status {
        pb::ExitStatus::Done | pb::ExitStatus::Degraded => {
            Some(format!("`tactus export {recording}` writes its table; `tactus runs` lists all runs"))
        }
        pb::ExitStatus::Stopped | pb::ExitStatus::Failed | pb::ExitStatus::Crashed => {
            let embedded = if summary.embedded { " --embedded" } else { "" };
            Some(format!("`tactus run --continue {}{embedded}` goes on with it", summary.run_id))
        }
        pb::ExitStatus::Unspecified | pb::ExitStatus::Aborted | pb::ExitStatus::Refused => None,
    }
}

fn presses_in_words(summary: &RunSummary) -> String {
    let now = format!("{}, {} dwells", summary.presses, summary.dwells);
    match &summary.taken_over {
        Some(taken) => format!("{now}; {}, {} dwells taken over", taken.presses, taken.dwells),
        None => now,
    }
}

#[cfg(test)]
#[path = "run_tests.rs"]
mod tests;
