//! The gap before and after, what stays unexplained, and what to measure next.

use std::fmt;

use tactus_discover::{Discovery, Level, Verdict};

use super::{
    DiscoveryReport, draft,
    figures::staircase,
    gap, next,
    words::{list, percent},
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
    let mut table = Table::new(&[
        Column::Name("on held-out presses"),
        Column::Number("residual / counts rms"),
        Column::Number("residual / noise"),
        Column::Number("variance / counts\u{b2}"),
        Column::Number("variance / noise\u{b2}"),
        Column::Number("gap / counts rms"),
        Column::Number("gap / noise"),
        Column::Number("structured / noise"),
        Column::Number("at most (95 %)"),
    ]);
    let noise = found.floor.rms_counts();
    let or_dash = |value: Option<f64>| {
        value.map_or_else(
            || "\u{2013}".to_owned(),
            |value| if value.is_finite() { digits(value, 3) } else { "unknown".into() },
        )
    };
    let mut row = |name: &str, level: Level| {
        let rms = level.heldout_rms_counts;
        let gap = noise.map(|noise| (rms * rms - noise * noise).max(0.0).sqrt());
        table.row([
            name.to_owned(),
            digits(rms, 3),
            or_dash(noise.map(|noise| rms / noise)),
            digits(rms * rms, 3),
            or_dash(level.heldout_chi2),
            or_dash(gap),
            or_dash(gap.zip(noise).map(|(gap, noise)| gap / noise)),
            or_dash(level.structured.map(|part| part.rms_noise)),
            or_dash(level.structured.map(|part| part.upper_noise)),
        ]);
    };
    row("base model, recalibrated", found.base);
    row("grown model", found.final_.level);
    writeln!(
        f,
        "<section>\n<h2>The gap before and after</h2>\n<figure>\n{}\n<figcaption>Root mean square of the residual on held-out presses, in \
         counts: from the base model to the grown one, with each effect in the order in which it was added and all else fitted \
         again.</figcaption>\n</figure>\n{table}\n<p class=\"lead\">The gap is the part of the residual beyond noise: the square root of the \
         difference of their mean squares. What is structured is not noise: among all held-out readings, or among those with a signal if more is \
         structured there. {}</p>\n</section>",
        staircase(found),
        found.final_.shrink.map_or_else(String::new, |share| format!(
            "{} of the base model's gap was closed, in mean squares.",
            percent(share)
        ))
    )
}

fn unexplained(f: &mut fmt::Formatter<'_>, found: &Discovery) -> fmt::Result {
    let share = percent(found.unexplained.share);
    writeln!(f, "<section>\n<h2>What stays unexplained</h2>")?;
    if found.verdict == Verdict::CannotJudge {
        writeln!(f, "<p>Unknown: these data do not tell it from noise.</p>")?;
    } else if found.unexplained.depends_on.is_empty() {
        writeln!(f, "<p>Nothing beyond noise is left that depends on any covariate examined.</p>")?;
    } else {
        writeln!(
            f,
            "<p class=\"warn\">{share} of the gap is left. It depends on {}, and no effect of the library explains it, so the grown model does \
             not contain it.</p>",
            Text(list(&found.unexplained.depends_on))
        )?;
        if !found.unexplained.gap.is_empty() {
            writeln!(f, "{}", gap::table_of(&found.unexplained.gap))?;
        }
    }
    writeln!(f, "</section>")
}
