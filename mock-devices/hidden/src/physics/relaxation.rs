//! Covering: response that changes at constant depth.

use super::{Definition, PipelineHook, left};

pub(super) const PRONY: Definition = Definition {
    id: "relaxation-prony",
    effect: Some("relaxation"),
    is_library_point: false,
    about: "u' = integral of E(t - s) du(s), E = 1 - sum g_i (1 - exp(-t/T_i)): generalised Maxwell, three branches",
    is_fine: false,
    make: |knobs| {
        let times_s = vec![
            knobs.decade("time_constant_1_s", 0.15, 0.6),
            knobs.decade("time_constant_2_s", 0.8, 4.0),
            knobs.decade("time_constant_3_s", 5.0, 25.0),
        ];
        let parts = ["part_1", "part_2", "part_3"].map(|name| knobs.between(name, 0.5, 1.5));
        let share = knobs.share("relaxed_share", 0.15);
        let all: f64 = parts.iter().sum();
        relaxing(times_s, parts.map(|part| share * part / all).to_vec())
    },
};

pub(super) const POWER_LAW: Definition = Definition {
    id: "relaxation-power-law",
    effect: Some("relaxation"),
    is_library_point: false,
    about: "E(t) = 1 - g + g (1 + t/T)^-b: power-law relaxation of a fractional element (Laplace mixture of exponentials)",
    is_fine: false,
    make: |knobs| {
        let exponent = knobs.between("exponent", 0.15, 0.5);
        let time_s = knobs.decade("time_constant_s", 0.05, 0.3);
        let share = knobs.share("relaxed_share", 0.2);
        let (times_s, weights) = power_law(exponent, time_s);
        relaxing(times_s, weights.into_iter().map(|weight| share * weight).collect())
    },
};

pub(super) const LOGARITHMIC: Definition = Definition {
    id: "creep-logarithmic",
    effect: Some("relaxation"),
    is_library_point: false,
    about: "u' = u (1 + a log10(1 + t_c/T)), t_c the time in contact: logarithmic creep, signal grows at held depth",
    is_fine: false,
    make: |knobs| {
        let time_s = knobs.decade("time_constant_s", 0.1, 1.0);
        let by_decade = knobs.scaled("per_decade", 0.05);
        let mut in_contact_s = 0.0;
        PipelineHook::depth(move |now, depth_mm| {
            in_contact_s = if depth_mm > 0.0 { in_contact_s + now.dt_s } else { 0.0 };
            depth_mm * (1.0 + by_decade * (1.0 + in_contact_s / time_s).log10())
        })
    },
};

pub(super) const STRETCHED: Definition = Definition {
    id: "relaxation-stretched",
    effect: Some("relaxation"),
    is_library_point: false,
    about: "E(t) = 1 - g + g exp(-sqrt(t/T)): a stretched exponential (Kohlrausch 1854), as the Laplace mixture that it is",
    is_fine: false,
    make: |knobs| {
        let time_s = knobs.decade("time_constant_s", 0.3, 3.0);
        let share = knobs.share("relaxed_share", 0.2);
        let (times_s, weights) = stretched(time_s);
        relaxing(times_s, weights.into_iter().map(|weight| share * weight).collect())
    },
};

pub(super) const BY_LOAD: Definition = Definition {
    id: "relaxation-by-load",
    effect: Some("relaxation"),
    is_library_point: false,
    about: "u' = u (1 - g (depth/t) (1 - exp(-t_c/T))), t_c the time in contact: the more it is loaded, the more it flows (Schapery 1969)",
    is_fine: false,
    make: |knobs| {
        let time_s = knobs.decade("time_constant_s", 0.5, 3.0);
        let share = knobs.scaled("share_at_thickness", 0.4);
        let thickness_mm = knobs.sensor.covering.thickness_mm;
        let mut in_contact_s = 0.0;
        PipelineHook::depth(move |now, depth_mm| {
            in_contact_s = if depth_mm > 0.0 { in_contact_s + now.dt_s } else { 0.0 };
            depth_mm * (1.0 - share * depth_mm / thickness_mm * (1.0 - left(in_contact_s, time_s)))
        })
    },
};

