//! What is known before a calibration, and how a press stands on the sensor.

use std::collections::BTreeMap;

use tactus_model::{
    Array, Contact, Covering, ForwardModel, Indenter, ModelError, Psf, Registration, Response,
};

use crate::readings::{Dwell, MeasuredPress, Readings};

/// Presses go across the sensor if these many pitches lie between them: then they tell its rotation.
const SPAN_LEAST_PITCHES: f64 = 2.0;

/// Thicknesses that differ by less are those of one covering.
const SAME_COVERING_MM: f64 = 5e-4;

/// What the rig's description says: where a calibration starts, and what it keeps where the data say nothing.
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
pub(crate) struct Setting {
    pub(crate) registration: Registration,
    /// Distances in the robot's frame over those in the sensor's.
    pub(crate) scale: f64,
    /// Height of the covering's surface, robot frame.
    pub(crate) surface_mm: f64,
}

impl Declared {
    pub(crate) fn array(&self) -> &Array {
        self.model.array()
    }

    /// Elements that all answer with 1 to the reference press of 1 mm, under one spread for all coverings.
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

    /// As declared: at z = 0 stands the surface.
    pub(crate) fn setting(&self) -> Setting {
        Setting { registration: self.registration, scale: 1.0, surface_mm: 0.0 }
    }

    /// The declared spread under a covering.
    pub(crate) fn sigma_mm(&self, covering_mm: f64) -> f64 {
        self.model.psf().sigma_mm(Covering { thickness_mm: covering_mm })
    }

    /// The tool of a press.
    pub(crate) fn indenter(&self, press: &MeasuredPress) -> Option<&Indenter> {
        self.indenters.get(&*press.indenter)
    }

    /// True if a press is of the kind for which sensitivity is stated, in tool and covering.
    pub(crate) fn is_reference(&self, press: &MeasuredPress) -> bool {
        let response = self.model.response();
        same_covering(press.covering_mm, response.reference_covering.thickness_mm)
            && self.indenter(press) == Some(&response.reference_indenter)
    }
}

impl Setting {
    /// A place on the sensor, of a place in the robot's frame.
    pub(crate) fn on_sensor(&self, place_mm: [f64; 2]) -> [f64; 2] {
        self.registration.to_sensor(place_mm).map(|along| along / self.scale)
    }

    /// How a press stands on the sensor at a dwell.
    pub(crate) fn contact(&self, press: &MeasuredPress, dwell: &Dwell, indenter: &Indenter) -> Contact {
        Contact {
            indenter: indenter.clone(),
            position_mm: self.on_sensor(press.place_mm),
            rotation_deg: -self.registration.rotation_deg,
            depth_mm: self.surface_mm - dwell.height_mm,
        }
    }
}

/// True if two thicknesses are one covering's.
pub(crate) fn same_covering(one_mm: f64, other_mm: f64) -> bool {
    (one_mm - other_mm).abs() < SAME_COVERING_MM
}

/// The coverings pressed, by thickness.
pub(crate) fn coverings_mm<'a>(presses: impl Iterator<Item = &'a MeasuredPress>) -> Vec<f64> {
    let mut coverings_mm: Vec<f64> = presses.map(|press| press.covering_mm).collect();
    coverings_mm.sort_by(f64::total_cmp);
    coverings_mm.dedup_by(|next, last| same_covering(*next, *last));
    coverings_mm
}

/// The reference presses of the runs that go across the sensor; where none does, all reference presses.
///
/// Sweeps over one element would outweigh them and tell less.
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

/// True if presses lie so far apart that they tell a rotation.
pub(crate) fn goes_across<'a>(declared: &Declared, presses: impl Iterator<Item = &'a MeasuredPress>) -> bool {
    let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for press in presses {
        for (range, along) in range.iter_mut().zip(press.place_mm) {
            *range = [range[0].min(along), range[1].max(along)];
        }
    }
    range.iter().any(|[least, most]| most - least >= SPAN_LEAST_PITCHES * declared.array().pitch_mm())
}
