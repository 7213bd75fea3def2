//! The page of a fleet: which sensors drift, which coverings age, which rigs share an effect that their model lacks.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::{
    document::{Column, SIMULATED_BADGE, SIMULATED_NOTICE, Table, document, notes},
    markup::Text,
    numbers::{count, plural, probability, with_error},
    plot::{Axis, Figure, Ink, Series},
};

/// Figures of one section at most; its table has all.
const FIGURES_MAX: usize = 12;

/// Runs without a result that are named at most.
const REFUSED_MAX: usize = 20;

/// What the runs of a fleet say together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FleetReport {
    /// Where the fleet is.
    pub fleet: String,
    /// True if some runs read no physical sensor.
    pub simulated: bool,
    /// Number of runs.
    pub runs: u64,
    /// Number of rigs.
    pub rigs: u64,
    /// Of each rig its sensitivity and its baseline, those that change first.
    pub drifts: Vec<Trend>,
    /// Of each rig and covering its spread, those that change first.
    pub ageing: Vec<Trend>,
    /// Effects that models lack, those of most rigs first.
    pub effects: Vec<MissingEffect>,
    /// Runs that could not be judged, and why; a sentence each.
    pub refused: Vec<String>,
}

/// A quantity of a rig over time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trend {
    /// Name of the rig.
    pub rig: String,
    /// What changes, such as `sensitivity`.
    pub quantity: String,
    /// Its unit.
    pub unit: String,
    /// Thickness of the covering, if it is of one.
    pub covering_mm: Option<f64>,
    /// Of each run the days since the first, the value, its standard error.
    pub points: Vec<[f64; 3]>,
    /// Change per day, its standard error, and its p-value; none with fewer than three days or equal ones.
    pub slope: Option<Slope>,
    /// True if so great a change is not by chance, among all that were looked at.
    pub changes: bool,
}

/// A line through the points of a [`Trend`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Slope {
    /// Value at the first run.
    pub start: f64,
    /// Change per day.
    pub per_day: f64,
    /// Its standard error.
    pub standard_error: f64,
    /// Probability of such a change without a trend.
    pub p_value: f64,
}

/// An effect that models lack.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct MissingEffect {
    /// Its name.
    pub effect: String,
    /// The rigs whose runs show it.
    pub rigs: Vec<AtRig>,
    /// True if it is missing on more than one rig, in at least half of the runs of each.
    pub shared: bool,
}

/// How many runs of a rig show an effect.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct AtRig {
    /// Name of the rig.
    pub rig: String,
    /// Runs that show it.
    pub shown: u64,
    /// Runs that were judged.
    pub judged: u64,
}

/// Makes the page: HTML with its style and figures inline. All text from outside is escaped.
pub fn fleet_html(report: &FleetReport) -> String {
    document("Fleet", fmt::from_fn(|f| body(f, report)))
}

fn body(f: &mut fmt::Formatter<'_>, report: &FleetReport) -> fmt::Result {
    writeln!(f, "<header>\n<div class=\"headline\"><h1>Fleet</h1>")?;
    if report.simulated {
        writeln!(f, "{SIMULATED_BADGE}")?;
    }
    let (runs, rigs) = (plural(report.runs, "run"), plural(report.rigs, "rig"));
    writeln!(f, "</div>\n<p class=\"under\">{runs} of {rigs} &#183; {}</p>", Text(&report.fleet))?;
    if report.simulated {
        writeln!(f, "{SIMULATED_NOTICE}")?;
    }
    writeln!(f, "</header>")?;
    refused(f, &report.refused)?;
    trends(f, "Sensors that drift", "sensitivity or baseline", &report.drifts)?;
    trends(f, "Coverings that age", "spread under one covering", &report.ageing)?;
    effects(f, &report.effects)
}

fn refused(f: &mut fmt::Formatter<'_>, refused: &[String]) -> fmt::Result {
    let mut shown: Vec<String> = refused.iter().take(REFUSED_MAX).cloned().collect();
    if refused.len() > shown.len() {
        shown.push(format!("and {} more", refused.len() - shown.len()));
    }
    notes(f, "Could not be judged", &shown)
}

