//! How far physics is from the base model on the runs of one set.

use std::sync::Arc;

use tactus_hidden::{Climate, Dose, HiddenSensor, RandomRig, STRENGTH_MAX};
use tactus_model::effect::EffectError;
use tactus_model::{Effect, Images, Moment, Path, Pipeline, Simulator, Trajectory};

use crate::noise::Noise;
use crate::plan::PlannedRun;
use crate::separation::Separation;

/// A measurement of a set's sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Visit {
    /// The set's own.
    Own,
    /// On another path, with other noise.
    Elsewhere,
    /// The same, [`LATER_S`] later.
    Later,
}

/// Time from the set's own measurement to a later one.
const LATER_S: f64 = 3600.0;

impl Visit {
    const fn begin_s(self) -> f64 {
        match self {
            Self::Own | Self::Elsewhere => 0.0,
            Self::Later => LATER_S,
        }
    }
}

const STRENGTH_MIN: f64 = 1e-5;
const TRIALS_MAX: usize = 24;
/// Relative tolerance of a requested separation.
const CLOSE: f64 = 0.01;

/// Computes how far physics is from the base model on the runs of one set.
pub(crate) struct SeparationOracle<'a> {
    pub(crate) base: &'a RandomRig,
    pub(crate) visit: Visit,
    pub(crate) planned: Vec<PlannedRun>,
    pub(crate) climate: Climate,
    /// True if the table tells the temperature.
    pub(crate) has_thermometer: bool,
    pub(crate) noise: Noise,
    /// Counts of all frames, without physics and noise.
    pub(crate) clean: Vec<f64>,
    /// The same with a spread that is [`WIDER`] times as wide.
    wider: Vec<f64>,
}

/// The spread of [`SeparationOracle::wider`], as a multiple of the true one.
pub(crate) const WIDER: f64 = 1.001;
/// The search for the nearest spread ends when its change is below this share, or after this many rounds.
const SPREAD_CHANGE_LEAST: f64 = 5e-4;
const SPREAD_ROUNDS: usize = 3;

impl<'a> SeparationOracle<'a> {
    pub(crate) fn new(
        base: &'a RandomRig,
        visit: Visit,
        planned: Vec<PlannedRun>,
        climate: Climate,
        has_thermometer: bool,
        noise: Noise,
    ) -> Self {
        let (clean, wider) = (Vec::new(), Vec::new());
        let mut oracle = Self { base, visit, planned, climate, has_thermometer, noise, clean, wider };
        oracle.clean = oracle.counts(base, &[]);
        oracle.wider =
            base.spread_by(WIDER).map_or_else(|_| oracle.clean.clone(), |wider| oracle.counts(&wider, &[]));
        oracle
    }

    pub(crate) fn sensor(&self, base: &RandomRig, doses: &[Dose], run: usize) -> HiddenSensor {
        let covering = self.planned[run].covering;
        HiddenSensor::new(&Simulator { covering, ..base.sensor.clone() }, doses, self.climate, run as u64)
    }

    /// A step of a sensor along a run, at a time since its start.
    pub(crate) fn step(&self, sensor: &mut HiddenSensor, t_s: f64, run: &PlannedRun) {
        let begin_s = self.visit.begin_s();
        sensor.step(begin_s + t_s, &Delayed { path: &run.trajectory, begin_s });
    }

    /// Counts of all frames that the base model has with an effect, without noise.
    pub(crate) fn modelled(
        &self,
        base: &RandomRig,
        effect: &Effect,
        images: &Arc<Images>,
    ) -> Result<Vec<f64>, EffectError> {
        // Quantisation acts in the converter, which rounds to the declared step as well: a divisor of any other.
        let is_converted =
            effect.name() == "quantisation" && effect.value("step_counts").is_some_and(|step| step > 0.0);
        let rate_hz = base.rig.array.rate_hz();
        let mut all = Vec::with_capacity(self.clean.len());
        for run in &self.planned {
            let effects = vec![effect.clone()];
            let simulator = Simulator { covering: run.covering, effects, ..base.sensor.clone() };
            let mut pipeline = Pipeline::new(&simulator)?;
            pipeline.share(Arc::clone(images));
            for frame in 0..run.frames {
                let t_s = frame as f64 / rate_hz;
                let temperature_c = self.has_thermometer.then(|| self.climate.at(self.visit.begin_s() + t_s));
                pipeline.step(Moment { t_s, temperature_c }, &run.trajectory);
                all.extend(pipeline.counts());
                if is_converted {
                    let from = all.len() - pipeline.counts().len();
                    for count in &mut all[from..] {
                        *count = pipeline.read(*count, 0.0);
                    }
                }
            }
        }
        Ok(all)
    }

