//! Covering: what earlier presses left.

use super::relaxation::power_law;
use super::{Definition, PipelineHook, left};

pub(super) const IMPRINT_POWER_LAW: Definition = Definition {
    id: "imprint-power-law",
    effect: Some("imprint"),
    is_library_point: false,
    about: "after release u' = a u_held (1 + t/T)^-b: a dent that closes by a power law",
    is_fine: false,
    make: |knobs| {
        let exponent = knobs.between("exponent", 0.5, 1.2);
        let time_s = knobs.decade("time_constant_s", 0.3, 2.0);
        let share = knobs.scaled("share", 0.06);
        let (times_s, weights) = power_law(exponent, time_s);
        imprint(times_s, weights, share)
    },
};

pub(super) const IMPRINT_TWO_EXPONENTIALS: Definition = Definition {
    id: "imprint-two-exponentials",
    effect: Some("imprint"),
    is_library_point: false,
    about: "after release u' = a u_held (c exp(-t/T1) + (1 - c) exp(-t/T2)): skin and bulk recover each at its pace",
    is_fine: false,
    make: |knobs| {
        let times_s =
            vec![knobs.decade("time_constant_1_s", 0.4, 2.0), knobs.decade("time_constant_2_s", 6.0, 30.0)];
        let skin = knobs.between("skin_share", 0.3, 0.7);
        let share = knobs.scaled("share", 0.05);
        imprint(times_s, vec![skin, 1.0 - skin], share)
    },
};

pub(super) const MULLINS_EXPONENTIAL: Definition = Definition {
    id: "softening-exponential",
    effect: Some("softening"),
    is_library_point: false,
    about: "u' = u (1 - a (1 - exp(-m/m0))), m the element's largest indentation in the past: Mullins by damage (Simo 1987)",
    is_fine: false,
    make: |knobs| {
        let scale_mm = knobs.between("scale_mm", 0.1, 0.4);
        let loss = knobs.share("loss", 0.12);
        let mut largest_mm = vec![0.0_f64; knobs.elements()];
        PipelineHook::covering(move |_, indentation_mm| {
            for (value, largest_mm) in indentation_mm.iter_mut().zip(&mut largest_mm) {
                *largest_mm = largest_mm.max(*value);
                *value *= 1.0 - loss * (1.0 - left(*largest_mm, scale_mm));
            }
        })
    },
};

pub(super) const MULLINS_DISCONTINUOUS: Definition = Definition {
    id: "softening-ogden-roxburgh",
    effect: Some("softening"),
    is_library_point: false,
    about: "u' = u (1 - a tanh((m - u)/w)), m the largest indentation in the past: softer below it only (Ogden and Roxburgh 1999)",
    is_fine: false,
    make: |knobs| {
        let width_mm = knobs.between("width_mm", 0.05, 0.2);
        let loss = knobs.share("loss", 0.12);
        let mut largest_mm = vec![0.0_f64; knobs.elements()];
        PipelineHook::covering(move |_, indentation_mm| {
            for (value, largest_mm) in indentation_mm.iter_mut().zip(&mut largest_mm) {
                *largest_mm = largest_mm.max(*value);
                *value *= 1.0 - loss * ((*largest_mm - *value) / width_mm).tanh();
            }
        })
    },
};

pub(super) const IMPRINT_DWELL: Definition = Definition {
    id: "imprint-dwell",
    effect: Some("imprint"),
    is_library_point: false,
    about: "u' = u + a max(0, m - u), dm/dt = (u - m)/T with a short T while u > m and a long one after: a dent as deep as the dwell was long",
    is_fine: false,
    make: |knobs| {
        let times_s = [knobs.between("setting_s", 0.5, 3.0), knobs.decade("recovery_s", 3.0, 20.0)];
        let share = knobs.scaled("share", 0.12);
        let mut dents_mm = vec![0.0_f64; knobs.elements()];
        PipelineHook::covering(move |now, indentation_mm| {
            for (value, dent_mm) in indentation_mm.iter_mut().zip(&mut dents_mm) {
                let time_s = times_s[usize::from(*value <= *dent_mm)];
                *dent_mm += (*value - *dent_mm) * (1.0 - left(now.dt_s, time_s));
                *value += share * (*dent_mm - *value).max(0.0);
            }
        })
    },
};

pub(super) const SOFTENING_WORK: Definition = Definition {
    id: "softening-work",
    effect: Some("softening"),
    is_library_point: false,
    about: "u' = u (1 - a (1 - exp(-w/w0))), w the element's loading path so far: continuous damage (Miehe 1995)",
    is_fine: false,
    make: |knobs| {
        let scale_mm = knobs.decade("scale_mm", 0.3, 2.0);
        let loss = knobs.share("loss", 0.15);
        let mut paths_mm = vec![[0.0_f64; 2]; knobs.elements()];
        PipelineHook::covering(move |_, indentation_mm| {
            for (value, [path_mm, last_mm]) in indentation_mm.iter_mut().zip(&mut paths_mm) {
                *path_mm += (*value - *last_mm).max(0.0);
                *last_mm = *value;
                *value *= 1.0 - loss * (1.0 - left(*path_mm, scale_mm));
            }
        })
    },
};

/// Dents: each follows a press down at once and closes with a time constant; a share of what stands out shows.
fn imprint(times_s: Vec<f64>, weights: Vec<f64>, share: f64) -> PipelineHook {
    let mut dents: Vec<Vec<f64>> = vec![Vec::new(); times_s.len()];
    PipelineHook::covering(move |now, indentation_mm| {
        let mut left_mm = vec![0.0; indentation_mm.len()];
        for ((dent, time_s), weight) in dents.iter_mut().zip(&times_s).zip(&weights) {
            dent.resize(indentation_mm.len(), 0.0);
            let kept = left(now.dt_s, *time_s);
            for ((dent, left_mm), value) in dent.iter_mut().zip(&mut left_mm).zip(indentation_mm.iter()) {
                *dent = (*dent * kept).max(*value);
                *left_mm += share * weight * (*dent - *value);
            }
        }
        for (value, left_mm) in indentation_mm.iter_mut().zip(left_mm) {
            *value += left_mm;
        }
    })
}
