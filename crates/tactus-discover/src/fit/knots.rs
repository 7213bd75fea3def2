//! Knots of free curves in a fit: where they lie, how they move, and steps that keep them within their class.
//!
//! The values of a curve that must not fall are fitted as their increments, each at least 0; other values each by itself. A step solves the
//! damped normal equations under these bounds: what would leave its bound is held there, and what would rather return is let go.
//!
//! # Source
//! Least squares under bounds: C. L. Lawson and R. J. Hanson, *Solving Least Squares Problems* (1974), chapter 23.

use nalgebra::{DMatrix, DVector};
use tactus_model::effect::{CurveKind, FreeCurve, Knots};

use super::parameters::Term;
use super::problem::solve;
use crate::data::{Frames, interval_s};

/// Step of a value for derivatives, as a share of its range.
const STEP: f64 = 1e-3;
/// Number of knots of a line, of weights of times, and of weights of thresholds.
const OF_LINE: usize = 10;
const OF_TIMES: usize = 9;
const OF_THRESHOLDS: usize = 8;
/// The narrowest threshold and the slowest speed, as shares of the greatest.
const LEAST_THRESHOLD: f64 = 0.03;
const LEAST_SPEED: f64 = 0.01;

impl Term {
    /// The curve that its effect may have.
    pub(crate) fn curve(&self) -> Option<&'static FreeCurve> {
        self.definition.curve.as_ref()
    }

    /// Moves a value, or from one knot on all values, and returns by how much; less than `step` at the end of the range.
    pub(super) fn move_knot(&mut self, knot: usize, step: f64) -> f64 {
        let least_step = self.least_step(knot);
        let Some((curve, knots)) = self.definition.curve.as_ref().zip(self.knots.as_mut()) else {
            return 0.0;
        };
        let moved = if curve.increasing { &mut knots.values[knot..] } else { &mut knots.values[knot..=knot] };
        let [least, most] = curve.range;
        let last = moved.last().copied().unwrap_or_default();
        let taken = step.max(least_step).min((most - last).max(0.0));
        // Rounding must not bring a value out of its range, or below the one before.
        for value in moved {
            *value = (*value + taken).clamp(least, most);
        }
        if curve.increasing {
            for knot in knot.max(1)..knots.values.len() {
                knots.values[knot] = knots.values[knot].max(knots.values[knot - 1]);
            }
        }
        taken
    }

    /// A small step of a knot, for a derivative: away from the end of the range.
    pub(super) fn small_step(&self, knot: usize) -> f64 {
        let Some((curve, knots)) = self.curve().zip(self.knots.as_ref()) else { return 0.0 };
        let step = STEP * (curve.range[1] - curve.range[0]);
        let last = if curve.increasing { knots.values.len() - 1 } else { knot };
        if knots.values[last] + step > curve.range[1] { -step } else { step }
    }

    /// The least step of a knot that its class allows: not above 0.
    pub(super) fn least_step(&self, knot: usize) -> f64 {
        let Some((curve, knots)) = self.curve().zip(self.knots.as_ref()) else { return 0.0 };
        let before = knot.checked_sub(1).filter(|_| curve.increasing).map(|before| knots.values[before]);
        before.unwrap_or(curve.range[0]) - knots.values[knot]
    }
}

/// Places of a curve's knots that these frames can tell apart.
pub(crate) fn places(curve: &FreeCurve, frames: &Frames) -> Vec<f64> {
    let deepest_mm = frames.position_mm.iter().map(|[_, _, z_mm]| -z_mm).fold(0.0, f64::max);
    let thickest_mm = frames.covering_mm.iter().copied().fold(0.0, f64::max);
    let depth_mm = deepest_mm.min(thickest_mm).max(f64::MIN_POSITIVE);
    let even = |most: f64| (1..=OF_LINE).map(|k| most * k as f64 / OF_LINE as f64).collect();
    match (curve.at, curve.kind) {
        ("at_s", _) => {
            let duration_s = frames.t_s.iter().copied().fold(1.0, f64::max);
            logarithmic(2.0 * interval_s(frames), duration_s, OF_TIMES)
        }
        ("at_mm_per_s", _) => {
            let fastest = fastest_mm_per_s(frames);
            logarithmic(LEAST_SPEED * fastest, fastest, OF_LINE)
        }
        (_, CurveKind::Weights) => logarithmic(LEAST_THRESHOLD * depth_mm, depth_mm, OF_THRESHOLDS),
        ("at_mm", _) => even(depth_mm),
        _ => even(1.0),
    }
}

