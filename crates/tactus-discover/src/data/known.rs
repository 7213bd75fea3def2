//! What is known of a rig before anything is fitted.

use std::collections::BTreeMap;

use tactus_model::effect::Definition;
use tactus_model::{Array, Effect, Indenter, Psf, Registration, Response};

/// What is known beforehand: the model with which the data are compared.
#[derive(Debug, Clone)]
pub struct Known {
    /// Geometry and converter of the sensor.
    pub array: Array,
    /// Declared point spread.
    pub psf: Psf,
    /// Declared response of the elements.
    pub response: Response,
    /// Assumed position of the sensor in the robot frame.
    pub registration: Registration,
    /// The indenters by id.
    pub indenters: BTreeMap<String, Indenter>,
    /// Effects of the known model. They are refitted with the rest and never removed.
    pub effects: Vec<Effect>,
    /// Effects that the lab has beside those of the library: drafts.
    pub drafts: Vec<&'static Definition>,
}
