//! The whole calibration, step by step.

mod remarks;

use serde::Serialize;
use tactus_model::{Covering, ModelError, Psf, Response};

use crate::{
    Declared, Estimate, Health, Readings, RegistrationFit, ResponseFit, ResponseForm, SpreadFit,
    ThicknessFit,
    faults::examine,
    order::median,
    placement::{coverings_mm, same_covering},
    registration::{SensorPose, register},
    response::respond,
    spread::spreads,
    thickness::against_thickness,
};

/// The characterisation of one sensor under its coverings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Calibration {
    /// The measurements used.
    pub data: DataSummary,
    /// Noise of the median element at rest, in counts.
    pub noise_rms_counts: Option<f64>,
    /// Each element's reading at rest.
    pub baseline_counts: Vec<Option<Estimate>>,
    /// Faulty elements, and elements that could not be judged.
    pub health: Health,
    /// Where the sensor lies in the robot's frame; `None` if it could not be fitted.
    pub registration: Option<RegistrationFit>,
    /// The elements' responses; `None` if they could not be fitted.
    pub response: Option<ResponseFit>,
    /// The spread of each covering at each depth.
    pub spreads: Vec<SpreadFit>,
    /// Spread against thickness (Eq. 4); `None` without spreads.
    pub thickness: Option<ThicknessFit>,
    /// What could not be determined, and what it would take; a sentence each.
    pub missing: Vec<String>,
    /// What a reader must know before using a number; a sentence each.
    pub warnings: Vec<String>,
}

/// The measurements that a calibration used.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DataSummary {
    /// Ids of the runs.
    pub runs: Vec<String>,
    /// Number of presses in all runs.
    pub presses: usize,
    /// Number of dwells in all presses.
    pub dwells: usize,
    /// Frames in all.
    pub frames: u64,
    /// Frames left out because an element's reading is an outlier.
    pub frames_left_out: u64,
    /// The coverings pressed, in mm.
    pub coverings_mm: Vec<f64>,
    /// Thickness of the covering for which sensitivities are stated, in mm.
    pub reference_covering_mm: f64,
}

/// Characterises a sensor from measured presses, starting from the declared description.
///
/// The steps are the paper's: faulty elements, registration (Sec. 2.1), response (Sec. 2.2), spread (Sec. 3.1, Eq. 3),
/// spread against thickness (Eq. 4). Each uses the results of the steps before it, errors included. A step for which the
/// data do not suffice is left out; [`Calibration::missing`] says so, and later steps use what is declared.
///
/// # Errors
/// [`ModelError`] if the declared description makes no model with the covering that was pressed as its reference.
pub fn calibrate(declared: &Declared, readings: &Readings) -> Result<Calibration, ModelError> {
    let mut warnings = Vec::new();
    let mut missing = Vec::new();
    let declared = &referred(declared, readings, &mut warnings)?;
    let reference_mm = declared.model.response().reference_covering.thickness_mm;

    let Placed { health, place, registration } = Placed::of(declared, readings);
    let registration = match registration {
        Ok(registration) => Some(registration),
        Err(problem) => {
            missing.push(format!(
                "Registration: {problem}. Origin, rotation and surface are taken as declared."
            ));
            None
        }
    };
    let mut calibration = Calibration {
        data: DataSummary::of(readings, reference_mm),
        noise_rms_counts: median(readings.noise_rms_counts.iter().flatten().copied()),
        baseline_counts: readings
            .rest_counts
            .iter()
            .map(|rest| rest.map(|[value, standard_error]| Estimate { value, standard_error }))
            .collect(),
        health,
        registration,
        response: None,
        spreads: Vec::new(),
        thickness: None,
        missing,
        warnings,
    };
    match respond(declared, readings, &calibration.health, &place) {
        Err(problem) => {
            calibration.missing.push(format!(
                "Response of the elements: {problem}. Without it images cannot be corrected, and no spread can be fitted."
            ));
        }
        Ok((response, gains)) => {
            calibration.response = Some(response);
            let (fitted, refused) = spreads(declared, readings, &gains, &place);
            calibration.missing.extend(refused.into_iter().map(|problem| format!("Spread: {problem}.")));
            calibration.thickness = against_thickness(&fitted);
            calibration.spreads = fitted.fits;
        }
    }
    calibration.remark(declared, readings);
    Ok(calibration)
}

/// Judges every element of a sensor as [`calibrate`] does, without the steps that come after it.
///
/// # Errors
/// As [`calibrate`].
pub fn health(declared: &Declared, readings: &Readings) -> Result<Health, ModelError> {
    let declared = referred(declared, readings, &mut Vec::new())?;
    Ok(Placed::of(&declared, readings).health)
}

/// The elements' health and the sensor's place, each found with the help of the other.
struct Placed {
    health: Health,
    place: SensorPose,
    registration: Result<RegistrationFit, String>,
}

impl Placed {
    fn of(declared: &Declared, readings: &Readings) -> Self {
        let reference_mm = declared.model.response().reference_covering.thickness_mm;
        let mut place = SensorPose::declared(declared, reference_mm);
        let mut health = examine(declared, readings, &place);
        let sound = health.sound(readings.elements);
        let mut registration = register(declared, readings, &sound);
        if let Ok((_, fitted)) = &registration {
            place = fitted.clone();
            // With the fitted pose, faults show more clearly.
            health = examine(declared, readings, &place);
            let sounder = health.sound(readings.elements);
            if sounder != sound
                && let Ok((again, fitted)) = register(declared, readings, &sounder)
            {
                place = fitted.clone();
                registration = Ok((again, fitted));
            }
        }
        Self { health, place, registration: registration.map(|(registration, _)| registration) }
    }
}

