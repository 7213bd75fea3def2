//! Baselines that follow a random walk in time, each element its own.
//!
//! ```text
//! baseline(run, e, t) = baseline(run, e) + u(run, e, t)      u is linear between knots and a random walk over the knots:
//! u(k + 1) - u(k) ~ N(0, rate^2 knot)
//! ```
//!
//! Given the rate, `u` is eliminated in closed form, like constant baselines: it is the mean of the walk given the readings,
//! a least-squares solution that penalises each step by its precision. All elements and runs share one rate and one
//! distance between knots, those with the greatest marginal likelihood. The gain in twice the logarithm of that likelihood
//! is the walk's reduction of the cost; it already accounts for the number of knots. The noise level used here is that of
//! long averages, so coloured noise is not taken for a walk.
//!
//! # Source
//! Random walks given readings: G. Wahba, *Spline Models for Observational Data* (1990), ch. 1 and 4. Fits beside them
//! (partial splines): P. Speckman, *J. R. Stat. Soc. B* 50 (1988) 413.

use tactus_model::effect::{Definition, Make, Now, OnReadout, Parameter};
use tactus_model::{Covariate, Effect};

use super::parameters::{Parameters, Term};
use super::problem::Problem;
use crate::data::{Bins, DiscoverError};
use crate::numbers::median;

/// Random walks of the baselines as a term of a model. It has the statistics of the walks; [`RandomWalk`] has their values.
pub(crate) static RANDOM_WALK: Definition = Definition {
    name: "baseline-drift",
    summary: "the baseline of each element follows a random walk in time",
    parameters: &[
        Parameter::given("counts_per_root_s", 0.0, [0.0, Parameter::COUNTS_MAX]),
        Parameter::given("knot_s", 0.0, [0.0, 1e6]),
        Parameter::given("rms_counts", 0.0, [0.0, Parameter::COUNTS_MAX]),
    ],
    near_twins: &["imprint", "relaxation", "gain-drift"],
    acts_by: &[Covariate::Time, Covariate::Press, Covariate::Temperature],
    shown_by: &["drift"],
    curve: None,
    make: Make::Readout(|_| Box::new(BesidePipeline)),
};

/// Knots of one `baseline-drift` effect of the library. A random walk is written as several of these.
const KNOTS: usize = 16;
/// Least time between knots, if there are more than [`KNOTS`].
const KNOT_S_LEAST: f64 = 3.0;
/// By how much knots at half the distance must reduce the cost.
const FINER_GAIN: f64 = 10.0;
/// Rates that are tried, in noise standard deviations per root second: from the least in factors of the root of 2.
const RATE_LEAST: f64 = 1e-3;
const RATES: i32 = 32;

/// Random walks of the baselines, run by run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunWalks {
    /// Time between knots. The walk is straight between knots and constant after the last.
    pub knot_s: f64,
    /// For each run, knot by knot from its start, one value per element, in counts.
    pub runs_counts: Vec<Vec<f64>>,
}

/// Random walks of the baselines of each run, knot by knot, element by element; they start at 0.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RandomWalk {
    pub(crate) knot_s: f64,
    pub(crate) runs: Vec<Vec<f64>>,
}

/// The baselines' part of a least-squares problem: constants, or random walks if the model has them.
#[derive(Debug)]
pub(crate) struct Baselines<'a> {
    problem: &'a Problem<'a>,
    /// Weight of each bin.
    weights: &'a [f64],
    /// Infinite for constants.
    knot_s: f64,
    knots: usize,
    /// Precision of a step from knot to knot, in counts^-2.
    stiffness: f64,
    /// Weighted products of the interpolation weights, run by run: of each knot with itself, and with the next.
    grams: Vec<Vec<[f64; 2]>>,
}

/// Estimated statistics of a random walk.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WalkEstimate {
    pub(crate) knot_s: f64,
    pub(crate) counts_per_root_s: f64,
    /// Reduction of the cost.
    pub(crate) gain: f64,
}

impl RandomWalk {
    /// Adds a multiple of the walk to readings, which are ordered bin by bin, element by element.
    pub(crate) fn add(&self, bins: &Bins, times: f64, readings: &mut [f64]) {
        self.add_from(bins, 0, times, readings);
    }

