//! Depth and signal over time, lost frames, and the time between frames.

use std::{collections::BTreeMap, fmt};

use super::WIDTH_PX;
use crate::{
    markup::Text,
    numbers::{count, duration, plural},
    plot::{Axis, Figure, Ink, Series, extremes, number, round_step, steps},
    run::{Intervals, RunReport, Timing},
};

/// Gaps that are listed at most.
const LOSSES_MAX: usize = 40;
/// Bins of the histogram, roughly at most.
const BINS_MAX: f64 = 60.0;

pub(super) fn signal(f: &mut fmt::Formatter<'_>, report: &RunReport) -> fmt::Result {
    let trace = &report.trace;
    if trace.signal.is_empty() && trace.depth.is_empty() {
        return Ok(());
    }
    writeln!(
        f,
        "<section>\n<h2>Depth and signal over time</h2>\n<p class=\"lead\">The tip's depth below the covering's nominal surface (0 above it), and the sum of all elements above the baseline. Each pixel column shows its least and greatest value.</p>"
    )?;
    for (name, unit, points, ink) in
        [("depth", "mm", &trace.depth, Ink::Text), ("total signal", "counts", &trace.signal, Ink::Blue)]
    {
        let figure = over_time(report, name, unit, [WIDTH_PX, 190.0]);
        let line = Series::line(extremes(points, figure.columns())).ink(ink).width_px(1.0);
        writeln!(f, "{}", figure.with(line))?;
    }
    writeln!(f, "</section>")?;
    if report.response.is_none() { against_depth(f, report) } else { Ok(()) }
}

/// For presses away from element centres: the sum of all elements against depth.
fn against_depth(f: &mut fmt::Formatter<'_>, report: &RunReport) -> fmt::Result {
    const INKS: [Ink; 5] = [Ink::Blue, Ink::Red, Ink::Green, Ink::Amber, Ink::Muted];
    let mut by_covering: BTreeMap<String, Vec<[f64; 2]>> = BTreeMap::new();
    for dwell in report.presses.iter().flat_map(|press| &press.dwells) {
        let covering = by_covering.entry(format!("{} mm covering", dwell.covering_mm)).or_default();
        covering.push([dwell.depth_mm, dwell.total_counts()]);
    }
    if by_covering.is_empty() {
        return Ok(());
    }
    let x = Axis::new("depth", "mm").from_zero();
    let y = Axis::new("total signal", "counts").from_zero();
    let mut figure = Figure::new("Signal of each dwell against its depth", x, y).size_px([680.0, 380.0]);
    for (nth, (covering, points)) in by_covering.into_iter().enumerate() {
        figure = figure.with(
            Series::dots(points).ink(INKS[nth % INKS.len()]).width_px(3.5).opacity(0.5).label(covering),
        );
    }
    writeln!(
        f,
        "<section>\n<h2>Signal against depth</h2>\n<p class=\"lead\">The sum of all elements above the baseline. Each point is the mean of one dwell.</p>\n{figure}\n</section>"
    )
}

pub(super) fn losses(f: &mut fmt::Formatter<'_>, report: &RunReport) -> fmt::Result {
    let summary = &report.summary;
    if summary.frames == 0 {
        return Ok(());
    }
    writeln!(f, "<section>\n<h2>Lost frames</h2>")?;
    if report.losses.is_empty() {
        return writeln!(
            f,
            "<p>None: {} frames with consecutive numbers over {}.</p>\n</section>",
            count(summary.frames),
            duration(summary.duration_s)
        );
    }
    let share = 100.0 * summary.frames_lost as f64 / (summary.frames + summary.frames_lost) as f64;
    writeln!(
        f,
        "<p class=\"lead\">{} lost in {}: {} % of what the sensor took.</p>",
        plural(summary.frames_lost, "frame"),
        plural(summary.gaps, "gap"),
        number(share, 3)
    )?;
    let points: Vec<[f64; 2]> = report.losses.iter().map(|loss| [loss.at_s, loss.frames as f64]).collect();
    let figure = over_time(report, "frames lost", "", [WIDTH_PX, 150.0]);
    let columns = figure.columns();
    writeln!(f, "{}", figure.with(Series::stems(extremes(&points, columns)).ink(Ink::Red).width_px(2.0)))?;
    writeln!(
        f,
        "<table class=\"numbers\">\n<thead><tr><th class=\"n\">time / s</th><th class=\"n\">frames lost</th><th class=\"n\">after frame</th><th class=\"n\">before frame</th><th class=\"n\">press</th></tr></thead>"
    )?;
    for loss in report.losses.iter().take(LOSSES_MAX) {
        let press = if loss.press < 0 { "\u{2013}".into() } else { loss.press.to_string() };
        writeln!(
            f,
            "<tr><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{press}</td></tr>",
            number(loss.at_s, 2),
            loss.frames,
            loss.after_seq,
            loss.next_seq
        )?;
    }
    writeln!(f, "</table>")?;
    if report.losses.len() > LOSSES_MAX {
        writeln!(f, "<p>The first {LOSSES_MAX} of {} gaps are listed.</p>", report.losses.len())?;
    }
    writeln!(f, "</section>")
}

