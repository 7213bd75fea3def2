//! A line through values over time, and whether it may be by chance.

use tactus_report::{fit::Polynomial, fleet::Slope};

/// The line through points `[day, value, standard error]`, of equal weight: runs differ by more than their own errors say, because covering and
/// sensor were touched between them. Its slope is no surer than the scatter about the line allows, nor than the runs' own errors do. `None` with
/// fewer than three points, or if all are of one time.
pub(super) fn slope(points: &[[f64; 3]]) -> Option<Slope> {
    let places: Vec<[f64; 2]> = points.iter().map(|[day, value, _]| [*day, *value]).collect();
    let line = Polynomial::fit(1, &places)?;
    let [start, per_day] = line.coefficients.as_slice() else { return None };
    let standard_error = per_day.standard_error?.max(own_error(points));
    let p_value = if standard_error > 0.0 {
        p_of_t(per_day.value / standard_error, line.degrees_of_freedom)
    } else {
        1.0
    };
    Some(Slope { start: start.value, per_day: per_day.value, standard_error, p_value })
}

/// Standard error of the slope if the values had no error but their own.
fn own_error(points: &[[f64; 3]]) -> f64 {
    let mean = |of: fn(&[f64; 3]) -> f64| points.iter().map(of).sum::<f64>() / points.len() as f64;
    let middle = mean(|[day, ..]| *day);
    let spread: f64 = points.iter().map(|[day, ..]| (day - middle).powi(2)).sum();
    (mean(|[.., error]| error * error) / spread).sqrt()
}

/// Probability that Student's t with so many degrees of freedom is farther from 0.
///
/// # Source
/// Abramowitz and Stegun, *Handbook of Mathematical Functions*, 26.7.3 and 26.7.4.
fn p_of_t(t: f64, freedom: usize) -> f64 {
    let angle = (t.abs() / (freedom as f64).sqrt()).atan();
    let (sin, cos) = angle.sin_cos();
    let is_odd = freedom % 2 == 1;
    // The terms of the series, each from the one before.
    let (mut term, mut sum) = if is_odd { (cos, 0.0) } else { (1.0, 0.0) };
    let first = if is_odd { 3 } else { 2 };
    for next in (first..=freedom).step_by(2) {
        sum += term;
        term *= cos * cos * (next - 1) as f64 / next as f64;
    }
    let within = if is_odd { (angle + sin * sum) * std::f64::consts::FRAC_2_PI } else { sin * sum };
    (1.0 - within).clamp(0.0, 1.0)
}

#[cfg(test)]
#[path = "trend_tests.rs"]
mod tests;