    /// As [`Self::add`], to the readings of some bins from `first` on.
    pub(crate) fn add_from(&self, bins: &Bins, first: usize, times: f64, readings: &mut [f64]) {
        let elements = bins.elements;
        for (bin, readings) in (first..).zip(readings.chunks_exact_mut(elements)) {
            let of_run = &self.runs[bins.run[bin]];
            let (knot, share) = place(bins.t_s[bin], self.knot_s, of_run.len() / elements);
            for (knot, share) in [(knot, 1.0 - share), (knot + 1, share)] {
                for (reading, value) in readings.iter_mut().zip(of_run.iter().skip(knot * elements)) {
                    *reading += times * share * value;
                }
            }
        }
    }

    pub(crate) fn of(RunWalks { knot_s, runs_counts }: &RunWalks) -> Self {
        Self { knot_s: *knot_s, runs: runs_counts.clone() }
    }

    /// Each run's walk less the mean over the runs; `None` for one run.
    pub(crate) fn apart(&self) -> Option<RunWalks> {
        let mean = self.mean();
        let less = |run: &Vec<f64>| run.iter().zip(&mean).map(|(value, mean)| value - mean).collect();
        let apart = || RunWalks { knot_s: self.knot_s, runs_counts: self.runs.iter().map(less).collect() };
        (self.runs.len() > 1).then(apart)
    }

    fn mean(&self) -> Vec<f64> {
        let mut mean = vec![0.0; self.runs.first().map_or(0, Vec::len)];
        for run in &self.runs {
            mean.iter_mut().zip(run).for_each(|(mean, value)| *mean += value / self.runs.len() as f64);
        }
        mean
    }

    /// The mean walk over the runs, as effects of the library, element by element.
    pub(crate) fn effects(&self, elements: usize) -> Result<Vec<Effect>, DiscoverError> {
        let mean = self.mean();
        let definition = Definition::find(RANDOM_WALK.name)?;
        let mut effects = Vec::new();
        for element in 0..elements {
            let knots: Vec<f64> = mean.iter().skip(element).step_by(elements).copied().collect();
            for (window, values) in knots.windows(KNOTS + 1).step_by(KNOTS).enumerate() {
                let duration_s = KNOTS as f64 * self.knot_s;
                let given = [
                    ("element", element as f64),
                    ("start_s", window as f64 * duration_s),
                    ("duration_s", duration_s),
                ];
                let offsets = definition.parameters.iter().filter(|one| one.name.starts_with("offset"));
                let offsets = offsets.zip(&values[1..]).map(|(one, value)| (one.name, value - values[0]));
                effects.push(Effect::of(definition, given.into_iter().chain(offsets))?);
            }
        }
        Ok(effects)
    }

    fn rms_counts(&self, elements: usize) -> f64 {
        let mut squares = 0.0;
        let mut values = 0.0_f64;
        for element in 0..elements {
            for run in &self.runs {
                let of: Vec<f64> = run.iter().skip(element).step_by(elements).copied().collect();
                let mean = of.iter().sum::<f64>() / of.len() as f64;
                squares += of.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
                values += of.len() as f64;
            }
        }
        (squares / values.max(1.0)).sqrt()
    }
}

impl<'a> Baselines<'a> {
    /// The baselines of a model.
    pub(crate) fn of(problem: &'a Problem<'a>, at: &Parameters) -> Self {
        match at.terms.iter().find(|term| is_random_walk(term)) {
            Some(Term { values, .. }) if values[0] > 0.0 && values[1] > 0.0 => {
                Self::walking(problem, &problem.slow, values[1], values[0])
            }
            // Constants use the same weights as other parameters.
            _ => Self::new(problem, &problem.train, f64::INFINITY, 1, 0.0),
        }
    }

    fn walking(problem: &'a Problem<'a>, weights: &'a [f64], knot_s: f64, counts_per_root_s: f64) -> Self {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some knots")]
        let steps = (problem.extent.duration_s / knot_s).round() as usize;
        Self::new(problem, weights, knot_s, steps + 1, stiffness(counts_per_root_s, knot_s))
    }

    fn new(problem: &'a Problem<'a>, weights: &'a [f64], knot_s: f64, knots: usize, stiffness: f64) -> Self {
        let bins = problem.predictor.bins;
        let mut grams = vec![vec![[0.0; 2]; knots]; bins.paths.len()];
        for (bin, weight) in weights.iter().enumerate() {
            let (knot, share) = place(bins.t_s[bin], knot_s, knots);
            let of_run = &mut grams[bins.run[bin]];
            of_run[knot][0] += weight * (1.0 - share).powi(2);
            if share > 0.0 {
                of_run[knot][1] += weight * share * (1.0 - share);
                of_run[knot + 1][0] += weight * share * share;
            }
        }
        Self { problem, weights, knot_s, knots, stiffness, grams }
    }

