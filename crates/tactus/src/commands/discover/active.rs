//! `discover --active`: runs experiments that distinguish the remaining explanations, and analyses again.

use std::path::PathBuf;

use anyhow::bail;
use tactus_discover::{Discovery, NextExperiment, Verdict};
use tactus_model::effect::{Definition, EffectError};
use tactus_report::discovery::{ActiveRun, AmbiguousEffect, command, nothing_open, open};
use tactus_runner::config;
use tactus_runner::embedded::SIMULATED_RIG;
use tactus_schema::draft::DraftStatus;
use tactus_schema::pb::ExitStatus;
use tactus_schema::{DraftFile, Rig};

use super::settled::{self, Settled};
use super::{Discovered, LiveRig};
use crate::cli::{Common, DiscoverArgs, ExperimentArgs, LeaseArgs, RunArgs, RunSubject};
use crate::commands::library::Held;
use crate::commands::plan::{self, PlannedRig};
use crate::commands::run::{RunSummary, execute_part};
use crate::exit::{Exit, Failure, in_words};
use crate::output::{duration, say};

/// Runs experiments on the service or on the embedded rig.
struct ExperimentRunner<'a> {
    common: &'a Common,
    args: &'a DiscoverArgs,
    live: LiveRig,
    /// The rig on whose twin experiments are planned: of a service, as it stands there.
    planned_on: Rig,
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

