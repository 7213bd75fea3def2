//! The rig as clients draw it.

use tactus_model::Indenter;
use tactus_schema::{Rig, pb};

/// `None` for a rig without a service part, which has no service.
pub(super) fn describe(rig: &Rig) -> Option<pb::RigDescription> {
    let service = rig.service.as_ref()?;
    let (envelope, motion, array) = (&service.envelope, &service.motion, &rig.array);
    let (indenter_shape, indenter_width_mm) = rig.mounted().map(|tool| tip(&tool)).unwrap_or_default();
    Some(pb::RigDescription {
        col_centres_mm: array.col_centres_mm().to_vec(),
        row_centres_mm: array.row_centres_mm().to_vec(),
        element_mm: array.element_mm().to_vec(),
        origin_mm: rig.registration.origin_mm.to_vec(),
        rotation_deg: rig.registration.rotation_deg,
        rate_hz: array.rate_hz(),
        full_scale_counts: array.full_scale_counts(),
        baseline_counts: rig.baseline_counts.clone(),
        covering_mm: rig.covering.thickness_mm,
        indenter: rig.indenter.clone(),
        indenter_shape,
        indenter_width_mm,
        x_mm: envelope.x_mm.to_vec(),
        y_mm: envelope.y_mm.to_vec(),
        z_max_mm: envelope.z_max_mm,
        depth_max_mm: envelope.depth_max_mm(rig.covering),
        element_max_counts: envelope.element_max_counts,
        sum_max_counts: envelope.sum_max_counts,
        baseline_band_counts: envelope.baseline_band_counts,
        safe_height_mm: motion.safe_height_mm,
        approach_height_mm: motion.approach_height_mm,
        unwatched_elements: envelope
            .unwatched_elements
            .iter()
            .filter_map(|&element| u32::try_from(element).ok())
            .collect(),
    })
}

/// Shape of a tool in a word, and the width of its tip along x in mm; 0 if that is not known.
fn tip(tool: &Indenter) -> (String, f64) {
    let (shape, width_mm) = match tool {
        Indenter::Cylinder { diameter_mm } => ("cylinder", *diameter_mm),
        Indenter::Sphere { diameter_mm } => ("sphere", *diameter_mm),
        Indenter::Cone { diameter_mm, .. } => ("cone", *diameter_mm),
        Indenter::Box { size_mm: [width_mm, _] } => ("box", *width_mm),
        Indenter::Mesh(_) => ("mesh", 0.0),
    };
    (shape.to_owned(), width_mm)
}
