//! In what runs differ: settings and outcome, side by side.

use serde_json::{Map, Value, json};
use tactus_report::{ResponseCurves, RunReport, run_report};

use super::{ListedRun, several};
use crate::cli::Common;
use crate::exit::{Exit, in_words};
use crate::output::{print_table, say};

/// A row for each setting and result; the runs' values in their order.
pub(super) fn compare(common: &Common, runs: &[ListedRun]) -> anyhow::Result<Exit> {
    let paths = several(runs)?;
    let reports = paths.iter().map(|path| run_report(path)).collect::<Result<Vec<_>, _>>();
    let reports = reports.map_err(|error| anyhow::anyhow!(in_words(&error.into())))?;
    let columns: Vec<Vec<(String, String)>> = reports.iter().map(facts).collect();
    let mut names: Vec<&String> = Vec::new();
    for (name, _) in columns.iter().flatten() {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let value = |column: &Vec<(String, String)>, name: &String| {
        column.iter().find(|(one, _)| one == name).map_or_else(|| "-".to_owned(), |(_, value)| value.clone())
    };
    let rows: Vec<(&String, Vec<String>)> = names
        .iter()
        .map(|name| (*name, columns.iter().map(|column| value(column, name)).collect()))
        .collect();
    let differs = |values: &[String]| values.windows(2).any(|pair| pair[0] != pair[1]);
    let ids: Vec<&str> = runs.iter().map(|run| run.entry.run_id.as_str()).collect();
    if common.json {
        let values = |wanted: bool| {
            let rows = rows.iter().filter(|(_, values)| differs(values) == wanted);
            rows.map(|(name, values)| ((*name).clone(), json!(values))).collect::<Map<String, Value>>()
        };
        say(&json!({ "runs": ids, "differ": values(true), "same": values(false) }).to_string());
        return Ok(Exit::Done);
    }
    let different: Vec<Vec<String>> = rows
        .iter()
        .filter(|(_, values)| differs(values))
        .map(|(name, values)| [vec![(*name).clone()], values.clone()].concat())
        .collect();
    let header: Vec<&str> = std::iter::once("DIFFERENT").chain(ids).collect();
    print_table(&header, &different);
    let same: Vec<String> = rows
        .iter()
        .filter(|(_, values)| !differs(values))
        .map(|(name, values)| format!("{name} {}", values.first().map_or("-", String::as_str)))
        .collect();
    say(&format!("the same: {}", same.join(", ")));
    Ok(Exit::Done)
}

/// Names and values of what a run was and gave.
fn facts(report: &RunReport) -> Vec<(String, String)> {
    let run = &report.summary;
    let of = |name: &str, value: String| (name.to_owned(), value);
    let unknown = || "-".to_owned();
    let mut facts = vec![
        of("experiment", run.experiment.clone()),
        of("rig", run.rig.clone()),
        of("simulated", run.simulated.to_string()),
        of("who", run.who.clone()),
        of("seed", run.seed.map_or_else(unknown, |seed| seed.to_string())),
        of(
            "script",
            run.script_sha256.as_deref().map_or_else(unknown, |sha256| sha256.chars().take(12).collect()),
        ),
        of("covering", format!("{} mm", run.covering_mm)),
        of("indenter", run.indenter.clone()),
    ];
    facts.extend(run.parameters.iter().map(|(name, value)| (format!("-p {name}"), value.clone())));
    facts.extend(run.versions.iter().map(|(name, version)| (format!("version of {name}"), version.clone())));
    facts.extend([
        of("ended", run.exit_status.unwrap_or("open").to_owned()),
        of("presses", run.presses.to_string()),
        of("dwells", run.dwells.to_string()),
        of("frames", run.frames.to_string()),
        of("frames lost", run.frames_lost.to_string()),
        of("duration", format!("{:.1} s", run.duration_s)),
    ]);
    if let Some([mean, deviation]) = report.response.as_ref().and_then(ResponseCurves::slope_spread) {
        facts.push(of("mean slope of the elements", format!("{mean:.1} counts/mm")));
        facts.push(of("spread of the slopes", format!("{deviation:.1} counts/mm")));
    }
    facts
}