    /// Subtracts from a column what the baselines fit.
    pub(crate) fn centre(&self, column: &mut [f64]) {
        let (runs, _) = self.taken(column);
        RandomWalk { knot_s: self.knot_s, runs }.add(self.problem.predictor.bins, -1.0, column);
    }

    /// The baselines fitted to a column, and by how much walks reduce the cost below constants.
    fn taken(&self, column: &[f64]) -> (Vec<Vec<f64>>, f64) {
        self.solved(self.sums(column))
    }

    /// Weighted sums of a column with each knot's interpolation weights: run by run, knot by knot, element by element.
    fn sums(&self, column: &[f64]) -> Vec<Vec<f64>> {
        let bins = self.problem.predictor.bins;
        let elements = bins.elements;
        let mut sums = vec![vec![0.0; self.knots * elements]; bins.paths.len()];
        for ((bin, values), weight) in column.chunks_exact(elements).enumerate().zip(self.weights) {
            let (knot, share) = place(bins.t_s[bin], self.knot_s, self.knots);
            for (knot, share) in [(knot, 1.0 - share), (knot + 1, share)] {
                let of_run = sums[bins.run[bin]].iter_mut().skip(knot * elements);
                of_run.zip(values).for_each(|(sum, value)| *sum += weight * share * value);
            }
        }
        sums
    }

    /// The knots' values for such sums, and by how much walks reduce the cost below constants.
    fn solved(&self, mut sums: Vec<Vec<f64>>) -> (Vec<Vec<f64>>, f64) {
        let mut gain = 0.0;
        for (sums, gram) in sums.iter_mut().zip(&self.grams) {
            for (element, weight) in self.problem.element_weight.iter().enumerate() {
                gain += self.solve(gram, *weight, &mut sums[element..]);
            }
        }
        (sums, gain)
    }

    /// Solves `(G + stiffness / weight R) u = b` for one element; `R` penalises steps. `values` has the element's numbers at
    /// a stride of the number of elements. Returns twice the logarithm of the likelihood ratio of walk and constant.
    fn solve(&self, gram: &[[f64; 2]], weight: f64, values: &mut [f64]) -> f64 {
        let elements = self.problem.predictor.bins.elements;
        let stiff = self.stiffness / weight;
        let last = self.knots - 1;
        let whole: f64 = gram.iter().map(|[own, next]| own + 2.0 * next).sum();
        let total: f64 = values.iter().step_by(elements).sum();
        if whole <= 0.0 || weight <= 0.0 {
            // Without a weight nothing tells a walk from noise: the baseline is constant.
            let constant = if whole > 0.0 { total / whole } else { 0.0 };
            values.iter_mut().step_by(elements).for_each(|value| *value = constant);
            return 0.0;
        }
        let mut pivots = vec![0.0; self.knots];
        let (mut squares, mut logarithms) = (-total * total / whole * weight, -(weight * whole).ln());
        for knot in 0..=last {
            let ends = f64::from(u8::from(knot > 0)) + f64::from(u8::from(knot < last));
            pivots[knot] = gram[knot][0] + ends * stiff;
            if knot > 0 {
                let factor = (gram[knot - 1][1] - stiff) / pivots[knot - 1];
                pivots[knot] -= factor * (gram[knot - 1][1] - stiff);
                values[knot * elements] -= factor * values[(knot - 1) * elements];
            }
            squares += weight * values[knot * elements].powi(2) / pivots[knot];
            logarithms += (weight * pivots[knot]).ln() - if knot > 0 { self.stiffness.ln() } else { 0.0 };
        }
        for knot in (0..=last).rev() {
            let after =
                if knot < last { (gram[knot][1] - stiff) * values[(knot + 1) * elements] } else { 0.0 };
            values[knot * elements] = (values[knot * elements] - after) / pivots[knot];
        }
        squares - logarithms
    }
}

