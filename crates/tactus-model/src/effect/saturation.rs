//! `saturation`: the response levels off at the top.
//!
//! ```text
//! u_e -> u_e (1 + q (u_e / 1 mm)^knee)^(-1 / knee)          q = (1 - loss_at_1_mm)^(-knee) - 1
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `loss_at_1_mm` | - | 0 | 0 to 0.99 | share that a signal of 1 mm loses |
//! | `knee` | - | 2 | 0.5 to 12 | how sharply the response turns off |
//!
//! Small signals stay as they are; the largest end at the ceiling `q^(-1 / knee)` mm. With a knee of 1 the curve is the
//! hyperbola of Michaelis and Menten, with 2 nearly a tanh, with 12 nearly a kink at the ceiling. The effect acts before
//! the element's gain and baseline. The converter's own end, which is sudden, belongs to the base model. The first term is
//! `-loss_at_1_mm u^(knee + 1)`, so a fit can start from a loss of 0.
//!
//! Other forms that lose up to half of the signal, to 0.6 mm and with a free gain: of what the gain alone leaves, 0.02 %
//! stays unexplained for tanh, exponential, arctan and logarithm, and 1.1 % for a kink at 0.4 mm.
//!
//! Derivatives in closed form. Cost: two powers for each element with a signal.
//!
//! # Source
//! The compression of an amplifier: C. Rapp, *Effects of HPA-Nonlinearity on a 4-DPSK/OFDM-Signal* (1991).

use super::{BaseModel, Definition, Make, OnElement, Parameter};

pub(super) static DEFINITION: Definition = Definition {
    name: "saturation",
    summary: "the response levels off at the top",
    parameters: &[
        Parameter::real("loss_at_1_mm", 0.0, [0.0, 0.99]),
        Parameter::real("knee", 2.0, [0.5, 12.0]),
    ],
    near_twins: &["hardening", "surface-offset", "depth-dependent-spread", "quadratic_per_mm"],
    shown_by: &["ladder", "element-centres"],
    curve: None,
    make: Make::Element(|values| Box::new(Saturation::new(values[0], values[1]))),
};

#[derive(Debug)]
struct Saturation {
    /// `ln (1 - loss_at_1_mm)`.
    kept_log: f64,
    knee: f64,
    q: f64,
}

impl OnElement for Saturation {
    fn signal(&self, _: BaseModel<'_>, _: &[f64], signal_mm: &mut [f64]) {
        if self.q > 0.0 {
            for u in signal_mm.iter_mut().filter(|u| **u > 0.0) {
                *u *= self.bend(*u).powf(-1.0 / self.knee);
            }
        }
    }

    fn slope(
        &self,
        parameter: usize,
        _: BaseModel<'_>,
        _: &[f64],
        before_mm: &[f64],
        slope_mm: &mut [f64],
    ) -> bool {
        let by = match parameter {
            0 => Self::by_loss,
            1 => Self::by_knee,
            _ => return false,
        };
        for (slope, u) in slope_mm.iter_mut().zip(before_mm) {
            *slope = if *u > 0.0 { by(self, *u) } else { 0.0 };
        }
        true
    }
}

impl Saturation {
    fn new(loss_at_1_mm: f64, knee: f64) -> Self {
        let kept_log = (-loss_at_1_mm).ln_1p();
        Self { kept_log, knee, q: (-knee * kept_log).exp_m1() }
    }

    /// `1 + q u^knee`: near 1 for small signals.
    fn bend(&self, u: f64) -> f64 {
        1.0 + self.q * u.powf(self.knee)
    }

    fn by_loss(&self, u: f64) -> f64 {
        let power = self.knee + 1.0;
        -u.powf(power) * self.bend(u).powf(-power / self.knee) * (-power * self.kept_log).exp()
    }

    fn by_knee(&self, u: f64) -> f64 {
        let (bend, power) = (self.bend(u), u.powf(self.knee));
        let bend_by_knee = power * (self.q * u.ln() - (1.0 + self.q) * self.kept_log);
        u * bend.powf(-1.0 / self.knee) * (bend.ln() / self.knee - bend_by_knee / bend) / self.knee
    }
}

#[cfg(test)]
#[path = "saturation_tests.rs"]
mod tests;
