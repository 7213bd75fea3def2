//! A rig drawn from a seed: what a lab declares, and the true sensor.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tactus_model::{
    Array, Covering, ForwardModel, Indenter, ModelError, Psf, Registration, Response, Simulator,
};
use tactus_schema::Rig;
use tactus_schema::rig::SensitivityReference;

/// A rig as declared, and the true sensor behind it. A recalibration finds the difference: gains scatter by 10 % from
/// element to element, baselines are 80 to 120 counts, both parameters of the spread are off by up to 5 %.
#[derive(Debug, Clone)]
pub struct RandomRig {
    /// The rig in the measurement table.
    pub rig: Rig,
    /// The true base model, without effects and noise.
    pub sensor: Simulator,
}

impl RandomRig {
    /// The rig of a seed. Registration and surface are as declared.
    ///
    /// # Errors
    /// None for any seed: the parameters are within the model's ranges.
    pub fn new(seed: u64) -> Result<Self, ModelError> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let array = Array::digitacts();
        let indenter = Indenter::Cylinder { diameter_mm: 1.0 };
        let covering = Covering { thickness_mm: 1.016 };
        let registration = Registration {
            origin_mm: [20.0 + rng.random_range(-2.0..2.0), 15.0 + rng.random_range(-2.0..2.0)],
            rotation_deg: rng.random_range(-3.0..3.0),
        };
        let declared = Response::uniform(array.elements(), 1000.0, 100.0);
        let mut gain = || {
            let deviate: f64 = StandardNormal.sample(&mut rng);
            1.0 + 0.1 * deviate.clamp(-3.0, 3.0)
        };
        let sensitivities =
            declared.sensitivity_counts_per_mm.iter().map(|declared| declared * gain()).collect();
        let baseline_counts = (0..array.elements()).map(|_| rng.random_range(80.0..120.0)).collect();
        let response =
            Response { sensitivity_counts_per_mm: sensitivities, baseline_counts, ..declared.clone() };
        let psf = Psf {
            sigma_intercept_mm: Psf::PAPER.sigma_intercept_mm * rng.random_range(0.95..1.05),
            sigma_per_mm: Psf::PAPER.sigma_per_mm * rng.random_range(0.95..1.05),
        };
        let rig = Rig {
            name: "sim".into(),
            simulated: true,
            array: array.clone(),
            registration,
            psf: Psf::PAPER,
            sensitivity_counts_per_mm: declared.sensitivity_counts_per_mm,
            sensitivity_reference: SensitivityReference { indenter: "cyl1".into(), covering },
            baseline_counts: declared.baseline_counts,
            indenters: [("cyl1".to_owned(), indenter.clone())].into(),
            indenter: "cyl1".into(),
            covering,
            service: None,
            simulation: None,
        };
        let sensor = Simulator {
            model: ForwardModel::new(array, psf, response)?,
            registration,
            surface_mm: 0.0,
            covering,
            indenter,
            effects: Vec::new(),
            noise_rms_counts: 0.0,
        };
        Ok(Self { rig, sensor })
    }

    /// The same sensor with a spread that is `by` times as wide.
    ///
    /// # Errors
    /// If the model does not accept that spread.
    pub fn spread_by(&self, by: f64) -> Result<Self, ModelError> {
        let model = &self.sensor.model;
        let Psf { sigma_intercept_mm, sigma_per_mm } = model.psf();
        let psf = Psf { sigma_intercept_mm: by * sigma_intercept_mm, sigma_per_mm: by * sigma_per_mm };
        let model = ForwardModel::new(model.array().clone(), psf, model.response().clone())?;
        Ok(Self { rig: self.rig.clone(), sensor: Simulator { model, ..self.sensor.clone() } })
    }
}
