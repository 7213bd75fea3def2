//! The noise from presses that repeat each other: the same run, covering, tool, place, depth and direction of motion.
//!
//! Readings of the same moment of two such dwells differ by noise, and by what changes from press to press. In order of time,
//! with `m` dwells,
//!
//! ```text
//! noise^2 = mean (x(i + 1) - x(i))^2 / 2                     m < 4
//! noise^2 = mean (x(i) - 2 x(i + 1) + x(i + 2))^2 / 6        m >= 4, free of a drift along a line
//! ```
//!
//! The products of differences at two moments of a dwell give the autocorrelation. What changes from press to press is in it, so
//! this floor is what even an exact model leaves.
//!
//! # Source
//! J. von Neumann, R. H. Kent, H. R. Bellinson and B. I. Hart, *Ann. Math. Stat.* 12 (1941) 153; for second differences T. Gasser,
//! L. Sroka and C. Jennen-Steinmetz, *Biometrika* 73 (1986) 625.

use std::collections::BTreeMap;
use std::ops::Range;

use tactus_model::Phase;

use super::stretches::stretches;
use super::{ALIKE_Z, DIFFERENCES_SHARE, FREEDOM_LEAST, Noise, bias_variance, pooled, repeated_frames};
use crate::data::frames::Frames;
use crate::data::motion::{pressing, still_mm};
use crate::numbers::median;

/// Places in the same square of this width are one place.
const PLACE_MM: f64 = 0.02;
/// Depths in the same interval of this width are one depth.
const DEPTH_MM: f64 = 0.005;
/// Least number of dwells for second differences.
const SECOND_LEAST: usize = 4;
/// Share of the degrees of freedom in second differences, `1 / (1 + 2 (4/6)^2 + 2 (1/6)^2)`: their correlations are -4/6 and 1/6.
const SECOND_SHARE: f64 = 36.0 / 70.0;
/// Frames of a dwell that are compared.
const MOMENTS: usize = 30;

/// The command of a dwell.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Command {
    run: usize,
    covering_um: i64,
    indenter: u16,
    place: [i64; 2],
    depth: i64,
    upward: bool,
}

/// Differences of dwells with the same command.
struct Differences {
    /// Weighted sum of squares for each element.
    squares: Vec<f64>,
    /// Sum of products of readings some frames apart, in units of the sum of squares, and number of products.
    products: [[f64; 2]; MOMENTS],
    freedom: f64,
}

/// The noise, and the degrees of freedom of one element's. `None` if too few presses repeat each other.
pub(super) fn noise(frames: &Frames, still: &[usize], step_counts: f64) -> Option<(Noise, f64)> {
    let mut differences =
        Differences { squares: vec![0.0; frames.elements], products: [[0.0; 2]; MOMENTS], freedom: 0.0 };
    for dwells in dwells(frames, still).values() {
        if dwells.len() >= SECOND_LEAST {
            differences.take::<3>(frames, dwells, [1.0, -2.0, 1.0], SECOND_SHARE);
        } else {
            differences.take::<2>(frames, dwells, [-1.0, 1.0], DIFFERENCES_SHARE);
        }
    }
    let Differences { squares, products, freedom } = differences;
    if freedom < FREEDOM_LEAST {
        return None;
    }
    let rounding = step_counts * step_counts / 12.0;
    let variance = |sum: &f64| (sum / freedom).max(rounding).max(f64::MIN_POSITIVE);
    let variances: Vec<f64> = squares.iter().map(variance).collect();
    let variances = pooled(&variances, ALIKE_Z * (2.0 / freedom).sqrt());
    let typical = median(&variances);
    let [all, readings] = products[0];
    let mean_square = (all / readings).max(f64::MIN_POSITIVE);
    let correlation = |[sum, count]: &[f64; 2]| (sum / count / mean_square).clamp(0.0, 1.0);
    let known = products.iter().take_while(|[_, count]| *count > 0.0);
    let noise = Noise {
        rms_counts: typical.sqrt(),
        by_element_counts: variances.iter().map(|variance| variance.sqrt()).collect(),
        correlation: known.map(correlation).collect(),
        rounding_share: bias_variance(typical - rounding, step_counts) / typical,
        repeated_frames: repeated_frames(frames, still),
    };
    Some((noise, freedom))
}

/// The dwells in contact of each command, in order of time: the first one of each press. What follows in the same press is no other one.
fn dwells(frames: &Frames, still: &[usize]) -> BTreeMap<Command, Vec<Range<usize>>> {
    let mut dwells: BTreeMap<Command, Vec<Range<usize>>> = BTreeMap::new();
    let still_mm = still_mm(frames);
    let mut run = 0;
    for dwell in stretches(frames, still) {
        let frame = dwell.start;
        while frames.runs[run].1 <= frame {
            run += 1;
        }
        let [x_mm, y_mm, z_mm] = frames.position_mm[frame];
        let press = |frame: usize| frames.press.get(frame).copied();
        let begins = frame == 0 || press(frame - 1) != press(frame);
        let is_alone = begins && press(dwell.end) != press(frame);
        let rests = dwell.len() > 1 || frames.phase[frame] == Phase::Hold || is_alone;
        let touches = press(frame) >= Some(0) && (z_mm < 0.0 || pressing(frames.phase[frame]));
        if !(rests && touches) {
            continue;
        }
        #[expect(clippy::cast_possible_truncation, reason = "a length over a small one")]
        let nearest = |value_mm: f64, width_mm: f64| (value_mm / width_mm).round() as i64;
        let command = Command {
            run,
            covering_um: nearest(frames.covering_mm[frame], 0.001),
            indenter: frames.indenter[frame],
            place: [nearest(x_mm, PLACE_MM), nearest(y_mm, PLACE_MM)],
            depth: nearest(z_mm, DEPTH_MM),
            upward: !begins && z_mm > frames.position_mm[frame - 1][2] + still_mm,
        };
        let of_command = dwells.entry(command).or_default();
        if of_command.last().is_none_or(|last| press(last.start) != press(frame)) {
            of_command.push(dwell);
        }
    }
    dwells
}

impl Differences {
    /// Adds the differences of `N` dwells in a row, with these factors.
    fn take<const N: usize>(
        &mut self,
        frames: &Frames,
        dwells: &[Range<usize>],
        factors: [f64; N],
        freedom_share: f64,
    ) {
        let unit: f64 = factors.iter().map(|factor| factor * factor).sum::<f64>().sqrt();
        for dwells in dwells.windows(N) {
            let moments = dwells.iter().map(Range::len).min().unwrap_or(0).min(MOMENTS);
            for element in 0..frames.elements {
                let difference = |moment: usize| {
                    let of = |(dwell, factor): (&Range<usize>, &f64)| {
                        factor * f64::from(frames.counts_of(dwell.start + moment)[element])
                    };
                    dwells.iter().zip(&factors).map(of).sum::<f64>() / unit
                };
                let differences: Vec<f64> = (0..moments).map(difference).collect();
                let squares: f64 = differences.iter().map(|one| one * one).sum();
                self.squares[element] += freedom_share * squares / moments as f64;
                for (lag, [sum, count]) in self.products.iter_mut().enumerate().take(moments) {
                    *sum += differences.iter().zip(&differences[lag..]).map(|(a, b)| a * b).sum::<f64>();
                    *count += (moments - lag) as f64;
                }
            }
            self.freedom += freedom_share;
        }
    }
}
