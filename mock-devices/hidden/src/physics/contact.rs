//! Contact: the tool's face.

use super::{Definition, PipelineHook};

pub(super) const WORN_TOOL: Definition = Definition {
    id: "worn-tool",
    effect: Some("indenter-size"),
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
