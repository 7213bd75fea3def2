//! Gauss-Legendre quadrature in panels.

/// Positive half of the 16 nodes on `[-1, 1]` and their weights.
///
/// # Source
/// Abramowitz and Stegun, Handbook of Mathematical Functions, table 25.4, n = 16.
const NODES: [(f64, f64); 8] = [
    (0.095_012_509_837_637_44, 0.189_450_610_455_068_5),
    (0.281_603_550_779_258_9, 0.182_603_415_044_923_6),
    (0.458_016_777_657_227_4, 0.169_156_519_395_002_54),
    (0.617_876_244_402_643_7, 0.149_595_988_816_576_73),
    (0.755_404_408_355_003, 0.124_628_971_255_533_87),
    (0.865_631_202_387_831_7, 0.095_158_511_682_492_78),
    (0.944_575_023_073_232_6, 0.062_253_523_938_647_89),
    (0.989_400_934_991_649_9, 0.027_152_459_411_754_1),
];

/// The integral of `f` over `[from, to]`, in equal panels no wider than `panel`.
pub(crate) fn integrate([from, to]: [f64; 2], panel: f64, f: impl Fn(f64) -> f64) -> f64 {
    let panels = ((to - from) / panel).ceil().max(1.0);
    let half = (to - from) / (2.0 * panels);
    let (mut sum, mut index) = (0.0, 0.0);
    while index < panels {
        let middle = from + half * (2.0 * index + 1.0);
        sum += NODES
            .iter()
            .map(|(node, weight)| weight * (f(middle - half * node) + f(middle + half * node)))
            .sum::<f64>();
        index += 1.0;
    }
    half * sum
}
