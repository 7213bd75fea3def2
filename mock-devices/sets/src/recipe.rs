//! From a recipe to a data set.

use std::collections::BTreeMap;

use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tactus_hidden::{CATALOGUE, Climate, Definition, Dose, RandomRig};
use tactus_model::effect::{self, EffectError};
use tactus_model::{ModelError, TrajectoryError};
use tactus_schema::Rig;
use tactus_schema::table::Row;

use crate::label::{Label, PhysicsLabel};
use crate::nearest::{ClassFits, Fitter};
use crate::noise::{Noise, NoiseKind};
use crate::oracle::{SeparationOracle, Visit};
use crate::plan::Plan;
use crate::separation::Separation;
use crate::set::DataSet;

/// How to make one data set. Equal recipes make equal sets.
#[derive(Debug, Clone)]
pub struct Recipe {
    /// Name of the set, and prefix of its run ids.
    pub name: String,
    /// Seed of everything random.
    pub seed: u64,
    /// What the stage does.
    pub plan: Plan,
    /// Number of frames; the plan's if `None`.
    pub frames: Option<usize>,
    /// Noise of the readings.
    pub noise: NoiseKind,
    /// Its physics.
    pub content: Content,
    /// How strong each physics is.
    pub amount: Amount,
}

/// Which physics a set has. The default is a random one of the library's effects.
#[derive(Debug, Clone, Default)]
pub struct Content {
    /// Physics by id.
    pub physics: Vec<String>,
    /// A random instance of each of these effects.
    pub effects: Vec<String>,
    /// Number of further effects of the library, all different; 1 if nothing else is given.
    pub combine: Option<usize>,
    /// A random physics outside the library.
    pub outside: bool,
    /// No physics at all.
    pub none: bool,
}

/// How strong each physics is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Amount {
    /// This strength.
    Strength(f64),
    /// The strength at which the physics alone has this [`Separation::z`].
    Separation(f64),
    /// The strength at which the physics alone has this [`Separation::z_beyond_spread`].
    BeyondSpread(f64),
}

/// Why a set cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum RecipeError {
    /// No such physics.
    #[error("no physics {0:?}; `tactus-mock hidden list` names all of them")]
    UnknownPhysics(String),
    /// No physics of that effect.
    #[error("no physics is an instance of the effect {0:?}; `tactus-mock hidden list` names those that are")]
    UnknownEffect(String),
    /// A number is out of its range.
    #[error("{field} must be {range}, not {value}")]
    #[expect(missing_docs, reason = "the message says what each field is")]
    Range { field: &'static str, range: &'static str, value: f64 },
    /// The base model refused its parameters.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The plan made no trajectory.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
    /// The base model does not take an effect.
    #[error(transparent)]
    Effect(#[from] EffectError),
}

/// Uses of random numbers. Each has its own stream.
#[derive(Debug, Clone, Copy)]
enum RandomStream {
    Content,
    Shape,
    Base,
    Plan,
    Climate,
    Thermometer,
    NoiseKind,
    Noise,
    OtherPlan,
    OtherNoise,
}

impl RandomStream {
    /// That of the path of a measurement.
    const fn plan(visit: Visit) -> Self {
        match visit {
            Visit::Own => Self::Plan,
            Visit::Elsewhere | Visit::Later => Self::OtherPlan,
        }
    }

    /// That of its noise.
    const fn noise(visit: Visit) -> Self {
        match visit {
            Visit::Own => Self::Noise,
            Visit::Elsewhere | Visit::Later => Self::OtherNoise,
        }
    }
}

impl Recipe {
    /// A bundle with random noise and one random effect of the library, at strength 1.
    pub fn new(seed: u64) -> Self {
        Self {
            name: "set-0000".into(),
            seed,
            plan: Plan::Bundle,
            frames: None,
            noise: NoiseKind::Any,
            content: Content::default(),
            amount: Amount::Strength(1.0),
        }
    }

    /// Makes the set.
    ///
    /// # Errors
    /// [`RecipeError`] names the unknown physics or effect, or the number out of range.
    pub fn make(&self) -> Result<DataSet, RecipeError> {
        self.check()?;
        let chosen = self.content.choose(&mut self.rng(RandomStream::Content))?;
        let base = self.base()?;
        let oracle = self.oracle(&base, Visit::Own)?;
        let (doses, physics) = self.doses(&chosen, &oracle);
        Ok(self.measured(&oracle, &doses, physics))
    }

