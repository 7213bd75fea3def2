//! Knots of free curves in a fit: where they lie, how they move, and steps that keep them within their class.
//!
//! The values of a curve that must not fall are fitted as their increments, each at least 0, or as those of value times place; other values
//! each by itself. A step solves the
//! damped normal equations under these bounds: what would leave its bound is held there, and what would rather return is let go.
//!
//! # Source
//! Least squares under bounds: C. L. Lawson and R. J. Hanson, *Solving Least Squares Problems* (1974), chapter 23.

use nalgebra::{DMatrix, DVector};
use tactus_model::Registration;
use tactus_model::effect::{By, CurveKind, FreeCurve, Knots, Rises, Table};

use super::parameters::Term;
use super::problem::{Problem, solve};
use super::scale::{Extent, Scale};
use crate::data::{Frames, interval_s, presses};

/// Step of a value for derivatives, as a share of its range.
const STEP: f64 = 1e-3;
/// Number of knots of a line, of weights of times, of delays, of thresholds, and of widths.
const OF_LINE: usize = 10;
const OF_TIMES: usize = 9;
const OF_DELAYS: usize = 8;
const OF_THRESHOLDS: usize = 8;
const OF_WIDTHS: usize = 5;
/// A line in time has a knot for so many presses, and so many knots at most: what drifts holds for several presses in a row. With fewer than
/// the least, formulas follow as much.
const PRESSES_A_KNOT: usize = 4;
const OF_TIME_LINE: std::ops::RangeInclusive<usize> = 8..=24;
/// Number of places of a table over the sensor, and of one of depth or time; the least distance from the first to the last: in mm, or of time
/// in s.
const OVER_THE_SENSOR: usize = 5;
const OF_DEPTH_OR_TIME: usize = 8;
const APART_MM: f64 = 0.05;
const APART_S: f64 = 1.0;
/// The narrowest and the widest Gaussian of a tail, over the core.
const WIDTHS: [f64; 2] = [1.4, 6.0];
/// The narrowest threshold and the slowest speed, as shares of the greatest.
const LEAST_THRESHOLD: f64 = 0.03;
const LEAST_SPEED: f64 = 0.01;

/// The values among which a knot is, and their rules.
struct Listed<'a> {
    values: &'a [f64],
    /// The knot's number among them.
    at: usize,
    range: [f64; 2],
    rises: Rises,
    /// The place of each; none where values are each by itself.
    places: &'a [f64],
}

impl Listed<'_> {
    /// The least value that the one before allows.
    fn floor(&self) -> Option<f64> {
        let before = self.at.checked_sub(1)?;
        let places = [before, self.at].map(|place| self.places.get(place).copied());
        self.rises.least([places[0]?, places[1]?], self.values[before])
    }

    /// By how much each value from the knot on moves with it.
    fn moved(&self) -> Vec<f64> {
        match self.rises {
            Rises::No => vec![1.0],
            Rises::Value => vec![1.0; self.values.len() - self.at],
            Rises::ValueTimesPlace => {
                let here = self.places[self.at];
                self.places[self.at..].iter().map(|place| here / place).collect()
            }
        }
    }

    /// The longest steps down and up within the range.
    fn room(&self) -> [f64; 2] {
        let [least, most] = self.range;
        let moved = self.moved();
        let values = || self.values[self.at..].iter().zip(&moved);
        let down = values().map(|(value, moved)| (value - least) / moved).fold(f64::INFINITY, f64::min);
        let up = values().map(|(value, moved)| (most - value) / moved).fold(f64::INFINITY, f64::min);
        [down.max(0.0), up.max(0.0)]
    }
}

