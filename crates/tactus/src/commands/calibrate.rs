//! `calibrate`: calibrates the sensor from measured presses; writes a model, numbers and a report.

mod model;
mod print;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use serde::Serialize;
use tactus_calibrate::{Calibration, Declared, Readings};
use tactus_record::rows::{self, RunSource, Source};
use tactus_report::calibration::{CalibrationReport, calibration_html};
use tactus_schema::{Model, Rig};

use crate::cli::{CalibrateArgs, Common};
use crate::exit::Exit;
use crate::output;
use crate::progress::Busy;

pub(crate) use print::{estimate, faulty};

/// Name of the form of `calibration.json`.
const SCHEMA: &str = "tactus.calibration/1";

/// A calibration and its data.
#[derive(Debug, Clone)]
pub(crate) struct Calibrated {
    pub(crate) rig: Rig,
    pub(crate) simulated: bool,
    pub(crate) runs: Vec<RunSource>,
    /// What to know of the files.
    pub(crate) notes: Vec<String>,
    /// True if something of the files was lost.
    pub(crate) is_lossy: bool,
    pub(crate) calibration: Calibration,
}

/// `calibration.json`, and what `--json` prints.
#[derive(Serialize)]
struct CalibrationJson<'a> {
    schema: &'static str,
    rig: &'a str,
    simulated: bool,
    files: Vec<&'a Path>,
    notes: &'a [String],
    #[serde(flatten)]
    calibration: &'a Calibration,
}

pub(crate) fn calibrate(common: &Common, args: &CalibrateArgs) -> anyhow::Result<Exit> {
    let busy = Busy::with("reading", common.json);
    let measured = busy.reads(|| rows::readings(&args.files))?;
    busy.goes_on("fitting");
    let calibrated = from_readings(measured)?;
    let paths = write(&calibrated, &args.out)?;
    drop(busy);
    if common.json {
        output::write(&format!("{}\n", calibrated.to_json()?))?;
    } else {
        print::calibrated(&calibrated, &paths);
    }
    let whole = calibrated.calibration.missing.is_empty() && !calibrated.is_lossy;
    Ok(if whole { Exit::Done } else { Exit::Degraded })
}

/// Reads the files and calibrates the sensor.
pub(crate) fn from_files(files: &[PathBuf]) -> anyhow::Result<Calibrated> {
    from_readings(rows::readings(files)?)
}

fn from_readings((source, readings): (Source, Readings)) -> anyhow::Result<Calibrated> {
    if readings.frames == 0 {
        bail!("the files hold no frame");
    }
    let renamed = source.renamed();
    let rig = source.rig;
    let model = Model::of_rig(&rig).context("the rig's reference indenter is not among its tools")?;
    let declared = Declared {
        model: model.forward().context("the rig file gives no valid model")?,
        registration: rig.registration,
        indenters: rig.indenters.clone(),
    };
    let calibration = tactus_calibrate::calibrate(&declared, &readings)?;
    let simulated = rig.simulated || source.runs.iter().any(|run| run.simulated);
    Ok(Calibrated {
        rig,
        simulated,
        runs: source.runs,
        is_lossy: !source.warnings.is_empty(),
        notes: [source.warnings, source.notes, Vec::from_iter(renamed)].concat(),
        calibration,
    })
}

/// Writes model, numbers and report; returns the files.
pub(crate) fn write(calibrated: &Calibrated, folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let mut paths = Vec::new();
    let mut put = |name: &str, text: String| {
        let path = folder.join(name);
        fs::write(&path, text).with_context(|| path.display().to_string())?;
        paths.push(std::path::absolute(path)?);
        anyhow::Ok(())
    };
    if let Some(model) = calibrated.model() {
        put("model.toml", model.to_toml().context("the calibrated model")?)?;
    }
    put("calibration.json", calibrated.to_json()?)?;
    put("report.html", calibration_html(&calibrated.report()))?;
    Ok(paths)
}

impl Calibrated {
    /// The content of its report.
    pub(crate) fn report(&self) -> CalibrationReport<'_> {
        CalibrationReport {
            rig: &self.rig.name,
            simulated: self.simulated,
            array: &self.rig.array,
            declared_registration: self.rig.registration,
            declared_psf: self.rig.psf,
            calibration: &self.calibration,
            notes: &self.notes,
        }
    }

    fn to_json(&self) -> anyhow::Result<String> {
        let mut files: Vec<&Path> = self.runs.iter().map(|run| run.path.as_path()).collect();
        files.dedup();
        Ok(serde_json::to_string_pretty(&CalibrationJson {
            schema: SCHEMA,
            rig: &self.rig.name,
            simulated: self.simulated,
            files,
            notes: &self.notes,
            calibration: &self.calibration,
        })?)
    }
}
