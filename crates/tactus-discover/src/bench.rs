//! What the tests press on.

use tactus_model::{Array, Covering, Indenter, Psf, Registration, Response};

use crate::Known;

/// The paper's sensor and tool, its elements all alike: 1000 counts per mm upon 100.
pub(crate) fn known() -> Known {
    let array = Array::digitacts();
    Known {
        response: Response {
            reference_covering: Covering { thickness_mm: 1.016 },
            ..Response::uniform(array.elements(), 1000.0, 100.0)
        },
        array,
        psf: Psf::PAPER,
        registration: Registration { origin_mm: [0.0, 0.0], rotation_deg: 0.0 },
        indenters: [("cyl1".to_owned(), Indenter::Cylinder { diameter_mm: 1.0 })].into(),
        effects: Vec::new(),
    }
}
