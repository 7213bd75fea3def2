//! The model of a calibrated sensor.

use std::collections::BTreeMap;

use tactus_calibrate::FaultKind;
use tactus_model::Effect;
use tactus_schema::Model;
use tactus_schema::model::{BaseModel, KnownEffect};

use super::Calibrated;

impl Calibrated {
    /// The rig file's model with the calibrated parameters, and with faulty elements as effects. `None` if no model
    /// parameter was calibrated.
    pub(crate) fn model(&self) -> Option<Model> {
        let declared = Model::of_rig(&self.rig)?.base;
        let psf = self.calibration.psf(declared.psf);
        let responses = self.calibration.responses(&declared.response);
        if psf.is_none() && responses.is_none() {
            return None;
        }
        let mut base =
            BaseModel { noise_rms_counts: self.calibration.noise_rms_counts.unwrap_or(0.0), ..declared };
        if let Some((psf, errors)) = psf {
            (base.psf, base.psf_se) = (psf, errors);
        }
        if let Some((response, [sensitivity, baseline, quadratic])) = responses {
            base.response = response;
            base.sensitivity_counts_per_mm_se = Some(sensitivity);
            base.baseline_counts_se = Some(baseline);
            base.quadratic_per_mm_se = Some(quadratic);
        }
        let faults = self.calibration.health.faults.iter();
        let effects = faults.filter_map(|fault| match fault.kind {
            FaultKind::Dead | FaultKind::Stuck { .. } => miswired(fault.element, fault.element, 0.0),
            FaultKind::CrossWired { answers_for } => miswired(fault.element, answers_for, 1.0),
            // It may still respond, and the model has one noise for all elements.
            FaultKind::Noisy { .. } => None,
        });
        Some(Model { effects: effects.collect(), base })
    }
}

fn miswired(element: usize, answers_for: usize, other_share: f64) -> Option<KnownEffect> {
    let parameters = [
        ("element", element as f64),
        ("answers_for", answers_for as f64),
        ("own_share", 0.0),
        ("other_share", other_share),
    ];
    let effect = Effect::new("miswired", parameters).ok()?;
    Some(KnownEffect { effect, standard_errors: BTreeMap::new(), evidence: None, version: None })
}
