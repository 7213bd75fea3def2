//! Reduction of points without a visible change.

/// The lowest and the highest point of each of `columns` equal columns along x, in their order.
///
/// Points must be in order of x. If a column is a pixel wide, a line through the result covers the same pixels as a line
/// through all points. Points that are not finite are left out.
pub fn extremes(points: &[[f64; 2]], columns: usize) -> Vec<[f64; 2]> {
    let points: Vec<[f64; 2]> =
        points.iter().copied().filter(|point| point.iter().all(|value| value.is_finite())).collect();
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return points };
    if points.len() <= 2 * columns {
        return points;
    }
    let width = (last[0] - first[0]) / columns.max(1) as f64;
    let column = |point: &[f64; 2]| ((point[0] - first[0]) / width).floor();
    let mut kept = Vec::with_capacity(2 * columns);
    for group in points.chunk_by(|a, b| column(a).total_cmp(&column(b)).is_eq()) {
        let lowest = group.iter().enumerate().min_by(|a, b| a.1[1].total_cmp(&b.1[1]));
        let highest = group.iter().enumerate().max_by(|a, b| a.1[1].total_cmp(&b.1[1]));
        let (Some(lowest), Some(highest)) = (lowest, highest) else { continue };
        let (early, late) = if lowest.0 <= highest.0 { (lowest, highest) } else { (highest, lowest) };
        kept.push(*early.1);
        if late.0 != early.0 {
            kept.push(*late.1);
        }
    }
    kept
}

/// The outline of a histogram: bin `k` reaches from `from + k width` to `from + (k + 1) width`.
pub fn steps(from: f64, width: f64, counts: &[u64]) -> Vec<[f64; 2]> {
    let mut outline = vec![[from, 0.0]];
    for (index, count) in counts.iter().enumerate() {
        let left = from + index as f64 * width;
        outline.push([left, *count as f64]);
        outline.push([left + width, *count as f64]);
    }
    outline.push([from + counts.len() as f64 * width, 0.0]);
    outline
}

#[cfg(test)]
#[path = "decimate_tests.rs"]
mod tests;
