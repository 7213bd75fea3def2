//! Elements that may be miswired: their reading follows another element's signal besides their own.

use crate::fit::{Fitted, Problem};
use crate::numbers::median;

/// A pair is tried if the other's signal reduces the cost of the element's reading by more than this,
const GAIN_LEAST: f64 = 30.0;
/// and by more than this many times the typical reduction.
const STANDS_OUT: f64 = 6.0;
/// Greatest number of pairs.
pub(crate) const PAIRS_MAX: usize = 4;
/// An element with less than this share of its declared gain may be dead.
const DEAD_SHARE: f64 = 0.3;
/// A partner is told if, of all that it could be, it has at least this probability.
const TOLD: f64 = 0.95;

/// Pairs of an element and the one for which it may answer, likeliest first. A pair of an element with itself means that it
/// may be dead.
pub(crate) fn pairs(problem: &Problem<'_>, fitted: &Fitted) -> Vec<[usize; 2]> {
    let partners = Partners::of(problem, fitted);
    let mut found: Vec<(f64, [usize; 2])> = Vec::new();
    let declared = &problem.predictor.known.response.sensitivity_counts_per_mm;
    for element in partners.elements.iter().copied() {
        found.extend(partners.best(element).map(|(gain, other)| (gain, [element, other])));
        let ratio = fitted.parameters.sensitivity[element] / declared[element];
        if ratio.abs() < DEAD_SHARE {
            found.push((f64::INFINITY, [element, element]));
        }
    }
    // The best of many pairs gains something from noise alone, more so from autocorrelated noise. The median measures this.
    let typical = median(&found.iter().map(|(gain, _)| *gain).collect::<Vec<_>>());
    found.retain(|(gain, _)| *gain > GAIN_LEAST.max(STANDS_OUT * typical));
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().take(PAIRS_MAX).map(|(_, pair)| pair).collect()
}

/// For which others the elements may answer.
pub(crate) struct Partners {
    sums: Sums,
    /// Elements with a weight.
    elements: Vec<usize>,
}

impl Partners {
    /// `fitted` has no miswired element.
    pub(crate) fn of(problem: &Problem<'_>, fitted: &Fitted) -> Self {
        let bins = problem.predictor.bins;
        let signal: Vec<f64> = fitted
            .predicted
            .chunks_exact(bins.elements)
            .zip(&bins.run)
            .flat_map(|(counts, run)| {
                let gains = counts.iter().zip(&fitted.parameters.baseline[*run]);
                gains.zip(&fitted.parameters.sensitivity).map(|((counts, baseline), gain)| {
                    if *gain == 0.0 { 0.0 } else { (counts - baseline) / gain }
                })
            })
            .collect();
        let weighed = |element: &usize| problem.element_weight[*element] > 0.0;
        Self { sums: Sums::of(problem, &signal), elements: (0..bins.elements).filter(weighed).collect() }
    }

    /// Every other element, with what it would gain as the one for which `element` answers.
    fn gains(&self, element: usize) -> impl Iterator<Item = (f64, usize)> {
        let others = self.elements.iter().copied().filter(move |other| *other != element);
        others.map(move |other| (self.sums.gain(element, other), other))
    }

    fn best(&self, element: usize) -> Option<(f64, usize)> {
        self.gains(element).max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// True if the readings tell that it is this other element for which a faulty one answers: all others together are improbable, each as
    /// probable before as any. Few presses give many elements alike signals.
    pub(crate) fn tell(&self, element: usize, answers_for: usize) -> bool {
        if element == answers_for {
            return true;
        }
        // What the best of so many gains from white noise; noise with a memory gives more.
        let by_chance = 2.0 * (self.elements.len() as f64).ln();
        let best = self.elements.iter().filter_map(|one| Some(self.best(*one)?.0));
        let scale = (median(&best.collect::<Vec<_>>()) / by_chance).max(1.0);
        let own = self.sums.gain(element, answers_for);
        let odds = self.gains(element).map(|(gain, _)| ((gain - own) / (2.0 * scale)).exp());
        odds.sum::<f64>() * TOLD <= 1.0
    }
}

/// Moments of the signals and of the readings in the fitted bins, centred and weighted.
struct Sums {
    elements: usize,
    /// Products of two elements' signals.
    signals: Vec<f64>,
    /// Products of an element's reading with another's signal.
    readings: Vec<f64>,
}

impl Sums {
    fn of(problem: &Problem<'_>, signal: &[f64]) -> Self {
        let bins = problem.predictor.bins;
        let elements = bins.elements;
        let total: f64 = problem.train.iter().sum();
        let mean = |values: &[f64]| -> Vec<f64> {
            let mut mean = vec![0.0; elements];
            for (values, weight) in values.chunks_exact(elements).zip(&problem.train) {
                mean.iter_mut().zip(values).for_each(|(mean, value)| *mean += weight * value / total);
            }
            mean
        };
        let (mean_signal, mean_counts) = (mean(signal), mean(&bins.counts));
        let mut sums = Self {
            elements,
            signals: vec![0.0; elements * elements],
            readings: vec![0.0; elements * elements],
        };
        let of_bins = signal.chunks_exact(elements).zip(bins.counts.chunks_exact(elements));
        for ((signal, counts), weight) in of_bins.zip(&problem.train).filter(|(_, weight)| **weight > 0.0) {
            let centred: Vec<f64> = signal.iter().zip(&mean_signal).map(|(one, mean)| one - mean).collect();
            for element in 0..elements {
                let of_signal = weight * centred[element];
                let of_counts = weight
                    * (counts[element] - mean_counts[element])
                    * problem.element_weight[element].sqrt();
                let at = element * elements..(element + 1) * elements;
                for ((signals, readings), other) in
                    sums.signals[at.clone()].iter_mut().zip(&mut sums.readings[at]).zip(&centred)
                {
                    *signals += of_signal * other;
                    *readings += of_counts * other;
                }
            }
        }
        sums
    }

    /// By how much another element's signal, besides its own, reduces the cost of an element's reading.
    fn gain(&self, element: usize, other: usize) -> f64 {
        let at = |one: usize, other: usize| one * self.elements + other;
        let own = self.signals[at(element, element)];
        let across = self.signals[at(element, other)];
        let left = self.signals[at(other, other)] - if own > 0.0 { across * across / own } else { 0.0 };
        let reading = self.readings[at(element, other)]
            - if own > 0.0 { across / own * self.readings[at(element, element)] } else { 0.0 };
        if left > 1e-9 * self.signals[at(other, other)] { reading * reading / left } else { 0.0 }
    }
}

#[cfg(test)]
#[path = "wiring_tests.rs"]
mod tests;