impl Term {
    /// The curve that its effect may have.
    pub(crate) fn curve(&self) -> Option<&'static FreeCurve> {
        self.definition.curve.as_ref()
    }

    /// True if it has knots or a table.
    pub(crate) fn is_free(&self) -> bool {
        self.listed() > 0
    }

    /// True if its knots are weights, which may be those of several formulas.
    pub(crate) fn is_sum(&self) -> bool {
        self.knots.is_some() && self.curve().is_some_and(|curve| curve.kind == CurveKind::Weights)
    }

    /// Moves all its knots from their neutral values: those of a curve by these steps, those of a table by steps on the parameter's scale.
    pub(crate) fn free_steps(&mut self, steps: &[f64], extent: Extent) {
        for (knot, step) in steps.iter().enumerate() {
            if let Some((table, at)) = self.table_at(knot) {
                let (parameter, table) = &mut self.tables[table];
                let scale = Scale::of(&self.definition.parameters[*parameter], extent);
                table.values[at] = scale.forward(table.values[at], scale.bounded(*step));
            } else {
                self.move_knot(knot, *step);
            }
        }
    }

    /// A knot's value, less that at which the effect changes nothing, and the width of its range.
    pub(super) fn knot(&self, knot: usize) -> Option<(f64, f64)> {
        let Listed { values, at, range, .. } = self.listed_at(knot)?;
        let neutral = self.table_at(knot).map_or(0.0, |(table, _)| {
            let (parameter, _) = self.tables[table];
            self.definition.parameters[parameter].neutral
        });
        Some((values[at] - neutral, range[1] - range[0]))
    }

    /// By how much a knot's value moves with an earlier one, or with itself.
    pub(super) fn moves_with(&self, knot: usize, earlier: usize) -> f64 {
        let later = knot - earlier;
        self.listed_at(earlier).and_then(|listed| listed.moved().get(later).copied()).unwrap_or(0.0)
    }

    /// Those of its curve come first, then those of its tables.
    fn listed_at(&self, knot: usize) -> Option<Listed<'_>> {
        if let Some((table, at)) = self.table_at(knot) {
            let (parameter, table) = &self.tables[table];
            let range = self.definition.parameters[*parameter].range;
            return Some(Listed { values: &table.values, at, range, rises: Rises::No, places: &[] });
        }
        let (curve, knots) = self.curve().zip(self.knots.as_ref())?;
        Some(Listed {
            values: &knots.values,
            at: knot,
            range: curve.range,
            rises: curve.rises,
            places: &knots.at,
        })
    }

    /// The table that a knot is in, and its number there; `None` if it is one of the curve's.
    pub(super) fn table_at(&self, knot: usize) -> Option<(usize, usize)> {
        let mut at = knot.checked_sub(self.knots.as_ref().map_or(0, |knots| knots.values.len()))?;
        for (table, (_, of)) in self.tables.iter().enumerate() {
            if at < of.values.len() {
                return Some((table, at));
            }
            at -= of.values.len();
        }
        None
    }

    /// The same with all values of a table moved by a small step, and that step, for derivatives; `None` if the range leaves no room.
    pub(super) fn with_table_moved(&self, table: usize) -> Option<(Self, f64)> {
        let mut moved = self.clone();
        let (parameter, of) = &mut moved.tables[table];
        let [least, most] = self.definition.parameters[*parameter].range;
        let step = STEP * (most - least);
        let has_room = |step: &f64| of.values.iter().all(|value| (least..=most).contains(&(value + step)));
        let step = [step, -step].into_iter().find(has_room)?;
        of.values.iter_mut().for_each(|value| *value += step);
        Some((moved, step))
    }

    fn listed_mut(&mut self, knot: usize) -> Option<&mut Vec<f64>> {
        match self.table_at(knot) {
            Some((table, _)) => Some(&mut self.tables[table].1.values),
            None => self.knots.as_mut().map(|knots| &mut knots.values),
        }
    }

    /// Moves a value, and from it on what rises with it, and returns by how much; less than `step` at the end of the range.
    pub(super) fn move_knot(&mut self, knot: usize, step: f64) -> f64 {
        let least_step = self.least_step(knot);
        let Some(listed) = self.listed_at(knot) else { return 0.0 };
        let (at, [least, most], rises) = (listed.at, listed.range, listed.rises);
        let (moved, places) = (listed.moved(), listed.places.to_vec());
        let taken = step.max(least_step).min(listed.room()[1]);
        let Some(values) = self.listed_mut(knot) else { return 0.0 };
        // Rounding must not bring a value out of its range, or below what the one before allows.
        for (value, moved) in values[at..].iter_mut().zip(moved) {
            *value = (*value + moved * taken).clamp(least, most);
        }
        keep_rising(rises, &places, values);
        taken
    }

    /// A small step of a knot, for a derivative: away from the end of the range.
    pub(super) fn small_step(&self, knot: usize) -> f64 {
        let Some(listed) = self.listed_at(knot) else { return 0.0 };
        let step = STEP * (listed.range[1] - listed.range[0]);
        if step > listed.room()[1] { -step } else { step }
    }

    /// The least step of a knot that its class allows: not above 0.
    pub(crate) fn least_step(&self, knot: usize) -> f64 {
        let Some(listed) = self.listed_at(knot) else { return 0.0 };
        let floor = listed.floor().map_or(f64::NEG_INFINITY, |floor| floor - listed.values[listed.at]);
        floor.max(-listed.room()[0]).min(0.0)
    }
}

