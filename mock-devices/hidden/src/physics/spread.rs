//! Covering: how far a press spreads, and differences over the array.

use std::f64::consts::PI;

use tactus_solid::layered::{BaseContact, Layer};

use super::{Definition, Knobs, PipelineHook, left, minus, scale};

pub(super) const LAYERED_TAIL: Definition = Definition {
    id: "layered-tail",
    effect: Some("heavy-tail"),
    is_library_point: false,
    about: "G' = (1 - w) G + w p(r), p the elastic layer's pressure (Hankel transform): a thick soft bed below the sensor",
    is_fine: false,
    make: |knobs| {
        // A layer's pressure is most like a Gaussian of 0.48 of its thickness (nu 0.3).
        let thickness_mm = knobs.between("wider_by", 1.8, 2.5) * knobs.sigma_mm() / 0.48;
        let layer = Layer::new(thickness_mm, 0.3, BaseContact::Bonded).map(|layer| layer.under_point());
        tail(knobs, |distance_mm| layer.as_ref().map_or(0.0, |under| under.pressure_per_mm2(distance_mm)))
    },
};

pub(super) const EXPONENTIAL_TAIL: Definition = Definition {
    id: "exponential-tail",
    effect: Some("heavy-tail"),
    is_library_point: false,
    about: "G' = (1 - w) G + w exp(-r/l) / (2 pi l^2): the skin over the covering is taut and carries load far out",
    is_fine: false,
    make: |knobs| {
        let length_mm = knobs.between("length_mm", 2.5, 4.0);
        tail(knobs, |distance_mm| left(distance_mm, length_mm) / (2.0 * PI * length_mm * length_mm))
    },
};

pub(super) const POWER_TAIL: Definition = Definition {
    id: "power-tail",
    effect: Some("heavy-tail"),
    is_library_point: false,
    about: "G' = (1 - w) G + w / (2 pi a^2) (1 + (r/a)^2)^(-3/2): the field of a charge at height a over the array",
    is_fine: false,
    make: |knobs| {
        let height_mm = knobs.between("height_mm", 2.5, 4.0);
        tail(knobs, |distance_mm| {
            (1.0 + (distance_mm / height_mm).powi(2)).powf(-1.5) / (2.0 * PI * height_mm * height_mm)
        })
    },
};

pub(super) const PLATE_TAIL: Definition = Definition {
    id: "plate-tail",
    effect: Some("heavy-tail"),
    is_library_point: false,
    about: "G' = (1 - w) G + w / (pi R^2) within R: a stiff plate of radius R on the covering takes part of the press",
    is_fine: false,
    make: |knobs| {
        let radius_mm = knobs.between("radius_mm", 5.0, 8.0);
        tail(
            knobs,
            |distance_mm| {
                if distance_mm < radius_mm { 1.0 / (PI * radius_mm * radius_mm) } else { 0.0 }
            },
        )
    },
};

pub(super) const STRETCHED: Definition = Definition {
    id: "stretched-spread",
    effect: Some("anisotropic-spread"),
    is_library_point: true,
    about: "sigma_x' = sigma (1 + e), sigma_y' = sigma / (1 + e): the covering was laid on under tension",
    is_fine: false,
    make: |knobs| {
        let along_x = knobs.sign("along_x") > 0.0;
        let stretch = 1.0 + knobs.scaled("stretch", 0.08);
        let by = if along_x { stretch } else { 1.0 / stretch };
        PipelineHook::tool(move |_, tool| stretch_by(by, &mut tool.sigma_mm))
    },
};

pub(super) const SLANTED: Definition = Definition {
    id: "slanted-spread",
    effect: Some("anisotropic-spread"),
    is_library_point: false,
    about: "u' = u (1 + e (q_1^2 - q_2^2)), q along slanted axes, in sigma: an ellipse across the sensor's axes, to first order",
    is_fine: false,
    make: |knobs| {
        let (sin, cos) = knobs.between("slant_deg", 30.0, 60.0).to_radians().sin_cos();
        let stretch = knobs.sign("side") * knobs.scaled("stretch", 0.08);
        let sigma_mm = knobs.sigma_mm();
        let centres_mm = knobs.centres_mm();
        PipelineHook::covering(move |now, indentation_mm| {
            for (value, centre_mm) in indentation_mm.iter_mut().zip(&centres_mm) {
                let [x, y] = minus(*centre_mm, now.touch.point_mm).map(|mm| mm / sigma_mm);
                let (along, across) = (cos * x + sin * y, cos * y - sin * x);
                *value *= 1.0 + (stretch * (along * along - across * across)).clamp(-0.9, 3.0);
            }
        })
    },
};

