//! What a simulated rig hides from the service: the truth that a calibration estimates.

use std::collections::BTreeMap;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tactus_hidden::{Climate, Dose, HiddenSensor};
use tactus_model::{
    Covering, Effect, EffectError, ForwardModel, Indenter, Pipeline, Readout, Registration, Response,
    Simulator,
};
use tactus_schema::Rig;
use tactus_schema::rig::{ElementFault, GrblAxes, SimulatedStage, Simulation, StageProtocol};

use crate::sensor_model::SensorModel;
use crate::twin::simulation_of;

/// The true sensor, stage and tool behind a rig description.
#[derive(Debug, Clone)]
pub struct Truth {
    /// The seed of everything random.
    pub seed: u64,
    /// The base model with each element's true sensitivity.
    pub model: ForwardModel,
    /// Effects beyond the base model, without the faults of elements.
    pub effects: Vec<Effect>,
    /// Hidden physics. If there is any, `effects` are not used.
    pub physics: Vec<Dose>,
    /// Noise, saturation and quantisation of the converter.
    pub readout: Readout,
    /// Faults of elements, by index.
    pub faults: BTreeMap<usize, ElementFault>,
    /// Standard deviation of an element's noise, unless its fault is `Noisy`.
    pub noise_rms_counts: f64,
    /// True registration of the sensor in the robot frame.
    pub registration: Registration,
    /// True height of the covering's surface when the rig is switched on; the service believes 0.
    pub surface_mm: f64,
    /// The tool on the stage.
    pub indenter: Indenter,
    /// Steps, acceleration, speed and travel of the stage.
    pub stage: SimulatedStage,
    /// Protocol of its controller, and directions of its axes.
    pub stage_protocol: StageProtocol,
}

/// Uses of random numbers. Each has its own stream, so that one does not disturb the others.
#[derive(Debug, Clone, Copy)]
pub(crate) enum RandomStream {
    Gains,
    Noise,
    SensorLink,
    StageLink,
    StageController,
    ToStage,
    FromStage,
    ToSensor,
    FromSensor,
}

impl RandomStream {
    /// The stream's generator for a seed.
    pub(crate) fn rng(self, seed: u64) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(self as u64);
        rng
    }
}

impl Truth {
    /// The truth of a rig by its own simulation, or of its twin if it has none.
    ///
    /// # Panics
    /// As [`Truth::of`].
    pub fn of_rig(rig: &Rig, seed: u64) -> Self {
        Self::of(rig, &simulation_of(rig), seed)
    }

    /// The truth of a rig whose simulation is `simulation`.
    ///
    /// # Panics
    /// If the rig was not made by its own constructors, which check what is needed here.
    #[expect(clippy::expect_used, reason = "a checked rig lists its tools, and makes a model")]
    pub fn of(rig: &Rig, simulation: &Simulation, seed: u64) -> Self {
        let tool = |id: &str| rig.indenters.get(id).cloned().expect("a rig's tools are listed");
        let response = Response {
            sensitivity_counts_per_mm: spread(
                &rig.sensitivity_counts_per_mm,
                simulation.gain_spread,
                simulation.seed,
            ),
            baseline_counts: rig.baseline_counts.clone(),
            quadratic_per_mm: vec![simulation.quadratic_per_mm; rig.array.elements()],
            reference_indenter: tool(&rig.sensitivity_reference.indenter),
            reference_covering: rig.sensitivity_reference.covering,
        };
        let model = ForwardModel::new(rig.array.clone(), rig.psf, response).expect("a rig makes a model");
        let error = simulation.registration_error;
        Self {
            seed,
            model,
            effects: Vec::new(),
            physics: Vec::new(),
            readout: Readout::of(&rig.array),
            faults: simulation.faults.clone(),
            noise_rms_counts: simulation.noise_rms_counts,
            registration: Registration {
                origin_mm: std::array::from_fn(|axis| {
                    rig.registration.origin_mm[axis] + error.origin_mm[axis]
                }),
                rotation_deg: rig.registration.rotation_deg + error.rotation_deg,
            },
            surface_mm: simulation.surface_mm,
            indenter: tool(&rig.indenter),
            stage: simulation.stage,
            stage_protocol: rig.service.as_ref().map_or_else(
                || StageProtocol::Grbl(GrblAxes::default()),
                |service| service.stage.protocol.clone(),
            ),
        }
    }

    /// The sensor under a covering. It contains no stuck and noisy elements: these faults are applied to the readings.
    pub(crate) fn sensor_model(&self, covering: Covering) -> Result<Box<dyn SensorModel>, EffectError> {
        let sensor = self.sensor(covering)?;
        if self.physics.is_empty() {
            return Ok(Box::new(Pipeline::new(&sensor)?));
        }
        let mut sensor = HiddenSensor::new(&sensor, &self.physics, Climate::new(self.seed), self.seed);
        sensor.wire(self.wiring().collect());
        Ok(Box::new(sensor))
    }

    /// Rewired elements: the element, the element whose signal it gives, and the share of it.
    fn wiring(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        self.faults.iter().filter_map(|(element, fault)| match fault {
            ElementFault::Miswired { answers_for } => Some((*element, *answers_for, 1.0)),
            ElementFault::Dead => Some((*element, *element, 0.0)),
            ElementFault::Stuck { .. } | ElementFault::Noisy { .. } => None,
        })
    }

    fn sensor(&self, covering: Covering) -> Result<Simulator, EffectError> {
        let faults = self.wiring().map(|(element, answers_for, share)| answers(element, answers_for, share));
        Ok(Simulator {
            model: self.model.clone(),
            registration: self.registration,
            surface_mm: self.surface_mm,
            covering,
            indenter: self.indenter.clone(),
            effects: self.effects.iter().cloned().map(Ok).chain(faults).collect::<Result<_, _>>()?,
            noise_rms_counts: self.noise_rms_counts,
        })
    }
}

/// Each declared sensitivity times one plus a normal deviate of standard deviation `spread`.
fn spread(declared: &[f64], spread: f64, seed: u64) -> Vec<f64> {
    let mut rng = RandomStream::Gains.rng(seed);
    let deviates = StandardNormal.sample_iter(&mut rng);
    declared
        .iter()
        .zip(deviates)
        .map(|(declared, deviate): (_, f64)| declared * (1.0 + spread * deviate))
        .collect()
}

/// An element that gives a share of another's signal in place of its own.
fn answers(element: usize, answers_for: usize, share: f64) -> Result<Effect, EffectError> {
    let parameters = [
        ("element", element as f64),
        ("answers_for", answers_for as f64),
        ("own_share", 0.0),
        ("other_share", share),
    ];
    Effect::new("miswired", parameters)
}
