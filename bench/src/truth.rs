//! How well `tactus calibrate` recovers the truth.
//!
//! Simulated rigs with different true parameters are measured with the paper's experiments and calibrated by the program `tactus`. The results
//! are compared with the true parameters. Any number of workers share the rigs of a folder ([`tactus_work`]).

mod coverage;
mod recovery;
mod rig;

use std::fs::{self, File};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};
use tactus_schema::Rig;
use tactus_work::{Now, Stop, Work, Worked, Worker, agree, work, write_whole};
use tempfile::TempDir;

use crate::program::{Watched, digest, watched};

pub use coverage::{Coverage, Coverages};
pub use recovery::Recovery;

/// Measurements of rigs, each made from its own seed.
#[derive(Debug)]
pub struct Measurements {
    /// The program `tactus`.
    pub tactus: PathBuf,
    /// Points along a side of the sweep.
    pub points: u64,
    /// Folder of the results.
    pub work: PathBuf,
}

/// Exit codes of a calibration with a result: all is determined, or something is not.
const CALIBRATED: [i32; 2] = [0, 3];

/// Measures and calibrates so many rigs, with the other workers that have the same folder. Rigs that are done already are kept.
///
/// # Errors
/// If a rig cannot be measured, or if the folder has results of another build or sweep.
pub fn measure(
    rigs: u64,
    measurements: &Measurements,
    worker: &Worker,
    progress: &(dyn Fn(Option<&str>, Now) + Sync),
) -> Result<Worked> {
    let Measurements { tactus, points, work: folder } = measurements;
    agree(&folder.join("terms.json"), [("program", json!(digest(tactus)?)), ("points", json!(points))])?;
    // Each rig is measured in a folder of its own.
    let tactus = fs::canonicalize(tactus).with_context(|| at(tactus))?;
    let seeds: Vec<u64> = (0..rigs).collect();
    work(&Rigs { tactus, measurements }, &seeds, worker, progress)
}

impl Measurements {
    /// The results of so many rigs.
    ///
    /// # Errors
    /// If one is missing.
    pub fn read(&self, rigs: u64) -> Result<Vec<Recovery>> {
        let read = |seed| {
            let path = self.result(seed);
            let text = fs::read_to_string(&path).with_context(|| at(&path))?;
            serde_json::from_str(&text).with_context(|| at(&path))
        };
        (0..rigs).map(read).collect()
    }

    fn result(&self, seed: u64) -> PathBuf {
        self.work.join("rigs").join(format!("{}.json", name(seed)))
    }
}

fn name(seed: u64) -> String {
    format!("rig-{seed:03}")
}

/// The work on all rigs.
struct Rigs<'a> {
    tactus: PathBuf,
    measurements: &'a Measurements,
}

impl Work for Rigs<'_> {
    /// The seed of a rig.
    type Piece = u64;
    type Made = Recovery;
    type Error = anyhow::Error;

    fn name(&self, seed: &u64) -> String {
        name(*seed)
    }

    fn is_done(&self, seed: &u64) -> Result<bool> {
        Ok(self.measurements.result(*seed).exists())
    }

    fn make(&self, seed: &u64, stop: &Stop) -> Result<Option<Recovery>> {
        let folder = TempDir::new()?;
        let text = rig::varied(*seed)?;
        let rig = Rig::from_toml(&text)?;
        fs::write(folder.path().join("rig.toml"), text)?;
        let points = self.measurements.points;
        let sweep = [format!("points={points}"), format!("spacing_mm={}", 1.4 / (points - 1) as f64)];
        let mut calibrate = vec!["calibrate".to_owned()];
        for (experiment, parameters) in
            [("corners", &[][..]), ("element-centres", &[]), ("grid-sweep", &sweep)]
        {
            let seed = seed.to_string();
            let mut run =
                ["run", experiment, "--embedded", "--no-report", "--rig-file", "rig.toml", "--seed", &seed]
                    .map(str::to_owned)
                    .to_vec();
            for parameter in parameters {
                run.extend(["-p".to_owned(), parameter.clone()]);
            }
            let Some(ran) = self.tactus(folder.path(), &run, &[0], stop)? else { return Ok(None) };
            calibrate.push(ran["recording"].as_str().context("a run has a recording")?.to_owned());
        }
        let Some(found) = self.tactus(folder.path(), &calibrate, &CALIBRATED, stop)? else { return Ok(None) };
        Recovery::of(&rig, &found).map(Some)
    }

    fn keep(&self, seed: &u64, recovery: Recovery) -> Result<()> {
        let path = self.measurements.result(*seed);
        write_whole(&path, &serde_json::to_vec_pretty(&recovery)?).with_context(|| at(&path))
    }
}

impl Rigs<'_> {
    /// What the program prints as JSON, in a folder of its own; `None` if it was stopped.
    fn tactus(
        &self,
        folder: &Path,
        arguments: &[String],
        codes: &[i32],
        stop: &Stop,
    ) -> Result<Option<Value>> {
        let [out, log] = ["out", "log"].map(|name| folder.join(name));
        let mut tactus = Command::new(&self.tactus);
        tactus.arg("--json").args(arguments).current_dir(folder);
        // The lab's own effects take no part.
        tactus.env("XDG_STATE_HOME", folder).env_remove("STATE_DIRECTORY");
        tactus.stdout(File::create(&out)?).stderr(File::create(&log)?);
        // A terminal's Ctrl-C is for the worker alone, which ends the program.
        tactus.process_group(0);
        let Some(Watched { exit, .. }) = watched(&mut tactus, stop)? else { return Ok(None) };
        ensure!(
            exit.code().is_some_and(|code| codes.contains(&code)),
            "tactus {} failed, {exit}: {}",
            arguments.join(" "),
            fs::read_to_string(&log)?
        );
        Ok(Some(serde_json::from_slice(&fs::read(&out)?)?))
    }
}

fn at(path: &Path) -> String {
    path.display().to_string()
}
