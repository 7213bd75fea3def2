//! Curves and laws: which formula passes through a curve's knots.
//!
//! A curve has a value at each knot, and the products of its columns say how much of the likelihood a step away from them costs:
//!
//! ```text
//! cost(v) = (v - best)' H (v - best)          in units of the noise's variance
//! ```
//!
//! A law is a formula with one shape, such as an exponential with its length, and a scale. For each shape the scale follows from least squares
//! under `H`. What recalibration takes up, such as a constant share of the own signal, costs nothing, so each law may have a constant beside
//! it in the fit, which is dropped where that costs nothing. A curve becomes the law that costs least if that is less than a form may miss and noise
//! makes it miss; else it stays a table.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use tactus_model::effect::Law;

use super::grammar::{self, Atom};

/// Shapes that are tried between the least and the greatest length of a law.
const SHAPES: usize = 60;
/// A constant beside a law is dropped if that costs less, and the simpler of two laws taken.
const FREE_COST: f64 = 1.0;
/// A held mean weighs so much more than a knot.
const HELD: f64 = 1e3;
/// A prior so wide that it only keeps what the data do not show at 0.
const RIDGE: f64 = 1e-9;

/// A fitted curve.
pub(super) struct Curve {
    /// At each knot.
    pub(super) values: DVector<f64>,
    /// The products of the columns, in units of the noise's variance.
    pub(super) gram: DMatrix<f64>,
    /// How many of the values the data determine, and not the prior.
    pub(super) determined: f64,
}

/// A curve as a law or a table.
pub(super) struct Reduced {
    pub(super) law: Law,
    pub(super) covariance: Vec<Vec<f64>>,
    /// Place, value and standard error of the knots; of a single covariate.
    pub(super) knots: Vec<[f64; 3]>,
}

/// Steps by which a shape is refined, each half of the one before.
const REFINEMENTS: i32 = 8;

/// A law with what it costs, and its columns at the knots.
type Priced = (f64, Law, DMatrix<f64>);

/// A law of one covariate, up to its scale.
type Kind = fn(scale: f64, shape: f64) -> Law;

impl Curve {
    /// What the curve explains, in units of the noise's variance.
    pub(super) fn squares(&self) -> f64 {
        self.values.dot(&(&self.gram * &self.values))
    }

    /// With 1 as its largest value; `None` if all are 0.
    pub(super) fn shared(&self) -> Option<Arc<Vec<f64>>> {
        let most = self.values.amax();
        (most > 0.0).then(|| Arc::new(self.values.iter().map(|value| value / most).collect()))
    }

    /// The products with the mean of the knots held, if a constant as large as the curve costs nothing: recalibration takes it up, and the
    /// errors of the knots would be those of the constant.
    fn held_gram(&self) -> Option<DMatrix<f64>> {
        let count = self.values.len();
        let constant = DVector::from_element(count, self.values.amax());
        let cost = constant.dot(&(&self.gram * &constant));
        let most = (0..count).map(|knot| self.gram[(knot, knot)]).fold(0.0, f64::max);
        (count > 1 && cost < FREE_COST).then(|| self.gram.add_scalar(HELD * most))
    }

    /// The constant by which the knots are nearest to a law.
    fn shift_to(&self, places: &[f64], law: &Law) -> f64 {
        let apart = places.iter().zip(self.values.iter()).map(|(at, value)| law.value(&[*at]) - value);
        apart.sum::<f64>() / places.len() as f64
    }

    /// By how much a law misses more than noise alone makes the values miss it: a square for each that the data determine beyond the law's own.
    fn excess(&self, cost: f64, law: &Law) -> f64 {
        cost - (self.determined - law.numbers().len() as f64).max(0.0)
    }

    /// What it costs to have other values.
    fn cost(&self, values: &DVector<f64>) -> f64 {
        let step = values - &self.values;
        step.dot(&(&self.gram * &step))
    }
}

/// Covariance of linear combinations of columns with these products.
fn covariance(gram: &DMatrix<f64>, columns: &DMatrix<f64>) -> Vec<Vec<f64>> {
    let Some(inverse) = inverse(gram, columns) else { return Vec::new() };
    inverse.row_iter().map(|row| row.iter().copied().collect()).collect()
}