fn trends(f: &mut fmt::Formatter<'_>, title: &str, what: &str, trends: &[Trend]) -> fmt::Result {
    writeln!(f, "<section>\n<h2>{title}</h2>")?;
    if trends.is_empty() {
        return writeln!(f, "<p>No run gives a {what}: calibrate the fleet first.</p>\n</section>");
    }
    let changing = trends.iter().filter(|trend| trend.changes).count() as u64;
    writeln!(
        f,
        "<p>{} of {} change over time by more than chance, which is 5 % for all together.</p>",
        count(changing),
        count(trends.len() as u64),
    )?;
    for trend in trends.iter().filter(|trend| trend.changes).take(FIGURES_MAX) {
        writeln!(
            f,
            "<figure>\n{}\n<figcaption>{}</figcaption>\n</figure>",
            figure(trend),
            Text(caption(trend))
        )?;
    }
    let columns = [
        Column::Name("rig"),
        Column::Name("quantity"),
        Column::Number("runs"),
        Column::Number("change per day"),
        Column::Number("p"),
        Column::Name("changes"),
    ];
    let mut table = Table::new(&columns);
    for trend in trends {
        let slope = |of: fn(&Slope) -> String| trend.slope.as_ref().map_or_else(|| "\u{2013}".to_owned(), of);
        table.row([
            trend.rig.clone(),
            name(trend),
            count(trend.points.len() as u64),
            slope(|slope| with_error(slope.per_day, slope.standard_error)),
            slope(|slope| probability(slope.p_value)),
            if trend.changes { "yes".to_owned() } else { String::new() },
        ]);
    }
    writeln!(f, "{table}</section>")
}

/// The quantity with its covering and its unit.
fn name(trend: &Trend) -> String {
    let covering =
        trend.covering_mm.map(|covering_mm| format!(" under {covering_mm} mm")).unwrap_or_default();
    format!("{}{covering} / {}", trend.quantity, trend.unit)
}

fn caption(trend: &Trend) -> String {
    let change = trend.slope.map(|slope| with_error(slope.per_day, slope.standard_error)).unwrap_or_default();
    format!("Rig {}: {} changes by {change} a day.", trend.rig, name(trend))
}

fn figure(trend: &Trend) -> Figure {
    let title = format!("{} of rig {}", trend.quantity, trend.rig);
    let figure = Figure::new(title, Axis::new("time", "days"), Axis::new(&*trend.quantity, &*trend.unit))
        .with(
            Series::bars(trend.points.iter().map(|[day, value, error]| [*day, value - error, value + error]))
                .ink(Ink::Muted),
        )
        .with(
            Series::dots(trend.points.iter().map(|[day, value, _]| [*day, *value]).collect()).label("runs"),
        );
    let Some(slope) = trend.slope else { return figure };
    let ends = [trend.points.first(), trend.points.last()];
    let line =
        ends.into_iter().flatten().map(|[day, ..]| [*day, slope.start + slope.per_day * day]).collect();
    figure.with(Series::line(line).ink(Ink::Red).label("line"))
}

fn effects(f: &mut fmt::Formatter<'_>, effects: &[MissingEffect]) -> fmt::Result {
    writeln!(f, "<section>\n<h2>Effects that rigs share</h2>")?;
    if effects.is_empty() {
        return writeln!(
            f,
            "<p>No run shows an effect that its model lacks, or the fleet was not searched yet.</p>\n</section>"
        );
    }
    let columns = [
        Column::Name("effect"),
        Column::Name("shared"),
        Column::Prose("rigs: runs that show it, of those judged"),
    ];
    let mut table = Table::new(&columns);
    for missing in effects {
        let at = |at: &AtRig| format!("{}: {} of {}", at.rig, at.shown, at.judged);
        let rigs: Vec<String> = missing.rigs.iter().map(at).collect();
        let shared = if missing.shared { "yes" } else { "" };
        table.row([missing.effect.clone(), shared.to_owned(), rigs.join("; ")]);
    }
    writeln!(f, "{table}</section>")
}
