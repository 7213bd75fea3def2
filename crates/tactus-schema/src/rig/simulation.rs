//! The rig file's section for the hidden truth of a simulated rig.

use std::collections::BTreeMap;

use serde::Deserialize;
use tactus_model::{Array, Registration};

use super::registration::RawRegistration;
use super::{ElementFault, RegistrationError, SimulatedStage, Simulation};
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
    /// Elements that answer for others: `{ element = 18, answers_for = 19 }`.
    #[serde(default)]
    miswired: Vec<RawMiswired>,
    /// Elements that do not respond to presses; they still have noise.
    #[serde(default)]
    dead: Vec<usize>,
    /// Elements that always read the same: `{ element = 5, counts = 812 }`.
    #[serde(default)]
    stuck: Vec<RawStuck>,
    /// Elements with a noise of their own: `{ element = 7, noise_rms_counts = 25.0 }`.
    #[serde(default)]
    noisy: Vec<RawNoisy>,
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
struct RawStuck {
    element: usize,
    counts: u16,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawNoisy {
    element: usize,
    noise_rms_counts: f64,
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
    pub(super) fn check(self, array: &Array) -> Result<Simulation, WrongField> {
        let faults = self.faults(array)?;
        let Registration { origin_mm, rotation_deg } =
            self.registration_error.check("simulation.registration_error")?;
        Ok(Simulation {
            seed: self.seed,
            noise_rms_counts: not_negative("simulation.noise_rms_counts", self.noise_rms_counts)?,
            gain_spread: not_negative("simulation.gain_spread", self.gain_spread)?,
            quadratic_per_mm: finite("simulation.quadratic_per_mm", self.quadratic_per_mm)?,
            surface_mm: finite("simulation.surface_mm", self.surface_mm)?,
            registration_error: RegistrationError { origin_mm, rotation_deg },
            faults,
            stage: self.stage.check()?,
        })
    }

    /// Merges the four lists; an element has at most one fault.
    fn faults(&self, array: &Array) -> Result<BTreeMap<usize, ElementFault>, WrongField> {
        let mut faults = BTreeMap::new();
        let mut add = |list: &str, element, fault| {
            within(list, element, array)?;
            match faults.insert(element, fault) {
                None => Ok(()),
                Some(_) => Err(wrong(list, format!("element {element} has a fault already: one at most"))),
            }
        };
        for &RawMiswired { element, answers_for } in &self.miswired {
            let list = "simulation.miswired";
            within(list, answers_for, array)?;
            if element == answers_for {
                return Err(wrong(list, format!("element {element} answers for itself; name another")));
            }
            add(list, element, ElementFault::Miswired { answers_for })?;
        }
        for &element in &self.dead {
            add("simulation.dead", element, ElementFault::Dead)?;
        }
        for &RawStuck { element, counts } in &self.stuck {
            let list = "simulation.stuck";
            let range_counts = array.least_counts()..=array.full_scale_counts();
            if !range_counts.contains(&f64::from(counts)) {
                let (least, most) = (range_counts.start(), range_counts.end());
                let problem = format!("counts are {least} to {most}, not {counts}");
                return Err(wrong(list, problem));
            }
            add(list, element, ElementFault::Stuck { counts })?;
        }
        for &RawNoisy { element, noise_rms_counts } in &self.noisy {
            let list = "simulation.noisy";
            let noise_rms_counts = not_negative(list, noise_rms_counts)?;
            add(list, element, ElementFault::Noisy { noise_rms_counts })?;
        }
        Ok(faults)
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

fn within(list: &str, element: usize, array: &Array) -> Result<(), WrongField> {
    if element < array.elements() {
        Ok(())
    } else {
        Err(wrong(list, format!("elements are 0 to {}", array.elements() - 1)))
    }
}
