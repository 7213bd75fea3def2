//! The virtual sensor that replaces the paper's: a simulation with gain differences, noise and a converter.

use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use tactus_model::{Array, Contact, Covering, ForwardModel, ModelError, Psf, Readout, Response};

use super::{COVERINGS, REFERENCE_INDENTER};
use crate::fit::Polynomial;

/// Mean sensitivity to the reference press (paper, Fig. 2), in counts per mm.
const SENSITIVITY_COUNTS_PER_MM: f64 = 600.0;
/// Relative standard deviation of the elements' gains.
pub(super) const GAIN_SPREAD: f64 = 0.08;
/// Standard deviation of the noise of one reading, in counts.
pub(super) const NOISE_COUNTS: f64 = 2.0;
/// Reading at rest, in counts.
const BASELINE_COUNTS: f64 = 40.0;
/// Readings averaged in each contact: 250 ms at 30 Hz (paper, Sec. 2.1).
const READINGS: u32 = 8;
/// Depths of the presses to which an element's linear response is fitted (paper, Sec. 2.1).
const DEPTHS_MM: [f64; 5] = [0.2, 0.3, 0.4, 0.5, 0.6];

/// A simulated array of different elements, each corrected by its fitted linear response (paper, Sec. 2.2).
pub(super) struct VirtualSensor {
    model: ForwardModel,
    readout: Readout,
    rng: ChaCha8Rng,
    /// Fitted counts against depth, one line per element.
    responses: Vec<Polynomial>,
}

impl VirtualSensor {
    /// Draws random elements and calibrates them under the thinnest covering.
    pub(super) fn new(array: Array, seed: u64) -> Result<Self, ModelError> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let elements = array.elements();
        let readout = Readout::of(&array);
        let mut gain = || 1.0 + GAIN_SPREAD * normal(&mut rng);
        let response = Response {
            sensitivity_counts_per_mm: (0..elements).map(|_| SENSITIVITY_COUNTS_PER_MM * gain()).collect(),
            baseline_counts: vec![BASELINE_COUNTS; elements],
            quadratic_per_mm: vec![0.0; elements],
            reference_indenter: REFERENCE_INDENTER,
            reference_covering: COVERINGS[0],
        };
        let model = ForwardModel::new(array, Psf::PAPER, response)?;
        let mut sensor = Self { model, readout, rng, responses: Vec::new() };
        sensor.responses = (0..elements).filter_map(|element| sensor.calibrated(element)).collect();
        Ok(sensor)
    }

    /// Equivalent indentation of each element from its readings, in mm.
    pub(super) fn indentation_mm(&mut self, contact: &Contact, covering: Covering) -> Vec<f64> {
        let mut counts = self.counts(contact, covering);
        for (value, response) in counts.iter_mut().zip(&self.responses) {
            if let [offset, slope] = response.coefficients.as_slice() {
                *value = (*value - offset.value) / slope.value;
            }
        }
        counts
    }

    /// Line fitted to an element's readings in presses at its centre.
    fn calibrated(&mut self, element: usize) -> Option<Polynomial> {
        let position_mm = self.model.array().centre_mm(element)?;
        let presses = DEPTHS_MM.map(|depth_mm| {
            let contact = Contact { indenter: REFERENCE_INDENTER, position_mm, rotation_deg: 0.0, depth_mm };
            [depth_mm, self.counts(&contact, COVERINGS[0])[element]]
        });
        Polynomial::fit(1, &presses)
    }

    /// Mean reading of each element over one contact.
    fn counts(&mut self, contact: &Contact, covering: Covering) -> Vec<f64> {
        let mut counts = vec![0.0; self.model.array().elements()];
        self.model.image(contact, covering, &mut counts);
        for value in &mut counts {
            let read = |_| self.readout.read(*value, NOISE_COUNTS * normal(&mut self.rng));
            *value = (0..READINGS).map(read).sum::<f64>() / f64::from(READINGS);
        }
        counts
    }
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}