/// Parallel branches that each follow their input with a time constant; exact while the input is a straight line.
#[derive(Debug)]
pub(super) struct Branches {
    times_s: Vec<f64>,
    /// One list per branch, one value per element.
    values: Vec<Vec<f64>>,
    last: Vec<f64>,
}

impl Branches {
    pub(super) fn new(times_s: Vec<f64>) -> Self {
        Self { values: vec![Vec::new(); times_s.len()], times_s, last: Vec::new() }
    }

    /// Advances to an input. At the first one all branches are at rest, at 0.
    pub(super) fn follow(&mut self, dt_s: f64, input: &[f64]) {
        self.last.resize(input.len(), 0.0);
        for (time_s, values) in self.times_s.iter().zip(&mut self.values) {
            values.resize(input.len(), 0.0);
            if dt_s > 0.0 {
                for ((value, last), input) in values.iter_mut().zip(&self.last).zip(input) {
                    *value = followed(*value, *last, *input, dt_s, *time_s);
                }
            }
        }
        self.last.copy_from_slice(input);
    }

    /// Value of each branch at an element.
    pub(super) fn at(&self, element: usize) -> impl Iterator<Item = f64> {
        self.values.iter().map(move |values| values[element])
    }
}

/// What follows an input with a time constant, after a time in which the input went straight from `last` to `input`.
pub(super) fn followed(value: f64, last: f64, input: f64, dt_s: f64, time_s: f64) -> f64 {
    let lag = -(-dt_s / time_s).exp_m1() * time_s / dt_s;
    left(dt_s, time_s) * (value - last) + input - (input - last) * lag
}

/// The stress of a relaxing solid, `u - sum of weight times branch`, while the tool touches and never negative: a tool
/// does not pull. The branches continue out of contact, so that the next press is weaker.
fn relaxing(times_s: Vec<f64>, weights: Vec<f64>) -> PipelineHook {
    let mut branches = Branches::new(times_s);
    PipelineHook::covering(move |now, indentation_mm| {
        branches.follow(now.dt_s, indentation_mm);
        if now.touch.depth_mm <= 0.0 {
            return;
        }
        for (element, value) in indentation_mm.iter_mut().enumerate() {
            let relaxed = branches.at(element).zip(&weights).map(|(branch, weight)| weight * branch);
            *value = (*value - relaxed.sum::<f64>()).max(0.0);
        }
    })
}

/// Time constants and weights of exponentials that add up to `(1 + t/T)^-b`: its Laplace mixture
/// `1/Gamma(b) integral s^(b-1) exp(-s) exp(-s t/T) ds`, in equal steps of `ln s`. The part that is slower than the
/// slowest step, `integral s^(b-1) ds = s^b/b` below it, never decays.
pub(super) fn power_law(exponent: f64, time_s: f64) -> (Vec<f64>, Vec<f64>) {
    const STEP: f64 = 0.75;
    let rate_of = |step: f64| (STEP * step).exp();
    let (mut times_s, mut weights): (Vec<f64>, Vec<f64>) = (-14..=5)
        .map(|step| rate_of(f64::from(step)))
        .map(|rate| (time_s / rate, STEP * rate.powf(exponent) * (-rate).exp()))
        .unzip();
    times_s.push(1e12);
    weights.push(rate_of(-14.5).powf(exponent) / exponent);
    let all: f64 = weights.iter().sum();
    (times_s, weights.into_iter().map(|weight| weight / all).collect())
}

/// Time constants and weights of exponentials that add up to `exp(-sqrt(t/T))`: Levy's density
/// `s^(-3/2) exp(-1/(4 s)) / (2 sqrt(pi))` of rates, in equal steps of `ln s`.
pub(super) fn stretched(time_s: f64) -> (Vec<f64>, Vec<f64>) {
    const STEP: f64 = 0.5;
    let rates = (-8..=24).map(|step| (STEP * f64::from(step)).exp());
    let (times_s, weights): (Vec<f64>, Vec<f64>) =
        rates.map(|rate| (time_s / rate, (-0.25 / rate).exp() / rate.sqrt())).unzip();
    let all: f64 = weights.iter().sum();
    (times_s, weights.into_iter().map(|weight| weight / all).collect())
}