impl Calibration {
    /// Spread against thickness for a model, and its standard errors where it was fitted.
    ///
    /// With one covering only, the declared slope stays and the intercept is fitted. `None` without a fit, or if the fit is
    /// no valid spread: its intercept is not positive, or its slope is negative.
    pub fn psf(&self, declared: Psf) -> Option<(Psf, [Option<f64>; 2])> {
        let thickness = self.thickness.as_ref()?;
        let (psf, errors) = match (&thickness.linear, thickness.coverings.as_slice()) {
            (Some(line), _) => {
                let [intercept, slope] = line.coefficients;
                let psf = Psf { sigma_intercept_mm: intercept.value, sigma_per_mm: slope.value };
                (psf, [Some(intercept.standard_error), Some(slope.standard_error)])
            }
            (None, [covering]) => {
                let sigma_intercept_mm =
                    covering.sigma_mm.value - declared.sigma_per_mm * covering.covering_mm;
                (Psf { sigma_intercept_mm, ..declared }, [Some(covering.sigma_mm.standard_error), None])
            }
            _ => return None,
        };
        (psf.sigma_intercept_mm > 0.0 && psf.sigma_per_mm >= 0.0).then_some((psf, errors))
    }

    /// The elements' responses for a model, with the standard errors of sensitivity, baseline and curvature. Elements
    /// without a fit get the median of the fitted ones. `None` if no element was fitted.
    pub fn responses(&self, declared: &Response) -> Option<(Response, [Vec<f64>; 3])> {
        let fitted = self.response.as_ref()?;
        let elements = self.baseline_counts.len();
        let typical = |of: fn(&crate::ElementResponse) -> f64| {
            median(fitted.elements.iter().map(of)).unwrap_or_default()
        };
        let mut response = Response {
            sensitivity_counts_per_mm: vec![typical(|one| one.sensitivity_counts_per_mm.value); elements],
            quadratic_per_mm: vec![typical(|one| one.quadratic_per_mm.value); elements],
            baseline_counts: declared.baseline_counts.clone(),
            reference_indenter: declared.reference_indenter.clone(),
            reference_covering: Covering { thickness_mm: self.data.reference_covering_mm },
        };
        // The error of an element without a fit is the scatter between elements. A linear form's curvature has the error of the
        // shared one.
        let sensitivities: Vec<f64> =
            fitted.elements.iter().map(|one| one.sensitivity_counts_per_mm.value).collect();
        let bent = fitted.shared_quadratic_per_mm.map_or(0.0, |curvature| curvature.standard_error);
        let mut errors = [vec![scatter(&sensitivities); elements], vec![0.0; elements], vec![bent; elements]];
        for one in fitted.elements.iter().chain(&fitted.cross_wired) {
            response.sensitivity_counts_per_mm[one.element] = one.sensitivity_counts_per_mm.value;
            response.quadratic_per_mm[one.element] = one.quadratic_per_mm.value;
            errors[0][one.element] = one.sensitivity_counts_per_mm.standard_error;
            errors[2][one.element] = one
                .quadratic_per_mm
                .standard_error
                .max(if fitted.form == ResponseForm::Linear { bent } else { 0.0 });
        }
        for (element, baseline) in self.baseline_counts.iter().enumerate() {
            if let Some(baseline) = baseline {
                response.baseline_counts[element] = baseline.value;
                errors[1][element] = baseline.standard_error;
            }
        }
        Some((response, errors))
    }
}

impl DataSummary {
    fn of(readings: &Readings, reference_covering_mm: f64) -> Self {
        Self {
            runs: readings.runs.clone(),
            presses: readings.presses.len(),
            dwells: readings.presses.iter().map(|press| press.dwells.len()).sum(),
            frames: readings.frames,
            frames_left_out: readings.frames_left_out,
            coverings_mm: coverings_mm(readings.presses.iter()),
            reference_covering_mm,
        }
    }
}

/// The declared description. If no press is a reference press as declared, the most frequent combination of tool and
/// covering becomes the reference.
fn referred(
    declared: &Declared,
    readings: &Readings,
    warnings: &mut Vec<String>,
) -> Result<Declared, ModelError> {
    if readings.presses.iter().any(|press| declared.is_reference(press)) {
        return Ok(declared.clone());
    }
    let known = || readings.presses.iter().filter(|press| declared.indenter(press).is_some());
    let alike = |press: &&crate::MeasuredPress| {
        let of = |other: &&crate::MeasuredPress| {
            other.indenter == press.indenter && same_covering(other.covering_mm, press.covering_mm)
        };
        known().filter(of).count()
    };
    let Some(press) = known().max_by_key(alike) else { return Ok(declared.clone()) };
    let Some(indenter) = declared.indenter(press) else { return Ok(declared.clone()) };
    warnings.push(format!(
        "Nothing was pressed with the declared reference tool under the declared reference covering: sensitivities are stated \
         for tool {:?} under {:.3} mm.",
        &*press.indenter, press.covering_mm
    ));
    let response = Response {
        reference_indenter: indenter.clone(),
        reference_covering: Covering { thickness_mm: press.covering_mm },
        ..declared.model.response().clone()
    };
    let (array, psf) = (declared.array().clone(), declared.model.psf());
    Ok(Declared { model: tactus_model::ForwardModel::new(array, psf, response)?, ..declared.clone() })
}

/// Standard deviation about the mean.
fn scatter(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0)).sqrt()
}
