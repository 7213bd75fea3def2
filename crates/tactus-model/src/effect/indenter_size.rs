//! `indenter-size`: the tool is not as wide as declared.
//!
//! ```text
//! width = ratio x declared width
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `ratio` | - | 1 | 0.2 to 5 | true width over declared width; may be a table of `depth_mm`, as for a rounded rim, or of `time_s`, as for a tool that wears |
//!
//! The width is the diameter of a cylinder, sphere or cone (a cone keeps its angle), both sides of a box, and x and y of a
//! mesh. Sensitivity is stated for the reference tool as declared, and does not change.
//!
//! # Source
//! The tolerance of a tool. The paper gives 1 mm without a tolerance.

use std::sync::Arc;

use super::{By, Definition, Make, Now, OnContact, Parameter};
use crate::trace::Covariate;
use crate::{Contact, Indenter};

pub(super) static DEFINITION: Definition = Definition {
    name: "indenter-size",
    summary: "the tool is wider or narrower than declared",
    parameters: &[Parameter::real("ratio", 1.0, [0.2, 5.0]).or_table_of(&[By::Depth, By::Time])],
    near_twins: &["indenter-tilt", "anisotropic-spread", "sigma_intercept_mm", "sensitivity_counts_per_mm"],
    acts_by: &[Covariate::Distance, Covariate::ShareOfLargest, Covariate::Depth, Covariate::Time],
    shown_by: &["grid-sweep", "element-centres"],
    curve: None,
    make: Make::Contact(|values| Box::new(IndenterSize { ratio: values[0] })),
};

#[derive(Debug)]
struct IndenterSize {
    ratio: f64,
}

impl OnContact for IndenterSize {
    fn touch(&self, _: Now<'_>, contact: &mut Contact) {
        match &mut contact.indenter {
            Indenter::Cylinder { diameter_mm }
            | Indenter::Sphere { diameter_mm }
            | Indenter::Cone { diameter_mm, .. } => *diameter_mm *= self.ratio,
            Indenter::Box { size_mm } => *size_mm = size_mm.map(|side_mm| side_mm * self.ratio),
            Indenter::Mesh(mesh) => {
                // A tool that would be larger than any tool keeps its size.
                if let Ok(wider) =
                    mesh.turned([[self.ratio, 0.0, 0.0], [0.0, self.ratio, 0.0], [0.0, 0.0, 1.0]])
                {
                    *mesh = Arc::new(wider);
                }
            }
        }
    }
}

#[cfg(test)]
#[path = "indenter_size_tests.rs"]
mod tests;
