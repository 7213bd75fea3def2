//! Contact: the tool's face.

use std::f64::consts::TAU;

use rand::RngExt;

use super::{Definition, PipelineHook, left};

pub(super) const WORN_TOOL: Definition = Definition {
    id: "worn-tool",
    effect: Some("indenter-size"),
    is_library_point: true,
    about: "D' = D (1 + e): a tool of another diameter than declared",
    is_fine: false,
    make: |knobs| {
        let excess = (knobs.sign("side") * knobs.scaled("excess", 0.25)).max(-0.9);
        PipelineHook::tool(move |_, tool| tool.diameter_mm *= 1.0 + excess)
    },
};

pub(super) const COCKED_TOOL: Definition = Definition {
    id: "cocked-tool",
    effect: Some("indenter-tilt"),
    is_library_point: true,
    about: "I(p) = max(0, depth + tan(a) (n . (p - c) - D/2)): the cylinder leans and touches with its edge first",
    is_fine: false,
    make: |knobs| {
        let toward = knobs.direction("direction_deg");
        let rise = knobs.scaled("lean_deg", 8.0).min(60.0).to_radians().tan();
        PipelineHook::tool(move |_, tool| {
            tool.lean = [0, 1].map(|axis| tool.lean[axis] + rise * toward[axis]);
        })
    },
};

pub(super) const ROUNDED_RIM: Definition = Definition {
    id: "rounded-rim",
    effect: Some("indenter-size"),
    is_library_point: false,
    about: "D' = D - 2 r + 2 sqrt(2 r depth - depth^2) down to depth r: the cylinder's rim is rounded, so it touches with less at first",
    is_fine: false,
    make: |knobs| {
        let radius_mm = knobs.scaled("radius_mm", 0.25).min(0.45);
        PipelineHook::tool(move |now, tool| {
            let depth_mm = now.touch.depth_mm.clamp(0.0, radius_mm);
            let reached_mm = (2.0 * radius_mm * depth_mm - depth_mm * depth_mm).max(0.0).sqrt();
            tool.diameter_mm -= 2.0 * (radius_mm - reached_mm);
        })
    },
};

pub(super) const SPREADING_TIP: Definition = Definition {
    id: "spreading-tip",
    effect: Some("indenter-size"),
    is_library_point: false,
    about: "D' = D (1 + e (1 - exp(-depth/d0))): a tip of rubber spreads under its load",
    is_fine: false,
    make: |knobs| {
        let scale_mm = knobs.between("scale_mm", 0.1, 0.4);
        let excess = knobs.scaled("excess", 0.4);
        PipelineHook::tool(move |now, tool| {
            tool.diameter_mm *= 1.0 + excess * (1.0 - left(now.touch.depth_mm.max(0.0), scale_mm));
        })
    },
};

pub(super) const WEARING_TOOL: Definition = Definition {
    id: "wearing-tool",
    effect: Some("indenter-size"),
    is_library_point: false,
    about: "D' = D (1 - e (1 - exp(-t/T))), t the time in contact so far: a soft tool is worn down in the run",
    is_fine: false,
    make: |knobs| {
        let time_s = knobs.decade("time_constant_s", 15.0, 60.0);
        let worn = knobs.scaled("worn", 0.3).min(0.9);
        let mut in_contact_s = 0.0;
        PipelineHook::tool(move |now, tool| {
            in_contact_s += if now.touch.depth_mm > 0.0 { now.dt_s } else { 0.0 };
            tool.diameter_mm *= 1.0 - worn * (1.0 - left(in_contact_s, time_s));
        })
    },
};

pub(super) const WOBBLING_TOOL: Definition = Definition {
    id: "wobbling-tool",
    effect: Some("indenter-tilt"),
    is_library_point: false,
    about: "a lean as of `cocked-tool`, in a direction drawn for each press: the tool is loose in its holder",
    is_fine: false,
    make: |knobs| {
        let rise = knobs.scaled("lean_deg", 8.0).min(60.0).to_radians().tan();
        let mut rng = knobs.rng();
        let (mut angle, mut touched) = (0.0_f64, false);
        PipelineHook::tool(move |now, tool| {
            let touches = now.touch.depth_mm > 0.0;
            if touches && !touched {
                angle = rng.random_range(0.0..TAU);
            }
            touched = touches;
            tool.lean = [tool.lean[0] + rise * angle.cos(), tool.lean[1] + rise * angle.sin()];
        })
    },
};

pub(super) const YIELDING_TOOL: Definition = Definition {
    id: "yielding-tool",
    effect: Some("indenter-tilt"),
    is_library_point: false,
    about: "tan a = k depth/t: the tool's shaft bends as the load grows",
    is_fine: false,
    make: |knobs| {
        let toward = knobs.direction("direction_deg");
        let rise = knobs.scaled("lean_at_thickness_deg", 12.0).min(60.0).to_radians().tan();
        let thickness_mm = knobs.sensor.covering.thickness_mm;
        PipelineHook::tool(move |now, tool| {
            let by = rise * now.touch.depth_mm.clamp(0.0, thickness_mm) / thickness_mm;
            tool.lean = [0, 1].map(|axis| tool.lean[axis] + by * toward[axis]);
        })
    },
};

pub(super) const BENDING_ARM: Definition = Definition {
    id: "bending-arm",
    effect: Some("indenter-tilt"),
    is_library_point: false,
    about: "tan a = k (x - c_x)/L along x: the arm that carries the tool bends with its reach",
    is_fine: false,
    make: |knobs| {
        let middle_mm = knobs.middle_mm();
        let half_mm = knobs.half_size_mm();
        let rise = knobs.scaled("lean_at_edge_deg", 10.0).min(60.0).to_radians().tan();
        PipelineHook::tool(move |now, tool| {
            tool.lean[0] += rise * (now.touch.point_mm[0] - middle_mm[0]) / half_mm[0];
        })
    },
};
