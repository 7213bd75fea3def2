//! Motion: a surface that takes up the tool slowly, moves, or is no plane.

use super::{Definition, PipelineHook, dot, left, minus};

pub(super) const TOE: Definition = Definition {
    id: "toe",
    effect: Some("surface-offset"),
    is_library_point: false,
    about: "depth' = sqrt(depth^2 + c^2) - c: the covering's fibres straighten before they carry (toe region, Fung 1967)",
    is_fine: false,
    make: |knobs| {
        let toe_mm = knobs.scaled("toe_mm", 0.06);
        PipelineHook::touch(move |_, touch| {
            if touch.depth_mm > 0.0 {
                touch.depth_mm = touch.depth_mm.hypot(toe_mm) - toe_mm;
            }
        })
    },
};

pub(super) const SETTLING_SURFACE: Definition = Definition {
    id: "settling-surface",
    effect: Some("surface-offset"),
    is_library_point: false,
    about: "depth' = depth - h (1 - exp(-t/T)): the covering settles after the touch that found its surface",
    is_fine: false,
    make: |knobs| {
        let time_s = knobs.decade("time_constant_s", 30.0, 150.0);
        let sunk_mm = knobs.scaled("sunk_mm", 0.08);
        PipelineHook::touch(move |now, touch| touch.depth_mm -= sunk_mm * (1.0 - left(now.t_s, time_s)))
    },
};

pub(super) const THERMAL_GROWTH: Definition = Definition {
    id: "thermal-growth",
    effect: Some("surface-offset"),
    is_library_point: false,
    about: "depth' = depth + a (T - T_0): the column that holds the tool grows as the room warms",
    is_fine: false,
    make: |knobs| {
        let mm_per_k = knobs.sign("side") * knobs.scaled("mm_per_k", 0.05);
        let mut first_c = None;
        PipelineHook::touch(move |now, touch| {
            touch.depth_mm += mm_per_k * (now.temperature_c - *first_c.get_or_insert(now.temperature_c));
        })
    },
};

pub(super) const BOWED_SURFACE: Definition = Definition {
    id: "bowed-surface",
    effect: Some("surface-tilt"),
    is_library_point: false,
    about: "depth' = depth + g . (p - c) + a |p - c|^2/L^2: the sensor lies slanted and is bowed",
    is_fine: false,
    make: |knobs| {
        let middle_mm = knobs.middle_mm();
        let half_mm = knobs.half_size_mm();
        let uphill = knobs.direction("direction_deg");
        let slope = knobs.scaled("slope", 0.008);
        let bow_mm = knobs.sign("side") * knobs.scaled("bow_mm", 0.06);
        PipelineHook::touch(move |_, touch| {
            let away_mm = minus(touch.point_mm, middle_mm);
            touch.depth_mm +=
                slope * dot(uphill, away_mm) + bow_mm * dot(away_mm, away_mm) / dot(half_mm, half_mm);
        })
    },
};

pub(super) const FOLDED_SURFACE: Definition = Definition {
    id: "folded-surface",
    effect: Some("surface-tilt"),
    is_library_point: false,
    about: "depth' = depth + g max(0, n . (p - p0)): a strip lies under one side of the sensor, which rises from a fold on",
    is_fine: false,
    make: |knobs| {
        let middle_mm = knobs.middle_mm();
        let fold_mm = [
            middle_mm[0] + knobs.between("off_x_mm", -3.0, 3.0),
            middle_mm[1] + knobs.between("off_y_mm", -2.0, 2.0),
        ];
        let uphill = knobs.direction("direction_deg");
        let slope = knobs.scaled("slope", 0.015);
        PipelineHook::touch(move |_, touch| {
            touch.depth_mm += slope * dot(uphill, minus(touch.point_mm, fold_mm)).max(0.0);
        })
    },
};

pub(super) const TWISTED_SURFACE: Definition = Definition {
    id: "twisted-surface",
    effect: Some("surface-tilt"),
    is_library_point: false,
    about: "depth' = depth + a (x - c_x) (y - c_y)/(L_x L_y): one corner of the sensor does not lie on",
    is_fine: false,
    make: |knobs| {
        let middle_mm = knobs.middle_mm();
        let half_mm = knobs.half_size_mm();
        let lift_mm = knobs.sign("side") * knobs.scaled("lift_mm", 0.1);
        PipelineHook::touch(move |_, touch| {
            let [x, y] = minus(touch.point_mm, middle_mm);
            touch.depth_mm += lift_mm * (x / half_mm[0]) * (y / half_mm[1]);
        })
    },
};
