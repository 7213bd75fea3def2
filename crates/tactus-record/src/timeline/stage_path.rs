//! Where a stage was between two of its reports.
//!
//! A stage moves at constant speed except when it starts, stops or turns. If it does so between two reports, the straight
//! line between them cuts the corner, by up to a quarter of the interval times the change of speed (11 um at 1 mm/s and 22
//! reports a second). So the lines before and after are extrapolated to where they meet:
//!
//! ```text
//! x(t) = x_1 + v_01 (t - t_1)  until they meet,  x_2 + v_23 (t - t_2)  from then      v_ij from report i to report j
//! ```
//!
//! for each axis separately. A report that the stage stands gives a speed of 0. The speed from such a report to the next is
//! less than that of the motion, because the stage started in between; it is used only on the way to the next stop, where
//! there is no better one. If the lines do not meet between the two reports, the straight line is used.

use tactus_schema::MonoTime;

use super::StageReport;

/// Position at a time, by the stage's reports in order of time; before the first and after the last it is theirs.
pub(super) fn position_mm(reports: &[StageReport], at: MonoTime) -> Option<[f64; 3]> {
    let next = reports.partition_point(|report| report.at <= at);
    let before = next.checked_sub(1).and_then(|index| reports.get(index));
    let (one, two) = match (before, reports.get(next)) {
        (Some(one), Some(two)) => (one, two),
        (Some(nearest), None) | (None, Some(nearest)) => return Some(nearest.position_mm),
        (None, None) => return None,
    };
    let (earlier, later) = (next.checked_sub(2).and_then(|index| reports.get(index)), reports.get(next + 1));
    // Times in s after the first of the two.
    let since_s = |time: MonoTime| seconds_from(one.at, time);
    let (at_s, two_s) = (since_s(at), since_s(two.at));
    let along = |axis: usize| {
        let (x_1, x_2) = (one.position_mm[axis], two.position_mm[axis]);
        let straight = x_1 + (x_2 - x_1) * at_s / two_s;
        let (Some(arriving), Some(leaving)) = (speed(one, earlier, two, axis), speed(two, later, one, axis))
        else {
            return straight;
        };
        let corner_s = (x_2 - leaving * two_s - x_1) / (arriving - leaving);
        if !(0.0..=two_s).contains(&corner_s) {
            straight
        } else if at_s < corner_s {
            x_1 + arriving * at_s
        } else {
            x_2 + leaving * (at_s - two_s)
        }
    };
    Some([along(0), along(1), along(2)])
}

/// Speed along an axis, in mm/s, at a report of a pair: estimated from the report on the side away from `other`.
fn speed(
    report: &StageReport,
    beside: Option<&StageReport>,
    other: &StageReport,
    axis: usize,
) -> Option<f64> {
    if report.stands {
        return Some(0.0);
    }
    let beside = beside.filter(|beside| !beside.stands || other.stands)?;
    let by_s = seconds_from(report.at, beside.at);
    Some((beside.position_mm[axis] - report.position_mm[axis]) / by_s)
}

/// From one time to another, negative if that is earlier.
fn seconds_from(from: MonoTime, to: MonoTime) -> f64 {
    (i128::from(to.ns()) - i128::from(from.ns())) as f64 * 1e-9
}

#[cfg(test)]
#[path = "stage_path_tests.rs"]
mod tests;
