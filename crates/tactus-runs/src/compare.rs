//! In what runs differ: settings and outcome, side by side.

use std::path::Path;

use serde::Serialize;
use tactus_report::{ResponseCurves, RunReport, run_report};

use crate::RunsError;

/// Settings and results of several runs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Comparison {
    /// Ids of the runs, as they were given.
    pub runs: Vec<String>,
    /// In the order of a report.
    pub facts: Vec<Fact>,
}

/// A setting or result, with its value in each run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Fact {
    /// What it is.
    pub name: String,
    /// The runs' values in their order; `-` where there is none.
    pub values: Vec<String>,
    /// True if they are not all the same.
    pub differs: bool,
}

/// Compares the settings and results of recorded runs.
///
/// # Errors
/// If there are fewer than two, or one cannot be read.
pub(crate) fn compare<P: AsRef<Path>>(recordings: &[P]) -> Result<Comparison, RunsError> {
    if recordings.len() < 2 {
        return Err(RunsError::TooFew);
    }
    let reports = recordings.iter().map(|path| run_report(path.as_ref())).collect::<Result<Vec<_>, _>>()?;
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
    let fact = |name: &String| {
        let values: Vec<String> = columns.iter().map(|column| value(column, name)).collect();
        let differs = values.windows(2).any(|pair| pair[0] != pair[1]);
        Fact { name: name.clone(), values, differs }
    };
    let runs = reports.iter().map(|report| report.summary.run_id.clone()).collect();
    Ok(Comparison { runs, facts: names.into_iter().map(fact).collect() })
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
