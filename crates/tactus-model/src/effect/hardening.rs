//! `hardening`: the covering answers more than in proportion to depth.
//!
//! ```text
//! u_e -> u_e (1 + growth(a_e))          a_e = (1 - own_share) depth + own_share max(0, u_e)
//!
//! growth(a) = growth_at_1_mm (a / 1 mm)^exponent, or through knots
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `growth_at_1_mm` | - | 0 | 0 to 20 | relative growth of the signal where `a_e` is 1 mm |
//! | `exponent` | - | 2 | 0.25 to 6 | power of `a_e`: 1 adds the square of depth, 2 its cube |
//! | `own_share` | - | 0 | 0 to 1 | what hardens the covering: 0 the tool's depth, 1 the element's own signal; between, their mixture |
//!
//! | knots | unit | range | meaning |
//! |---|---|---|---|
//! | `at_mm` | mm | above 0 | places on the axis of `a_e` |
//! | `growth` | - | 0 to 20; times the place, never falling | `growth` there, in straight lines from 0 at 0 and constant after the last; replaces `growth_at_1_mm` and `exponent` |
//!
//! `depth` is that of the tool, from 0 to the covering's thickness. With an `own_share` of 0 the covering hardens under the
//! tool and spreads the result as before: all elements gain by the same factor. With 1 each element gains by its own signal,
//! as in the base model's quadratic term. What the effect adds, `a growth(a)`, never falls: the
//! response is nowhere less steep than in proportion. One that levels off is `saturation`.
//!
//! With a free gain, an `own_share` of 0 and depths to 0.6 mm it follows the elastic laws `exp(a depth) - 1` (`a` from 1 to 6
//! per mm) and `depth^p` (`p` from 1.2 to 2) within 0.5 % rms of the greatest response, and `depth^3` within 2 %.
//!
//! Cost: a power for each element, or one where `own_share` is 0.
//!
//! # Source
//! The paper's Sec. 6: at large deformation the response grows nonlinearly by elastic hardening. The first odd term
//! of an elastic law, as in a Duffing spring, is an exponent of 2; the power law of a contact, K. L. Johnson, *Contact
//! Mechanics* (1985), chapter 4, gives others.

use super::{
    BaseModel, CurveKind, Definition, FreeCurve, Knots, Make, Now, OnCovering, Parameter, Rises, Values,
};
use crate::Contact;
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "hardening",
    summary: "the response grows faster than depth",
    parameters: &[
        Parameter::real("growth_at_1_mm", 0.0, [0.0, 20.0]),
        Parameter::real("exponent", 2.0, [0.25, 6.0]),
        Parameter::real("own_share", 0.0, [0.0, 1.0]),
    ],
    near_twins: &["saturation", "surface-offset", "depth-dependent-spread", "quadratic_per_mm"],
    acts_by: &[Covariate::Depth, Covariate::Signal],
    shown_by: &["ladder", "element-centres"],
    curve: Some(FreeCurve {
        at: "at_mm",
        of: "growth",
        kind: CurveKind::Line,
        range: [0.0, 20.0],
        rises: Rises::ValueTimesPlace,
        replaces: &["growth_at_1_mm", "exponent"],
        formula: |values, at_mm| at_mm.iter().map(|at_mm| values[0] * at_mm.powf(values[1])).collect(),
    }),
    make: Make::Covering(|values| Box::new(Hardening { growth: Growth::of(values), own_share: values[2] })),
};

#[derive(Debug)]
struct Hardening {
    growth: Growth,
    own_share: f64,
}

/// By what share a signal grows.
#[derive(Debug)]
enum Growth {
    Power { at_1_mm: f64, exponent: f64 },
    Free(Knots),
}

impl OnCovering for Hardening {
    fn signal(&mut self, now: Now<'_>, contact: &Contact, signal_mm: &mut [f64]) {
        let depth_mm = depth_mm(now.base, contact);
        // An element that feels nothing feels no more of it; most do, between presses.
        let felt = signal_mm.iter_mut().filter(|u| **u != 0.0);
        if self.own_share == 0.0 {
            let factor = 1.0 + self.growth.at(depth_mm);
            felt.for_each(|u| *u *= factor);
        } else {
            felt.for_each(|u| *u *= 1.0 + self.growth.at(self.argument_mm(depth_mm, *u)));
        }
    }
}

impl Hardening {
    /// What the covering hardens with.
    fn argument_mm(&self, depth_mm: f64, u: f64) -> f64 {
        (1.0 - self.own_share) * depth_mm + self.own_share * u.max(0.0)
    }
}

impl Growth {
    fn of(values: &Values) -> Self {
        let power = || Self::Power { at_1_mm: values[0], exponent: values[1] };
        values.knots().cloned().map_or_else(power, Self::Free)
    }

    fn at(&self, argument_mm: f64) -> f64 {
        match self {
            Self::Power { at_1_mm, exponent } => at_1_mm * argument_mm.powf(*exponent),
            Self::Free(knots) => knots.line(argument_mm),
        }
    }
}

fn depth_mm(base: BaseModel<'_>, contact: &Contact) -> f64 {
    contact.depth_mm.min(base.covering.thickness_mm).max(0.0)
}

#[cfg(test)]
#[path = "hardening_tests.rs"]
mod tests;
