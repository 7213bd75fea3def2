//! `plan`: shows what an experiment would do, by a dry run on the rig's simulated twin.

use std::sync::Arc;

use anyhow::{Context, bail, ensure};
use serde_json::json;
use tactus_plan::{Arguments, Parameter, RigView, Script};
use tactus_runner::config;
use tactus_runner::embedded::SIMULATED_RIG;
use tactus_runner::order::{self, RunRequest};
use tactus_runner::script_process::ScriptProcesses;
use tactus_runner::twin::{self, DryRun};
use tactus_schema::key::Command;
use tactus_schema::{Rig, WallTime, pb};

use super::run::experiment;
use crate::cli::{Common, PlanArgs};
use crate::connection::{self, PATIENCE};
use crate::exit::{Exit, Failure, at_source};
use crate::output::{duration, print_fields, print_table, say, say_next};
use crate::progress::RunProgress;
use crate::source_line::with_source_line;

/// Default seed, so that repeated plans agree.
const SEED: u64 = 1;

pub(crate) fn plan(common: &Common, args: &PlanArgs) -> anyhow::Result<Exit> {
    let (script, arguments) = experiment(&args.experiment.experiment, &args.experiment.parameters)?;
    let (name, source) = (script.name().to_owned(), script.source().to_owned());
    plan_of(common, args, script, arguments).map_err(|error| at_source(&error, &name, &source))
}

fn plan_of(common: &Common, args: &PlanArgs, script: Script, arguments: Arguments) -> anyhow::Result<Exit> {
    let PlannedRig { rig, whose } = PlannedRig::find(common, args)?;
    let parameters =
        script.parameters(&RigView::of(&rig)).map_err(|error| Failure::new(Exit::Usage, error))?;
    let summary = script.doc().lines().next().unwrap_or_default().to_owned();
    let (name, source) = (script.name().to_owned(), script.source().to_owned());
    let request = request(script, arguments, args.experiment.seed.unwrap_or(SEED));
    let never = || false;
    let order = order::order(request, &rig, WallTime::default(), &never)
        .map_err(|error| Failure::new(Exit::Usage, error))?;
    let values: serde_json::Value = serde_json::from_str(&order.arguments.to_json())?;
    let progress = RunProgress::new(common.json, "");
    let plan = twin::dry_run(&rig, order, &progress);
    progress.clear();
    let plan = plan?;
    if common.json {
        let mut told = to_json(&name, &rig, &parameters, &values, &plan);
        told["rig_of"] = whose.into();
        println!("{told}");
    } else {
        println!("{name}: {summary}\n");
        print(&rig, &whose, &parameters, &values, &plan);
        if plan.is_possible() {
            say("");
            say_next(&format!("`{}` does it", run_command(args)));
        } else {
            let message = &plan.outcome.message;
            println!("\n{}", with_source_line(message, &name, &source));
        }
    }
    Ok(Exit::of_run(plan.outcome.exit_status))
}

/// How long an experiment takes on a rig, by a dry run on its twin.
///
/// # Errors
/// If there is no such experiment with these parameters, or the twin refuses it.
pub(super) fn duration_s(rig: &Rig, name: &str, parameters: &[String], seed: u64) -> anyhow::Result<f64> {
    let (script, arguments) = experiment(name, parameters)?;
    let request = request(script, arguments, seed);
    let never = || false;
    let order = order::order(request, rig, WallTime::default(), &never)?;
    let plan = twin::dry_run(rig, order, &never)?;
    ensure!(plan.is_possible(), "{}", plan.outcome.message);
    Ok(plan.outcome.duration_s)
}

fn request(script: Script, arguments: Arguments, seed: u64) -> RunRequest {
    RunRequest {
        script,
        arguments,
        seed: Some(seed),
        who: "plan".into(),
        evaluator: Arc::new(ScriptProcesses::of_this_program()),
        earlier: None,
    }
}

/// The command that runs what was planned.
fn run_command(args: &PlanArgs) -> String {
    let PlanArgs { experiment, embedded, rig_file } = args;
    let mut words = vec!["tactus".to_owned(), "run".to_owned(), experiment.experiment.clone()];
    words.extend(experiment.parameters.iter().flat_map(|parameter| ["-p".to_owned(), parameter.clone()]));
    words.extend(experiment.seed.iter().flat_map(|seed| ["--seed".to_owned(), seed.to_string()]));
    words.extend(embedded.then(|| "--embedded".to_owned()));
    words.extend(rig_file.iter().flat_map(|file| ["--rig-file".to_owned(), file.display().to_string()]));
    let as_typed = |word: &String| {
        let is_plain = word.chars().all(|letter| letter.is_alphanumeric() || "-_=./,:[]".contains(letter));
        if is_plain { word.clone() } else { format!("'{}'", word.replace('\'', "'\\''")) }
    };
    words.iter().map(as_typed).collect::<Vec<_>>().join(" ")
}

/// The rig that would run the experiment.
pub(super) struct PlannedRig {
    pub(super) rig: Rig,
    /// Whose rig it is, for a person.
    whose: String,
}

