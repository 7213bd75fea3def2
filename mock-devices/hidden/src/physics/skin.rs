//! Outside the library: what covering, tool and table do that no effect describes.

use std::f64::consts::TAU;

use super::{Definition, PipelineHook, dot, left, minus, shift};

pub(super) const AIR_POCKET: Definition = Definition {
    id: "air-pocket",
    effect: None,
    is_library_point: false,
    about: "depth' = depth - a exp(-|p - p_b|^2/R^2) (1 - exp(-depth/a)): a bubble under the covering is squeezed first",
    is_fine: false,
    make: |knobs| {
        let centres_mm = knobs.centres_mm();
        let bubble_mm = centres_mm[knobs.which("near_element")];
        let radius_mm = knobs.between("radius_mm", 2.5, 5.0);
        let height_mm = knobs.scaled("height_mm", 0.1).max(1e-18);
        PipelineHook::depth(move |now, depth_mm| {
            let away_mm = minus(now.touch.point_mm, bubble_mm);
            let here_mm = height_mm * (-dot(away_mm, away_mm) / (radius_mm * radius_mm)).exp();
            depth_mm - here_mm * (1.0 - left(depth_mm, height_mm))
        })
    },
};

pub(super) const GRIT: Definition = Definition {
    id: "grit",
    effect: None,
    is_library_point: false,
    about: "u_g' = u_g + a max(0, u_g - u_0) of one element: a grain in the covering meets its electrode in deep presses",
    is_fine: false,
    make: |knobs| {
        let element = knobs.which("element");
        let from_mm = knobs.between("from_mm", 0.02, 0.06);
        let gain = knobs.scaled("gain", 0.8);
        PipelineHook::covering(move |_, indentation_mm| {
            indentation_mm[element] += gain * (indentation_mm[element] - from_mm).max(0.0);
        })
    },
};

pub(super) const TAUT_SHEET: Definition = Definition {
    id: "taut-sheet",
    effect: None,
    is_library_point: false,
    about: "u' = u - a depth^2/t of every element, near or far: the press draws the whole sheet taut",
    is_fine: false,
    make: |knobs| {
        let lift = knobs.scaled("lift", 0.01);
        let thickness_mm = knobs.sensor.covering.thickness_mm;
        PipelineHook::covering(move |now, indentation_mm| {
            let depth_mm = now.touch.depth_mm.max(0.0);
            shift(indentation_mm, -lift * depth_mm * depth_mm / thickness_mm);
        })
    },
};

pub(super) const VIBRATING_TABLE: Definition = Definition {
    id: "vibrating-table",
    effect: None,
    is_library_point: false,
    about: "depth' = depth + a sin(2 pi f t): the building shakes the table; it shows in contact alone",
    is_fine: true,
    make: |knobs| {
        let frequency_hz = knobs.between("frequency_hz", 2.0, 12.0);
        let swing_mm = knobs.scaled("swing_mm", 0.015);
        PipelineHook::depth(move |now, depth_mm| depth_mm + swing_mm * (TAU * frequency_hz * now.t_s).sin())
    },
};
