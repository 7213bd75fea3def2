//! Covering: response that grows faster than depth.

use super::{Definition, PipelineHook};

pub(super) const EXPONENTIAL: Definition = Definition {
    id: "hardening-exponential",
    effect: Some("hardening"),
    is_library_point: false,
    about: "depth' = (exp(b depth) - 1)/b: an exponential elastic law of soft tissue (Fung 1967)",
    is_fine: false,
    make: |knobs| {
        let by_mm = knobs.scaled("rate_per_mm", 0.6).max(1e-12);
        PipelineHook::depth(move |_, depth_mm| (by_mm * depth_mm).exp_m1() / by_mm)
    },
};

pub(super) const POWER: Definition = Definition {
    id: "hardening-power",
    effect: Some("hardening"),
    is_library_point: true,
    about: "u' = u + a u^1.5: a Hertz-like term of every element's own indentation",
    is_fine: false,
    make: |knobs| {
        let share = knobs.scaled("share_per_mm_0_5", 0.4);
        PipelineHook::Covering(PipelineHook::each(move |u_mm| u_mm + share * u_mm.max(0.0).powf(1.5)))
    },
};

pub(super) const QUADRATIC: Definition = Definition {
    id: "hardening-quadratic",
    effect: Some("hardening"),
    is_library_point: true,
    about: "u' = u + k u^2: the paper's quadratic response at large depths (Sec. 2.2)",
    is_fine: false,
    make: |knobs| {
        let quadratic_per_mm = knobs.scaled("quadratic_per_mm", 0.4);
        PipelineHook::Covering(PipelineHook::each(move |u_mm| u_mm + quadratic_per_mm * u_mm * u_mm))
    },
};

pub(super) const LIMIT: Definition = Definition {
    id: "hardening-limit",
    effect: Some("hardening"),
    is_library_point: false,
    about: "depth' = depth / (1 - depth/L): chains of the covering come to the end of their length (Gent 1996)",
    is_fine: false,
    make: |knobs| {
        let by_mm = knobs.scaled("inverse_length_per_mm", 0.35);
        PipelineHook::depth(move |_, depth_mm| depth_mm / (1.0 - (by_mm * depth_mm).min(0.9)))
    },
};

pub(super) const TWO_LAYERS: Definition = Definition {
    id: "hardening-two-layers",
    effect: Some("hardening"),
    is_library_point: false,
    about: "depth' = depth + k max(0, depth - d0): a stiffer layer below bears from d0 on",
    is_fine: false,
    make: |knobs| {
        let from_mm = knobs.between("from_mm", 0.2, 0.4);
        let stiffer = knobs.scaled("stiffer", 0.6);
        PipelineHook::depth(move |_, depth_mm| depth_mm + stiffer * (depth_mm - from_mm).max(0.0))
    },
};

pub(super) const STEP: Definition = Definition {
    id: "hardening-step",
    effect: Some("hardening"),
    is_library_point: false,
    about: "depth' = depth + k w ln((1 + exp((depth - d0)/w)) / (1 + exp((depth - d1)/w))): stiffer between d0 and d1, as foam while its cells close",
    is_fine: false,
    make: |knobs| {
        let from_mm = knobs.between("from_mm", 0.15, 0.25);
        let to_mm = knobs.between("to_mm", 0.3, 0.4);
        let stiffer = knobs.scaled("stiffer", 0.8);
        PipelineHook::depth(move |_, depth_mm| {
            let beyond_mm = |from_mm: f64| WIDTH_MM * ((depth_mm - from_mm) / WIDTH_MM).exp().ln_1p();
            let at_rest_mm = |from_mm: f64| WIDTH_MM * (-from_mm / WIDTH_MM).exp().ln_1p();
            let more_mm = beyond_mm(from_mm) - beyond_mm(to_mm) - at_rest_mm(from_mm) + at_rest_mm(to_mm);
            depth_mm + stiffer * more_mm
        })
    },
};

/// Width of the ends of [`STEP`].
const WIDTH_MM: f64 = 0.02;

pub(super) const OWN_KNEE: Definition = Definition {
    id: "hardening-own-knee",
    effect: Some("hardening"),
    is_library_point: false,
    about: "u' = u + k max(0, u - u0) of every element's own indentation: a stiffer skin on each electrode",
    is_fine: false,
    make: |knobs| {
        let from_mm = knobs.between("from_mm", 0.08, 0.16);
        let stiffer = knobs.scaled("stiffer", 0.6);
        PipelineHook::Covering(PipelineHook::each(move |u_mm| u_mm + stiffer * (u_mm - from_mm).max(0.0)))
    },
};