impl PlannedRig {
    /// As `run` chooses it: the file that was given, else the service's rig, else the embedded one.
    fn find(common: &Common, args: &PlanArgs) -> anyhow::Result<Self> {
        if let Some(path) = &args.rig_file {
            let rig = config::load_rig(path).map_err(|error| Failure::new(Exit::Usage, error))?.rig;
            return Ok(Self { rig, whose: format!("of {}", path.display()) });
        }
        let embedded = |why: &str| {
            let whose = format!("embedded, {why}");
            anyhow::Ok(Self { rig: Rig::from_toml(SIMULATED_RIG)?, whose })
        };
        if args.embedded {
            return embedded("as asked");
        }
        match Self::served(common)? {
            Some(served) => Ok(served),
            None => embedded(&format!("no service at {}", common.endpoint)),
        }
    }

    /// The service's rig; `None` without a service.
    pub(super) fn served(common: &Common) -> anyhow::Result<Option<Self>> {
        connection::runtime()?.block_on(async {
            let Some(client) = connection::find(common).await? else { return Ok(None) };
            let request = pb::CommandRequest { who: connection::who(), ..Default::default() };
            let told = connection::ask(&client, Command::Status, &request, PATIENCE).await?;
            client.close().await?;
            Self::of_service(&told, &common.endpoint).map(Some)
        })
    }

    /// The service's rig, with the covering that is in place now.
    fn of_service(told: &pb::CommandReply, endpoint: &str) -> anyhow::Result<Self> {
        if told.rig_toml.is_empty() {
            bail!(
                "the service at {endpoint} does not tell its rig: it is of version {}; give the rig's file with --rig-file",
                told.version
            );
        }
        let mut rig = Rig::from_toml(&told.rig_toml).context("the rig of the service")?;
        rig.covering.thickness_mm = told.covering_mm;
        Ok(Self { rig, whose: format!("of the service at {endpoint}") })
    }
}

fn to_json(
    name: &str,
    rig: &Rig,
    parameters: &[Parameter],
    values: &serde_json::Value,
    plan: &DryRun,
) -> serde_json::Value {
    let outcome = &plan.outcome;
    json!({
        "experiment": name,
        "rig": rig.name,
        "possible": plan.is_possible(),
        "refused": (!plan.is_possible()).then_some(&outcome.message),
        "exit_status": outcome.exit_status.word(),
        "presses": outcome.presses,
        "dwells": outcome.dwells,
        "duration_s": outcome.duration_s,
        "depth_max_mm": plan.deepest_mm(),
        "travel_mm": travel(plan).map(|[x, y, z]| json!({ "x": x, "y": y, "z": z })),
        "parameters": parameters.iter().map(|parameter| json!({
            "name": parameter.name,
            "kind": parameter.kind.to_string(),
            "unit": parameter.unit,
            "default": parameter.default,
            "value": values.get(&parameter.name),
            "doc": parameter.doc,
            "choices": parameter.choices,
        })).collect::<Vec<_>>(),
    })
}

fn print(rig: &Rig, whose: &str, parameters: &[Parameter], values: &serde_json::Value, plan: &DryRun) {
    let rows: Vec<_> = parameters
        .iter()
        .map(|parameter| {
            vec![
                parameter.name.clone(),
                values.get(&parameter.name).unwrap_or(&parameter.default).to_string(),
                parameter.unit.clone().unwrap_or_default(),
                parameter.kind.to_string(),
                parameter.doc.clone(),
            ]
        })
        .collect();
    if !rows.is_empty() {
        print_table(&["parameter", "value", "unit", "type", "meaning"], &rows);
        println!();
    }
    let outcome = &plan.outcome;
    let result = if plan.is_possible() { "possible".into() } else { "REFUSED: see below".into() };
    let mut fields = vec![
        ("on rig", format!("{} ({whose}; dry run on its simulated twin)", rig.name)),
        ("result", result),
        ("presses", format!("{}, {} dwells", outcome.presses, outcome.dwells)),
        ("duration", duration(outcome.duration_s)),
    ];
    if let Some([[x0, x1], [y0, y1], [z0, z1]]) = travel(plan) {
        let limit_mm = rig.depth_max_mm().unwrap_or_default();
        fields.push((
            "deepest",
            format!("{:.3} mm (limit {limit_mm:.3} mm under the covering in place)", plan.deepest_mm()),
        ));
        fields.push((
            "travel",
            format!("x {x0:.2} to {x1:.2}, y {y0:.2} to {y1:.2}, z {z0:.2} to {z1:.2} mm (robot frame)"),
        ));
    }
    print_fields(&fields);
}

/// Least and greatest x, y, z, if anything was moved.
fn travel(plan: &DryRun) -> Option<[[f64; 2]; 3]> {
    let travel_mm = plan.outcome.travel_mm;
    travel_mm.iter().flatten().all(|bound| bound.is_finite()).then_some(travel_mm)
}
