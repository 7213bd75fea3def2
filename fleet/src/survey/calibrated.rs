//! The calibration of one run, as far as its presses go.

use std::path::Path;

use serde::{Deserialize, Serialize};
use tactus_calibrate::{Calibration, Declared, Estimate};
use tactus_record::rows;
use tactus_schema::Model;

use super::Analysis;

/// What a calibration finds in one run; each number with its standard error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Calibrated {
    /// Mean of the elements' sensitivities.
    pub(crate) sensitivity_counts_per_mm: Option<[f64; 2]>,
    /// Mean of the elements at rest.
    pub(crate) baseline_counts: Option<[f64; 2]>,
    /// Noise of the median element at rest.
    pub(crate) noise_rms_counts: Option<f64>,
    /// Spread of each covering.
    pub(crate) spreads: Vec<CoveringSpread>,
    /// Elements that do not answer as they should.
    pub(crate) faulty: Vec<usize>,
    /// What the run does not determine.
    pub(crate) missing: Vec<String>,
}

/// The spread of one covering.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct CoveringSpread {
    pub(crate) covering_mm: f64,
    pub(crate) sigma_mm: [f64; 2],
}

impl Analysis for Calibrated {
    const NAME: &'static str = "calibration";

    fn of(table: &Path) -> Result<Self, String> {
        let (source, readings) = rows::readings(&[table]).map_err(|error| error.to_string())?;
        let model =
            Model::of_rig(&source.rig).ok_or("the rig's reference indenter is not among its tools")?;
        let declared = Declared {
            model: model.forward().map_err(|error| error.to_string())?,
            registration: source.rig.registration,
            indenters: source.rig.indenters,
        };
        let calibration =
            tactus_calibrate::calibrate(&declared, &readings).map_err(|error| error.to_string())?;
        Ok(Self::from(calibration))
    }
}

impl From<Calibration> for Calibrated {
    fn from(calibration: Calibration) -> Self {
        let Calibration { noise_rms_counts, baseline_counts, health, response, thickness, missing, .. } =
            calibration;
        let coverings = thickness.into_iter().flat_map(|thickness| thickness.coverings);
        Self {
            sensitivity_counts_per_mm: response.map(|fit| pair(fit.mean_sensitivity_counts_per_mm)),
            baseline_counts: mean(baseline_counts.into_iter().flatten()),
            noise_rms_counts,
            spreads: coverings
                .map(|one| CoveringSpread { covering_mm: one.covering_mm, sigma_mm: pair(one.sigma_mm) })
                .collect(),
            faulty: health.faults.into_iter().map(|fault| fault.element).collect(),
            missing,
        }
    }
}

fn pair(estimate: Estimate) -> [f64; 2] {
    [estimate.value, estimate.standard_error]
}

/// The mean of independent estimates.
fn mean(estimates: impl Iterator<Item = Estimate>) -> Option<[f64; 2]> {
    let (mut sum, mut variance, mut number) = (0.0, 0.0, 0.0);
    for Estimate { value, standard_error } in estimates {
        sum += value;
        variance += standard_error * standard_error;
        number += 1.0;
    }
    (number > 0.0).then(|| [sum / number, variance.sqrt() / number])
}