    /// The readings of a measurement, with their label.
    pub(crate) fn measured(
        &self,
        oracle: &SeparationOracle<'_>,
        doses: &[Dose],
        mut physics: Vec<PhysicsLabel>,
    ) -> DataSet {
        let base = oracle.base;
        let Readings { rows, clean } = self.read(oracle, doses);
        let Separation { z, z_beyond_spread, .. } = oracle.separation_of(&clean);
        // The separation of a single physics is that of the set.
        if let [only] = &mut physics[..] {
            (only.z, only.z_beyond_spread) = (z, z_beyond_spread);
        }
        let response = base.sensor.model.response();
        let psf = base.sensor.model.psf();
        let label = Label {
            set: self.name.clone(),
            seed: self.seed,
            plan: self.plan,
            frames: rows.len(),
            physics,
            z,
            z_beyond_spread,
            noise: oracle.noise,
            sensitivity_counts_per_mm: response.sensitivity_counts_per_mm.clone(),
            baseline_counts: response.baseline_counts.clone(),
            sigma_intercept_mm: psf.sigma_intercept_mm,
            sigma_per_mm: psf.sigma_per_mm,
        };
        DataSet { rig: base.rig.clone(), rows, label }
    }

    /// The fits of effects of the library, one of which is right, to one physics of this set's label, alone and without noise. They end
    /// with a wrong one that makes [`ClassFits::z_name`] less than `enough`.
    ///
    /// # Errors
    /// As [`Recipe::make`].
    pub fn class_fits(&self, of: &PhysicsLabel, right: &str, enough: f64) -> Result<ClassFits, RecipeError> {
        let right = effect::Definition::find(right)?;
        self.fitted(of, |fitter| fitter.until(right, enough))
    }

    /// The fit of one effect alone.
    ///
    /// # Errors
    /// As [`Recipe::make`].
    pub fn class_fit(&self, of: &PhysicsLabel, effect: &str) -> Result<ClassFits, RecipeError> {
        let definition = effect::Definition::find(effect)?;
        self.fitted(of, |fitter| fitter.one(definition))
    }

    fn fitted(
        &self,
        of: &PhysicsLabel,
        fit: impl Fn(&Fitter<'_>) -> ClassFits,
    ) -> Result<ClassFits, RecipeError> {
        let base = self.base()?;
        let oracle = self.oracle(&base, Visit::Own)?;
        let with = oracle.counts(&base, &[of.dose()?]);
        Ok(fit(&Fitter::new(&oracle, &with)))
    }

    /// The set's sensor.
    pub(crate) fn base(&self) -> Result<RandomRig, RecipeError> {
        Ok(RandomRig::new(self.seed_of(RandomStream::Base))?)
    }

    pub(crate) fn oracle<'a>(
        &self,
        base: &'a RandomRig,
        visit: Visit,
    ) -> Result<SeparationOracle<'a>, RecipeError> {
        let Rig { array, registration, covering, .. } = &base.rig;
        let planned = self.plan.runs(
            array,
            *registration,
            *covering,
            self.frames,
            self.seed_of(RandomStream::plan(visit)),
        )?;
        Ok(SeparationOracle::new(
            base,
            visit,
            planned,
            Climate::new(self.seed_of(RandomStream::Climate)),
            self.rng(RandomStream::Thermometer).random_bool(0.7),
            Noise::draw(self.noise, &mut self.rng(RandomStream::NoiseKind)),
        ))
    }

    /// The dose of each physics, and its label.
    fn doses(
        &self,
        chosen: &[&'static Definition],
        oracle: &SeparationOracle<'_>,
    ) -> (Vec<Dose>, Vec<PhysicsLabel>) {
        let mut seeds = self.rng(RandomStream::Shape);
        let dose_of = |physics: &&'static Definition| {
            let dose = Dose { physics, strength: 1.0, seed: seeds.random() };
            let (dose, separation, reached) = match self.amount {
                Amount::Strength(strength) => {
                    let dose = Dose { strength, ..dose };
                    let is_alone = chosen.len() == 1;
                    (dose, if is_alone { Separation::default() } else { oracle.separation(dose) }, true)
                }
                Amount::Separation(z) => oracle.dose(dose, z, |separation| separation.z),
                Amount::BeyondSpread(z) => oracle.dose(dose, z, |separation| separation.z_beyond_spread),
            };
            let dosed = PhysicsLabel {
                id: physics.id.into(),
                effect: physics.effect.map(Into::into),
                is_library_point: physics.is_library_point,
                z_of_effects: BTreeMap::new(),
                strength: dose.strength,
                z: separation.z,
                z_beyond_spread: separation.z_beyond_spread,
                reached,
                seed: dose.seed,
                parameters: oracle
                    .sensor(oracle.base, &[dose], 0)
                    .parameters()
                    .concat()
                    .into_iter()
                    .collect(),
            };
            (dose, dosed)
        };
        chosen.iter().map(dose_of).unzip()
    }

    /// The readings of all runs.
    fn read(&self, oracle: &SeparationOracle<'_>, doses: &[Dose]) -> Readings {
        let array = &oracle.base.rig.array;
        let mut rng = self.rng(RandomStream::noise(oracle.visit));
        let mut noise_of = oracle.noise.series(&mut rng, array.elements());
        let mut noise_counts = vec![0.0; array.elements()];
        let mut readings = Readings::default();
        for (index, planned) in oracle.planned.iter().enumerate() {
            let mut sensor = oracle.sensor(oracle.base, doses, index);
            let run =
                if oracle.planned.len() == 1 { self.name.clone() } else { format!("{}-{index}", self.name) };
            for (frame, (press, phase)) in planned.phases_of_frames(array.rate_hz()).enumerate() {
                let t_s = frame as f64 / array.rate_hz();
                oracle.step(&mut sensor, t_s, planned);
                noise_of(&mut noise_counts);
                let mut counts = Vec::with_capacity(array.elements());
                for (clean, noise) in sensor.counts().iter().zip(&noise_counts) {
                    #[expect(clippy::cast_possible_truncation, reason = "whole counts below 4096")]
                    counts.push(sensor.read(*clean, *noise) as f32);
                    readings.clean.push(sensor.convert(*clean));
                }
                #[expect(clippy::cast_possible_truncation, reason = "a run of some minutes")]
                let t_ns = (t_s * 1e9).round() as i64;
                let temperature_c = sensor.temperature_c().filter(|_| oracle.has_thermometer);
                readings.rows.push(Row {
                    run: run.clone(),
                    press,
                    phase,
                    t_ns,
                    position_mm: planned.trajectory.at(t_s),
                    covering_mm: planned.covering.thickness_mm,
                    indenter: oracle.base.rig.indenter.clone(),
                    temperature_c,
                    counts,
                });
            }
        }
        readings
    }

    fn check(&self) -> Result<(), RecipeError> {
        let (field, range, value) = match self.amount {
            Amount::Strength(value) => ("strength", "0 or more", value),
            Amount::Separation(value) | Amount::BeyondSpread(value) => ("z", "above 0", value),
        };
        let is_zero_right = matches!(self.amount, Amount::Strength(_));
        if !(value.is_finite() && (value > 0.0 || (is_zero_right && value >= 0.0))) {
            return Err(RecipeError::Range { field, range, value });
        }
        match self.frames {
            Some(0) => Err(RecipeError::Range { field: "frames", range: "1 or more", value: 0.0 }),
            _ => Ok(()),
        }
    }

    fn rng(&self, draw: RandomStream) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(draw as u64);
        rng
    }

    fn seed_of(&self, draw: RandomStream) -> u64 {
        self.rng(draw).random()
    }
}

