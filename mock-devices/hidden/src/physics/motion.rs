//! Motion: where the tool is against where the stage says it is.

use super::{Definition, PipelineHook, dot, left, minus};

pub(super) const SHIFTED_MOUNT: Definition = Definition {
    id: "shifted-mount",
    effect: Some("misregistration"),
    is_library_point: true,
    about: "p' = p + s: the sensor was put back 0.15 mm aside",
    is_fine: false,
    make: |knobs| {
        let toward = knobs.direction("direction_deg");
        let shift_mm = knobs.scaled("shift_mm", 0.15);
        PipelineHook::touch(move |_, touch| {
            touch.point_mm = [0, 1].map(|axis| touch.point_mm[axis] + shift_mm * toward[axis]);
        })
    },
};

pub(super) const TURNED_MOUNT: Definition = Definition {
    id: "turned-mount",
    effect: Some("misregistration"),
    is_library_point: true,
    about: "p' = c + Rot(a) (p - c): the sensor turned about a place near its middle",
    is_fine: false,
    make: |knobs| {
        let middle_mm = knobs.middle_mm();
        let centre_mm = [
            middle_mm[0] + knobs.between("off_x_mm", -3.0, 3.0),
            middle_mm[1] + knobs.between("off_y_mm", -3.0, 3.0),
        ];
        let side = knobs.sign("side");
        let (sin, cos) = (side * knobs.scaled("angle_deg", 1.5)).to_radians().sin_cos();
        PipelineHook::touch(move |_, touch| {
            let [x, y] = minus(touch.point_mm, centre_mm);
            touch.point_mm = [centre_mm[0] + cos * x - sin * y, centre_mm[1] + sin * x + cos * y];
        })
    },
};

pub(super) const STRETCHED_STAGE: Definition = Definition {
    id: "stretched-stage",
    effect: Some("misregistration"),
    is_library_point: true,
    about: "p' = c + (1 + e) (p - c): both lead screws have another pitch than the controller believes",
    is_fine: false,
    make: |knobs| {
        let centre_mm = knobs.middle_mm();
        let stretch = 1.0 + knobs.sign("side") * knobs.scaled("stretch", 0.015);
        PipelineHook::touch(move |_, touch| {
            touch.point_mm = [0, 1].map(|axis| {
                touch.point_mm[axis] + (stretch - 1.0) * (touch.point_mm[axis] - centre_mm[axis])
            });
        })
    },
};

pub(super) const SHEARED_STAGE: Definition = Definition {
    id: "sheared-stage",
    effect: Some("misregistration"),
    is_library_point: false,
    about: "x' = x + e (y - c_y): the stage's axes are not square, which turns and shears at once",
    is_fine: false,
    make: |knobs| {
        let middle_mm = knobs.middle_mm();
        let slant = knobs.sign("side") * knobs.scaled("slant", 0.025);
        PipelineHook::touch(move |_, touch| touch.point_mm[0] += slant * (touch.point_mm[1] - middle_mm[1]))
    },
};

pub(super) const LATE_TOUCH: Definition = Definition {
    id: "late-touch",
    effect: Some("surface-offset"),
    is_library_point: true,
    about: "depth' = depth + h: the touch that found the surface was read too early or too late",
    is_fine: false,
    make: |knobs| {
        let offset_mm = knobs.sign("side") * knobs.scaled("offset_mm", 0.05);
        PipelineHook::touch(move |_, touch| touch.depth_mm += offset_mm)
    },
};

pub(super) const DEAD_BAND: Definition = Definition {
    id: "dead-band",
    effect: Some("surface-offset"),
    is_library_point: false,
    about: "depth' = depth - c (1 - exp(-depth/c)): a loose skin that must be taken up before anything presses",
    is_fine: false,
    make: |knobs| {
        let band_mm = knobs.scaled("band_mm", 0.06).max(1e-18);
        PipelineHook::touch(move |_, touch| {
            let taken_mm = band_mm * (1.0 - left(touch.depth_mm.max(0.0), band_mm));
            touch.depth_mm -= taken_mm;
        })
    },
};

pub(super) const SLOPING_SURFACE: Definition = Definition {
    id: "sloping-surface",
    effect: Some("surface-tilt"),
    is_library_point: true,
    about: "depth' = depth + g . (p - p0): the sensor lies slanted, its height found at p0 alone",
    is_fine: false,
    make: |knobs| {
        let middle_mm = knobs.middle_mm();
        let found_mm = [
            middle_mm[0] + knobs.between("off_x_mm", -6.0, 6.0),
            middle_mm[1] + knobs.between("off_y_mm", -4.0, 4.0),
        ];
        let uphill = knobs.direction("direction_deg");
        let slope = knobs.scaled("slope", 0.01);
        PipelineHook::touch(move |_, touch| {
            touch.depth_mm += slope * dot(uphill, minus(touch.point_mm, found_mm));
        })
    },
};

pub(super) const LATE_FRAMES: Definition = Definition {
    id: "late-frames",
    effect: Some("time-lag"),
    is_library_point: true,
    about: "p'(t) = p(t - l): frames wait in a buffer before they are stamped, or the stage's reports do (l < 0)",
    is_fine: false,
    make: |knobs| {
        let lag_s = knobs.sign("side") * knobs.scaled("lag_s", 0.04);
        PipelineHook::path(move |now, path, tip_mm| *tip_mm = path.at(now.t_s - lag_s))
    },
};

pub(super) const LOST_MOTION: Definition = Definition {
    id: "lost-motion",
    effect: Some("backlash"),
    is_library_point: true,
    about: "q' = max(p - r, min(p + r, q)): the play operator on each axis (Krasnosel'skii and Pokrovskii 1989)",
    is_fine: false,
    make: |knobs| {
        let shares = ["share_x", "share_y", "share_z"].map(|name| knobs.between(name, 0.3, 1.0));
        let play_mm = knobs.scaled("play_mm", 0.08);
        let mut carriage_mm: Option<[f64; 3]> = None;
        PipelineHook::path(move |_, _, tip_mm| {
            let last_mm = carriage_mm.unwrap_or(*tip_mm);
            *tip_mm =
                std::array::from_fn(|axis| play(last_mm[axis], tip_mm[axis], play_mm * shares[axis] / 2.0));
            carriage_mm = Some(*tip_mm);
        })
    },
};

/// What follows an input with a play of `half` to either side.
pub(super) fn play(last: f64, input: f64, half: f64) -> f64 {
    last.clamp(input - half, input + half)
}