/// The inverse of the products of linear combinations, with a ridge for each in a unit of its own: a combination may have any unit. `None` if
/// the data show none of them.
fn inverse(gram: &DMatrix<f64>, columns: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let products = columns.transpose() * gram * columns;
    let size = products.nrows();
    // The square of one whose parts cancel nowhere: what is less than rounding leaves of that is not shown.
    let whole = |i: usize| -> f64 {
        columns.column(i).iter().enumerate().map(|(knot, value)| gram[(knot, knot)] * value * value).sum()
    };
    let square = |i: usize| {
        let (own, whole) = (products[(i, i)], whole(i));
        if own > RIDGE * whole { own } else { whole }
    };
    let most = (0..size).map(square).fold(0.0, f64::max);
    let unit = |i: usize| if square(i) > 0.0 { square(i) } else { most }.sqrt().recip();
    let units = DVector::from_fn(size, |i, _| unit(i));
    let scaled = DMatrix::from_fn(size, size, |i, j| products[(i, j)] * units[i] * units[j]);
    let inverse = (scaled + DMatrix::identity(size, size) * RIDGE).try_inverse().filter(|_| most > 0.0)?;
    Some(DMatrix::from_fn(size, size, |i, j| inverse[(i, j)] * units[i] * units[j]))
}

/// The curve as the law that costs least, if it misses at most so many nats more than noise makes it miss; else as a table.
pub(super) fn reduced(atom: &Atom, curve: &Curve, missed: f64) -> Reduced {
    let count = curve.values.len();
    let held_gram = curve.held_gram();
    let all = covariance(held_gram.as_ref().unwrap_or(&curve.gram), &DMatrix::identity(count, count));
    if let Some(per_unit) = atom.per_unit {
        let law = Law::Periodic { offset: 0.0, sine: curve.values[0], cosine: curve.values[1], per_unit };
        return Reduced { law, covariance: all, knots: Vec::new() };
    }
    let [places] = atom.knots.as_slice() else {
        let law = Law::Table { at: atom.knots.clone(), values: curve.values.iter().copied().collect() };
        return Reduced { law, covariance: all, knots: Vec::new() };
    };
    if places.len() == 1 {
        let law = Law::Linear { offset: curve.values[0], slope: 0.0 };
        return Reduced { law, covariance: all, knots: Vec::new() };
    }
    let errors: Vec<f64> =
        (0..count).map(|knot| all.get(knot).map_or(f64::NAN, |row| row[knot].sqrt())).collect();
    let knots_by = |shift: f64| -> Vec<[f64; 3]> {
        let knots = places.iter().zip(curve.values.iter()).enumerate();
        knots.map(|(knot, (at, value))| [*at, value + shift, errors[knot]]).collect()
    };
    let best = best_law(places, curve, grammar::is_near_an_event(atom.covariates[0]));
    if let Some((_, law, columns)) = best.filter(|(cost, law, _)| 0.5 * curve.excess(*cost, law) <= missed) {
        let shift = if held_gram.is_some() { curve.shift_to(places, &law) } else { 0.0 };
        return Reduced { covariance: covariance(&curve.gram, &columns), law, knots: knots_by(shift) };
    }
    // Of curves that differ by a constant that nothing shows, the one that begins at 0.
    let shift = if held_gram.is_some() { -curve.values[0] } else { 0.0 };
    let values = curve.values.iter().map(|value| value + shift).collect();
    let law = Law::Table { at: vec![places.clone()], values };
    Reduced { law, covariance: all, knots: knots_by(shift) }
}

