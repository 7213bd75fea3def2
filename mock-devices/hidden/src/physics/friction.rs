//! Motion: a tip that lags behind its stage by friction, not by a fixed play.

use super::motion::play;
use super::{Definition, PipelineHook, left, minus};

pub(super) const DAHL: Definition = Definition {
    id: "lost-motion-dahl",
    effect: Some("backlash"),
    is_library_point: false,
    about: "q = p - z, dz = dp (1 - sgn(dp) z/z_c) on each axis: presliding friction winds the drive up (Dahl 1968)",
    is_fine: false,
    make: |knobs| {
        let shares = ["share_x", "share_y", "share_z"].map(|name| knobs.between(name, 0.3, 1.0));
        let wound_mm = knobs.scaled("wound_mm", 0.05);
        let mut last_mm: Option<[f64; 3]> = None;
        let mut lag_mm = [0.0; 3];
        PipelineHook::path(move |_, _, tip_mm| {
            let before_mm = last_mm.replace(*tip_mm).unwrap_or(*tip_mm);
            for axis in 0..3 {
                lag_mm[axis] = wound(lag_mm[axis], tip_mm[axis] - before_mm[axis], wound_mm * shares[axis]);
                tip_mm[axis] -= lag_mm[axis];
            }
        })
    },
};

pub(super) const WORN_SCREW: Definition = Definition {
    id: "lost-motion-worn",
    effect: Some("backlash"),
    is_library_point: false,
    about: "play of half-width r exp(-|p - c|^2/w^2) on x and y: the screws are worn where they are used most",
    is_fine: false,
    make: |knobs| {
        let [x, y] = knobs.middle_mm();
        let centre_mm = knobs.sensor.registration.to_robot([x, y]);
        let width_mm = knobs.between("width_mm", 4.0, 8.0);
        let play_mm = knobs.scaled("play_mm", 0.25);
        let mut carriage_mm: Option<[f64; 2]> = None;
        PipelineHook::path(move |_, _, tip_mm| {
            let at_mm = [tip_mm[0], tip_mm[1]];
            let [dx, dy] = minus(at_mm, centre_mm);
            let half_mm = play_mm / 2.0 * (-(dx.hypot(dy) / width_mm).powi(2)).exp();
            let last_mm = carriage_mm.unwrap_or(at_mm);
            let carriage = [0, 1].map(|axis| play(last_mm[axis], at_mm[axis], half_mm));
            (tip_mm[0], tip_mm[1]) = (carriage[0], carriage[1]);
            carriage_mm = Some(carriage);
        })
    },
};

pub(super) const STICTION: Definition = Definition {
    id: "lost-motion-stiction",
    effect: Some("backlash"),
    is_library_point: false,
    about: "q' = p where |p - q| > b, else q: an axis sticks and then jumps all the way",
    is_fine: false,
    make: |knobs| {
        let shares = ["share_x", "share_y", "share_z"].map(|name| knobs.between(name, 0.3, 1.0));
        let stuck_mm = knobs.scaled("stuck_mm", 0.06);
        let mut carriage_mm: Option<[f64; 3]> = None;
        PipelineHook::path(move |_, _, tip_mm| {
            let mut at_mm = carriage_mm.unwrap_or(*tip_mm);
            for axis in 0..3 {
                if (tip_mm[axis] - at_mm[axis]).abs() > stuck_mm * shares[axis] {
                    at_mm[axis] = tip_mm[axis];
                }
            }
            *tip_mm = at_mm;
            carriage_mm = Some(at_mm);
        })
    },
};

/// Dahl's lag after a move, exactly: it goes to the limit on the move's side.
pub(super) fn wound(lag_mm: f64, move_mm: f64, limit_mm: f64) -> f64 {
    if move_mm == 0.0 || limit_mm <= 0.0 {
        return lag_mm;
    }
    let end_mm = limit_mm.copysign(move_mm);
    end_mm - (end_mm - lag_mm) * left(move_mm.abs(), limit_mm)
}
