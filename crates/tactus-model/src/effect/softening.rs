//! `softening`: the response is weaker up to the greatest earlier signal (Mullins effect).
//!
//! ```text
//! u -> u (1 - lost_share(x))
//! x = (1 - |past_share|) (1 - u / m) + |past_share| q / (q + thickness)
//! m = greatest u so far;   q = m if past_share > 0, or the sum of all rises of u so far
//!
//! lost_share(x) = softened_share erf((1 - (1 - x)^2) / width_share), or through knots
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `softened_share` | - | 0 | -1 to 1 | share of the signal that is lost where `x` is 1 |
//! | `width_share` | - | 1 | 0.01 to 10 | width of the transition; with a `past_share` of 0 as a share of the energy `m^2` |
//! | `past_share` | - | 0 | -1 to 1 | what the loss follows: 0 how far below the greatest the signal is, 1 the greatest itself, -1 all loading so far; between, mixtures |
//!
//! | knots | unit | range | meaning |
//! |---|---|---|---|
//! | `at_share` | - | above 0 | places on the axis of `x`, to 1 |
//! | `lost_share` | - | 0 to 1, never falling | `lost_share` there, in straight lines from 0 at 0 and constant after the last; replaces `softened_share` and `width_share` |
//!
//! Each element has its own past, and the covering does not recover. With a `past_share` of 0 a first loading follows the base model, and so
//! does loading beyond the greatest signal so far; below that, unloading and every later press follow the same weaker curve. With 1 it is
//! damage: the signal loses the same share at every depth until it goes beyond its greatest, as a first loading does all the way. With
//! -1 it goes on with every press.
//!
//! Cost: an error function for each element.
//!
//! # Source
//! The Mullins effect in the pseudo-elastic form of R. W. Ogden and D. G. Roxburgh, *Proc. R. Soc. Lond. A* 455 (1999),
//! with the strain energy of a linear spring and a width in proportion to the greatest energy. Damage by the greatest strain: J. C. Simo,
//! *Comput. Methods Appl. Mech. Eng.* 60 (1987) 153; by the whole path: C. Miehe, *Eur. J. Mech. A* 14 (1995) 697.

use libm::erf;

use super::{CurveKind, Definition, FreeCurve, Make, Now, OnCovering, Parameter, Rises, Values};
use crate::Contact;
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "softening",
    summary: "the response falls with earlier loading",
    parameters: &[
        Parameter::real("softened_share", 0.0, [-1.0, 1.0]),
        Parameter::real("width_share", 1.0, [0.01, 10.0]),
        Parameter::real("past_share", 0.0, [-1.0, 1.0]).or_neutral(),
    ],
    near_twins: &["hysteresis", "relaxation", "gain-drift"],
    acts_by: &[Covariate::Depth, Covariate::DeepestBefore, Covariate::Signal],
    shown_by: &["repeats", "ladder"],
    curve: Some(FreeCurve {
        at: "at_share",
        of: "lost_share",
        kind: CurveKind::Line,
        range: [0.0, 1.0],
        rises: Rises::Value,
        replaces: &["softened_share", "width_share"],
        formula: |values, at| at.iter().map(|place| lost_share(values, *place)).collect(),
    }),
    make: Make::Covering(|values| Box::new(Softening { values: values.clone(), pasts: Vec::new() })),
};

#[derive(Debug)]
struct Softening {
    values: Values,
    /// One for each element.
    pasts: Vec<Past>,
}

/// What an element was loaded with.
#[derive(Debug, Clone, Copy, Default)]
#[expect(clippy::struct_field_names, reason = "the unit is the last word of a name")]
struct Past {
    last_mm: f64,
    greatest_mm: f64,
    /// Sum of all rises.
    path_mm: f64,
}

impl OnCovering for Softening {
    fn signal(&mut self, now: Now<'_>, _: &Contact, signal_mm: &mut [f64]) {
        self.pasts.resize(signal_mm.len(), Past::default());
        for (u, past) in signal_mm.iter_mut().zip(&mut self.pasts) {
            past.load(*u);
            if past.greatest_mm > 0.0 {
                let place = past.place(*u, self.values[2], now.base.covering.thickness_mm);
                let lost = self
                    .values
                    .knots()
                    .map_or_else(|| lost_share(&self.values, place), |knots| knots.line(place));
                *u *= 1.0 - lost;
            }
        }
    }

    fn remembers(&self) -> bool {
        true
    }

    fn reset(&mut self) {
        self.pasts.clear();
    }
}

impl Past {
    fn load(&mut self, u: f64) {
        self.path_mm += (u - self.last_mm).max(0.0);
        self.greatest_mm = self.greatest_mm.max(u);
        self.last_mm = u;
    }

    /// Where a signal is on the axis of the loss, 0 to 1.
    fn place(&self, u: f64, past_share: f64, thickness_mm: f64) -> f64 {
        let below = (1.0 - u / self.greatest_mm).min(1.0);
        let loaded_mm = if past_share > 0.0 { self.greatest_mm } else { self.path_mm };
        let share = past_share.abs();
        (1.0 - share) * below + share * loaded_mm / (loaded_mm + thickness_mm)
    }
}

/// The formula.
fn lost_share(values: &[f64], place: f64) -> f64 {
    values[0] * erf((1.0 - (1.0 - place).powi(2)).max(0.0) / values[1])
}

#[cfg(test)]
#[path = "softening_tests.rs"]
mod tests;