pub(super) const STRETCHED_BY_DEPTH: Definition = Definition {
    id: "stretched-by-depth",
    effect: Some("anisotropic-spread"),
    is_library_point: false,
    about: "sigma_x' = sigma (1 + e depth/t), sigma_y' = sigma / (1 + e depth/t): threads along x carry the more the deeper the press",
    is_fine: false,
    make: |knobs| {
        let along_x = knobs.sign("along_x") > 0.0;
        let stretch = knobs.scaled("stretch_at_thickness", 0.25);
        let thickness_mm = knobs.sensor.covering.thickness_mm;
        PipelineHook::tool(move |now, tool| {
            let by = 1.0 + stretch * now.touch.depth_mm.clamp(0.0, thickness_mm) / thickness_mm;
            stretch_by(if along_x { by } else { 1.0 / by }, &mut tool.sigma_mm);
        })
    },
};

pub(super) const STRETCHED_HALF: Definition = Definition {
    id: "stretched-half",
    effect: Some("anisotropic-spread"),
    is_library_point: false,
    about: "sigma_x' = sigma (1 + e), sigma_y' = sigma / (1 + e) for presses right of the seam: two sheets, one laid on under tension",
    is_fine: false,
    make: |knobs| {
        let along_x = knobs.sign("along_x") > 0.0;
        let stretch = 1.0 + knobs.scaled("stretch", 0.12);
        let seam_mm = knobs.middle_mm()[0];
        PipelineHook::tool(move |now, tool| {
            if now.touch.point_mm[0] > seam_mm {
                stretch_by(if along_x { stretch } else { 1.0 / stretch }, &mut tool.sigma_mm);
            }
        })
    },
};

pub(super) const WIDER_WITH_DEPTH: Definition = Definition {
    id: "wider-with-depth",
    effect: Some("depth-dependent-spread"),
    is_library_point: false,
    about: "sigma' = sigma sqrt(1 + a depth/t): the covering bulges beside the tool the more the deeper it stands",
    is_fine: false,
    make: |knobs| {
        let growth = knobs.scaled("growth", 0.5);
        let thickness_mm = knobs.sensor.covering.thickness_mm;
        PipelineHook::tool(move |now, tool| {
            let widened = (1.0 + growth * now.touch.depth_mm.clamp(0.0, thickness_mm) / thickness_mm).sqrt();
            tool.sigma_mm = tool.sigma_mm.map(|sigma_mm| sigma_mm * widened);
        })
    },
};

pub(super) const WIDER_CUBED: Definition = Definition {
    id: "wider-cubed",
    effect: Some("depth-dependent-spread"),
    is_library_point: false,
    about: "sigma' = sigma (1 + a (depth/t)^3): a deep press pushes the covering aside, a light one does not",
    is_fine: false,
    make: |knobs| {
        let growth = knobs.scaled("growth", 0.8);
        let thickness_mm = knobs.sensor.covering.thickness_mm;
        PipelineHook::tool(move |now, tool| {
            let share = now.touch.depth_mm.clamp(0.0, thickness_mm) / thickness_mm;
            tool.sigma_mm = tool.sigma_mm.map(|sigma_mm| sigma_mm * (1.0 + growth * share.powi(3)));
        })
    },
};

pub(super) const NARROWER_AT_FIRST: Definition = Definition {
    id: "narrower-at-first",
    effect: Some("depth-dependent-spread"),
    is_library_point: false,
    about: "sigma' = sigma (1 - a exp(-depth/d0)): light presses stay in the skin",
    is_fine: false,
    make: |knobs| {
        let scale_mm = knobs.between("scale_mm", 0.15, 0.3);
        let narrowed = knobs.share("narrowed_share", 0.2).min(0.9);
        PipelineHook::tool(move |now, tool| {
            let by = 1.0 - narrowed * left(now.touch.depth_mm.max(0.0), scale_mm);
            tool.sigma_mm = tool.sigma_mm.map(|sigma_mm| sigma_mm * by);
        })
    },
};

pub(super) const WIDER_BEYOND: Definition = Definition {
    id: "wider-beyond-depth",
    effect: Some("depth-dependent-spread"),
    is_library_point: false,
    about: "sigma' = sigma (1 + a / (1 + exp(-(depth - d0)/w))): the covering's skin buckles at d0",
    is_fine: false,
    make: |knobs| {
        let from_mm = knobs.between("from_mm", 0.3, 0.5);
        let width_mm = knobs.between("width_mm", 0.02, 0.06);
        let growth = knobs.scaled("growth", 0.15);
        PipelineHook::tool(move |now, tool| {
            let buckled = 1.0 / (1.0 + left(now.touch.depth_mm - from_mm, width_mm));
            tool.sigma_mm = tool.sigma_mm.map(|sigma_mm| sigma_mm * (1.0 + growth * buckled));
        })
    },
};

