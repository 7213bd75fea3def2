//! Outside the library: a covering that keeps its volume.

use super::{Definition, Stage, minus};

pub(super) const BULGE: Definition = Definition {
    id: "bulge",
    effect: None,
    about: "u' = u - a depth exp(-((r - r0)/w)^2): an incompressible covering rises in a ring about the tool, which lifts off the elements there",
    is_fine: false,
    make: |knobs| {
        let radius_mm = knobs.between("radius_mm", 4.0, 5.5);
        let width_mm = knobs.between("width_mm", 0.8, 1.5);
        let lift = knobs.scaled("lift", 0.06);
        let centres_mm = knobs.centres_mm();
        Stage::covering(move |now, indentation_mm| {
            let depth_mm = now.touch.depth_mm.max(0.0);
            for (value, centre_mm) in indentation_mm.iter_mut().zip(&centres_mm) {
                let [x, y] = minus(*centre_mm, now.touch.point_mm);
                *value -= lift * depth_mm * (-((x.hypot(y) - radius_mm) / width_mm).powi(2)).exp();
            }
        })
    },
};
