//! What the virtual devices of a simulated rig hide, as the rig file writes it.

use serde::Deserialize;
use tactus_model::Registration;

use super::registration::RawRegistration;
use super::{Miswired, RegistrationError, SimulatedStage, Simulation};
use crate::description::{WrongField, finite, not_negative, positive, range, wrong};

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawSimulation {
    seed: u64,
    noise_rms_counts: f64,
    gain_spread: f64,
    quadratic_per_mm: f64,
    surface_mm: f64,
    registration_error: RawRegistration,
    #[serde(default)]
    miswired: Vec<RawMiswired>,
    stage: RawSimulatedStage,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawMiswired {
    element: usize,
    answers_for: usize,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSimulatedStage {
    lateral_step_mm: f64,
    vertical_step_mm: f64,
    acceleration_mm_per_s2: f64,
    speed_max_mm_per_s: f64,
    travel_mm: [[f64; 2]; 3],
}

impl RawSimulation {
    pub(super) fn check(self, elements: usize) -> Result<Simulation, WrongField> {
        let Registration { origin_mm, rotation_deg } =
            self.registration_error.check("simulation.registration_error")?;
        let miswired = self.miswired.into_iter().map(|raw| raw.check(elements));
        Ok(Simulation {
            seed: self.seed,
            noise_rms_counts: not_negative("simulation.noise_rms_counts", self.noise_rms_counts)?,
            gain_spread: not_negative("simulation.gain_spread", self.gain_spread)?,
            quadratic_per_mm: finite("simulation.quadratic_per_mm", self.quadratic_per_mm)?,
            surface_mm: finite("simulation.surface_mm", self.surface_mm)?,
            registration_error: RegistrationError { origin_mm, rotation_deg },
            miswired: miswired.collect::<Result<_, _>>()?,
            stage: self.stage.check()?,
        })
    }
}

impl RawMiswired {
    fn check(self, elements: usize) -> Result<Miswired, WrongField> {
        let Self { element, answers_for } = self;
        if element < elements && answers_for < elements {
            Ok(Miswired { element, answers_for })
        } else {
            Err(wrong("simulation.miswired", format!("elements are 0 to {}", elements - 1)))
        }
    }
}

impl RawSimulatedStage {
    fn check(self) -> Result<SimulatedStage, WrongField> {
        let field = |name: &str| format!("simulation.stage.{name}");
        let [x_mm, y_mm, z_mm] = self.travel_mm;
        Ok(SimulatedStage {
            lateral_step_mm: positive(field("lateral_step_mm"), self.lateral_step_mm)?,
            vertical_step_mm: positive(field("vertical_step_mm"), self.vertical_step_mm)?,
            acceleration_mm_per_s2: positive(field("acceleration_mm_per_s2"), self.acceleration_mm_per_s2)?,
            speed_max_mm_per_s: positive(field("speed_max_mm_per_s"), self.speed_max_mm_per_s)?,
            travel_mm: [
                range(field("travel_mm[0]"), x_mm)?,
                range(field("travel_mm[1]"), y_mm)?,
                range(field("travel_mm[2]"), z_mm)?,
            ],
        })
    }
}