/// Raises each value that is below what the one before allows.
fn keep_rising(rises: Rises, places: &[f64], values: &mut [f64]) {
    for knot in 1..places.len() {
        let least = rises.least([places[knot - 1], places[knot]], values[knot - 1]);
        values[knot] = values[knot].max(least.unwrap_or(f64::NEG_INFINITY));
    }
}

impl Problem<'_> {
    /// For each place of a table, its weight at each bin.
    pub(crate) fn weights_at(&self, table: &Table) -> Vec<Vec<f64>> {
        let (bins, frames) = (self.predictor.bins, self.predictor.frames);
        let registration = &self.predictor.known.registration;
        let place = |bin: usize| place(table.by, bins.t_s[bin], &bins.position_mm(frames, bin), registration);
        let places: Vec<f64> = (0..bins.len()).map(place).collect();
        let weights = |knot| {
            let hat = Hat::of(&table.at, knot);
            places.iter().map(|place| hat.at(*place)).collect()
        };
        (0..table.at.len()).map(weights).collect()
    }
}

/// Where the tip stands, or when, as a table has it; the covering's surface is at a height of 0.
fn place(by: By, t_s: f64, [x_mm, y_mm, z_mm]: &[f64; 3], registration: &Registration) -> f64 {
    let [x_mm, y_mm] = registration.to_sensor([*x_mm, *y_mm]);
    match by {
        By::Depth => -z_mm,
        By::X => x_mm,
        By::Y => y_mm,
        By::Time => t_s,
    }
}

/// Places of a table that these frames can tell apart, from end to end of where the tool pressed: evenly over the sensor, closer together near
/// the surface, where a tool first touches, and with as many frames in contact between moments. `None` if it pressed at one place or moment.
pub(crate) fn table_places(by: By, frames: &Frames, registration: &Registration) -> Option<Vec<f64>> {
    let tips = frames.position_mm.iter().zip(&frames.t_s).filter(|([_, _, z_mm], _)| *z_mm < 0.0);
    let mut pressed: Vec<f64> = tips.map(|(tip_mm, t_s)| place(by, *t_s, tip_mm, registration)).collect();
    pressed.sort_by(f64::total_cmp);
    let [mut least, most] = [*pressed.first()?, *pressed.last()?];
    if by == By::Depth {
        least = 0.0;
    }
    let (count, apart) = match by {
        By::Depth => (OF_DEPTH_OR_TIME, APART_MM),
        By::X | By::Y => (OVER_THE_SENSOR, APART_MM),
        By::Time => (OF_DEPTH_OR_TIME, APART_S),
    };
    let place = |k: usize| {
        let share = k as f64 / (count - 1) as f64;
        match by {
            By::Depth => most * share.powi(2),
            By::X | By::Y => least + (most - least) * share,
            By::Time => pressed[k * (pressed.len() - 1) / (count - 1)],
        }
    };
    let mut places: Vec<f64> = (0..count).map(place).collect();
    // Moments of a short press among runs of hours may be the same one, and no frame may be between two depths.
    places.dedup();
    let has_weight = |places: &[f64], at| pressed.iter().any(|one| Hat::of(places, at).at(*one) > 0.0);
    while let Some(without) = (0..places.len()).find(|at| !has_weight(&places, *at)) {
        places.remove(without);
    }
    (most - least > apart).then_some(places)
}

