//! Remarks on a calibration: what is missing, and what limits the trust in its numbers.

use super::Calibration;
use crate::{
    Declared, Health, Readings, RegistrationFit, ResponseFit, ResponseForm, ThicknessFit,
    faults::{FaultKind, WIRING_PLACES_LEAST},
    placement::{across, goes_across},
    places::distinct_places,
    readings::number_of,
    thickness::IMPLAUSIBLE,
};

/// Residuals beyond this many times the noise show that the model does not hold.
const MISFIT: f64 = 1.5;

/// Share of the spread below which a departure is not worth a warning, however certain it is.
const NEGLIGIBLE_SHARE: f64 = 0.005;

/// Remarks in the order of the calibration's steps.
#[derive(Default)]
struct Remarks {
    missing: Vec<String>,
    warnings: Vec<String>,
}

impl Calibration {
    /// Adds the remarks on its results and on its data.
    pub(super) fn remark(&mut self, declared: &Declared, readings: &Readings) {
        let mut remarks = Remarks::default();
        remarks.data(declared, readings);
        remarks.health(&self.health, declared, readings);
        if let Some(registration) = &self.registration {
            remarks.registration(registration);
        }
        if let Some(response) = &self.response {
            remarks.response(response, self);
        }
        if let Some(thickness) = &self.thickness {
            remarks.thickness(thickness);
        } else if self.response.is_some() && self.spreads.is_empty() {
            let places = distinct_places(readings.presses.iter().map(|press| press.place_mm)).len();
            remarks.missing.push(format!(
                "Point spread: {} pressed; it takes 9 under one covering, between the elements.",
                number_of(places)
            ));
        }
        self.missing.extend(remarks.missing);
        self.warnings.extend(remarks.warnings);
    }
}

impl Remarks {
    fn data(&mut self, declared: &Declared, readings: &Readings) {
        let unrested = readings.presses.iter().filter(|press| press.rest.is_none()).count();
        if unrested > 0 {
            self.missing
                .push(format!("{unrested} presses have no reading at rest before them and are left out."));
        }
        if readings.frames_left_out > 0 {
            self.warnings.push(format!(
                "{} of {} frames are left out: an element's reading is an outlier.",
                readings.frames_left_out, readings.frames
            ));
        }
        let unknown = readings.presses.iter().filter(|press| declared.indenter(press).is_none()).count();
        if unknown > 0 {
            self.missing
                .push(format!("{unknown} presses are left out: their tool is not in the rig's description."));
        }
    }

    fn health(&mut self, health: &Health, declared: &Declared, readings: &Readings) {
        let presses = across(declared, readings);
        let places = distinct_places(presses.iter().map(|press| press.place_mm)).len();
        if places < WIRING_PLACES_LEAST || !goes_across(declared, presses.into_iter()) {
            self.missing.push(format!(
                "Cross-wired elements: {} pressed; it takes {WIRING_PLACES_LEAST}, some pitches apart, to tell whose signal an \
                 element gives.",
                number_of(places)
            ));
        }
        if !health.not_judged.is_empty() {
            self.missing.push(format!(
                "Health of {} elements: no reference press came near them ({}).",
                health.not_judged.len(),
                listed(&health.not_judged)
            ));
        }
        if health.faults.iter().any(|fault| matches!(fault.kind, FaultKind::Noisy { .. })) {
            self.warnings.push("Noisy elements are left out of all fits, though they may respond.".into());
        }
    }

    fn registration(&mut self, registration: &RegistrationFit) {
        if registration.rotation_deg.is_none() {
            self.missing.push(
                "Rotation: the presses lie too close together, within two pitches; it is taken as declared."
                    .into(),
            );
        }
        if registration.surface_mm.is_none() {
            self.missing.push("Surface: it takes three depths; its height is taken as declared.".into());
        }
        if !registration.left_out.is_empty() {
            self.warnings.push(format!(
                "{} presses contradict the others and are left out of registration and responses.",
                registration.left_out.len()
            ));
        }
        if registration.residual_in_noise > MISFIT {
            self.warnings.push(format!(
                "Residuals of the registration are {:.1} times the noise: the base model lacks something, and errors are wider \
                 for it but may still be too small.",
                registration.residual_in_noise
            ));
        }
        if let Some(scale) = registration.scale
            && !scale.covers(1.0)
            && (scale.value - 1.0).abs() > 1e-3
        {
            self.warnings.push(format!(
                "Distances measured are {:.4} +- {:.4} of those declared: check the element centres and the stage's steps per mm.",
                scale.value, scale.standard_error
            ));
        }
    }

