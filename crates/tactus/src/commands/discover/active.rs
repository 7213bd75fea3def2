//! `discover --active`: runs experiments that distinguish the remaining explanations, and analyses again.

use std::path::PathBuf;

use anyhow::bail;
use tactus_discover::{Discovery, NextExperiment, Verdict};
use tactus_model::effect::Definition;
use tactus_report::discovery::{ActiveRun, AmbiguousEffect, command, nothing_open, open};
use tactus_runner::config;
use tactus_runner::embedded::SIMULATED_RIG;
use tactus_schema::Rig;
use tactus_schema::pb::ExitStatus;

use super::settled::{self, Settled};
use super::{Discovered, LiveRig};
use crate::cli::{Common, DiscoverArgs, ExperimentArgs, LeaseArgs, RunArgs, RunSubject};
use crate::commands::run::{RunSummary, execute_part};
use crate::connection;
use crate::exit::{Exit, Failure};
use crate::output::{duration, say};

/// Runs experiments on the service or on the embedded rig.
struct ExperimentRunner<'a> {
    common: &'a Common,
    args: &'a DiscoverArgs,
    live: LiveRig,
    /// Remaining rig time.
    budget_s: f64,
    /// Number of experiments so far.
    runs: u64,
}

/// An experiment that was chosen.
#[derive(Debug, Clone, PartialEq)]
struct ChosenExperiment {
    experiment: String,
    parameters: Vec<(&'static str, String)>,
    /// The seed of its rehearsal; `None` if it was not rehearsed.
    seed: Option<u64>,
    duration_s: f64,
    separates: [String; 2],
    expected_z: Option<f64>,
}

pub(super) fn discover(
    common: &Common,
    args: &DiscoverArgs,
    analyse: impl Fn(&[PathBuf], Option<&LiveRig>, &[&'static Definition]) -> anyhow::Result<Discovered>,
) -> anyhow::Result<Discovered> {
    let mut runner = ExperimentRunner::find(common, args)?;
    let mut files = args.files.clone();
    if files.is_empty() {
        files.push(
            runner.run(&ChosenExperiment::diagnose((runner.budget_s / 2.0 / DIAGNOSE_S).min(1.0)))?.recording,
        );
    }
    let mut discovered = analyse(&files, Some(&runner.live), &[])?;
    let mut active: Vec<ActiveRun> = Vec::new();
    let mut settled: Vec<Settled> = Vec::new();
    let mut active_ended = None;
    for nth in 1..=args.rounds {
        let chosen = match choose(&discovered.discovery, runner.budget_s, &active) {
            Ok(chosen) => chosen,
            Err(why) => {
                let why = format!("Round {nth} of {} runs nothing: {why}.", args.rounds);
                runner.say(&why);
                active_ended = Some(why);
                break;
            }
        };
        runner.say(&format!("Round {nth} of {}:", args.rounds));
        let before = undecided(&discovered.discovery);
        let mut round = Vec::new();
        for chosen in chosen {
            let summary = runner.run(&chosen)?;
            round.push(ActiveRun {
                experiment: chosen.experiment,
                parameters: chosen.parameters,
                recording: summary.run_id,
                duration_s: summary.duration_s,
                separates: chosen.separates,
                expected_z: chosen.expected_z,
                before: before.clone(),
                after: Vec::new(),
            });
            files.push(summary.recording);
        }
        let new = &files[files.len() - round.len()..];
        if let Some(one) = settled::settle(&discovered, new)? {
            runner.say(&one.in_words);
            settled.push(one);
        }
        let holding: Vec<&'static Definition> = settled.iter().filter_map(|one| one.holding).collect();
        discovered = analyse(&files, Some(&runner.live), &holding)?;
        let after = undecided(&discovered.discovery);
        active.extend(round.into_iter().map(|run| ActiveRun { after: after.clone(), ..run }));
    }
    let (files, in_words) = settled.into_iter().map(|one| (one.file, one.in_words)).unzip();
    Ok(Discovered { active, active_ended, settled: files, settled_in_words: in_words, ..discovered })
}

/// The best affordable experiment for each undecided pair; `diagnose` if there is none and something is unexplained.
///
/// # Errors
/// Why there is nothing to run.
fn choose(found: &Discovery, budget_s: f64, done: &[ActiveRun]) -> Result<Vec<ChosenExperiment>, String> {
    let mut chosen: Vec<ChosenExperiment> = Vec::new();
    let undecided = found.plan.open.iter().filter(|one| one.separates[1] != "nothing");
    let mut reasons: Vec<String> = undecided.map(|one| lowered(&open(one))).collect();
    let mut left_s = budget_s;
    let mut answered: Vec<&[String; 2]> = Vec::new();
    let is_done = |one: &ChosenExperiment| {
        done.iter().any(|run| run.experiment == one.experiment && run.parameters == one.parameters)
    };
    for next in found.plan.next.iter().filter(|next| next.separates[1] != "nothing") {
        let one = ChosenExperiment::of(next);
        if answered.contains(&&next.separates) {
            continue;
        }
        if chosen.iter().any(|other| other.is_same(&one)) {
            answered.push(&next.separates);
        } else if is_done(&one) {
            reasons.push(format!("`{}` was run already", one.command()));
        } else if one.duration_s > left_s {
            reasons.push(format!(
                "`{}` takes {}, and {} of the budget are left",
                one.command(),
                duration(one.duration_s),
                duration(left_s)
            ));
        } else {
            answered.push(&next.separates);
            left_s -= one.duration_s;
            chosen.push(one);
        }
    }
    if !chosen.is_empty() {
        return Ok(chosen);
    }
    if reasons.is_empty() {
        reasons.push(nothing_open(found).to_owned());
    }
    if matches!(found.verdict, Verdict::CannotJudge | Verdict::Unexplained | Verdict::PartlyExplained) {
        let scale = (budget_s / DIAGNOSE_S).min(1.0);
        let one = ChosenExperiment::diagnose((100.0 * scale).floor() / 100.0);
        if done.iter().any(|run| run.experiment == one.experiment) {
            reasons.push("`tactus run diagnose` was run already".to_owned());
        } else if scale < DIAGNOSE_SCALE_LEAST {
            reasons
                .push(format!("the budget of {} is too short for `tactus run diagnose`", duration(budget_s)));
        } else {
            return Ok(vec![one]);
        }
    }
    Err(reasons.join("; "))
}

/// A sentence as part of another one.
fn lowered(sentence: &str) -> String {
    let mut letters = sentence.trim_end_matches('.').chars();
    letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect())
}

/// Least `scale` of a `diagnose` that is worth its time.
const DIAGNOSE_SCALE_LEAST: f64 = 0.1;

/// Approximate duration of `diagnose` at scale 1.
const DIAGNOSE_S: f64 = 1100.0;

impl ChosenExperiment {
    fn of(next: &NextExperiment) -> Self {
        Self {
            experiment: next.experiment.clone(),
            parameters: next.parameters.clone(),
            seed: Some(next.seed),
            duration_s: next.duration_s,
            separates: next.separates.clone(),
            expected_z: next.expected_z,
        }
    }

    fn diagnose(scale: f64) -> Self {
        let parameters = if scale < 1.0 { vec![("scale", scale.to_string())] } else { Vec::new() };
        Self {
            experiment: "diagnose".into(),
            parameters,
            seed: None,
            duration_s: scale * DIAGNOSE_S,
            separates: ["what is missing".into(), "noise".into()],
            expected_z: None,
        }
    }

    fn is_same(&self, other: &Self) -> bool {
        self.experiment == other.experiment && self.parameters == other.parameters
    }

    fn command(&self) -> String {
        command(&self.experiment, &self.parameters)
    }
}

fn undecided(found: &Discovery) -> Vec<AmbiguousEffect> {
    let of = |step: &tactus_discover::AddedEffect| AmbiguousEffect {
        effect: step.effect,
        equivalent: step.equivalent.clone(),
    };
    found.steps.iter().map(of).collect()
}

impl<'a> ExperimentRunner<'a> {
    /// Finds the service's rig or the embedded one, and prints which.
    fn find(common: &'a Common, args: &'a DiscoverArgs) -> anyhow::Result<Self> {
        if !(args.budget_min > 0.0 && args.budget_min.is_finite()) {
            let error = format!("--budget-min must be above 0, not {}", args.budget_min);
            return Err(Failure::new(Exit::Usage, error).into());
        }
        let asked = args.embedded || args.rig_file.is_some();
        let served = if asked {
            None
        } else {
            let client = connection::runtime()?.block_on(connection::find(common))?;
            client.map(|client| client.rig().to_owned())
        };
        let (live, first_line) = if let Some(name) = served {
            let line = format!("experiments run on the service at {} (rig {name:?})", common.endpoint);
            (LiveRig { name, rig: None }, line)
        } else {
            let rig = match &args.rig_file {
                Some(path) => config::load_rig(path).map_err(|error| Failure::new(Exit::Usage, error))?.rig,
                None => Rig::from_toml(SIMULATED_RIG)?,
            };
            let why = if asked { "as asked".into() } else { format!("no service at {}", common.endpoint) };
            let line =
                format!("SIMULATED: experiments run on the embedded simulated rig {:?} ({why})", rig.name);
            (LiveRig { name: rig.name.clone(), rig: Some(rig) }, line)
        };
        let runner = Self { common, args, live, budget_s: 60.0 * args.budget_min, runs: 0 };
        runner.say(&first_line);
        Ok(runner)
    }

    /// Says a line to a person.
    fn say(&self, line: &str) {
        if !self.common.json {
            say(line);
        }
    }

    fn run(&mut self, chosen: &ChosenExperiment) -> anyhow::Result<RunSummary> {
        let command = chosen.command();
        let [one, other] = &chosen.separates;
        let expected = chosen.expected_z.map_or_else(String::new, |z| format!(", by {z:.1} standard errors"));
        self.say(&format!(
            "{command}: to distinguish {one} from {other}{expected}; {}",
            duration(chosen.duration_s)
        ));
        let parameters = chosen.parameters.iter().map(|(name, value)| format!("{name}={value}"));
        let args = RunArgs {
            subject: RunSubject::from(ExperimentArgs {
                experiment: chosen.experiment.clone(),
                parameters: parameters.collect(),
                seed: Some(chosen.seed.unwrap_or_else(|| self.args.seed.wrapping_add(self.runs))),
            }),
            embedded: self.live.rig.is_some(),
            rig_file: self.args.rig_file.clone(),
            truth: self.args.truth.clone(),
            real_time: false,
            out: self.args.out.join("runs"),
            who: self.args.who.clone(),
            no_report: true,
            lease: LeaseArgs::default(),
        };
        let summary = execute_part(self.common, &args, &chosen.experiment)?;
        if !matches!(summary.exit_status, ExitStatus::Done | ExitStatus::Degraded) {
            bail!(Failure::new(Exit::of_run(summary.exit_status), format!("{command}: {}", summary.message)));
        }
        self.runs += 1;
        self.budget_s -= summary.duration_s;
        Ok(summary)
    }
}

#[cfg(test)]
#[path = "active_tests.rs"]
mod tests;
