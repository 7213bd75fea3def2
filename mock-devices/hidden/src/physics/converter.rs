//! Readout: converters with uneven steps.

use super::{Definition, Knobs, PipelineHook};

pub(super) const MISSING_CODES: Definition = Definition {
    id: "missing-codes",
    effect: Some("quantisation"),
    is_library_point: false,
    about: "y = k P for x from k P to k P + w, else x: the converter leaves out w codes after every P",
    is_fine: false,
    make: |knobs| {
        let period_counts = knobs.between("period_counts", 40.0, 80.0);
        let missing_counts = knobs.scaled("missing_counts", 16.0).min(period_counts);
        PipelineHook::converter(move |count| {
            let beyond = count.rem_euclid(period_counts);
            if beyond < missing_counts { count - beyond } else { count }
        })
    },
};

pub(super) const UNEVEN_STEPS: Definition = Definition {
    id: "uneven-steps",
    effect: Some("quantisation"),
    is_library_point: false,
    about: "y = q floor(x/q) with steps of q (1 + d) and q (1 - d) in turn: a bit of the converter is badly trimmed",
    is_fine: false,
    make: |knobs| {
        let step_counts = coarse(knobs, 16.0);
        let wide = knobs.between("wide_share", 0.6, 0.85);
        PipelineHook::converter(move |count| {
            if step_counts <= 0.0 {
                return count;
            }
            let pair = 2.0 * step_counts;
            let beyond = count.rem_euclid(pair);
            count - beyond + if beyond < wide * pair { 0.0 } else { step_counts }
        })
    },
};

pub(super) const COMPANDED: Definition = Definition {
    id: "companded",
    effect: Some("quantisation"),
    is_library_point: false,
    about: "y = q round(x/q), q doubles at 128, 256, 512 ... counts: a converter with few bits and a range switch",
    is_fine: false,
    make: |knobs| {
        let step_counts = coarse(knobs, 8.0);
        PipelineHook::converter(move |count| {
            if step_counts <= 0.0 {
                return count;
            }
            let step = step_counts * 2.0_f64.powf((count.abs() / 64.0).max(1.0).log2().floor());
            (count / step).round() * step
        })
    },
};

/// A step of whole declared steps; 0 where it is not coarser than declared.
fn coarse(knobs: &mut Knobs<'_>, at_one: f64) -> f64 {
    let steps = (at_one * knobs.strength).round();
    let step = if steps > 1.0 { steps * knobs.sensor.model.array().step_counts() } else { 0.0 };
    knobs.keep("step_counts", step)
}