    fn response(&mut self, response: &ResponseFit, calibration: &Calibration) {
        if calibration.registration.is_none() {
            self.warnings.push(
                "Sensitivities rest on the declared place, surface and spread: as far as these are nominal, they are slopes at \
                 the place that was pressed, not the elements' own."
                    .into(),
            );
        }
        if response.residual_in_noise > MISFIT {
            self.warnings.push(format!(
                "Residuals of the responses are {:.1} times the noise: no form tried here is the sensor's, and errors are wider \
                 for it but may still be too small.",
                response.residual_in_noise
            ));
        }
        let flat = response.elements.iter().filter(|one| one.begins_flat()).map(|one| one.element);
        let flat: Vec<usize> = flat.collect();
        if !flat.is_empty() {
            self.warnings.push(format!(
                "The responses of {} elements begin flat ({}): their sensitivity at the surface and their curvature say little \
                 apart from each other. Use them together, within the depths that were pressed.",
                flat.len(),
                listed(&flat)
            ));
        }
        let fitted = |element: usize| response.elements.iter().any(|one| one.element == element);
        let faulty = |element: usize| calibration.health.faults.iter().any(|fault| fault.element == element);
        let without: Vec<usize> = (0..calibration.baseline_counts.len())
            .filter(|&element| !fitted(element) && !faulty(element))
            .collect();
        if !without.is_empty() {
            self.missing.push(format!(
                "Response of {} elements: they were not pressed at their centres ({}).",
                without.len(),
                listed(&without)
            ));
        }
        if response.trials.iter().all(|trial| trial.heldout_rms_counts.is_none()) {
            self.missing.push(match response.form {
                ResponseForm::Linear => "Form of the response: one depth was pressed. It is taken to be linear; as far as it is curved, \
                                 sensitivities and spreads are off by more than their errors say."
                    .into(),
                ResponseForm::SharedQuadratic | ResponseForm::OwnQuadratic => {
                    "Form of the response: it takes three depths in a press to hold one out. One curvature is taken for all."
                        .into()
                }
            });
        }
    }

    fn thickness(&mut self, thickness: &ThicknessFit) {
        if thickness.coverings.len() < 2 {
            self.missing.push(
                "Spread against thickness: one covering was pressed; it takes two for a line, three for a parabola.".into(),
            );
        }
        for covering in &thickness.coverings {
            if covering.p_value.is_some_and(|p_value| p_value < IMPLAUSIBLE)
                && covering.range_mm > NEGLIGIBLE_SHARE * covering.sigma_mm.value
            {
                self.warnings.push(format!(
                    "Under the covering of {:.3} mm the spread changes with depth by {:.3} mm, more than its errors explain.",
                    covering.covering_mm, covering.range_mm
                ));
            }
        }
        if let Some(line) = &thickness.linear {
            let [intercept, slope] = line.coefficients;
            if intercept.value <= 0.0 || slope.value < 0.0 {
                self.warnings.push(format!(
                    "Spread against thickness has intercept {:.3} mm and slope {:.3}, which is no covering's: the model keeps the \
                     declared spread.",
                    intercept.value, slope.value
                ));
            }
        }
        if let Some(line) = &thickness.linear
            && line.p_value.is_some_and(|p_value| p_value < IMPLAUSIBLE)
            && thickness.coverings.iter().any(|one| line.rms_mm > NEGLIGIBLE_SHARE * one.sigma_mm.value)
        {
            self.warnings.push(format!(
                "Spread against thickness is no straight line: points lie {:.3} mm rms off it, more than their errors explain. \
                 The errors of the line are widened accordingly.",
                line.rms_mm
            ));
        }
    }
}

fn listed(elements: &[usize]) -> String {
    elements.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}
