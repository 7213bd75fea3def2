//! The runs of a study. Completed runs are kept in a file, so that an interrupted study does not repeat them.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::Context;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use tactus_model::Covering;
use tactus_report::figures::COVERINGS;
use tactus_report::study::StudyRun;
use tactus_schema::pb::ExitStatus;

use crate::cli::{Common, ExperimentArgs, LeaseArgs, RunArgs, RunSubject, StudyArgs};
use crate::commands::run::execute_part;
use crate::exit::{Exit, Failure};
use crate::output::{duration, say};
use crate::progress::beside_runs;
use crate::sha256;

/// Name of the format of `study.json`.
const SCHEMA: &str = "tactus.study-steps/1";

/// The completed steps; kept in `study.json`.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct StudySteps {
    schema: String,
    // The arguments of the study; a study with others cannot continue this one.
    seed: u64,
    points: u32,
    embedded: bool,
    rig: Option<String>,
    /// SHA-256 of the rig file.
    rig_file: Option<String>,
    /// SHA-256 of the truth file.
    truth: Option<String>,
    taken: Vec<CompletedStep>,
    #[serde(skip)]
    path: PathBuf,
}

/// A completed run.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct CompletedStep {
    pub(super) step: String,
    pub(super) run_id: String,
    pub(super) presses: u32,
    pub(super) duration_s: f64,
    pub(super) embedded: bool,
    /// What was lost during the run, if anything.
    pub(super) degraded: Option<String>,
    pub(super) recording: PathBuf,
}

/// A run to make.
pub(super) struct StudyStep {
    pub(super) name: String,
    pub(super) experiment: &'static str,
    pub(super) parameters: Vec<String>,
    /// An embedded rig for this step only.
    pub(super) rig_file: Option<PathBuf>,
}

impl CompletedStep {
    pub(super) fn run(&self) -> StudyRun {
        StudyRun {
            name: self.step.clone(),
            run_id: self.run_id.clone(),
            presses: self.presses.into(),
            duration_s: self.duration_s,
            path: self.recording.display().to_string(),
        }
    }
}

impl StudySteps {
    /// Reads the completed steps from the study's folder; none in a new folder.
    ///
    /// # Errors
    /// If the folder holds a study with other arguments.
    pub(super) fn resume(common: &Common, args: &StudyArgs) -> anyhow::Result<Self> {
        let path = args.out.join("study.json");
        let new = Self {
            schema: SCHEMA.into(),
            seed: args.seed,
            points: args.points,
            embedded: args.embedded,
            rig: common.rig.clone(),
            rig_file: args.rig_file.as_deref().map(sha256::of_file).transpose()?,
            truth: args.truth.as_deref().map(sha256::of_file).transpose()?,
            taken: Vec::new(),
            path: path.clone(),
        };
        if !path.exists() {
            return Ok(new);
        }
        let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        let known: Self = serde_json::from_str(&text).with_context(|| {
            format!("{} is not a study's list of steps; give another --out", path.display())
        })?;
        let with = |steps: &Self| {
            let Self { schema, seed, points, embedded, rig, rig_file, truth, .. } = steps;
            (schema.clone(), *seed, *points, *embedded, rig.clone(), rig_file.clone(), truth.clone())
        };
        if with(&known) != with(&new) {
            let error = format!(
                "{} belongs to a study with another seed, rig, rig file, truth or number of points: give another --out, or the same arguments and files",
                path.display()
            );
            return Err(Failure::new(Exit::Usage, error).into());
        }
        Ok(Self { path, ..known })
    }

    /// Runs corners, element centres and the sweep under each covering.
    pub(super) fn measure(
        &mut self,
        common: &Common,
        args: &StudyArgs,
    ) -> anyhow::Result<Vec<CompletedStep>> {
        let plain = |name: &str, experiment| StudyStep {
            name: name.into(),
            experiment,
            parameters: Vec::new(),
            rig_file: None,
        };
        let mut steps = vec![plain("corners", "corners"), plain("element-centres", "element-centres")];
        steps.extend(COVERINGS.map(|Covering { thickness_mm }| StudyStep {
            parameters: vec![
                format!("coverings_mm=[{thickness_mm}]"),
                format!("points={}", args.points),
                // The paper's grid, whatever the number of points in it.
                format!("spacing_mm={}", 1.4 / f64::from(args.points - 1)),
            ],
            ..plain(&format!("sweep, {thickness_mm} mm"), "grid-sweep")
        }));
        self.take(common, args, &steps)
    }

