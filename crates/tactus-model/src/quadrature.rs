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

/// The 2 nodes on `[-1, 1]` and their weight (same source, n = 2).
const TWO: [(f64, f64); 1] = [(0.577_350_269_189_625_7, 1.0)];

/// Positive half of the 8 nodes on `[-1, 1]` and their weights (same source, n = 8).
const EIGHT: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_5),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_3),
];

/// Positive half of the 4 nodes on `[-1, 1]` and their weights (same source, n = 4).
const FOUR: [(f64, f64); 2] = [
    (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];

/// Points and weights that integrate over `[from, to]` a function smoothed by a Gaussian of standard deviation
/// `sigma_mm`, to about 1e-11 (1e-9 if narrow): 2 points for up to 1/32 of a standard deviation, 4 for up to a quarter, 8
/// for up to two, otherwise 16 per four.
pub(crate) fn smooth(from: f64, to: f64, sigma_mm: f64) -> impl Iterator<Item = (f64, f64)> {
    if to - from <= sigma_mm / 32.0 {
        panels(&TWO, from, to, 1)
    } else if to - from <= sigma_mm / 4.0 {
        panels(&FOUR, from, to, 1)
    } else if to - from <= 2.0 * sigma_mm {
        panels(&EIGHT, from, to, 1)
    } else {
        panels(&SIXTEEN, from, to, whole((to - from) / (4.0 * sigma_mm)))
    }
}

/// As [`smooth`], to about 1e-5 with fewer points: 2 over half a standard deviation, 4 over two, otherwise 8 per four and a half; `finely` 2 over 1/32,
/// 4 over one, otherwise 8 per two and a quarter. `sigmas`: how many standard deviations a line is long. Gives the positive half of the
/// nodes of a panel, on `[-1, 1]`, with their weights, and how many panels the line has.
pub(crate) fn few(sigmas: f64, finely: bool) -> (&'static [(f64, f64)], usize) {
    let [two, four, eight] = if finely { [1.0 / 32.0, 1.0, 2.25] } else { [0.5, 2.0, 4.5] };
    if sigmas <= two {
        (&TWO, 1)
    } else if sigmas <= four {
        (&FOUR, 1)
    } else {
        (&EIGHT, whole(sigmas / eight))
    }
}

fn panels(
    nodes: &'static [(f64, f64)],
    from: f64,
    to: f64,
    panels: usize,
) -> impl Iterator<Item = (f64, f64)> {
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