pub(super) const SOFT_CORNERS: Definition = Definition {
    id: "soft-corners",
    effect: Some("edge-effect"),
    is_library_point: false,
    about: "u' = u (1 - a exp(-d/l)), d the press's distance to the nearest corner: the covering is cut round there",
    is_fine: false,
    make: |knobs| {
        let length_mm = knobs.between("length_mm", 2.0, 4.0);
        let loss = knobs.share("loss", 0.35);
        let extent_mm = knobs.sensor.model.array().extent_mm();
        PipelineHook::covering(move |now, indentation_mm| {
            let to_side_mm = |axis: usize| {
                let at_mm = now.touch.point_mm[axis];
                (at_mm - extent_mm[axis][0]).abs().min((extent_mm[axis][1] - at_mm).abs())
            };
            scale(indentation_mm, 1.0 - loss * left(to_side_mm(0).hypot(to_side_mm(1)), length_mm));
        })
    },
};

pub(super) const GLUED_SIDE: Definition = Definition {
    id: "glued-side",
    effect: Some("edge-effect"),
    is_library_point: false,
    about: "u' = u (1 - a / (1 + (d/l)^2)), d the press's distance to one side along x: the covering is glued down there alone",
    is_fine: false,
    make: |knobs| {
        let length_mm = knobs.between("length_mm", 1.5, 3.5);
        let side = usize::from(knobs.sign("right_side") > 0.0);
        let loss = knobs.share("loss", 0.25);
        let side_mm = knobs.sensor.model.array().extent_mm()[0][side];
        PipelineHook::covering(move |now, indentation_mm| {
            let away = (now.touch.point_mm[0] - side_mm) / length_mm;
            scale(indentation_mm, 1.0 - loss / (1.0 + away * away));
        })
    },
};

pub(super) const SOFT_EDGE: Definition = Definition {
    id: "soft-edge",
    effect: Some("edge-effect"),
    is_library_point: true,
    about: "u' = u (1 + a exp(-d/l)), d the press's distance to the array's edge: the covering gives way there",
    is_fine: false,
    make: |knobs| {
        let length_mm = knobs.between("length_mm", 0.8, 2.5);
        let change = (knobs.sign("side") * knobs.scaled("change", 0.2)).max(-1.0);
        let extent_mm = knobs.sensor.model.array().extent_mm();
        PipelineHook::covering(move |now, indentation_mm| {
            let to_edge_mm = |axis: usize| {
                let at_mm = now.touch.point_mm[axis];
                (at_mm - extent_mm[axis][0]).min(extent_mm[axis][1] - at_mm)
            };
            let by = 1.0 + change * left(to_edge_mm(0).min(to_edge_mm(1)).max(0.0), length_mm);
            scale(indentation_mm, by);
        })
    },
};

pub(super) const SEAM: Definition = Definition {
    id: "seam",
    effect: Some("edge-effect"),
    is_library_point: false,
    about: "u' = u (1 - a max(0, 1 - |x - x_s|/w)): the covering is cut along the seam between the two sensors",
    is_fine: false,
    make: |knobs| {
        let width_mm = knobs.between("width_mm", 1.2, 2.5);
        let loss = knobs.share("loss", 0.2);
        let seam_mm = knobs.middle_mm()[0];
        PipelineHook::covering(move |now, indentation_mm| {
            let by = 1.0 - loss * (1.0 - (now.touch.point_mm[0] - seam_mm).abs() / width_mm).max(0.0);
            scale(indentation_mm, by);
        })
    },
};

/// Widens along x as much as it narrows along y.
fn stretch_by(by: f64, sigma_mm: &mut [f64; 2]) {
    *sigma_mm = [sigma_mm[0] * by, sigma_mm[1] / by];
}

/// Spreads a share of the press by another kernel of unit volume, evaluated at the elements' centres.
fn tail(knobs: &mut Knobs<'_>, per_mm2: impl Fn(f64) -> f64) -> PipelineHook {
    const STEP_MM: f64 = 0.05;
    const REACH_MM: f64 = 30.0;
    let weight = knobs.share("weight", 0.1);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a table of 600 places")]
    let table: Vec<f64> =
        (0..=(REACH_MM / STEP_MM) as u32 + 1).map(|place| per_mm2(f64::from(place) * STEP_MM)).collect();
    let centres_mm = knobs.centres_mm();
    let [width_mm, height_mm] = knobs.sensor.model.array().element_mm();
    let face_mm2 = crate::sensor::diameter_mm(&knobs.sensor.indenter).powi(2) * PI / 4.0;
    let per_mm = face_mm2 * width_mm * height_mm / knobs.sensor.model.reference_mm2();
    let thickness_mm = knobs.sensor.covering.thickness_mm;
    PipelineHook::covering(move |now, indentation_mm| {
        let depth_mm = now.touch.depth_mm.clamp(0.0, thickness_mm);
        if depth_mm <= 0.0 {
            return;
        }
        for (value, centre_mm) in indentation_mm.iter_mut().zip(&centres_mm) {
            let [x, y] = minus(*centre_mm, now.touch.point_mm);
            let place = x.hypot(y).min(REACH_MM) / STEP_MM;
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the table")]
            let before = place as usize;
            let between = place - place.floor();
            let kernel = table[before] + between * (table[before + 1] - table[before]);
            *value += weight * (depth_mm * per_mm * kernel - *value);
        }
    })
}
