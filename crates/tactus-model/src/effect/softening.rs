//! `softening`: the response is weaker up to the greatest earlier signal (Mullins effect).
//!
//! ```text
//! u -> u (1 - lost_share(1 - u / m))          m = greatest u so far
//!
//! lost_share(x) = softened_share erf((1 - (1 - x)^2) / width_share), or through knots
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `softened_share` | - | 0 | -1 to 1 | share of the signal that is lost far below the greatest signal so far |
//! | `width_share` | - | 1 | 0.01 to 10 | width of the transition below `m`, as a share of the energy `m^2` |
//!
//! | knots | unit | range | meaning |
//! |---|---|---|---|
//! | `at_share` | - | above 0 | how far below the greatest the signal is: `1 - u / m`, to 1 |
//! | `lost_share` | - | 0 to 1, never falling | `lost_share` there, in straight lines from 0 at 0 and constant after the last; replaces both parameters |
//!
//! Each element has its own past. A first loading follows the base model, and so does loading beyond the greatest signal so
//! far. Below that, unloading and every later press follow the same weaker curve. The covering does not recover.
//!
//! Cost: an error function for each element.
//!
//! # Source
//! The Mullins effect in the pseudo-elastic form of R. W. Ogden and D. G. Roxburgh, *Proc. R. Soc. Lond. A* 455 (1999),
//! with the strain energy of a linear spring and a width in proportion to the greatest energy.

use libm::erf;

use super::{CurveKind, Definition, FreeCurve, Knots, Make, Now, OnCovering, Parameter, Rises};
use crate::Contact;

pub(super) static DEFINITION: Definition = Definition {
    name: "softening",
    summary: "the response falls with earlier loading",
    parameters: &[
        Parameter::real("softened_share", 0.0, [-1.0, 1.0]),
        Parameter::real("width_share", 1.0, [0.01, 10.0]),
    ],
    near_twins: &["hysteresis", "relaxation", "gain-drift"],
    shown_by: &["repeats", "ladder"],
    curve: Some(FreeCurve {
        at: "at_share",
        of: "lost_share",
        kind: CurveKind::Line,
        range: [0.0, 1.0],
        rises: Rises::Value,
        replaces: &["softened_share", "width_share"],
        formula: |values, at| {
            let lost = |below: &f64| values[0] * erf(widths_below(1.0 - below, 1.0, values[1]));
            at.iter().map(lost).collect()
        },
    }),
    make: Make::Covering(|values| match values.knots() {
        Some(knots) => Box::new(FreeSoftening { lost_share: knots.clone(), greatest_mm: Vec::new() }),
        None => {
            Box::new(Softening { softened_share: values[0], width_share: values[1], greatest_mm: Vec::new() })
        }
    }),
};

#[derive(Debug)]
struct Softening {
    softened_share: f64,
    width_share: f64,
    greatest_mm: Vec<f64>,
}

impl OnCovering for Softening {
    fn signal(&mut self, _: Now<'_>, _: &Contact, signal_mm: &mut [f64]) {
        self.greatest_mm.resize(signal_mm.len(), 0.0);
        for (u, greatest_mm) in signal_mm.iter_mut().zip(&mut self.greatest_mm) {
            *greatest_mm = greatest_mm.max(*u);
            let below = widths_below(*u, *greatest_mm, self.width_share);
            *u *= 1.0 - self.softened_share * erf(below);
        }
    }

    fn reset(&mut self) {
        self.greatest_mm.clear();
    }
}

#[derive(Debug)]
struct FreeSoftening {
    lost_share: Knots,
    greatest_mm: Vec<f64>,
}

impl OnCovering for FreeSoftening {
    fn signal(&mut self, _: Now<'_>, _: &Contact, signal_mm: &mut [f64]) {
        self.greatest_mm.resize(signal_mm.len(), 0.0);
        for (u, greatest_mm) in signal_mm.iter_mut().zip(&mut self.greatest_mm) {
            *greatest_mm = greatest_mm.max(*u);
            if *greatest_mm > 0.0 {
                *u *= 1.0 - self.lost_share.line((1.0 - *u / *greatest_mm).min(1.0));
            }
        }
    }

    fn reset(&mut self) {
        self.greatest_mm.clear();
    }
}

/// How far below the greatest a signal is, in energy and in widths; 0 for what never was pressed.
fn widths_below(u: f64, greatest_mm: f64, width_share: f64) -> f64 {
    if greatest_mm > 0.0 { (1.0 - (u / greatest_mm).powi(2)).max(0.0) / width_share } else { 0.0 }
}

#[cfg(test)]
#[path = "softening_tests.rs"]
mod tests;