/// The law that costs least. Of those that hardly cost more the first is taken: a straight line; and of two that differ by a constant that nothing
/// shows the one that is over in time, if the covariate is that since an event (`decays`), else the one that begins at 0.
fn best_law(places: &[f64], curve: &Curve, decays: bool) -> Option<Priced> {
    let (least, most) = (places[0], places[places.len() - 1]);
    let lengths: Vec<f64> =
        (0..SHAPES).map(|step| (most - least) * 0.02 * 250.0_f64.powf(step as f64 / SHAPES as f64)).collect();
    let exponents: Vec<f64> = (1..=SHAPES).map(|step| 0.1 * step as f64).collect();
    let between: Vec<f64> = places.windows(2).map(|two| f64::midpoint(two[0], two[1])).collect();
    let linear: Kind = |scale, _| Law::Linear { offset: 0.0, slope: scale };
    let power: Kind = |scale, exponent| Law::Power { scale, exponent };
    let exponential: Kind = |scale, length| Law::Exponential { scale, length };
    let saturating: Kind = |scale, length| Law::Saturating { scale, length };
    let logarithm: Kind = |scale, length| Law::Logarithm { scale, length };
    let threshold: Kind = |scale, at| Law::Threshold { scale, at };
    let [first, second] = if decays { [exponential, saturating] } else { [saturating, exponential] };
    let mut kinds: Vec<(Kind, &[f64])> = vec![(linear, &[1.0])];
    if least >= 0.0 {
        kinds.extend([(power, &*exponents), (first, &*lengths), (second, &*lengths), (logarithm, &*lengths)]);
    }
    kinds.push((threshold, &*between));
    let of_kind = |(kind, shapes): (Kind, &[f64])| {
        let priced = shapes.iter().filter_map(|shape| Some((fitted(places, curve, kind, *shape)?, *shape)));
        let (best, shape) = priced.min_by(|a, b| a.0.0.total_cmp(&b.0.0))?;
        Some(refined(places, curve, kind, shape, best))
    };
    let laws: Vec<Priced> = kinds.into_iter().filter_map(of_kind).collect();
    let least = laws.iter().map(|law| law.0).fold(f64::INFINITY, f64::min);
    laws.into_iter().find(|law| law.0 < least + FREE_COST)
}

/// The same law with the shape between the tried ones that costs least.
fn refined(places: &[f64], curve: &Curve, kind: Kind, shape: f64, best: Priced) -> Priced {
    let (mut best, mut shape) = (best, shape);
    for halving in 0..REFINEMENTS {
        let step = 0.1 * 0.5_f64.powi(halving);
        for next in [shape * (1.0 - step), shape * (1.0 + step)] {
            if let Some(found) = fitted(places, curve, kind, next).filter(|found| found.0 < best.0) {
                (best, shape) = (found, next);
            }
        }
    }
    best
}

/// What a law costs with its best scale, the law, and its columns at the knots. Only a straight line keeps a constant that costs something.
fn fitted(places: &[f64], curve: &Curve, kind: Kind, shape: f64) -> Option<Priced> {
    let unit = kind(1.0, shape);
    let column = DVector::from_iterator(places.len(), places.iter().map(|at| unit.value(&[*at])));
    let constant = DVector::from_element(places.len(), 1.0);
    let both = DMatrix::from_columns(&[column.clone(), constant]);
    let products = both.transpose() * &curve.gram * &both;
    let wanted = both.transpose() * &curve.gram * &curve.values;
    let solved = inverse(&curve.gram, &both)? * wanted;
    let with = curve.cost(&(&both * &solved));
    let without = curve.cost(&(&column * solved[0]));
    if let Law::Linear { .. } = unit {
        let is_dropped = without - with < FREE_COST;
        let offset = if is_dropped { 0.0 } else { solved[1] };
        let law = Law::Linear { offset, slope: solved[0] };
        return Some((
            if is_dropped { without } else { with },
            law,
            DMatrix::from_columns(&[both.column(1), both.column(0)]),
        ));
    }
    // Without the constant its scale is another.
    let square = products[(0, 0)];
    let scale = if without - with < FREE_COST {
        solved[0]
    } else if square > 0.0 {
        column.dot(&(&curve.gram * &curve.values)) / square
    } else {
        return None;
    };
    let cost = curve.cost(&(&column * scale));
    // The shape is a number too.
    Some((cost + 2.0, kind(scale, shape), DMatrix::from_columns(&[column])))
}

#[cfg(test)]
#[path = "curves_tests.rs"]
mod tests;
