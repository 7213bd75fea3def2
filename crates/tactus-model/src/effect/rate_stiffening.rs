//! `rate-stiffening`: the response depends on the speed of loading.
//!
//! ```text
//! u_e -> u_e (1 + growth(v))
//! v(t) = greatest of the speed of loading and v before, fallen by exp(-dt / recovery)
//!
//! growth(v) = stiffening_share ln(1 + v / speed), or through knots
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `stiffening_share` | - | 0 | 0 to 2 | relative growth of the signal for each factor e in `1 + v / speed` |
//! | `speed_mm_per_s` | mm/s | 1 | 0.001 to 100 | speed from which on stiffening shows |
//! | `recovery_s` | s | 1 | 0.001 to 100000 | time in which the speed that still acts falls to 1/e |
//!
//! | knots | unit | range | meaning |
//! |---|---|---|---|
//! | `at_mm_per_s` | mm/s | above 0 | speeds |
//! | `growth` | - | 0 to 20 | `growth` there, never falling, in straight lines over the logarithm of the speed; from 0 at 0 to the first a straight line, constant after the last; replaces `stiffening_share` and `speed_mm_per_s` |
//!
//! A faster press is never softer: a signal that grows while the tool waits is creep, a `relaxation` with a negative share.
//!
//! The speed of loading is the rate at which depth grows while the tool is in the covering. Without loading the stiffening dies
//! away with the recovery time: with a short one it acts on the way down only, with a long one as long as the tool is in the
//! covering. It is gone once the tool has left.
//!
//! Cost: none.
//!
//! # Source
//! The strain-rate factor of G. R. Johnson and W. H. Cook, *Proc. 7th Int. Symp. on Ballistics* (1983), with 1 added
//! to the ratio of speeds, so that rest is the base model's.

use super::{CurveKind, Definition, FreeCurve, Knots, Make, Now, OnCovering, Parameter, Rises, Values};
use crate::Contact;
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "rate-stiffening",
    summary: "the response depends on the speed of loading",
    parameters: &[
        Parameter::real("stiffening_share", 0.0, [0.0, 2.0]),
        Parameter::real("speed_mm_per_s", 1.0, [1e-3, 100.0]),
        Parameter::real("recovery_s", 1.0, [1e-3, 1e5]),
    ],
    near_twins: &["relaxation", "low-pass", "time-lag", "hysteresis"],
    acts_by: &[Covariate::Speed, Covariate::SinceTurn],
    shown_by: &["rates"],
    curve: Some(FreeCurve {
        at: "at_mm_per_s",
        of: "growth",
        kind: CurveKind::LogLine,
        range: [0.0, 20.0],
        rises: Rises::Value,
        replaces: &["stiffening_share", "speed_mm_per_s"],
        formula: |values, at| at.iter().map(|speed| values[0] * (speed / values[1]).ln_1p()).collect(),
    }),
    make: Make::Covering(|values| {
        Box::new(RateStiffening { growth: Growth::of(values), recovery_s: values[2], past: None })
    }),
};

#[derive(Debug)]
struct RateStiffening {
    growth: Growth,
    recovery_s: f64,
    past: Option<Previous>,
}

/// By what share a speed of loading raises the signal.
#[derive(Debug)]
enum Growth {
    Logarithm { share: f64, speed_mm_per_s: f64 },
    Free(Knots),
}

#[derive(Debug, Clone, Copy)]
struct Previous {
    depth_mm: f64,
    /// Speed of loading that still acts, and how long it has not been reached.
    loading_mm_per_s: f64,
    age_s: f64,
}

impl OnCovering for RateStiffening {
    fn signal(&mut self, now: Now<'_>, contact: &Contact, signal_mm: &mut [f64]) {
        let depth_mm = contact.depth_mm;
        let rest = Previous { depth_mm, loading_mm_per_s: 0.0, age_s: 0.0 };
        let past = self.past.unwrap_or(rest);
        let fallen = past.loading_mm_per_s * (-now.dt_s / self.recovery_s).exp();
        let speed = if now.dt_s > 0.0 { (depth_mm - past.depth_mm) / now.dt_s } else { 0.0 };
        let past = if depth_mm <= 0.0 {
            rest
        } else if speed > fallen {
            Previous { loading_mm_per_s: speed, ..rest }
        } else {
            Previous { depth_mm, loading_mm_per_s: fallen, age_s: past.age_s + now.dt_s }
        };
        self.past = Some(past);
        let factor = 1.0 + self.growth.at(past.loading_mm_per_s);
        for u in signal_mm {
            *u *= factor;
        }
    }

    fn remembers(&self) -> bool {
        true
    }

    fn reset(&mut self) {
        self.past = None;
    }
}

impl Growth {
    fn of(values: &Values) -> Self {
        let logarithm = || Self::Logarithm { share: values[0], speed_mm_per_s: values[1] };
        values.knots().cloned().map_or_else(logarithm, Self::Free)
    }

    fn at(&self, mm_per_s: f64) -> f64 {
        match self {
            Self::Logarithm { share, speed_mm_per_s } => share * (mm_per_s / speed_mm_per_s).ln_1p(),
            Self::Free(knots) => knots.log_line(mm_per_s),
        }
    }
}

#[cfg(test)]
#[path = "rate_stiffening_tests.rs"]
mod tests;
