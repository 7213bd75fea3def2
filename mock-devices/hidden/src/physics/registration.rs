//! Motion: ways of a stage that no shift, turn, scale or shear makes good.

use std::f64::consts::TAU;

use super::{Definition, PipelineHook, minus};

pub(super) const BENT_GUIDE: Definition = Definition {
    id: "bent-guide",
    effect: Some("misregistration"),
    is_library_point: false,
    about: "y' = y + a ((x - c)/L)^2, L half the array: the guide of the x axis is bowed",
    is_fine: false,
    make: |knobs| {
        let middle_mm = knobs.middle_mm();
        let half_mm = knobs.half_size_mm();
        let bow_mm = knobs.sign("side") * knobs.scaled("bow_mm", 0.25);
        PipelineHook::touch(move |_, touch| {
            touch.point_mm[1] += bow_mm * ((touch.point_mm[0] - middle_mm[0]) / half_mm[0]).powi(2);
        })
    },
};

pub(super) const SCREW_ERROR: Definition = Definition {
    id: "screw-error",
    effect: Some("misregistration"),
    is_library_point: false,
    about: "x' = x + a sin(2 pi x/P), y alike: the error of a lead screw repeats with every turn (ISO 230-2)",
    is_fine: false,
    make: |knobs| {
        let pitch_mm = knobs.between("pitch_mm", 4.0, 8.0);
        let phases = [knobs.between("phase_x_rad", 0.0, TAU), knobs.between("phase_y_rad", 0.0, TAU)];
        let error_mm = knobs.scaled("error_mm", 0.15);
        PipelineHook::path(move |_, _, tip_mm| {
            for (at_mm, phase) in tip_mm.iter_mut().zip(phases) {
                *at_mm += error_mm * (TAU * *at_mm / pitch_mm + phase).sin();
            }
        })
    },
};

pub(super) const UNEQUAL_AXES: Definition = Definition {
    id: "unequal-axes",
    effect: Some("misregistration"),
    is_library_point: false,
    about: "x' = c_x + (1 + e) (x - c_x), y' = c_y + (1 - e) (y - c_y): the two lead screws differ in pitch",
    is_fine: false,
    make: |knobs| {
        let middle_mm = knobs.middle_mm();
        let stretch = knobs.sign("side") * knobs.scaled("stretch", 0.02);
        PipelineHook::touch(move |_, touch| {
            let [x, y] = minus(touch.point_mm, middle_mm);
            touch.point_mm = [touch.point_mm[0] + stretch * x, touch.point_mm[1] - stretch * y];
        })
    },
};
