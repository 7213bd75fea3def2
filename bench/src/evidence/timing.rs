//! Time and memory of `tactus discover`.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use tactus_sets::{Content, Plan, Recipe};
use tactus_work::Stop;

use super::rate::quantile;
use crate::Growth;
use crate::program::{Watched, kib, watched};

/// Time and memory at several sizes, on all cores.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// Cores of the machine.
    pub cores: usize,
    /// A row for each size.
    pub rows: Vec<Cost>,
    /// Sizes that were not run: in proportion to the size before, they need more memory than is available.
    pub left_out: Vec<usize>,
    /// `p`, where time grows as `frames^p`.
    pub exponent: f64,
}

/// Time and memory at one size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Frames of 48 elements.
    pub frames: usize,
    /// Median of the runs, from start to files written.
    pub seconds: f64,
    /// Median of the processor's time on all cores. Other programs hardly change it.
    #[serde(default)]
    pub processor_s: f64,
    /// Greatest resident memory of any run.
    pub peak_mib: f64,
}

/// Two physics of a bad rig, so that the search takes several rounds.
const PHYSICS: [&str; 2] = ["relaxation-prony", "shifted-mount"];

impl Timing {
    /// Makes a set of each size by the plan of the experiment `diagnose`, and runs `tactus discover` on it `runs` times.
    ///
    /// # Errors
    /// If a set cannot be made or the program fails.
    pub fn measure(tactus: &Path, folder: &Path, sizes: &[usize], runs: usize) -> Result<Self> {
        let (mut rows, mut left_out) = (Vec::<Cost>::new(), Vec::new());
        for frames in sizes {
            let wanted_mib = rows.last().map(|last| last.peak_mib * *frames as f64 / last.frames as f64);
            if wanted_mib.zip(available_mib()).is_some_and(|(wanted, available)| wanted > 0.8 * available) {
                left_out.push(*frames);
                continue;
            }
            let content = Content { physics: PHYSICS.map(Into::into).into(), ..Content::default() };
            let recipe = Recipe { plan: Plan::Diagnose, frames: Some(*frames), content, ..Recipe::new(1) };
            // The peers expect these paths.
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
            let median =
                |of: fn(&Watched) -> f64| quantile(costs.iter().map(of).collect(), 0.5).unwrap_or(f64::NAN);
            rows.push(Cost {
                frames: *frames,
                seconds: median(|cost| cost.seconds),
                processor_s: median(|cost| cost.processor_s),
                peak_mib: costs.iter().map(|cost| cost.peak_mib).fold(0.0, f64::max),
            });
        }
        let points = rows.iter().map(|cost| [cost.frames as f64, cost.seconds]).collect();
        let exponent = Growth { what: "discover".into(), size_of: "frames", points }.exponent();
        Ok(Self { cores: thread::available_parallelism().map_or(1, usize::from), rows, left_out, exponent })
    }
}

/// A run to its end.
fn cost(tactus: &Path, table: &Path, out: &Path) -> Result<Watched> {
    let mut discover = Command::new(tactus);
    discover.args(["--json", "discover", "--out"]).arg(out).arg(table).stdout(Stdio::null());
    // No effects of the lab take part.
    discover.env("XDG_STATE_HOME", out).env_remove("STATE_DIRECTORY");
    let ended = watched(&mut discover, &Stop::default())?.context("nothing stops it")?;
    ensure!(ended.exit.success(), "{} {} failed: {}", tactus.display(), table.display(), ended.exit);
    Ok(ended)
}

/// Memory that is available to programs.
fn available_mib() -> Option<f64> {
    Some(kib(&fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:")? / 1024.0)
}