/// True if a curve is a line in the run's time.
pub(super) fn is_of_run_time(curve: &FreeCurve) -> bool {
    (curve.at, curve.kind) == ("at_s", CurveKind::Line)
}

/// True if a curve is one of elements' signals, each as its own counts are over those of a mean gain.
fn is_of_signal(curve: &FreeCurve) -> bool {
    (curve.at, curve.of) == ("at_mm", "lost_share")
}

/// The highest gain of an element over the mean one, as declared; at least 1.
fn highest_gain(problem: &Problem<'_>) -> f64 {
    let gains = &problem.predictor.known.response.sensitivity_counts_per_mm;
    let mean = gains.iter().sum::<f64>() / gains.len() as f64;
    let over_mean = gains.iter().map(|gain| gain / mean).filter(|over| over.is_finite());
    over_mean.fold(1.0, f64::max)
}

/// Places of a curve's knots that the frames can tell apart; none if there are too few.
pub(crate) fn places(curve: &FreeCurve, problem: &Problem<'_>) -> Vec<f64> {
    let (frames, duration_s) = (problem.predictor.frames, problem.extent.duration_s);
    let deepest_mm = frames.position_mm.iter().map(|[_, _, z_mm]| -z_mm).fold(0.0, f64::max);
    let thickest_mm = frames.covering_mm.iter().copied().fold(0.0, f64::max);
    let depth_mm = deepest_mm.min(thickest_mm).max(f64::MIN_POSITIVE);
    match (curve.at, curve.kind) {
        _ if is_of_run_time(curve) => {
            let count = (presses(frames) / PRESSES_A_KNOT).min(*OF_TIME_LINE.end());
            if OF_TIME_LINE.contains(&count) { even(duration_s, count) } else { Vec::new() }
        }
        ("at_s", _) => logarithmic(2.0 * interval_s(frames), duration_s, OF_TIMES),
        // Between two frames nothing tells when.
        ("delay_s", _) => even(OF_DELAYS as f64 * interval_s(frames), OF_DELAYS),
        ("at_ratio", _) => logarithmic(WIDTHS[0], WIDTHS[1], OF_WIDTHS),
        ("at_mm_per_s", _) => {
            let fastest = fastest_mm_per_s(frames);
            logarithmic(LEAST_SPEED * fastest, fastest, OF_LINE)
        }
        (_, CurveKind::Weights) => logarithmic(LEAST_THRESHOLD * depth_mm, depth_mm, OF_THRESHOLDS),
        ("at_mm", _) if is_of_signal(curve) => even(depth_mm * highest_gain(problem), OF_LINE),
        ("at_mm", _) => even(depth_mm, OF_LINE),
        _ => even(1.0, OF_LINE),
    }
}

/// The weight of a knot's value in a function that is straight between knots, and constant beyond the first and the last.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hat {
    before: Option<f64>,
    knot: f64,
    after: Option<f64>,
}

impl Hat {
    /// That of one of some knots, by its number.
    pub(crate) fn of(knots: &[f64], knot: usize) -> Self {
        let before = knot.checked_sub(1).map(|before| knots[before]);
        Self { before, knot: knots[knot], after: knots.get(knot + 1).copied() }
    }

    /// The weight at a value: 0 from the neighbours of the knot on, which is where most values are.
    pub(crate) fn at(self, value: f64) -> f64 {
        let is_near =
            self.before.is_none_or(|before| value > before) && self.after.is_none_or(|after| value < after);
        if !is_near {
            return 0.0;
        }
        let slope = |from: Option<f64>| from.map_or(1.0, |from| (value - from) / (self.knot - from));
        slope(self.before).min(slope(self.after)).clamp(0.0, 1.0)
    }
}

fn even(most: f64, count: usize) -> Vec<f64> {
    (1..=count).map(|k| most * k as f64 / count as f64).collect()
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
    for value in &mut values {
        *value = value.clamp(least, most);
    }
    keep_rising(curve.rises, at, &mut values);
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
