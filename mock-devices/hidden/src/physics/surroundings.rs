//! Outside the library: what electronics and surroundings do that no effect describes.

use std::f64::consts::TAU;

use rand::RngExt;

use super::drift::normal;
use super::wiring::telegraph;
use super::{Definition, PipelineHook, left, scale, shift};

pub(super) const ARM_SHADOW: Definition = Definition {
    id: "arm-shadow",
    effect: None,
    is_library_point: false,
    about: "c' = c + a tanh((x - x_c)/L) of every element: the robot's arm is one more electrode, nearer the farther the tool reaches",
    is_fine: false,
    make: |knobs| {
        let middle_mm = knobs.middle_mm();
        let length_mm = knobs.between("length_mm", 3.0, 8.0);
        let counts = knobs.sign("side") * knobs.scaled("counts", 15.0);
        PipelineHook::readout(move |now, readings| {
            let reach = (now.touch.point_mm[0] - middle_mm[0]) / length_mm;
            shift(readings, counts * reach.tanh());
        })
    },
};

pub(super) const COMMON_MODE: Definition = Definition {
    id: "common-mode",
    effect: None,
    is_library_point: false,
    about: "y = x - a mean of all rises, the same for every element: the reference electrode follows the array",
    is_fine: false,
    make: |knobs| {
        let share = knobs.sign("side") * knobs.scaled("share", 0.25);
        PipelineHook::element(move |_, signal| {
            let mean = signal.iter().sum::<f64>() / signal.len() as f64;
            shift(signal, -share * mean);
        })
    },
};

pub(super) const GAIN_FLICKER: Definition = Definition {
    id: "gain-flicker",
    effect: None,
    is_library_point: false,
    about: "s' = s (1 + a n), n drawn for each frame, the same for all elements: ripple of the excitation",
    is_fine: false,
    make: |knobs| {
        let ripple = knobs.scaled("ripple", 0.02);
        let mut rng = knobs.rng();
        PipelineHook::element(move |_, signal| scale(signal, 1.0 + ripple * normal(&mut rng)))
    },
};

pub(super) const ROW_BURSTS: Definition = Definition {
    id: "row-bursts",
    effect: None,
    is_library_point: false,
    about: "y = x + a n of one row, now and then, n drawn for each frame: an amplifier with burst noise",
    is_fine: false,
    make: |knobs| {
        let (rows, cols) = knobs.grid();
        let row = knobs.which("near_element") / cols % rows;
        let mut is_on = telegraph(knobs);
        let rms_counts = knobs.scaled("rms_counts", 6.0);
        let mut rng = knobs.rng();
        PipelineHook::readout(move |now, counts| {
            let deviate = normal(&mut rng);
            if is_on(now.dt_s) {
                shift(&mut counts[row * cols..(row + 1) * cols], rms_counts * deviate);
            }
        })
    },
};

pub(super) const FRAME_TEARING: Definition = Definition {
    id: "frame-tearing",
    effect: None,
    is_library_point: false,
    about: "rows from a random one on show the frame before, in a share of the frames: the host reads while the sensor writes",
    is_fine: false,
    make: |knobs| {
        let (rows, cols) = knobs.grid();
        let torn = knobs.share("torn_share", 0.4);
        let mut rng = knobs.rng();
        let mut before: Vec<f64> = Vec::new();
        PipelineHook::readout(move |_, counts| {
            let fresh = counts.to_vec();
            let from = cols * rng.random_range(1..rows);
            if rng.random::<f64>() < torn && !before.is_empty() {
                counts[from..].copy_from_slice(&before[from..]);
            }
            before = fresh;
        })
    },
};

pub(super) const BIT_FLIPS: Definition = Definition {
    id: "bit-flips",
    effect: None,
    is_library_point: false,
    about: "y_e = x_e + 64 of a random element in a share of the frames: the link to the sensor loses a bit",
    is_fine: false,
    make: |knobs| {
        let flipped = knobs.share("flipped_share", 0.02);
        let mut rng = knobs.rng();
        PipelineHook::readout(move |_, counts| {
            let element = rng.random_range(0..counts.len());
            if rng.random::<f64>() < flipped {
                counts[element] += 64.0;
            }
        })
    },
};

pub(super) const CONTACT_HUM: Definition = Definition {
    id: "contact-hum",
    effect: None,
    is_library_point: false,
    about: "y = x + a w_e sin(2 pi f t) while the tool touches: the stage carries the mains into the array",
    is_fine: false,
    make: |knobs| {
        let frequency_hz = knobs.between("frequency_hz", 1.0, 13.0);
        let amplitude_counts = knobs.scaled("amplitude_counts", 4.0);
        let weights = knobs.per_element(0.6, 1.4);
        PipelineHook::readout(move |now, counts| {
            if now.touch.depth_mm > 0.0 {
                let tone = amplitude_counts * (TAU * frequency_hz * now.t_s).sin();
                counts.iter_mut().zip(&weights).for_each(|(count, weight)| *count += weight * tone);
            }
        })
    },
};

pub(super) const STATIC_CHARGE: Definition = Definition {
    id: "static-charge",
    effect: None,
    is_library_point: false,
    about: "y = x + a w_e exp(-t/T) since the tool left, wherever it was: parting leaves a charge on the covering (triboelectric)",
    is_fine: false,
    make: |knobs| {
        let time_s = knobs.between("time_constant_s", 0.2, 1.0);
        let charge_counts = knobs.sign("side") * knobs.scaled("charge_counts", 8.0);
        let weights = knobs.per_element(0.3, 1.7);
        let (mut touched, mut charge) = (false, 0.0);
        PipelineHook::readout(move |now, counts| {
            let touches = now.touch.depth_mm > 0.0;
            charge = if touched && !touches { 1.0 } else { charge * left(now.dt_s, time_s) };
            touched = touches;
            counts
                .iter_mut()
                .zip(&weights)
                .for_each(|(count, weight)| *count += charge_counts * weight * charge);
        })
    },
};

pub(super) const RANGE_SWITCH: Definition = Definition {
    id: "range-switch",
    effect: None,
    is_library_point: false,
    about: "y = x + a where x > X: the amplifier changes its range there, and the two ranges do not meet",
    is_fine: false,
    make: |knobs| {
        let limit_counts = knobs.between("limit_counts", 150.0, 250.0);
        let step_counts = knobs.sign("side") * knobs.scaled("step_counts", 8.0);
        PipelineHook::converter(move |count| if count > limit_counts { count + step_counts } else { count })
    },
};