pub(super) fn timing(f: &mut fmt::Formatter<'_>, timing: &Timing) -> fmt::Result {
    let clocks =
        [("device clock", &timing.device, Ink::Red), ("arrival at the host", &timing.host, Ink::Blue)];
    if clocks.iter().all(|(_, intervals, _)| intervals.is_none()) {
        return Ok(());
    }
    writeln!(
        f,
        "<section>\n<h2>Time between frames</h2>\n<p class=\"lead\">Between consecutive frames without a loss. The nominal interval is {} ms. The outermost bins include everything beyond them.</p>",
        number(timing.expected_ms, 2)
    )?;
    if let Some(figure) = histogram(&clocks) {
        writeln!(f, "{figure}")?;
    }
    writeln!(
        f,
        "<table class=\"numbers\">\n<thead><tr><th></th><th class=\"n\">intervals</th><th class=\"n\">median / ms</th><th class=\"n\">99th percentile / ms</th><th class=\"n\">greatest / ms</th><th class=\"n\">jitter (standard deviation) / ms</th></tr></thead>"
    )?;
    for (name, intervals, _) in &clocks {
        let Some(intervals) = intervals else {
            writeln!(f, "<tr><td>{name}</td><td colspan=\"5\">unknown</td></tr>")?;
            continue;
        };
        write!(f, "<tr><td>{name}</td><td class=\"n\">{}</td>", count(intervals.sorted_ms.len() as u64))?;
        for ms in [
            intervals.quantile_ms(0.5),
            intervals.quantile_ms(0.99),
            intervals.quantile_ms(1.0),
            intervals.jitter_ms,
        ] {
            write!(f, "<td class=\"n\">{}</td>", number(ms, 3))?;
        }
        writeln!(f, "</tr>")?;
    }
    writeln!(f, "</table>")?;
    for clock in &timing.clocks {
        writeln!(f, "<p class=\"lead\">{}</p>", Text(clock))?;
    }
    writeln!(f, "</section>")
}

/// Histogram of both clocks' intervals; the outermost bins include everything beyond them.
fn histogram(clocks: &[(&str, &Option<Intervals>, Ink)]) -> Option<Figure> {
    let known =
        || clocks.iter().filter_map(|(name, intervals, ink)| Some((*name, intervals.as_ref()?, *ink)));
    let lo = known().map(|(_, intervals, _)| intervals.quantile_ms(0.005)).fold(f64::INFINITY, f64::min);
    let hi = known().map(|(_, intervals, _)| intervals.quantile_ms(0.995)).fold(f64::NEG_INFINITY, f64::max);
    if !(lo.is_finite() && hi.is_finite()) {
        return None;
    }
    let width = round_step(((hi - lo) / BINS_MAX).max(0.05));
    // Bins are centred at multiples of their width, so that intervals of whole clock ticks are at bin centres.
    let first = (lo / width).round() - 1.0;
    let bins = (hi / width).round() - first + 2.0;
    let x = Axis::new("interval", "ms").tight();
    let mut figure =
        Figure::new("Time between frames", x, Axis::new("intervals", "").from_zero()).size_px([680.0, 300.0]);
    for (name, intervals, ink) in known() {
        let counts = binned(&intervals.sorted_ms, first, width, bins);
        let outline = steps((first - 0.5) * width, width, &counts);
        figure = figure.with(Series::line(outline).ink(ink).label(name));
    }
    Some(figure)
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few dozen bins")]
fn binned(sorted_ms: &[f64], first: f64, width: f64, bins: f64) -> Vec<u64> {
    let mut counts = vec![0; bins.clamp(1.0, 1000.0) as usize];
    let last = counts.len() - 1;
    for ms in sorted_ms {
        counts[((ms / width).round() - first).clamp(0.0, last as f64) as usize] += 1;
    }
    counts
}

/// A figure whose x axis is the time of the whole run.
fn over_time(report: &RunReport, name: &str, unit: &str, size_px: [f64; 2]) -> Figure {
    let trace = &report.trace;
    let ends = [trace.signal.first(), trace.signal.last(), trace.depth.first(), trace.depth.last()];
    let times = ends.into_iter().flatten().map(|point| point[0]);
    let (lo, hi) = times.fold((0.0, 0.0), |(lo, hi): (f64, f64), at| (lo.min(at), hi.max(at)));
    let title = format!("{name} over time");
    Figure::new(title, Axis::new("time", "s").spanning([lo, hi]), Axis::new(name, unit).from_zero().tight())
        .size_px(size_px)
}