/// Discovers with experiments, and with the drafts of the lab's library that are in use.
pub(super) fn discover(
    common: &Common,
    args: &DiscoverArgs,
    library: &[Held],
    analyse: impl Fn(&[PathBuf], Option<&LiveRig>, &[&'static Definition]) -> anyhow::Result<Discovered>,
) -> anyhow::Result<Discovered> {
    let mut runner = ExperimentRunner::find(common, args)?;
    let mut files = args.files.clone();
    if files.is_empty() {
        files.push(runner.run(&runner.first()?)?.recording);
    }
    let mut drafts = Drafts::of(library)?;
    let mut discovered = analyse(&files, Some(&runner.live), &drafts.in_use)?;
    let mut active: Vec<ActiveRun> = Vec::new();
    let mut active_ended = None;
    for nth in 1..=args.rounds {
        let unconfirmed = drafts.unconfirmed(&discovered.discovery);
        let planned_s = |one: &ChosenExperiment| runner.planned_s(one);
        let chosen = match choose(&discovered.discovery, &unconfirmed, runner.budget_s, &active, &planned_s) {
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
            // One before it may have taken longer than it should.
            if chosen.duration_s > runner.budget_s {
                runner.say(&chosen.is_too_long(runner.budget_s));
                continue;
            }
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
        for one in settled::settle(&discovered, &unconfirmed, new)? {
            runner.say(&one.in_words);
            drafts.take(one)?;
        }
        discovered = analyse(&files, Some(&runner.live), &drafts.in_use)?;
        settled::renumber(&mut discovered.discovery, &drafts.refuted, &drafts.in_use)?;
        let after = undecided(&discovered.discovery);
        active.extend(round.into_iter().map(|run| ActiveRun { after: after.clone(), ..run }));
    }
    let Drafts { settled, remeasured, settled_in_words, .. } = drafts;
    Ok(Discovered { active, active_ended, settled, remeasured, settled_in_words, ..discovered })
}

/// The drafts of a discovery with experiments.
struct Drafts<'a> {
    library: &'a [Held],
    /// Those that an analysis tries.
    in_use: Vec<&'static Definition>,
    /// Names of those that experiments have refuted.
    refuted: Vec<String>,
    /// Drafts of this discovery of which experiments have told.
    settled: Vec<DraftFile>,
    /// The same of the library.
    remeasured: Vec<Held>,
    settled_in_words: Vec<String>,
}

impl<'a> Drafts<'a> {
    fn of(library: &'a [Held]) -> anyhow::Result<Self> {
        let in_use = library.iter().map(|one| one.draft.define()).collect::<Result<_, _>>()?;
        Ok(Self {
            library,
            in_use,
            refuted: Vec::new(),
            settled: Vec::new(),
            remeasured: Vec::new(),
            settled_in_words: Vec::new(),
        })
    }

    /// Those of the library that a discovery names and no measurement has confirmed yet.
    fn unconfirmed(&self, found: &Discovery) -> Vec<&'a Held> {
        let is_named = |one: &&Held| found.steps.iter().any(|step| step.effect == one.draft.draft.name);
        let is_open = |one: &&Held| {
            one.draft.status.is_open() && self.remeasured.iter().all(|other| other.path != one.path)
        };
        self.library.iter().filter(is_named).filter(is_open).collect()
    }

    /// Takes what an experiment tells of a draft.
    fn take(&mut self, told: Settled) -> Result<(), EffectError> {
        self.settled_in_words.push(told.in_words);
        let Some(file) = told.file else { return Ok(()) };
        let name = &file.draft.name;
        if file.status == DraftStatus::Refuted {
            self.in_use.retain(|one| one.name != name);
            self.refuted.push(name.clone());
        } else if told.held_at.is_none() {
            self.in_use.push(file.define()?);
        }
        match told.held_at {
            Some(path) => self.remeasured.push(Held { path, draft: file }),
            None => self.settled.push(file),
        }
        Ok(())
    }
}

/// How long an experiment would take on the rig, in seconds, or why nobody can tell.
type PlannedSeconds<'a> = &'a dyn Fn(&ChosenExperiment) -> Result<f64, String>;

/// The best affordable experiment for each undecided pair; `diagnose` if there is none and a draft of the library is unconfirmed or something is
/// unexplained.
///
/// # Errors
/// Why there is nothing to run.
fn choose(
    found: &Discovery,
    unconfirmed: &[&Held],
    budget_s: f64,
    done: &[ActiveRun],
    planned_s: PlannedSeconds<'_>,
) -> Result<Vec<ChosenExperiment>, String> {
    let mut chosen: Vec<ChosenExperiment> = Vec::new();
    let undecided = found.plan.open.iter().filter(|one| one.separates[1] != "nothing");
    let mut reasons: Vec<String> = undecided.map(|one| lowered(&open(one))).collect();
    let mut left_s = budget_s;
    let mut answered: Vec<&[String; 2]> = Vec::new();
    for next in found.plan.next.iter().filter(|next| next.separates[1] != "nothing") {
        let one = ChosenExperiment::of(next, done);
        if answered.contains(&&next.separates) {
            continue;
        }
        if chosen.iter().any(|other| other.is_same(&one)) {
            answered.push(&next.separates);
        } else if one.is_done(done) {
            reasons.push(format!("`{}` was run already", one.command()));
        } else if one.duration_s > left_s {
            reasons.push(one.is_too_long(left_s));
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
    match diagnosis(found, unconfirmed, budget_s, done, planned_s) {
        Some(Ok(one)) if one.is_done(done) => reasons.push(format!("`{}` was run already", one.command())),
        Some(Ok(one)) => return Ok(vec![one]),
        Some(Err(why)) => reasons.push(why),
        None => {}
    }
    Err(reasons.join("; "))
}

/// The `diagnose` that measures a draft of the library anew, or what is unexplained, as long as the budget allows.
fn diagnosis(
    found: &Discovery,
    unconfirmed: &[&Held],
    budget_s: f64,
    done: &[ActiveRun],
    planned_s: PlannedSeconds<'_>,
) -> Option<Result<ChosenExperiment, String>> {
    if let Some(draft) = unconfirmed.first() {
        // The data that are there may be of the seed of the discovery.
        let seed = found.seed.wrapping_add(ANEW_SEED).wrapping_add(done.len() as u64);
        let of = |percent| ChosenExperiment {
            separates: [draft.draft.draft.name.clone(), NOISE.into()],
            seed: Some(seed),
            ..ChosenExperiment::diagnose(percent)
        };
        return Some(longest(of, ANEW_PERCENT, budget_s, planned_s));
    }
    let is_open =
        matches!(found.verdict, Verdict::CannotJudge | Verdict::Unexplained | Verdict::PartlyExplained);
    is_open.then(|| longest(ChosenExperiment::diagnose, 100, budget_s, planned_s))
}

/// The longest `diagnose` that the time allows, of so many percent at most: its parts have least lengths, so only a plan tells how long one is.
///
/// # Errors
/// How long the shortest one takes that is worth its time, if that is too long, or why there is no plan.
fn longest(
    of: impl Fn(u32) -> ChosenExperiment,
    most_percent: u32,
    budget_s: f64,
    planned_s: PlannedSeconds<'_>,
) -> Result<ChosenExperiment, String> {
    let planned = |percent: u32| {
        let one = of(percent);
        Ok::<_, String>(ChosenExperiment { duration_s: planned_s(&one)?, ..one })
    };
    let full = planned(most_percent)?;
    if full.duration_s <= budget_s {
        return Ok(full);
    }
    let mut fits = planned(LEAST_PERCENT)?;
    if fits.duration_s > budget_s {
        return Err(fits.is_too_long(budget_s));
    }
    let (mut least, mut too_long) = (LEAST_PERCENT, most_percent);
    while too_long - least > 1 {
        let percent = u32::midpoint(least, too_long);
        let one = planned(percent)?;
        if one.duration_s <= budget_s {
            (least, fits) = (percent, one);
        } else {
            too_long = percent;
        }
    }
    Ok(fits)
}

/// A sentence as part of another one.
fn lowered(sentence: &str) -> String {
    let mut letters = sentence.trim_end_matches('.').chars();
    letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect())
}

/// Least `scale` of a `diagnose` that is worth its time, in percent.
const LEAST_PERCENT: u32 = 10;

/// The `scale` of a `diagnose` that measures a draft of the library anew, in percent.
const ANEW_PERCENT: u32 = 30;

/// Makes another seed of that of a discovery.
const ANEW_SEED: u64 = 0x5eed;

/// What a plan distinguishes a draft from.
const NOISE: &str = "noise";

/// What a `diagnose` looks for if nothing is named.
const MISSING: &str = "what is missing";

impl ChosenExperiment {
    /// An experiment of a plan; one that was run before has another seed.
    fn of(next: &NextExperiment, done: &[ActiveRun]) -> Self {
        let is_same =
            |run: &&ActiveRun| run.experiment == next.experiment && run.parameters == next.parameters;
        let times = done.iter().filter(is_same).count() as u64;
        Self {
            experiment: next.experiment.clone(),
            parameters: next.parameters.clone(),
            seed: Some(next.seed.wrapping_add(times)),
            duration_s: next.duration_s,
            separates: next.separates.clone(),
            expected_z: next.expected_z,
        }
    }

    /// All of `diagnose` at a scale in percent. How long that takes is not planned yet.
    fn diagnose(percent: u32) -> Self {
        let scale = f64::from(percent) / 100.0;
        let parameters = if percent < 100 { vec![("scale", scale.to_string())] } else { Vec::new() };
        Self {
            experiment: "diagnose".into(),
            parameters,
            seed: None,
            duration_s: f64::INFINITY,
            separates: [MISSING.into(), NOISE.into()],
            expected_z: None,
        }
    }

    fn is_same(&self, other: &Self) -> bool {
        self.experiment == other.experiment && self.parameters == other.parameters
    }

    /// True if it was run before for the same question. A draft needs a run that it was not drafted from, so each draft is a question of its own.
    fn is_done(&self, done: &[ActiveRun]) -> bool {
        let is_of_draft = self.separates[1] == NOISE && self.separates[0] != MISSING;
        done.iter().any(|run| {
            run.experiment == self.experiment
                && run.parameters == self.parameters
                && (!is_of_draft || run.separates == self.separates)
        })
    }

    fn command(&self) -> String {
        command(&self.experiment, &self.parameters)
    }

    /// Its parameters as `tactus run` takes them.
    fn arguments(&self) -> Vec<String> {
        self.parameters.iter().map(|(name, value)| format!("{name}={value}")).collect()
    }

    /// Why it is not begun.
    fn is_too_long(&self, left_s: f64) -> String {
        let (takes, left) = (duration(self.duration_s), duration(left_s));
        format!("`{}` takes {takes}, and {left} of the budget are left", self.command())
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
        let served = if asked { None } else { PlannedRig::served(common)? };
        let (live, planned_on, first_line) = if let Some(PlannedRig { rig, .. }) = served {
            let name = rig.name.clone();
            let line = format!("experiments run on the service at {} (rig {name:?})", common.endpoint);
            (LiveRig { name, rig: None }, rig, line)
        } else {
            let rig = match &args.rig_file {
                Some(path) => config::load_rig(path).map_err(|error| Failure::new(Exit::Usage, error))?.rig,
                None => Rig::from_toml(SIMULATED_RIG)?,
            };
            let why = if asked { "as asked".into() } else { format!("no service at {}", common.endpoint) };
            let line =
                format!("SIMULATED: experiments run on the embedded simulated rig {:?} ({why})", rig.name);
            (LiveRig { name: rig.name.clone(), rig: Some(rig.clone()) }, rig, line)
        };
        let runner = Self { common, args, live, planned_on, budget_s: 60.0 * args.budget_min, runs: 0 };
        runner.say(&first_line);
        Ok(runner)
    }

    /// Says a line to a person.
    fn say(&self, line: &str) {
        if !self.common.json {
            say(line);
        }
    }

    /// The `diagnose` of which the data are if there are none: half of the budget is left for what it leaves open, if that suffices.
    fn first(&self) -> anyhow::Result<ChosenExperiment> {
        let planned_s = |one: &ChosenExperiment| self.planned_s(one);
        let within = |most, budget_s| longest(ChosenExperiment::diagnose, most, budget_s, &planned_s);
        let chosen = within(100, self.budget_s / 2.0).or_else(|_| within(LEAST_PERCENT, self.budget_s));
        Ok(chosen.map_err(|why| Failure::new(Exit::Usage, why))?)
    }

    fn seed(&self, chosen: &ChosenExperiment) -> u64 {
        chosen.seed.unwrap_or_else(|| self.args.seed.wrapping_add(self.runs))
    }

    /// How long an experiment takes, by a dry run.
    fn planned_s(&self, chosen: &ChosenExperiment) -> Result<f64, String> {
        let planned =
            plan::duration_s(&self.planned_on, &chosen.experiment, &chosen.arguments(), self.seed(chosen));
        planned.map_err(|error| format!("`{}` cannot be planned: {}", chosen.command(), in_words(&error)))
    }

    fn run(&mut self, chosen: &ChosenExperiment) -> anyhow::Result<RunSummary> {
        let command = chosen.command();
        let [one, other] = &chosen.separates;
        let expected = chosen.expected_z.map_or_else(String::new, |z| format!(", by {z:.1} standard errors"));
        self.say(&format!(
            "{command}: to distinguish {one} from {other}{expected}; {}",
            duration(chosen.duration_s)
        ));
        let args = RunArgs {
            subject: RunSubject::from(ExperimentArgs {
                experiment: chosen.experiment.clone(),
                parameters: chosen.arguments(),
                seed: Some(self.seed(chosen)),
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
