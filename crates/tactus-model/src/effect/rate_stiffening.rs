//! `rate-stiffening`: the response depends on the speed of loading.
//!
//! ```text
//! u_e -> u_e (1 + stiffening_share ln(1 + v / speed))
//! v(t) = greatest of the speed of loading and v before, fallen by exp(-dt / recovery)
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `stiffening_share` | - | 0 | -0.5 to 2 | relative growth of the signal for each factor e in `1 + v / speed` |
//! | `speed_mm_per_s` | mm/s | 1 | 0.001 to 100 | speed from which on stiffening shows |
//! | `recovery_s` | s | 1 | 0.001 to 100000 | time in which the speed that still acts falls to 1/e |
//!
//! The speed of loading is the rate at which depth grows while the tool is in the covering. Without loading the stiffening dies
//! away with the recovery time: with a short one it acts on the way down only, with a long one as long as the tool is in the
//! covering. It is gone once the tool has left.
//!
//! Derivatives in closed form. Cost: none.
//!
//! # Source
//! The strain-rate factor of G. R. Johnson and W. H. Cook, *Proc. 7th Int. Symp. on Ballistics* (1983), with 1 added
//! to the ratio of speeds, so that rest is the base model's.

use super::{BaseModel, Definition, Make, Now, OnCovering, Parameter};
use crate::Contact;

pub(super) static DEFINITION: Definition = Definition {
    name: "rate-stiffening",
    summary: "the response depends on the speed of loading",
    parameters: &[
        Parameter::real("stiffening_share", 0.0, [-0.5, 2.0]),
        Parameter::real("speed_mm_per_s", 1.0, [1e-3, 100.0]),
        Parameter::real("recovery_s", 1.0, [1e-3, 1e5]),
    ],
    near_twins: &["relaxation", "low-pass", "time-lag", "hysteresis"],
    shown_by: &["rates"],
    curve: None,
    make: Make::Covering(|values| {
        Box::new(RateStiffening {
            stiffening_share: values[0],
            speed_mm_per_s: values[1],
            recovery_s: values[2],
            past: None,
        })
    }),
};

#[derive(Debug)]
struct RateStiffening {
    stiffening_share: f64,
    speed_mm_per_s: f64,
    recovery_s: f64,
    past: Option<Previous>,
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
        let factor = 1.0 + self.stiffening_share * self.efolds(past);
        for u in signal_mm {
            *u *= factor;
        }
    }

    fn slope(
        &self,
        parameter: usize,
        _: BaseModel<'_>,
        _: &Contact,
        before_mm: &[f64],
        slope_mm: &mut [f64],
    ) -> bool {
        let Some(past) = self.past else { return false };
        let (share, v, v0) = (self.stiffening_share, past.loading_mm_per_s, self.speed_mm_per_s);
        let factor = match parameter {
            0 => self.efolds(past),
            1 => -share * v / (v0 * (v0 + v)),
            2 => share * v * past.age_s / (self.recovery_s.powi(2) * (v0 + v)),
            _ => return false,
        };
        for (slope, u) in slope_mm.iter_mut().zip(before_mm) {
            *slope = u * factor;
        }
        true
    }

    fn reset(&mut self) {
        self.past = None;
    }
}

impl RateStiffening {
    fn efolds(&self, past: Previous) -> f64 {
        (past.loading_mm_per_s / self.speed_mm_per_s).ln_1p()
    }
}

#[cfg(test)]
#[path = "rate_stiffening_tests.rs"]
mod tests;
