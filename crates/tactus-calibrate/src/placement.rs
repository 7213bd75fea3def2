//! What is declared before a calibration, and where a press lies on the sensor.

use std::collections::BTreeMap;

use tactus_model::{
    Array, Contact, Covering, ForwardModel, Indenter, ModelError, Psf, Registration, Response,
};

use crate::readings::{Dwell, MeasuredPress, Readings};

/// Presses that span this many pitches determine the sensor's rotation.
const SPAN_LEAST_PITCHES: f64 = 2.0;

/// Coverings whose thicknesses differ by less are the same covering.
const SAME_COVERING_MM: f64 = 5e-4;

/// The rig's description: the starting values of a calibration, kept for whatever the data do not determine.
#[derive(Debug, Clone)]
pub struct Declared {
    /// Array, spread, response.
    pub model: ForwardModel,
    /// Where the sensor lies in the robot's frame.
    pub registration: Registration,
    /// The tools, by id.
    pub indenters: BTreeMap<String, Indenter>,
}

/// Where the sensor lies in the robot's frame, its surface included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Placement {
    pub(crate) registration: Registration,
    /// Distances in the robot's frame divided by those in the sensor's frame.
    pub(crate) scale: f64,
    /// Height of the covering's surface, robot frame.
    pub(crate) surface_mm: f64,
}

impl Declared {
    pub(crate) fn array(&self) -> &Array {
        self.model.array()
    }

    /// A model whose elements all read 1 under a reference press of 1 mm, with one spread for all coverings.
    pub(crate) fn unit_model(&self, sigma_mm: f64) -> Result<ForwardModel, ModelError> {
        let declared = self.model.response();
        let response = Response {
            reference_indenter: declared.reference_indenter.clone(),
            reference_covering: declared.reference_covering,
            ..Response::uniform(self.array().elements(), 1.0, 0.0)
        };
        ForwardModel::new(
            self.array().clone(),
            Psf { sigma_intercept_mm: sigma_mm, sigma_per_mm: 0.0 },
            response,
        )
    }

    /// As declared, with the surface at z = 0.
    pub(crate) fn placement(&self) -> Placement {
        Placement { registration: self.registration, scale: 1.0, surface_mm: 0.0 }
    }

    /// The declared spread under a covering.
    pub(crate) fn sigma_mm(&self, covering_mm: f64) -> f64 {
        self.model.psf().sigma_mm(Covering { thickness_mm: covering_mm })
    }

    /// The tool of a press; `None` if the rig does not describe it.
    pub(crate) fn indenter(&self, press: &MeasuredPress) -> Option<&Indenter> {
        self.indenters.get(&*press.indenter)
    }

    /// True if a press was made with the reference tool under the reference covering.
    pub(crate) fn is_reference(&self, press: &MeasuredPress) -> bool {
        let response = self.model.response();
        same_covering(press.covering_mm, response.reference_covering.thickness_mm)
            && self.indenter(press) == Some(&response.reference_indenter)
    }
}

impl Placement {
    /// Converts a position from the robot's frame to the sensor's.
    pub(crate) fn on_sensor(&self, place_mm: [f64; 2]) -> [f64; 2] {
        self.registration.to_sensor(place_mm).map(|along| along / self.scale)
    }

    /// The contact of a dwell in the sensor's frame.
    pub(crate) fn contact(&self, press: &MeasuredPress, dwell: &Dwell, indenter: &Indenter) -> Contact {
        Contact {
            indenter: indenter.clone(),
            position_mm: self.on_sensor(press.place_mm),
            rotation_deg: -self.registration.rotation_deg,
            depth_mm: self.surface_mm - dwell.height_mm,
        }
    }
}

pub(crate) fn same_covering(one_mm: f64, other_mm: f64) -> bool {
    (one_mm - other_mm).abs() < SAME_COVERING_MM
}

/// Thicknesses of the coverings under which `presses` were made, ascending.
pub(crate) fn coverings_mm<'a>(presses: impl Iterator<Item = &'a MeasuredPress>) -> Vec<f64> {
    let mut coverings_mm: Vec<f64> = presses.map(|press| press.covering_mm).collect();
    coverings_mm.sort_by(f64::total_cmp);
    coverings_mm.dedup_by(|next, last| same_covering(*next, *last));
    coverings_mm
}

/// The reference presses of the runs that go across the sensor; of all runs if none does.
///
/// Sweeps over one element have more presses, but tell less about the sensor's pose.
pub(crate) fn across<'a>(declared: &Declared, readings: &'a Readings) -> Vec<&'a MeasuredPress> {
    let of_run = |run: usize| {
        readings
            .presses
            .iter()
            .filter(move |press| press.run == run)
            .filter(|press| declared.is_reference(press))
    };
    let runs = || 0..readings.runs.len();
    let across: Vec<usize> = runs().filter(|run| goes_across(declared, of_run(*run))).collect();
    if across.is_empty() {
        runs().flat_map(of_run).collect()
    } else {
        across.into_iter().flat_map(of_run).collect()
    }
}

/// True if the presses lie far enough apart to determine a rotation.
pub(crate) fn goes_across<'a>(declared: &Declared, presses: impl Iterator<Item = &'a MeasuredPress>) -> bool {
    let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for press in presses {
        for (range, along) in range.iter_mut().zip(press.place_mm) {
            *range = [range[0].min(along), range[1].max(along)];
        }
    }
    range.iter().any(|[least, most]| most - least >= SPAN_LEAST_PITCHES * declared.array().pitch_mm())
}
