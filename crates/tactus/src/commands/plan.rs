//! `plan`: shows what an experiment would do, by a dry run on the rig's simulated twin.

use std::sync::Arc;

use serde_json::json;
use tactus_plan::{Parameter, RigView};
use tactus_runner::config;
use tactus_runner::embedded::SIMULATED_RIG;
use tactus_runner::order::{self, RunRequest};
use tactus_runner::script_process::ScriptProcesses;
use tactus_runner::twin::{self, DryRun};
use tactus_schema::{Rig, WallTime};

use super::run::experiment;
use crate::cli::{Common, PlanArgs};
use crate::exit::{Exit, Failure};
use crate::output::{duration, print_fields, print_table};

/// Default seed, so that repeated plans agree.
const SEED: u64 = 1;

pub(crate) fn plan(common: &Common, args: &PlanArgs) -> anyhow::Result<Exit> {
    let (script, arguments) = experiment(&args.experiment.experiment, &args.experiment.parameters)?;
    let rig = match &args.rig_file {
        Some(path) => config::load_rig(path).map_err(|error| Failure::new(Exit::Usage, error))?.rig,
        None => Rig::from_toml(SIMULATED_RIG)?,
    };
    let parameters =
        script.parameters(&RigView::of(&rig)).map_err(|error| Failure::new(Exit::Usage, error))?;
    let summary = script.doc().lines().next().unwrap_or_default().to_owned();
    let name = script.name().to_owned();
    let request = RunRequest {
        script,
        arguments,
        seed: Some(args.experiment.seed.unwrap_or(SEED)),
        who: "plan".into(),
        evaluator: Arc::new(ScriptProcesses::of_this_program()),
        earlier: None,
    };
    let never = || false;
    let order = order::order(request, &rig, WallTime::default(), &never)
        .map_err(|error| Failure::new(Exit::Usage, error))?;
    let values: serde_json::Value = serde_json::from_str(&order.arguments.to_json())?;
    let plan = twin::dry_run(&rig, order, &never)?;
    if common.json {
        println!("{}", to_json(&name, &rig, &parameters, &values, &plan));
    } else {
        print(&name, &summary, &rig, &parameters, &values, &plan);
    }
    Ok(Exit::of_run(plan.outcome.exit_status))
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

fn print(
    name: &str,
    summary: &str,
    rig: &Rig,
    parameters: &[Parameter],
    values: &serde_json::Value,
    plan: &DryRun,
) {
    println!("{name}: {summary}\n");
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
    let result = if plan.is_possible() { "possible".into() } else { format!("REFUSED: {}", outcome.message) };
    let mut fields = vec![
        ("on rig", format!("{} (dry run on its simulated twin)", rig.name)),
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
