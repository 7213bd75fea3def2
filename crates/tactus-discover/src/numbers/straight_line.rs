//! A straight line through values that are evenly spaced.

/// The line of least squares through values at the places 0, 1, 2 and so on. Through a single value it is level.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StraightLine {
    mean: f64,
    slope: f64,
    middle: f64,
}

impl StraightLine {
    pub(crate) fn through(values: impl Iterator<Item = f64> + Clone) -> Self {
        let count = values.clone().count() as f64;
        let (mean, middle) = (values.clone().sum::<f64>() / count, 0.5 * (count - 1.0));
        let (mut along, mut spread) = (0.0, 0.0);
        for (place, value) in values.enumerate() {
            let place = place as f64 - middle;
            along += (value - mean) * place;
            spread += place * place;
        }
        Self { mean, slope: if spread > 0.0 { along / spread } else { 0.0 }, middle }
    }

    /// Its value at a place.
    pub(crate) fn at(self, place: usize) -> f64 {
        self.mean + self.slope * (place as f64 - self.middle)
    }
}

#[cfg(test)]
#[path = "straight_line_tests.rs"]
mod tests;
