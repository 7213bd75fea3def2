//! The gap before and after, what stays unexplained, and what to measure next.

use std::fmt;

use tactus_discover::{Discovery, Level, Verdict};

use super::{
    DiscoveryReport, draft,
    figures::staircase,
    gap, next,
    words::{self, list},
};
use crate::{
    document::{Column, Table},
    markup::Text,
    numbers::digits,
};

pub(super) fn sections(f: &mut fmt::Formatter<'_>, report: &DiscoveryReport<'_>) -> fmt::Result {
    let found = report.discovery;
    before_and_after(f, found)?;
    unexplained(f, found)?;
    draft::section(f, report)?;
    next::section(f, found)
}

fn before_and_after(f: &mut fmt::Formatter<'_>, found: &Discovery) -> fmt::Result {
    let noise = found.floor.rms_counts();
    let or_dash = |value: Option<f64>| {
        value.map_or_else(
            || "\u{2013}".to_owned(),
            |value| if value.is_finite() { digits(value, 3) } else { "unknown".into() },
        )
    };
    let gap = |level: Level| {
        let rms = level.heldout_rms_counts;
        noise.map(|noise| (rms * rms - noise * noise).max(0.0).sqrt())
    };
    let in_noise = |counts: Option<f64>| counts.zip(noise).map(|(counts, noise)| counts / noise);
    let both = [found.base, found.final_.level];
    let rows = [
        ("residual / counts rms", both.map(|level| Some(level.heldout_rms_counts))),
        ("residual / noise", both.map(|level| in_noise(Some(level.heldout_rms_counts)))),
        ("its variance / counts\u{b2}", both.map(|level| Some(level.heldout_rms_counts.powi(2)))),
        ("its variance / noise\u{b2}", both.map(|level| level.heldout_chi2)),
        ("gap / counts rms", both.map(gap)),
        ("gap / noise", both.map(|level| in_noise(gap(level)))),
        ("structured / noise", both.map(|level| level.structured.map(|part| part.rms_noise))),
        (
            "structured at most (95 %) / noise",
            both.map(|level| level.structured.map(|part| part.upper_noise)),
        ),
    ];
    let mut table = Table::new(&[
        Column::Name("on held-out presses"),
        Column::Number("base model, recalibrated"),
        Column::Number("grown model"),
    ]);
    for (name, [base, grown]) in rows {
        table.row([name.to_owned(), or_dash(base), or_dash(grown)]);
    }
    writeln!(
        f,
        "<section>\n<h2>The gap before and after</h2>\n<figure>\n{}\n<figcaption>Root mean square of the residual on held-out presses, in \
         counts: from the base model to the grown one, with each effect in the order in which it was added and all else fitted \
         again.</figcaption>\n</figure>\n{table}\n<p class=\"lead\">The gap is the part of the residual beyond noise: the square root of the \
         difference of their mean squares. What is structured is not noise: among all held-out readings, or among those with a signal if more is \
         structured there. {}</p>\n</section>",
        staircase(found),
        found.final_.closed.map_or_else(String::new, |of_gap| format!(
            "{} of the base model's gap was closed, in mean squares.",
            words::closed(of_gap)
        ))
    )
}

fn unexplained(f: &mut fmt::Formatter<'_>, found: &Discovery) -> fmt::Result {
    writeln!(f, "<section>\n<h2>What stays unexplained</h2>")?;
    if found.verdict == Verdict::CannotJudge {
        writeln!(f, "<p>Unknown: these data do not tell it from noise.</p>")?;
    } else if found.unexplained.depends_on.is_empty() {
        writeln!(f, "<p>Nothing beyond noise is left that depends on any covariate examined.</p>")?;
    } else {
        writeln!(
            f,
            "<p class=\"warn\">What is left of the gap depends on {}, and no effect of the library explains it, so the grown model does \
             not contain it.</p>",
            Text(list(&found.unexplained.depends_on))
        )?;
        if !found.unexplained.gap.is_empty() {
            writeln!(f, "{}", gap::table_of(&found.unexplained.gap))?;
        }
    }
    writeln!(f, "</section>")
}
