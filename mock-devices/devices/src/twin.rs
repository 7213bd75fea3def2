//! The simulation of a rig that has none of its own.

use std::collections::BTreeMap;

use tactus_schema::Rig;
use tactus_schema::rig::{RegistrationError, SimulatedStage, Simulation};

/// The virtual stage's travel reaches this far beyond the rig's envelope, but not above it: it homes there, and no run may begin
/// outside of the envelope.
const MARGIN_MM: f64 = 10.0;

/// A simulated rig that behaves exactly as this one's description says: no noise, no scatter of gains, no errors.
///
/// A dry run on it finds what an experiment will do, and reveals nothing that a simulated rig hides. The kinematics are those
/// of the rig's simulation, or of the paper's stage.
#[must_use]
pub fn twin_of(rig: &Rig) -> Rig {
    Rig { simulated: true, simulation: Some(ideal(rig)), ..rig.clone() }
}

/// The rig's own simulation, or its twin's.
pub fn simulation_of(rig: &Rig) -> Simulation {
    rig.simulation.clone().unwrap_or_else(|| ideal(rig))
}

fn ideal(rig: &Rig) -> Simulation {
    Simulation {
        seed: 0,
        noise_rms_counts: 0.0,
        gain_spread: 0.0,
        quadratic_per_mm: 0.0,
        surface_mm: 0.0,
        registration_error: RegistrationError::default(),
        faults: BTreeMap::new(),
        stage: rig.simulation.as_ref().map_or_else(|| stage_for(rig), |simulation| simulation.stage),
    }
}

/// The paper's stage (platen-forcer, 3 um and 1 um), with travel for the rig's envelope.
fn stage_for(rig: &Rig) -> SimulatedStage {
    let wider = |[least, greatest]: [f64; 2]| [least - MARGIN_MM, greatest + MARGIN_MM];
    let deeper = |[least, greatest]: [f64; 2]| [least - MARGIN_MM, greatest];
    let deepest_mm = -rig.covering.thickness_mm;
    let ([x_mm, y_mm, z_mm], speed_max_mm_per_s) = if let Some(service) = &rig.service {
        let envelope = &service.envelope;
        ([envelope.x_mm, envelope.y_mm, [deepest_mm, envelope.z_max_mm]], envelope.speed_max_mm_per_s)
    } else {
        let [x_mm, y_mm] = rig.array.extent_mm();
        ([x_mm, y_mm, [deepest_mm, 0.0]], 50.0)
    };
    SimulatedStage {
        lateral_step_mm: 0.003,
        vertical_step_mm: 0.001,
        acceleration_mm_per_s2: 500.0,
        speed_max_mm_per_s,
        travel_mm: [wider(x_mm), wider(y_mm), deeper(z_mm)],
    }
}

#[cfg(test)]
#[path = "twin_tests.rs"]
mod tests;