impl Problem<'_> {
    /// Residual of a model without its random walk.
    pub(crate) fn standing(&self, at: &Parameters, predicted: &[f64]) -> Vec<f64> {
        let mut residual: Vec<f64> = self.residuals(predicted).collect();
        if let Some(walk) = &at.walk {
            walk.add(self.predictor.bins, 1.0, &mut residual);
        }
        residual
    }

    /// The parameters with the random walk re-estimated from the residual, if the model has one.
    pub(crate) fn with_walk(&self, mut at: Parameters) -> Result<Parameters, DiscoverError> {
        let Some(term) = at.terms.iter().position(is_random_walk) else {
            at.walk = None;
            return Ok(at);
        };
        let residual = self.standing(&at, &self.predict(&at)?);
        let walk = self.estimate_walk(&residual, &self.slow);
        at.terms[term].values = vec![walk.counts_per_root_s, walk.knot_s, 0.0];
        Baselines::of(self, &at).settle(&residual, &mut at);
        Ok(at)
    }

    /// Cost of a model with a random walk: that of constant baselines less the gain in likelihood.
    pub(crate) fn cost_with_walk(&self, at: &Parameters, predicted: &[f64]) -> f64 {
        let mut residual = self.standing(at, predicted);
        let (_, gain) = Baselines::of(self, at).taken(&residual);
        Baselines::new(self, &self.train, f64::INFINITY, 1, 0.0).centre(&mut residual);
        let weighted =
            residual.iter().zip(self.weights()).map(|(residual, weight)| weight * residual * residual);
        weighted.sum::<f64>() - gain
    }

    /// The random walk with the greatest likelihood, given the residual of constant baselines and the bins' weights.
    pub(crate) fn estimate_walk(&self, residual: &[f64], weights: &[f64]) -> WalkEstimate {
        let weighed = self.element_weight.iter().copied().filter(|weight| *weight > 0.0);
        let noise_counts = median(&weighed.collect::<Vec<_>>()).powf(-0.5);
        let mut best: Option<WalkEstimate> = None;
        let mut knots = KNOTS;
        loop {
            let knot_s = self.extent.duration_s / knots as f64;
            let mut baselines = Baselines::walking(self, weights, knot_s, noise_counts);
            let sums = baselines.sums(residual);
            let walks = (0..RATES).map(|step| {
                let counts_per_root_s = RATE_LEAST * noise_counts * 2.0_f64.powf(0.5 * f64::from(step));
                baselines.stiffness = stiffness(counts_per_root_s, knot_s);
                let (_, gain) = baselines.solved(sums.clone());
                WalkEstimate { knot_s, counts_per_root_s, gain }
            });
            let Some(walk) = walks.max_by(|a, b| a.gain.total_cmp(&b.gain)) else { break };
            if best.is_some_and(|best| walk.gain < best.gain + FINER_GAIN) {
                break;
            }
            best = Some(walk);
            knots *= 2;
            if self.extent.duration_s / (knots as f64) < KNOT_S_LEAST {
                break;
            }
        }
        best.unwrap_or(WalkEstimate { knot_s: self.extent.duration_s, counts_per_root_s: 0.0, gain: 0.0 })
    }
}

impl Baselines<'_> {
    /// Fits the baselines of a model to the residual of its constant baselines.
    pub(super) fn settle(&self, residual: &[f64], at: &mut Parameters) {
        let (taken, _) = self.taken(residual);
        self.put(taken, at);
    }

    /// Adds a fit's first knot to the constant baselines, and makes the remainder the random walk.
    fn put(&self, mut taken: Vec<Vec<f64>>, at: &mut Parameters) {
        let elements = self.problem.predictor.bins.elements;
        for (baseline, taken) in at.baseline.iter_mut().zip(&mut taken) {
            let first = taken[..elements].to_vec();
            baseline.iter_mut().zip(&first).for_each(|(baseline, first)| *baseline += first);
            taken.iter_mut().zip(first.iter().cycle()).for_each(|(value, first)| *value -= first);
        }
        at.walk = (self.knots > 1).then_some(RandomWalk { knot_s: self.knot_s, runs: taken });
        let term = at.terms.iter_mut().find(|term| is_random_walk(term));
        if let (Some(term), Some(walk)) = (term, &at.walk) {
            term.values[2] = walk.rms_counts(elements);
        }
    }
}

pub(crate) fn is_random_walk(term: &Term) -> bool {
    std::ptr::eq(term.definition, &raw const RANDOM_WALK)
}

/// Precision of a random walk's step from knot to knot, in counts^-2.
fn stiffness(counts_per_root_s: f64, knot_s: f64) -> f64 {
    1.0 / (counts_per_root_s.powi(2) * knot_s)
}

/// The knot before a time, and the share of the way to the next.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to the last knot")]
fn place(t_s: f64, knot_s: f64, knots: usize) -> (usize, f64) {
    let along = (t_s / knot_s).clamp(0.0, (knots - 1) as f64);
    (along as usize, along.fract())
}

/// Random walks act outside the pipeline, because every run has its own.
#[derive(Debug)]
struct BesidePipeline;

impl OnReadout for BesidePipeline {
    fn counts(&mut self, _: Now<'_>, _: &mut [f64]) {}
}

#[cfg(test)]
#[path = "random_walk_tests.rs"]
mod tests;
