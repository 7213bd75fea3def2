//! `saturation`: the response levels off at the top.
//!
//! ```text
//! u_e -> u_e (1 - lost_share(a_e))          a_e = u_e (1 - c + c s_e / mean s)          c = counts_share
//!
//! lost_share(u) = 1 - (1 + q (u / 1 mm)^knee)^(-1 / knee), or through knots          q = (1 - loss_at_1_mm)^(-knee) - 1
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `loss_at_1_mm` | - | 0 | 0 to 0.99 | share that a signal of 1 mm loses |
//! | `knee` | - | 2 | 0.5 to 12 | how sharply the response turns off |
//! | `counts_share` | - | 0 | 0 to 1 | what saturates: 0 the element's signal, 1 its counts beside those of the mean sensitivity; may be left out |
//!
//! | knots | unit | range | meaning |
//! |---|---|---|---|
//! | `at_mm` | mm | above 0 | signals |
//! | `lost_share` | - | 0 to 0.99, never falling | `lost_share` there, in straight lines from 0 at 0 and constant after the last; replaces the loss and the knee |
//!
//! Small signals stay as they are; the largest end at the ceiling `q^(-1 / knee)` mm. With a knee of 1 the curve is the
//! hyperbola of Michaelis and Menten, with 2 nearly a tanh, with 12 nearly a kink at the ceiling. An amplifier saturates at the same
//! counts whatever the element's gain: then elements of a higher gain saturate at a smaller signal. The baseline
//! is no part of it, and the converter's own end, which is sudden, belongs to the base model. The first term is
//! `-loss_at_1_mm u^(knee + 1)`, so a fit can start from a loss of 0.
//!
//! Other forms that lose up to half of the signal, to 0.6 mm and with a free gain: of what the gain alone leaves, 0.02 %
//! stays unexplained for tanh, exponential, arctan and logarithm, and 1.1 % for a kink at 0.4 mm.
//!
//! Cost: two powers for each element with a signal.
//!
//! # Source
//! The compression of an amplifier: C. Rapp, *Effects of HPA-Nonlinearity on a 4-DPSK/OFDM-Signal* (1991).

use super::{CurveKind, Definition, FreeCurve, Knots, Make, Now, OnElement, Parameter, Rises, Values};
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "saturation",
    summary: "the response levels off at the top",
    parameters: &[
        Parameter::real("loss_at_1_mm", 0.0, [0.0, 0.99]),
        Parameter::real("knee", 2.0, [0.5, 12.0]),
        Parameter::real("counts_share", 0.0, [0.0, 1.0]).or_neutral(),
    ],
    near_twins: &["hardening", "surface-offset", "depth-dependent-spread", "quadratic_per_mm"],
    acts_by: &[Covariate::Signal, Covariate::Counts],
    shown_by: &["ladder", "element-centres"],
    curve: Some(FreeCurve {
        at: "at_mm",
        of: "lost_share",
        kind: CurveKind::Line,
        range: [0.0, 0.99],
        rises: Rises::Value,
        replaces: &["loss_at_1_mm", "knee"],
        formula: |values, at_mm| {
            let formula = Loss::knee(values[0], values[1]);
            at_mm.iter().map(|at_mm| 1.0 - formula.kept(*at_mm)).collect()
        },
    }),
    make: Make::Element(|values| Box::new(Saturation { loss: Loss::of(values), counts_share: values[2] })),
};

/// Where `q u^knee` is less, the share that is left is 1 in double precision.
const SHARE_LEAST: f64 = f64::EPSILON / 8.0;

#[derive(Debug)]
struct Saturation {
    loss: Loss,
    counts_share: f64,
}

/// What share of a signal is lost.
#[derive(Debug)]
enum Loss {
    Knee { knee: f64, q: f64, least_mm: f64 },
    Free(Knots),
}

impl OnElement for Saturation {
    fn signal(&mut self, now: Now<'_>, _: &[f64], signal_mm: &mut [f64]) {
        let gains = &now.base.model.response().sensitivity_counts_per_mm;
        let mean = gains.iter().sum::<f64>() / gains.len() as f64;
        let counts_share = if mean == 0.0 { 0.0 } else { self.counts_share };
        for (u, gain) in signal_mm.iter_mut().zip(gains).filter(|(u, _)| **u > 0.0) {
            let relative = if counts_share > 0.0 { 1.0 + counts_share * (gain / mean - 1.0) } else { 1.0 };
            *u *= self.loss.kept(*u * relative.max(0.0));
        }
    }
}

impl Loss {
    fn of(values: &Values) -> Self {
        values.knots().cloned().map_or_else(|| Self::knee(values[0], values[1]), Self::Free)
    }

    fn knee(loss_at_1_mm: f64, knee: f64) -> Self {
        let kept_log = (-loss_at_1_mm).ln_1p();
        let q = (-knee * kept_log).exp_m1();
        // Most elements are far from the tip, and a power takes long.
        Self::Knee { knee, q, least_mm: (SHARE_LEAST / q).powf(1.0 / knee) }
    }

    /// The share that is left of a signal: near 1 for small ones.
    fn kept(&self, argument_mm: f64) -> f64 {
        match self {
            Self::Knee { least_mm, .. } if argument_mm < *least_mm => 1.0,
            Self::Knee { knee, q, .. } => (1.0 + q * argument_mm.powf(*knee)).powf(-1.0 / knee),
            Self::Free(knots) => 1.0 - knots.line(argument_mm),
        }
    }
}

#[cfg(test)]
#[path = "saturation_tests.rs"]
mod tests;
