//! Time of a calibration from recordings.

use std::{path::PathBuf, time::Instant};

use anyhow::{Context, Result};
use tactus_calibrate::{Declared, Readings, calibrate};
use tactus_record::rows;
use tactus_schema::Model;

use crate::clock::timed;

/// Times of a calibration, and the images that its spreads are fitted to.
#[derive(Debug, Clone)]
pub struct Calibration {
    /// Number of presses.
    pub presses: usize,
    /// Time to read the recordings and gather their frames.
    pub read_s: f64,
    /// Median time of the calibration.
    pub whole_s: f64,
    /// The same without the presses of the sweeps, to which only the spreads are fitted.
    pub without_sweeps_s: f64,
    /// The sweeps, by covering and depth.
    pub sweeps: Vec<Sweep>,
}

/// Presses to one depth under one covering.
#[derive(Debug, Clone)]
pub struct Sweep {
    /// Thickness of the covering.
    pub covering_mm: f64,
    /// Depth of the presses.
    pub depth_mm: f64,
    /// The fitted spread.
    pub sigma_mm: f64,
    /// Centres of the elements used, sensor frame.
    pub centres_mm: Vec<[f64; 2]>,
    /// Places of the presses, sensor frame.
    pub places_mm: Vec<[f64; 2]>,
    /// Readings of these elements in each press, as equivalent indentations.
    pub images_mm: Vec<Vec<f64>>,
}

impl Calibration {
    /// Calibrates from recordings `times` times.
    ///
    /// # Errors
    /// If the files cannot be read, or show no spread.
    pub fn measure(files: &[PathBuf], times: usize) -> Result<Self> {
        let start = Instant::now();
        let (source, readings) = rows::readings(files)?;
        let read_s = start.elapsed().as_secs_f64();
        let rig = source.rig;
        let declared = Declared {
            model: Model::of_rig(&rig).context("the rig has no reference tool")?.forward()?,
            registration: rig.registration,
            indenters: rig.indenters,
        };
        let found = calibrate(&declared, &readings)?;
        let sweeps = found.spreads.iter().map(|spread| spread.run.clone()).collect::<Vec<_>>();
        let mut without = readings.clone();
        without.presses.retain(|press| !sweeps.contains(&readings.runs[press.run]));
        Ok(Self {
            presses: readings.presses.len(),
            read_s,
            whole_s: timed(times, || calibrate(&declared, &readings))?.1,
            without_sweeps_s: timed(times, || calibrate(&declared, &without))?.1,
            sweeps: sweeps_of(&declared, &readings, &found)?,
        })
    }
}

fn sweeps_of(
    declared: &Declared,
    readings: &Readings,
    found: &tactus_calibrate::Calibration,
) -> Result<Vec<Sweep>> {
    let responses = &found.response.as_ref().context("the recordings give no responses")?.elements;
    let place = found.registration.as_ref().context("the recordings give no registration")?;
    let registration = place.registration(declared.registration);
    let surface_mm = place.surface_mm.map_or(0.0, |surface| surface.value);
    let array = declared.model.array();
    let sweep = |spread: &tactus_calibrate::SpreadFit| {
        let mut sweep = Sweep {
            covering_mm: spread.covering_mm,
            depth_mm: spread.depth_mm,
            sigma_mm: spread.sigma_mm.value,
            centres_mm: responses.iter().filter_map(|one| array.centre_mm(one.element)).collect(),
            places_mm: Vec::new(),
            images_mm: Vec::new(),
        };
        let of_run = readings.presses.iter().filter(|press| readings.runs[press.run] == spread.run);
        for press in of_run {
            for dwell in &press.dwells {
                if (surface_mm - dwell.height_mm - spread.depth_mm).abs() < 0.01 {
                    let read = responses.iter().map(|one| {
                        let [rise, _] = press.rise(dwell, one.element)?;
                        one.indentation_mm(rise)
                    });
                    sweep.places_mm.push(registration.to_sensor(press.place_mm));
                    sweep.images_mm.push(
                        read.collect::<Option<_>>()
                            .context("a reading is outside the range of its element's response")?,
                    );
                }
            }
        }
        Ok(sweep)
    };
    found.spreads.iter().map(sweep).collect()
}
