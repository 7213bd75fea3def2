//! Readout: drift of baselines and gains.

use std::f64::consts::TAU;

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::wiring::telegraph;
use super::{Definition, PipelineHook, left, shift};

pub(super) const COMMON_WALK: Definition = Definition {
    id: "drift-common-walk",
    effect: Some("baseline-drift"),
    is_library_point: false,
    about: "b' = b + W(t), W one Wiener process for all elements: the reference voltage drifts",
    is_fine: false,
    make: |knobs| {
        let counts_per_root_s = knobs.scaled("counts_per_root_s", 0.5);
        let (mut rng, mut offset) = (knobs.rng(), 0.0);
        PipelineHook::readout(move |now, counts| {
            offset += now.dt_s.sqrt() * normal(&mut rng);
            shift(counts, counts_per_root_s * offset);
        })
    },
};

pub(super) const ORNSTEIN_UHLENBECK: Definition = Definition {
    id: "drift-ornstein-uhlenbeck",
    effect: Some("baseline-drift"),
    is_library_point: false,
    about: "db = -b dt/T + noise, each element for itself: leakage currents (Uhlenbeck and Ornstein 1930)",
    is_fine: false,
    make: |knobs| {
        let time_s = knobs.decade("time_constant_s", 15.0, 60.0);
        let rms_counts = knobs.scaled("rms_counts", 3.0);
        let mut rng = knobs.rng();
        let mut offsets: Vec<f64> = (0..knobs.elements()).map(|_| normal(&mut rng)).collect();
        PipelineHook::readout(move |now, counts| {
            let kept = left(now.dt_s, time_s);
            let fresh = (1.0 - kept * kept).sqrt();
            for (count, offset) in counts.iter_mut().zip(&mut offsets) {
                *offset = kept * *offset + fresh * normal(&mut rng);
                *count += rms_counts * *offset;
            }
        })
    },
};

pub(super) const WARM_UP: Definition = Definition {
    id: "drift-warm-up",
    effect: Some("baseline-drift"),
    is_library_point: false,
    about: "b' = b + A_e (1 - exp(-t/T)), A_e of one sign: the electronics warm up after they were switched on",
    is_fine: false,
    make: |knobs| {
        let time_s = knobs.decade("time_constant_s", 25.0, 120.0);
        let rise_counts = knobs.sign("side") * knobs.scaled("rise_counts", 10.0);
        let shares = knobs.per_element(0.5, 1.5);
        PipelineHook::readout(move |now, counts| {
            let warm = 1.0 - left(now.t_s, time_s);
            counts.iter_mut().zip(&shares).for_each(|(count, share)| *count += rise_counts * share * warm);
        })
    },
};

pub(super) const GAIN_WARM_UP: Definition = Definition {
    id: "gain-warm-up",
    effect: Some("gain-drift"),
    is_library_point: false,
    about: "s' = s (1 + a (1 - exp(-t/T))): the excitation's amplitude settles after it was switched on",
    is_fine: false,
    make: |knobs| {
        let time_s = knobs.decade("time_constant_s", 25.0, 120.0);
        let change = knobs.sign("side") * knobs.scaled("change", 0.05);
        gain(knobs.baselines_counts(), move |t_s, _, _| change * (1.0 - left(t_s, time_s)))
    },
};

pub(super) const GAIN_WALK: Definition = Definition {
    id: "gain-walk",
    effect: Some("gain-drift"),
    is_library_point: false,
    about: "s' = s (1 + W(t)), W one Wiener process for all elements: the excitation's amplitude drifts",
    is_fine: false,
    make: |knobs| {
        let per_root_s = knobs.scaled("per_root_s", 0.004);
        let (mut rng, mut offset) = (knobs.rng(), 0.0);
        gain(knobs.baselines_counts(), move |_, dt_s, _| {
            offset += dt_s.sqrt() * normal(&mut rng);
            per_root_s * offset
        })
    },
};

pub(super) const GAIN_TEMPERATURE: Definition = Definition {
    id: "gain-temperature",
    effect: Some("gain-drift"),
    is_library_point: true,
    about: "s' = s (1 + a (T - T_0)): the covering's permittivity changes with temperature",
    is_fine: false,
    make: |knobs| {
        let per_k = knobs.sign("side") * knobs.scaled("per_k", 0.02);
        let mut first_c = None;
        gain(knobs.baselines_counts(), move |_, _, temperature_c| {
            per_k * (temperature_c - *first_c.get_or_insert(temperature_c))
        })
    },
};

pub(super) const GAIN_WARMTH: Definition = Definition {
    id: "gain-warmth",
    effect: Some("gain-drift"),
    is_library_point: false,
    about: "s' = s (1 + a (w - w_0)), dw/dt = (T - w)/tau: the covering's permittivity follows the room's temperature slowly",
    is_fine: false,
    make: |knobs| {
        let time_s = knobs.decade("time_constant_s", 20.0, 80.0);
        let per_k = knobs.sign("side") * knobs.scaled("per_k", 0.05);
        let mut warmth_c: Option<[f64; 2]> = None;
        gain(knobs.baselines_counts(), move |_, dt_s, temperature_c| {
            let [first_c, now_c] = warmth_c.get_or_insert([temperature_c; 2]);
            *now_c += (temperature_c - *now_c) * (1.0 - left(dt_s, time_s));
            per_k * (*now_c - *first_c)
        })
    },
};

pub(super) const GAIN_CYCLE: Definition = Definition {
    id: "gain-cycle",
    effect: Some("gain-drift"),
    is_library_point: false,
    about: "s' = s (1 + a sin(2 pi t/P)): a thermostat near the electronics cycles",
    is_fine: false,
    make: |knobs| {
        let period_s = knobs.between("period_s", 20.0, 50.0);
        let swing = knobs.scaled("swing", 0.04);
        gain(knobs.baselines_counts(), move |t_s, _, _| swing * (TAU * t_s / period_s).sin())
    },
};

pub(super) const GAIN_JUMPS: Definition = Definition {
    id: "gain-jumps",
    effect: Some("gain-drift"),
    is_library_point: false,
    about: "s' = s (1 + a) now and then, else s: the excitation changes between two levels (random telegraph)",
    is_fine: false,
    make: |knobs| {
        let change = knobs.sign("side") * knobs.scaled("change", 0.05);
        let mut is_on = telegraph(knobs);
        gain(knobs.baselines_counts(), move |_, dt_s, _| if is_on(dt_s) { change } else { 0.0 })
    },
};

/// A gain of all elements: 1 plus `excess` of the time, the time step and the temperature.
fn gain(baselines: Vec<f64>, mut excess: impl FnMut(f64, f64, f64) -> f64 + Send + 'static) -> PipelineHook {
    PipelineHook::readout(move |now, counts| {
        let by = excess(now.t_s, now.dt_s, now.temperature_c);
        counts.iter_mut().zip(&baselines).for_each(|(count, baseline)| *count += by * (*count - baseline));
    })
}

/// A deviate of the standard normal distribution.
pub(super) fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}
