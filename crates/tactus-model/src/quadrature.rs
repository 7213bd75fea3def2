//! Gauss-Legendre quadrature in panels.

/// Positive half of the 16 nodes on `[-1, 1]` and their weights.
///
/// # Source
/// Abramowitz and Stegun, Handbook of Mathematical Functions, table 25.4, n = 16.
const SIXTEEN: [(f64, f64); 8] = [
    (0.095_012_509_837_637_44, 0.189_450_610_455_068_5),
    (0.281_603_550_779_258_9, 0.182_603_415_044_923_6),
    (0.458_016_777_657_227_4, 0.169_156_519_395_002_54),
    (0.617_876_244_402_643_7, 0.149_595_988_816_576_73),
    (0.755_404_408_355_003, 0.124_628_971_255_533_87),
    (0.865_631_202_387_831_7, 0.095_158_511_682_492_78),
    (0.944_575_023_073_232_6, 0.062_253_523_938_647_89),
    (0.989_400_934_991_649_9, 0.027_152_459_411_754_1),
];

/// Positive half of the 4 nodes on `[-1, 1]` and their weights (same source, n = 4).
const FOUR: [(f64, f64); 2] =
    [(0.339_981_043_584_856_26, 0.652_145_154_862_546_1), (0.861_136_311_594_052_6, 0.347_854_845_137_453_85)];

/// Points and weights that integrate over `[from, to]` what a Gaussian of standard deviation `sigma_mm` has
/// made smooth, to about 1e-11: 4 points over a quarter of a standard deviation, or 16 over each two of them.
pub(crate) fn smooth(from: f64, to: f64, sigma_mm: f64) -> impl Iterator<Item = (f64, f64)> {
    let (nodes, panels) = if to - from <= sigma_mm / 4.0 {
        (FOUR.as_slice(), 1)
    } else {
        (SIXTEEN.as_slice(), whole((to - from) / (2.0 * sigma_mm)))
    };
    let half = (to - from) / (2.0 * panels as f64);
    (0..panels).flat_map(move |panel| {
        let middle = from + half * (2.0 * panel as f64 + 1.0);
        nodes.iter().flat_map(move |(node, weight)| {
            [(middle - half * node, half * weight), (middle + half * node, half * weight)]
        })
    })
}

/// The next whole number above a length in units of another.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "not negative, and some thousands at most"
)]
pub(crate) fn whole(number: f64) -> usize {
    number.ceil() as usize
}

#[cfg(test)]
#[path = "quadrature_tests.rs"]
mod tests;
