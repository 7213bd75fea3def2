//! A value that changes in time: linear from knot to knot.

/// A piecewise linear curve through evenly spaced knots. It begins at 0 and is constant after the last knot.
///
/// ```text
/// c(t) = (1 - w) c_i + w c_(i+1)          x = K t / duration,  i = floor(x),  w = x - i,  c_0 = 0
/// ```
///
/// It follows any shape that is smooth over a knot's length. Of the variance of a random walk about its mean, a
/// least-squares fit leaves 10 % with 6 knots, 7.5 % with 8, 5.3 % with 12 and 3.9 % with 16 (400 walks of 1200 steps).
/// No 16 functions leave less than 3.7 %, by the walk's Karhunen-Loève series.
#[derive(Debug)]
pub(super) struct Curve<const K: usize> {
    duration_s: f64,
    /// The knots 1 to `K`, in the curve's own unit.
    knots: [f64; K],
}

impl<const K: usize> Curve<K> {
    /// The curve whose knots are these values; those that are missing are 0.
    pub(super) fn new(duration_s: f64, values: &[f64]) -> Self {
        let knots = std::array::from_fn(|knot| values.get(knot).copied().unwrap_or_default());
        Self { duration_s, knots }
    }

    /// Its value.
    pub(super) fn at(&self, t_s: f64) -> f64 {
        let (before, share) = self.place(t_s);
        (1.0 - share) * self.knot(before) + share * self.knot(before + 1)
    }

    /// The knot before, of 0 to `K`, and how far on to the next.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "from 0 to K; no number is 0"
    )]
    fn place(&self, t_s: f64) -> (usize, f64) {
        let along = (t_s / self.duration_s * K as f64).clamp(0.0, K as f64);
        (along as usize, along.fract())
    }

    fn knot(&self, knot: usize) -> f64 {
        knot.checked_sub(1).and_then(|index| self.knots.get(index)).copied().unwrap_or_default()
    }
}

#[cfg(test)]
#[path = "curve_tests.rs"]
mod tests;
