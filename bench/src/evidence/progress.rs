//! How much time a discovery has left in each of its stages: for the table of `tactus-discover`.

use std::collections::BTreeMap;
use std::fmt;
use std::fs;

use anyhow::{Context, Result};
use serde::Deserialize;
use tactus_discover::TimeLeft;

use super::campaign::Planned;
use super::rate::quantile;
use super::run::Places;

/// A moment of a discovery.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Number of the set.
    pub set: usize,
    /// Name of the stage.
    pub stage: String,
    /// Time since the first stage began.
    pub elapsed_s: f64,
    /// Time until all files were written.
    pub left_s: f64,
}

/// A line of a set's stages.
#[derive(Debug, Deserialize)]
struct Line {
    stage: String,
    elapsed_s: f64,
}

/// So many moments of each discovery, evenly in time: all discoveries count alike.
const MOMENTS: usize = 200;
/// Quantiles of the table.
const SHARES: [f64; 3] = [0.1, 0.5, 0.9];

/// Moments of the sets that have been run and have a report.
///
/// # Errors
/// If a file cannot be read.
pub fn moments(sets: &[Planned], places: &Places) -> Result<Vec<Moment>> {
    let mut all = Vec::new();
    for (number, set) in sets.iter().enumerate() {
        let path = places.stages(&set.id);
        if path.exists() {
            let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
            all.extend(of_lines(number, &text).with_context(|| path.display().to_string())?);
        }
    }
    Ok(all)
}

/// Moments of a discovery, from the lines of its stages.
fn of_lines(set: usize, text: &str) -> Result<Vec<Moment>> {
    let lines = text.lines().map(serde_json::from_str).collect::<Result<Vec<Line>, _>>()?;
    let whole_s = lines.last().context("no line")?.elapsed_s;
    let moment = |number: usize| {
        let elapsed_s = whole_s * (number as f64 + 0.5) / MOMENTS as f64;
        let stage = lines.iter().rfind(|line| line.elapsed_s <= elapsed_s)?.stage.clone();
        Some(Moment { set, stage, elapsed_s, left_s: whole_s - elapsed_s })
    };
    Ok((0..MOMENTS).filter_map(moment).collect())
}

impl Moment {
    /// The time left in times of the time so far.
    fn ratio(&self) -> f64 {
        self.left_s / self.elapsed_s
    }

    /// True if the program would tell a range here that holds the time left. `None` if it would tell none.
    fn is_told_right(&self) -> Option<bool> {
        let [least_s, most_s] = TimeLeft::in_stage(&self.stage)?.range_s(self.elapsed_s);
        Some((least_s..=most_s).contains(&self.left_s))
    }
}

/// The table as it stands in the code of `tactus-discover`, from these moments; then how often the table that stands there now holds.
pub fn progress_table(moments: &[Moment]) -> String {
    let mut stages: BTreeMap<&str, Vec<&Moment>> = BTreeMap::new();
    for moment in moments {
        stages.entry(&moment.stage).or_default().push(moment);
    }
    fmt::from_fn(|f| {
        for (stage, of) in &stages {
            let ratios: Vec<f64> = of.iter().map(|moment| moment.ratio()).collect();
            let left = SHARES.map(|share| quantile(ratios.clone(), share).unwrap_or(f64::NAN));
            writeln!(f, "    ({stage:?}, [{:.2}, {:.2}, {:.2}]),", left[0], left[1], left[2])?;
        }
        writeln!(f, "{:<30} {:>5} {:>8} {:>18}", "stage", "sets", "moments", "within the range")?;
        for (stage, of) in &stages {
            let mut sets: Vec<usize> = of.iter().map(|moment| moment.set).collect();
            sets.dedup();
            writeln!(f, "{stage:<30} {:>5} {:>8} {}", sets.len(), of.len(), within(of.iter().copied()))?;
        }
        write!(f, "{:<30} {:>5} {:>8} {}", "all", "", moments.len(), within(moments.iter()))
    })
    .to_string()
}

/// The share of moments at which the range that is told holds.
fn within<'a>(moments: impl Iterator<Item = &'a Moment>) -> String {
    let told: Vec<bool> = moments.filter_map(Moment::is_told_right).collect();
    let right = told.iter().filter(|right| **right).count();
    if told.is_empty() {
        return format!("{:>18}", "-");
    }
    format!("{:>16.1} %", 100.0 * right as f64 / told.len() as f64)
}

#[cfg(test)]
#[path = "progress_tests.rs"]
mod tests;
