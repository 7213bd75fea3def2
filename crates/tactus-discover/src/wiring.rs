//! Which elements may answer for another: those whose reading follows another's signal better than their own.

use crate::fit::{Fitted, Problem};

/// A pair is worth a try if the other's signal explains so much more of an element's variance than its own.
const LEAD_LEAST: f64 = 0.02;
/// So many pairs at most.
const PAIRS_MAX: usize = 4;
/// An element that answers with less than this share of the typical gain may be dead.
const DEAD_SHARE: f64 = 0.3;

/// Pairs of an element and the one for which it may answer, likeliest first; an element with itself may be dead.
pub(crate) fn pairs(problem: &Problem<'_>, fitted: &Fitted) -> Vec<[usize; 2]> {
    let rows = problem.sensor.rows;
    let elements = rows.elements;
    let signal: Vec<f64> = fitted
        .predicted
        .chunks_exact(elements)
        .zip(&rows.run)
        .flat_map(|(counts, run)| {
            let gains = counts.iter().zip(&fitted.parameters.baseline[*run]);
            gains
                .zip(&fitted.parameters.sensitivity)
                .map(|((counts, baseline), gain)| if *gain == 0.0 { 0.0 } else { (counts - baseline) / gain })
        })
        .collect();
    let mut found: Vec<(f64, [usize; 2])> = Vec::new();
    let declared = &problem.sensor.known.response.sensitivity_counts_per_mm;
    for element in 0..elements {
        let own = correlation(problem, &signal, element, element);
        let best = (0..elements)
            .filter(|other| *other != element)
            .map(|other| (correlation(problem, &signal, element, other), other))
            .max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((best, other)) = best.filter(|(best, _)| *best > own + LEAD_LEAST) {
            found.push((best - own, [element, other]));
        }
        let ratio = fitted.parameters.sensitivity[element] / declared[element];
        if ratio.abs() < DEAD_SHARE && own < 0.5 {
            found.push((1.0 - own, [element, element]));
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().take(PAIRS_MAX).map(|(_, pair)| pair).collect()
}

/// Share of the variance of an element's reading that another's signal explains, in the fitted rows.
fn correlation(problem: &Problem<'_>, signal: &[f64], element: usize, other: usize) -> f64 {
    let rows = problem.sensor.rows;
    let elements = rows.elements;
    let (mut w, mut x, mut y, mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (row, weight) in problem.train.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
        let (of_signal, of_counts) = (signal[row * elements + other], rows.counts[row * elements + element]);
        w += weight;
        x += weight * of_signal;
        y += weight * of_counts;
        xx += weight * of_signal * of_signal;
        xy += weight * of_signal * of_counts;
        yy += weight * of_counts * of_counts;
    }
    let (covariance, of_x, of_y) = (xy - x * y / w, xx - x * x / w, yy - y * y / w);
    if of_x > 0.0 && of_y > 0.0 { covariance * covariance / (of_x * of_y) } else { 0.0 }
}
