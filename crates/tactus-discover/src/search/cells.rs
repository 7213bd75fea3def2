//! A residual along a covariate, summed in narrow cells.

/// A reading, or a sum of some at one value of the covariate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    pub(super) value: f64,
    /// Weight times residual times what a dependence multiplies.
    pub(super) wanted: f64,
    /// Weight times the square of what it multiplies.
    pub(super) square: f64,
}

/// Points of equal weight, with a residual that follows the value.
#[cfg(test)]
pub(super) fn points(values: &[f64], residual: impl Fn(f64) -> f64) -> Vec<Point> {
    values.iter().map(|value| Point { value: *value, wanted: residual(*value), square: 1.0 }).collect()
}

/// Cells of equal width over the range of the covariate.
pub(super) struct Cells {
    pub(super) least: f64,
    pub(super) range: f64,
    /// Of each cell, what is wanted and the squares.
    pub(super) sums: Vec<[f64; 2]>,
}

impl Cells {
    /// So many cells of the points with a weight; `None` if the covariate does not vary.
    pub(super) fn of(points: &(impl Iterator<Item = Point> + Clone), count: usize) -> Option<Self> {
        let weighed = || points.clone().filter(|point| point.square > 0.0);
        let least = weighed().map(|point| point.value).fold(f64::INFINITY, f64::min);
        let most = weighed().map(|point| point.value).fold(f64::NEG_INFINITY, f64::max);
        let range = most - least;
        if !(range > 0.0 && range.is_finite()) {
            return None;
        }
        let mut sums = vec![[0.0; 2]; count];
        for point in weighed() {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "from 0 to the number of cells"
            )]
            let cell = (((point.value - least) / range * count as f64) as usize).min(count - 1);
            sums[cell][0] += point.wanted;
            sums[cell][1] += point.square;
        }
        Some(Self { least, range, sums })
    }

    /// The sums over all cells.
    pub(super) fn total(&self) -> [f64; 2] {
        self.sums.iter().fold([0.0; 2], |[wanted, square], [one, of]| [wanted + one, square + of])
    }
}
