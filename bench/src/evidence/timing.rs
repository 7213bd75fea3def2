//! What discovery costs.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use tactus_mock::hidden::{Content, Plan, Recipe};

use super::rate::quantile;
use crate::Growth;

/// Time and memory of `tactus discover` at several sizes, on all cores.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// Cores of the machine.
    pub cores: usize,
    /// One row a size.
    pub rows: Vec<Cost>,
    /// `p` of the time `~ frames^p`.
    pub exponent: f64,
}

/// One size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Frames of 48 elements.
    pub frames: usize,
    /// Median of the runs, from start to files written.
    pub seconds: f64,
    /// Greatest resident memory of any run.
    pub peak_mib: f64,
}

/// Two effects of a bad rig, so that the search goes several rounds.
const PHYSICS: [&str; 2] = ["relaxation-prony", "shifted-mount"];
const LOOK_AGAIN: Duration = Duration::from_millis(20);

impl Timing {
    /// Makes a set of each size in a folder, by the plan of the `diagnose` experiment, and discovers in it so many times.
    ///
    /// # Errors
    /// If a set cannot be made or the program fails.
    pub fn measure(tactus: &Path, folder: &Path, sizes: &[usize], runs: usize) -> Result<Self> {
        let mut rows = Vec::new();
        for frames in sizes {
            let content = Content { physics: PHYSICS.map(Into::into).into(), ..Content::default() };
            let recipe = Recipe { plan: Plan::Diagnose, frames: Some(*frames), content, ..Recipe::new(1) };
            // Laid out as the peers look for it.
            let place = |part: &str, ending: &str| folder.join(part).join(format!("{frames}.{ending}"));
            let table = place("sets", "parquet");
            for part in ["sets", "residuals", "reports"] {
                let part = folder.join(part);
                fs::create_dir_all(&part).with_context(|| part.display().to_string())?;
            }
            recipe.make()?.write(&table)?;
            let out = folder.join(format!("out-{frames}"));
            let costs = (0..runs).map(|_| cost(tactus, &table, &out)).collect::<Result<Vec<_>>>()?;
            fs::rename(out.join("residuals.parquet"), place("residuals", "parquet"))?;
            fs::rename(out.join("report.json"), place("reports", "json"))?;
            let seconds = quantile(costs.iter().map(|cost| cost.0).collect(), 0.5).unwrap_or(f64::NAN);
            let peak_mib = costs.iter().map(|cost| cost.1).fold(0.0, f64::max);
            rows.push(Cost { frames: *frames, seconds, peak_mib });
        }
        let points = rows.iter().map(|cost| [cost.frames as f64, cost.seconds]).collect();
        let exponent = Growth { what: "discover".into(), size_of: "frames", points }.exponent();
        Ok(Self { cores: thread::available_parallelism().map_or(1, usize::from), rows, exponent })
    }
}

/// Seconds of a run, and its greatest resident memory in MiB.
fn cost(tactus: &Path, table: &Path, out: &Path) -> Result<(f64, f64)> {
    let started = Instant::now();
    let mut child = Command::new(tactus)
        .args(["--json", "discover", "--out"])
        .arg(out)
        .arg(table)
        .stdout(Stdio::null())
        .spawn()
        .with_context(|| tactus.display().to_string())?;
    let status = format!("/proc/{}/status", child.id());
    let mut peak_kib = 0.0_f64;
    loop {
        // Gone in the last moment before the process is waited for; what was read before stays.
        let kib = fs::read_to_string(&status).ok().and_then(|text| high_water_kib(&text));
        peak_kib = peak_kib.max(kib.unwrap_or(0.0));
        if let Some(exit) = child.try_wait()? {
            ensure!(exit.success(), "{} {} failed: {exit}", tactus.display(), table.display());
            return Ok((started.elapsed().as_secs_f64(), peak_kib / 1024.0));
        }
        thread::sleep(LOOK_AGAIN);
    }
}

/// `VmHWM` of a process's status.
fn high_water_kib(status: &str) -> Option<f64> {
    status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
#[path = "timing_tests.rs"]
mod tests;