    /// Runs the steps of a part of the study: on embedded rigs several at a time, on a service's rig one after the other.
    pub(super) fn take(
        &mut self,
        common: &Common,
        args: &StudyArgs,
        steps: &[StudyStep],
    ) -> anyhow::Result<Vec<CompletedStep>> {
        let are_embedded =
            args.embedded || args.rig_file.is_some() || steps.iter().all(|step| step.rig_file.is_some());
        let kept = Mutex::new(self);
        let take = |(index, step): (usize, &StudyStep)| {
            let part = format!("{} of {}, {}", index + 1, steps.len(), step.name);
            take_step(&kept, common, args, step, &part)
        };
        if are_embedded {
            steps.par_iter().enumerate().map(take).collect()
        } else {
            steps.iter().enumerate().map(take).collect()
        }
    }

    /// A completed step whose recording is still there.
    fn known(&self, name: &str) -> Option<CompletedStep> {
        self.taken.iter().find(|taken| taken.step == name && taken.recording.is_file()).cloned()
    }

    /// Adds a completed step and writes the list. A study that is killed meanwhile leaves the former list or this one.
    fn keep(&mut self, taken: &CompletedStep) -> anyhow::Result<()> {
        self.taken.retain(|known| known.step != taken.step);
        self.taken.push(taken.clone());
        let beside: &Path = &self.path.with_extension("json.new");
        fs::write(beside, serde_json::to_string_pretty(self)?)
            .with_context(|| beside.display().to_string())?;
        fs::rename(beside, &self.path).with_context(|| self.path.display().to_string())
    }
}

/// Runs a step, unless it is completed; `part` is the title of its progress.
fn take_step(
    kept: &Mutex<&mut StudySteps>,
    common: &Common,
    args: &StudyArgs,
    step: &StudyStep,
    part: &str,
) -> anyhow::Result<CompletedStep> {
    let known = kept.lock().unwrap_or_else(PoisonError::into_inner).known(&step.name);
    if let Some(known) = known {
        if !common.json {
            beside_runs(|| say(&format!("{}: already done, run {}", step.name, known.run_id)));
        }
        return Ok(known);
    }
    let rig_file = step.rig_file.as_ref().or(args.rig_file.as_ref());
    let summary = execute_part(
        common,
        &RunArgs {
            subject: RunSubject::from(ExperimentArgs {
                experiment: step.experiment.into(),
                parameters: step.parameters.clone(),
                seed: Some(args.seed),
            }),
            embedded: args.embedded,
            rig_file: rig_file.cloned(),
            truth: args.truth.clone(),
            real_time: false,
            out: args.out.join("runs"),
            who: args.who.clone(),
            no_report: true,
            lease: LeaseArgs::default(),
        },
        part,
    )
    .with_context(|| format!("step {:?}", step.name))?;
    if !matches!(summary.exit_status, ExitStatus::Done | ExitStatus::Degraded) {
        let error = format!(
            "step {:?} ended as {}: {}; the same command continues from there",
            step.name,
            summary.exit_status.word(),
            summary.message
        );
        return Err(Failure::new(Exit::of_run(summary.exit_status), error).into());
    }
    let taken = CompletedStep {
        step: step.name.clone(),
        run_id: summary.run_id,
        presses: summary.presses,
        duration_s: summary.duration_s,
        embedded: summary.embedded,
        degraded: (summary.exit_status == ExitStatus::Degraded)
            .then(|| format!("StudyStep {:?} is degraded: {}.", step.name, summary.message)),
        recording: std::path::absolute(&summary.recording)?,
    };
    if !common.json {
        let simulated = if summary.simulated { "SIMULATED, " } else { "" };
        let done = duration(taken.duration_s);
        beside_runs(|| {
            say(&format!("{}: {simulated}{} presses, {done} of the rig's time", step.name, taken.presses));
        });
    }
    kept.lock().unwrap_or_else(PoisonError::into_inner).keep(&taken)?;
    Ok(taken)
}