    /// Counts of all frames without noise.
    pub(crate) fn counts(&self, base: &RandomRig, doses: &[Dose]) -> Vec<f64> {
        let rate_hz = base.rig.array.rate_hz();
        let mut counts = Vec::new();
        for (index, run) in self.planned.iter().enumerate() {
            let mut sensor = self.sensor(base, doses, index);
            for frame in 0..run.frames {
                self.step(&mut sensor, frame as f64 / rate_hz, run);
                counts.extend(sensor.counts().iter().map(|count| sensor.convert(*count)));
            }
        }
        counts
    }

    pub(crate) fn separation(&self, dose: Dose) -> Separation {
        self.separation_of(&self.counts(self.base, &[dose]))
    }

    pub(crate) fn sigma_counts(&self) -> f64 {
        self.noise.effective_rms_counts(self.base.rig.array.step_counts())
    }

    /// How far counts are from the base model.
    pub(crate) fn separation_of(&self, with: &[f64]) -> Separation {
        let counts_at = |spread: f64| Some(self.counts(&self.base.spread_by(spread).ok()?, &[]));
        self.separation_from([&self.clean, &self.wider], counts_at, with)
    }

    /// How far counts are from those of another model: those that it has with the true spread and with a wider one, and those with any
    /// multiple of it.
    pub(crate) fn separation_from(
        &self,
        [true_spread, wider]: [&[f64]; 2],
        counts_at: impl Fn(f64) -> Option<Vec<f64>>,
        with: &[f64],
    ) -> Separation {
        let array = &self.base.rig.array;
        let sigma_counts = self.sigma_counts();
        let from = |clean: &[f64], wider: &[f64]| {
            Separation::new(clean, with, wider, array.elements(), sigma_counts)
        };
        let mut separation = from(true_spread, wider);
        // Counts are linear only in small changes of the spread: a large change is compared again at the new spread.
        let mut spread = 1.0;
        for _ in 0..SPREAD_ROUNDS {
            let change = (WIDER - 1.0) * separation.spread_steps;
            if change.abs() < SPREAD_CHANGE_LEAST {
                break;
            }
            spread *= (1.0 + change).clamp(0.8, 1.25);
            let (Some(near), Some(wider)) = (counts_at(spread), counts_at(WIDER * spread)) else {
                break;
            };
            let nearer = from(&near, &wider);
            let z_beyond_spread = nearer.z_beyond_spread.min(separation.z_beyond_spread);
            separation = Separation { z_beyond_spread, spread_steps: nearer.spread_steps, ..separation };
        }
        separation
    }

    /// Finds the strength at which a physics has the separation `wanted`. Returns the dose, its separation, and whether
    /// that is the one wanted. If no strength has it (an element is dead or not), the result is the nearest.
    ///
    /// Each step first guesses that separation is proportional to strength.
    pub(crate) fn dose(
        &self,
        dose: Dose,
        wanted: f64,
        z_of: fn(&Separation) -> f64,
    ) -> (Dose, Separation, bool) {
        let (mut low, mut high) = (STRENGTH_MIN, STRENGTH_MAX);
        let mut strength: f64 = 1.0;
        let mut nearest = (dose, Separation::default(), f64::INFINITY);
        for _ in 0..TRIALS_MAX {
            let tried = Dose { strength, ..dose };
            let separation = self.separation(tried);
            let z = z_of(&separation);
            let off = (z / wanted).ln().abs();
            if off < nearest.2 {
                nearest = (tried, separation, off);
            }
            if off <= CLOSE || low >= 0.999 * high {
                break;
            }
            if z < wanted {
                low = strength;
            } else {
                high = strength;
            }
            let guess = strength * (wanted / z).clamp(0.05, 20.0);
            strength = if guess > low * 1.001 && guess < high * 0.999 {
                guess
            } else if guess >= STRENGTH_MAX && high >= STRENGTH_MAX {
                STRENGTH_MAX
            } else {
                (low * high).sqrt()
            };
        }
        let (dose, separation, off) = nearest;
        (dose, separation, off <= 2.0 * CLOSE)
    }
}

/// A path that begins later.
struct Delayed<'a> {
    path: &'a Trajectory,
    begin_s: f64,
}

impl Path for Delayed<'_> {
    fn at(&self, t_s: f64) -> [f64; 3] {
        self.path.at(t_s - self.begin_s)
    }
}