impl Content {
    /// The chosen physics, in the order of the catalogue.
    fn choose(&self, rng: &mut ChaCha8Rng) -> Result<Vec<&'static Definition>, RecipeError> {
        let mut chosen: Vec<&'static Definition> = Vec::new();
        if self.none {
            return Ok(chosen);
        }
        for id in &self.physics {
            let found = Definition::find(id).ok_or_else(|| RecipeError::UnknownPhysics(id.clone()))?;
            chosen.push(found);
        }
        for effect in &self.effects {
            let found = one_of(rng, |definition| definition.effect == Some(effect.as_str()));
            chosen.push(found.ok_or_else(|| RecipeError::UnknownEffect(effect.clone()))?);
        }
        if self.outside {
            chosen.extend(one_of(rng, |definition| definition.effect.is_none()));
        }
        for _ in 0..self.combine.unwrap_or(usize::from(chosen.is_empty())) {
            let mut effects: Vec<&str> =
                CATALOGUE.iter().filter_map(|definition| definition.effect).collect();
            effects.sort_unstable();
            effects.dedup();
            effects.retain(|effect| chosen.iter().all(|other| other.effect != Some(effect)));
            if let Some(effect) = effects.choose(rng) {
                chosen.extend(one_of(rng, |definition| definition.effect == Some(effect)));
            }
        }
        chosen.sort_by_key(|one| CATALOGUE.iter().position(|other| other.id == one.id));
        Ok(chosen)
    }
}

/// The readings of all runs.
#[derive(Debug, Default)]
struct Readings {
    rows: Vec<Row>,
    /// The counts of all rows without noise and quantisation.
    clean: Vec<f64>,
}

/// A random physics among those that fulfil a condition.
fn one_of(rng: &mut ChaCha8Rng, is_right: impl Fn(&Definition) -> bool) -> Option<&'static Definition> {
    let fitting: Vec<&'static Definition> =
        CATALOGUE.iter().copied().filter(|definition| is_right(definition)).collect();
    fitting.choose(rng).copied()
}

#[cfg(test)]
#[path = "recipe_tests.rs"]
mod tests;
