//! How much of what one model leaves another model closes, on held-out presses.
//!
//! With the residuals `b` and `a` of the two models on the same readings,
//!
//! ```text
//! E = mean of b^2 - a^2                       what is closed: the noise cancels
//! L = mean of a(t) a(t + lag)                 what the second model leaves, at lags at which the noise has long forgotten itself; or what of
//!                                             the mean of its squares is certain, if that is more
//! share = E / (E + L)
//! ```
//!
//! The second model's numbers have errors, as those of the truth would have: what these leave is known from the fit, and no part of `L`.
//!
//! A press has the weight of its readings in `L`, as it has in `E`, however few of its pairs lie that far apart; one without any such pair is in `E`
//! alone. An `L` below 0 comes from noise. The share takes it as 0; its standard error does not.
//!
//! What is random from frame to frame, such as a clock that jitters, counts as left, and no model of a mean can close it. So the most that another
//! model may close is a share of its own, in which only what lasts is left.
//!
//! A gap far below the noise is measured by this far better than by mean squares less that of the noise: of these the noise's own error may be
//! as large as the gap. The standard error is that of a jackknife over presses.

use super::structured::{Readings, Sums, jackknife};
use crate::numbers::student_95;

/// The share of what one model leaves that another closes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closed {
    /// At most 1; below 0 if the other model is worse.
    pub share: f64,
    /// Its standard error, from the scatter of presses; `None` of fewer than three.
    pub standard_error: Option<f64>,
    /// The share if only what lasts is left, and two of its standard errors; infinite of fewer than three presses.
    pub most: f64,
}

/// Standard errors from a share to the most that it may be.
pub(super) const MOST_ERRORS: f64 = 2.0;

/// Sums over a press: of what is closed, of what lasts in the second residual, and of its squares less the noise's.
type OfPress = [Sums; 3];

/// What the second model closes of what the first one leaves, among the readings that `among` selects; `None` if nothing is left or closed.
/// `of_estimates` is the mean square that the errors of the second model's numbers leave, in units of the noise's variance.
pub(super) fn closed(
    [before, after]: [&Readings<'_>; 2],
    of_estimates: f64,
    among: impl Fn(usize) -> bool,
) -> Option<Closed> {
    let of_press = |press| -> OfPress {
        let lasting = after.late_sums(press, &among);
        let ([_, before], [_, after]) = (before.sums(press, &among), after.sums(press, &among));
        [[before[0] - after[0], after[1]], of_readings(lasting, after[1]), after]
    };
    let presses: Vec<OfPress> = after.presses.iter().map(of_press).collect();
    let squares: Vec<Sums> = presses.iter().map(|of| of[2]).filter(|[_, count]| *count > 0.0).collect();
    let (left, error) = jackknife(&squares)?;
    let certain = left - student_95(squares.len()) * after.with_noise(left, error);
    let parts = |of: &OfPress, least_left: f64| -> Parts {
        let mean = |[sum, count]: Sums| if count > 0.0 { sum / count } else { 0.0 };
        Parts { closed: mean(of[0]), left: mean(of[1]).max(least_left) - of_estimates }
    };
    let (whole, standard_error) = with_error(&presses, |of| parts(of, certain))?;
    let (of_lasting, error) = with_error(&presses, |of| parts(of, f64::NEG_INFINITY))?;
    let most = of_lasting + MOST_ERRORS * error.unwrap_or(f64::INFINITY);
    Some(Closed { share: whole, standard_error, most })
}

/// A press's sum over pairs of readings, with the weight of its readings; none of a press without a pair.
fn of_readings([sum, pairs]: Sums, readings: f64) -> Sums {
    if pairs > 0.0 { [sum / pairs * readings, readings] } else { [0.0; 2] }
}

/// `E` and `L`.
#[derive(Debug, Clone, Copy)]
struct Parts {
    closed: f64,
    left: f64,
}

/// The share of the sums over all presses, and its standard error: what the share changes by without each press, to first order, since `E + L` of all
/// presses but one may be 0. `None` if nothing is left or closed.
fn with_error(presses: &[OfPress], parts: impl Fn(&OfPress) -> Parts) -> Option<(f64, Option<f64>)> {
    let mut total = OfPress::default();
    for of in presses {
        for (sums, of) in total.iter_mut().zip(of) {
            sums.iter_mut().zip(of).for_each(|(sum, of)| *sum += of);
        }
    }
    let Parts { closed, left } = parts(&total);
    let all = closed + left.max(0.0);
    let whole = (all > 0.0).then(|| closed / all)?;
    let moved = |press: &OfPress| {
        let Parts { closed, left } =
            parts(&[0, 1, 2].map(|which| [0, 1].map(|k| total[which][k] - press[which][k])));
        ((1.0 - whole) * closed - whole * left) / all
    };
    let moved: Vec<f64> = presses.iter().map(moved).collect();
    let count = moved.len() as f64;
    let mean = moved.iter().sum::<f64>() / count;
    let spread: f64 = moved.iter().map(|one| (one - mean).powi(2)).sum();
    Some((whole, (moved.len() >= 3).then(|| (spread * (count - 1.0) / count).sqrt())))
}

#[cfg(test)]
#[path = "closed_tests.rs"]
mod tests;
