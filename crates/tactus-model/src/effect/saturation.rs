//! `saturation`: the response levels off at the top.
//!
//! ```text
//! u_e -> u_e (1 - lost_share(u_e))
//!
//! lost_share(u) = 1 - (1 + q (u / 1 mm)^knee)^(-1 / knee), or through knots          q = (1 - loss_at_1_mm)^(-knee) - 1
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `loss_at_1_mm` | - | 0 | 0 to 0.99 | share that a signal of 1 mm loses |
//! | `knee` | - | 2 | 0.5 to 12 | how sharply the response turns off |
//!
//! | knots | unit | range | meaning |
//! |---|---|---|---|
//! | `at_mm` | mm | above 0 | signals |
//! | `lost_share` | - | 0 to 0.99, never falling | `lost_share` there, in straight lines from 0 at 0 and constant after the last; replaces both parameters |
//!
//! Small signals stay as they are; the largest end at the ceiling `q^(-1 / knee)` mm. With a knee of 1 the curve is the
//! hyperbola of Michaelis and Menten, with 2 nearly a tanh, with 12 nearly a kink at the ceiling. The effect acts before
//! the element's gain and baseline. The converter's own end, which is sudden, belongs to the base model. The first term is
//! `-loss_at_1_mm u^(knee + 1)`, so a fit can start from a loss of 0.
//!
//! Other forms that lose up to half of the signal, to 0.6 mm and with a free gain: of what the gain alone leaves, 0.02 %
//! stays unexplained for tanh, exponential, arctan and logarithm, and 1.1 % for a kink at 0.4 mm.
//!
//! Cost: two powers for each element with a signal.
//!
//! # Source
//! The compression of an amplifier: C. Rapp, *Effects of HPA-Nonlinearity on a 4-DPSK/OFDM-Signal* (1991).

use super::{CurveKind, Definition, FreeCurve, Knots, Make, Now, OnElement, Parameter, Rises};

pub(super) static DEFINITION: Definition = Definition {
    name: "saturation",
    summary: "the response levels off at the top",
    parameters: &[
        Parameter::real("loss_at_1_mm", 0.0, [0.0, 0.99]),
        Parameter::real("knee", 2.0, [0.5, 12.0]),
    ],
    near_twins: &["hardening", "surface-offset", "depth-dependent-spread", "quadratic_per_mm"],
    shown_by: &["ladder", "element-centres"],
    curve: Some(FreeCurve {
        at: "at_mm",
        of: "lost_share",
        kind: CurveKind::Line,
        range: [0.0, 0.99],
        rises: Rises::Value,
        replaces: &["loss_at_1_mm", "knee"],
        formula: |values, at_mm| {
            let formula = Saturation::new(values[0], values[1]);
            at_mm.iter().map(|u| 1.0 - formula.bend(*u).powf(-1.0 / formula.knee)).collect()
        },
    }),
    make: Make::Element(|values| match values.knots() {
        Some(knots) => Box::new(FreeSaturation { lost_share: knots.clone() }),
        None => Box::new(Saturation::new(values[0], values[1])),
    }),
};

#[derive(Debug)]
struct Saturation {
    knee: f64,
    q: f64,
}

impl OnElement for Saturation {
    fn signal(&mut self, _: Now<'_>, _: &[f64], signal_mm: &mut [f64]) {
        if self.q > 0.0 {
            for u in signal_mm.iter_mut().filter(|u| **u > 0.0) {
                *u *= self.bend(*u).powf(-1.0 / self.knee);
            }
        }
    }
}

impl Saturation {
    fn new(loss_at_1_mm: f64, knee: f64) -> Self {
        let kept_log = (-loss_at_1_mm).ln_1p();
        Self { knee, q: (-knee * kept_log).exp_m1() }
    }

    /// `1 + q u^knee`: near 1 for small signals.
    fn bend(&self, u: f64) -> f64 {
        1.0 + self.q * u.powf(self.knee)
    }
}

#[derive(Debug)]
struct FreeSaturation {
    lost_share: Knots,
}

impl OnElement for FreeSaturation {
    fn signal(&mut self, _: Now<'_>, _: &[f64], signal_mm: &mut [f64]) {
        for u in signal_mm.iter_mut().filter(|u| **u > 0.0) {
            *u *= 1.0 - self.lost_share.line(*u);
        }
    }
}

#[cfg(test)]
#[path = "saturation_tests.rs"]
mod tests;
