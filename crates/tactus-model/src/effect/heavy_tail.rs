//! `heavy-tail`: the point spread has more weight far out than a Gaussian.
//!
//! ```text
//! G -> (1 - sum of w_k) G_sigma + sum of w_k G_(r_k sigma)
//!
//! w = tail_share, r = width_ratio, or both from knots
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `tail_share` | - | 0 | 0 to 1 | share of the volume that is in the wider Gaussian |
//! | `width_ratio` | - | 2 | 1 to 10 | standard deviation of the wider Gaussian over that of the core |
//!
//! | knots | unit | range | meaning |
//! |---|---|---|---|
//! | `at_ratio` | - | above 0 | standard deviations `r_k` of Gaussians over that of the core |
//! | `tail_share` | - | 0 to 1 | share `w_k` of the volume that is in each; replaces all parameters |
//!
//! All Gaussians have unit volume. If the shares add up to more than 1, they are divided by their sum, and nothing is left in the core. The
//! tail lowers the peak, so that the sensitivity, which is stated for one Gaussian, must be calibrated again.
//!
//! Sums of Gaussians with shares that are not negative are the spreads that only fall, faster and then ever slower, with the square of the
//! distance: the Cauchy and Student families, exponentials and layered media are among them. The edge of a stiff plate, which rises beside
//! the tip, is none.
//!
//! Cost: an image for each Gaussian.
//!
//! # Source
//! The layered elastic solution falls off more slowly than the Gaussian of its core (the paper's Fig. 3); a mixture
//! of two Gaussians is the usual closed form of such a spread. Mixtures of Gaussians over their widths are the completely monotone functions
//! of the squared distance: I. J. Schoenberg, *Ann. Math.* 39 (1938) 811.

use super::{CurveKind, Definition, FreeCurve, Knots, Load, Make, Now, OnCovering, Parameter, Rises, Values};
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "heavy-tail",
    summary: "the point spread has more weight far out than a Gaussian",
    parameters: &[
        Parameter::real("tail_share", 0.0, [0.0, 1.0]),
        Parameter::real("width_ratio", 2.0, [1.0, 10.0]),
    ],
    near_twins: &["crosstalk", "sigma_intercept_mm"],
    acts_by: &[Covariate::Distance, Covariate::ShareOfLargest],
    shown_by: &["grid-sweep", "element-centres"],
    curve: Some(FreeCurve {
        at: "at_ratio",
        of: "tail_share",
        kind: CurveKind::Weights,
        range: [0.0, 1.0],
        rises: Rises::No,
        replaces: &["tail_share", "width_ratio"],
        formula: |values, at_ratio| Knots::divided([(values[1], values[0])], at_ratio, f64::ln),
    }),
    make: Make::Covering(|values| Box::new(HeavyTail::of(values))),
};

#[derive(Debug)]
struct HeavyTail {
    /// Of each Gaussian beside the core, its width over the core's, and its share of the volume.
    tails: Vec<(f64, f64)>,
    /// The share of the core.
    core_share: f64,
}

impl HeavyTail {
    fn of(values: &Values) -> Self {
        let mut tails = match values.knots() {
            Some(Knots { at, values }) => at.iter().copied().zip(values.iter().copied()).collect(),
            None => vec![(values[1], values[0])],
        };
        tails.retain(|(_, share)| *share != 0.0);
        let all: f64 = tails.iter().map(|(_, share)| share).sum();
        for (_, share) in &mut tails {
            *share /= all.max(1.0);
        }
        Self { tails, core_share: (1.0 - all).max(0.0) }
    }
}

impl OnCovering for HeavyTail {
    fn spreads(&self) -> bool {
        true
    }

    fn spread(&self, _: Now<'_>, loads: &mut Vec<Load>) {
        if self.tails.is_empty() {
            return;
        }
        let tail = |core: &Load, (ratio, share): (f64, f64)| Load {
            weight: share * core.weight,
            sigma_mm: core.sigma_mm.map(|sigma_mm| ratio * sigma_mm),
            ..core.clone()
        };
        let tails = self.tails.iter().flat_map(|one| loads.iter().map(|core| tail(core, *one)));
        let tails: Vec<Load> = tails.collect();
        for core in loads.iter_mut() {
            core.weight *= self.core_share;
        }
        loads.extend(tails);
    }
}

#[cfg(test)]
#[path = "heavy_tail_tests.rs"]
mod tests;