fn logarithmic(least: f64, most: f64, count: usize) -> Vec<f64> {
    let last = (count - 1) as f64;
    (0..count).map(|k| least * (most / least).powf(k as f64 / last)).collect()
}

/// The greatest speed at which the tool goes down in the covering.
fn fastest_mm_per_s(frames: &Frames) -> f64 {
    let speed = |frame: usize| {
        let [[_, _, above], [_, _, below]] = [frames.position_mm[frame - 1], frames.position_mm[frame]];
        let dt_s = frames.t_s[frame] - frames.t_s[frame - 1];
        if below < 0.0 && dt_s > 0.0 { (above - below) / dt_s } else { 0.0 }
    };
    (1..frames.t_s.len()).map(speed).fold(f64::MIN_POSITIVE, f64::max)
}

/// The formula of terms of one effect at places: together, and within the rules of the curve.
pub(crate) fn of_formulas<'a>(
    curve: &FreeCurve,
    terms: impl IntoIterator<Item = &'a Term>,
    at: &[f64],
) -> Knots {
    let mut values = vec![0.0; at.len()];
    for term in terms {
        let own = match &term.knots {
            None => (curve.formula)(&term.values, at),
            Some(knots) => knots.values.clone(),
        };
        values.iter_mut().zip(own).for_each(|(value, own)| *value += own);
    }
    let [least, most] = curve.range;
    let mut before = least;
    for value in &mut values {
        *value = value.clamp(least, most);
        if curve.increasing {
            *value = value.max(before);
            before = *value;
        }
    }
    Knots { at: at.to_vec(), values }
}

/// A step of the damped normal equations of which no part is below its least.
pub(super) fn bounded(
    gram: &DMatrix<f64>,
    right: &DVector<f64>,
    damping: f64,
    squares: &[f64],
    least: &[f64],
) -> DVector<f64> {
    let count = right.len();
    let mut held = vec![false; count];
    // Each turn holds or lets go one number; more turns than this mean a tie.
    for _ in 0..3 * count.max(1) {
        let step = solve_beside(gram, right, damping, squares, &held, least);
        let out = |index: &usize| !held[*index] && step[*index] < least[*index];
        let by = |index: usize| (least[index] - step[index]) * squares[index].max(0.0).sqrt();
        if let Some(worst) = (0..count).filter(out).max_by(|a, b| by(*a).total_cmp(&by(*b))) {
            held[worst] = true;
            continue;
        }
        let left = right - gram * &step;
        let pull = |index: usize| left[index] - damping * squares[index] * step[index];
        let back = |index: &usize| held[*index] && pull(*index) > 1e-9 * squares[*index].max(0.0).sqrt();
        match (0..count).filter(back).max_by(|a, b| pull(*a).total_cmp(&pull(*b))) {
            Some(best) => held[best] = false,
            None => return step,
        }
    }
    solve_beside(gram, right, damping, squares, &vec![true; count], least).map(|step| step.min(0.0))
}

/// The step of what is not held, beside what is.
fn solve_beside(
    gram: &DMatrix<f64>,
    right: &DVector<f64>,
    damping: f64,
    squares: &[f64],
    held: &[bool],
    least: &[f64],
) -> DVector<f64> {
    let (mut gram_left, mut right_left) = (gram.clone(), right.clone());
    for index in (0..held.len()).filter(|index| held[*index]) {
        right_left -= gram.column(index) * least[index];
        gram_left.column_mut(index).fill(0.0);
        gram_left.row_mut(index).fill(0.0);
    }
    let mut step = solve(&gram_left, &right_left, damping, squares);
    for index in (0..held.len()).filter(|index| held[*index]) {
        step[index] = least[index];
    }
    step
}

#[cfg(test)]
#[path = "knots_tests.rs"]
mod tests;
