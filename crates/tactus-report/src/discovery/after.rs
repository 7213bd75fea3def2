//! The gap before and after, what stays unexplained, and what to measure next.

use std::fmt;

use tactus_discover::{Discovery, Level, Structured, Verdict};

use super::{DiscoveryReport, draft, figures::staircase, gap, next, words};
use crate::{
    document::{Column, Table},
    markup::Text,
    numbers::digits,
};

/// A structured residual that is certainly below this does not count.
const HALF_NOISE: f64 = 0.5;
/// Columns of the table of levels.
const LEVELS: [Column; 3] = [
    Column::Name("on held-out presses"),
    Column::Number("base model, recalibrated"),
    Column::Number("grown model"),
];
/// The same where there is a draft.
const LEVELS_WITH_DRAFT: [Column; 4] = [
    Column::Name("on held-out presses"),
    Column::Number("base model, recalibrated"),
    Column::Number("grown model without the draft"),
    Column::Number("with the draft"),
];

pub(super) fn sections(f: &mut fmt::Formatter<'_>, report: &DiscoveryReport<'_>) -> fmt::Result {
    let found = report.discovery;
    before_and_after(f, found)?;
    unexplained(f, found)?;
    draft::section(f, report)?;
    next::section(f, found)
}

fn before_and_after(f: &mut fmt::Formatter<'_>, found: &Discovery) -> fmt::Result {
    writeln!(
        f,
        "<section>\n<h2>The gap before and after</h2>\n<figure>\n{}\n<figcaption>Root mean square of the residual on held-out presses, in \
         counts: from the base model to the grown one, with each effect in the order in which it was added and all else fitted \
         again.</figcaption>\n</figure>\n{}\n<p class=\"lead\">The gap is the part of the residual beyond noise: the square root of the \
         difference of their mean squares. What is structured is not noise: among all held-out readings, or among those with a signal if more is \
         structured there. {}</p>\n</section>",
        staircase(found),
        levels(found),
        found.final_.closed.map_or_else(String::new, |of_gap| format!(
            "The {} closes {} of the base model's gap. The share is the fall of the mean square, divided by the sum of that \
             fall and what lasts in the residual.",
            words::grown_model(found),
            words::closed(of_gap)
        ))
    )
}

/// The residuals of the base model, the grown one, and that with the draft, if there is one.
fn levels(found: &Discovery) -> Table<'static> {
    let noise = found.floor.rms_counts();
    let or_dash = |value: Option<f64>| {
        value.map_or_else(
            || "\u{2013}".to_owned(),
            |value| if value.is_finite() { digits(value, 3) } else { "unknown".into() },
        )
    };
    let gap = |level: &Level| {
        let rms = level.heldout_rms_counts;
        noise.map(|noise| (rms * rms - noise * noise).max(0.0).sqrt())
    };
    let in_noise = |counts: Option<f64>| counts.zip(noise).map(|(counts, noise)| counts / noise);
    let structured = |level: &Level, of: fn(Structured) -> f64| level.structured.map(of);
    let mut levels = vec![found.base, found.final_.level];
    if let Some(Ok(draft)) = &found.draft {
        let heldout_rms_counts = draft.heldout_rms_after_counts;
        let heldout_chi2 = noise.map(|noise| (heldout_rms_counts / noise).powi(2));
        levels.push(Level { heldout_rms_counts, heldout_chi2, structured: None });
    }
    let each = |of: &dyn Fn(&Level) -> Option<f64>| levels.iter().map(of).collect::<Vec<_>>();
    let rows = [
        ("residual / counts rms", each(&|level| Some(level.heldout_rms_counts))),
        ("residual / noise", each(&|level| in_noise(Some(level.heldout_rms_counts)))),
        ("its variance / counts\u{b2}", each(&|level| Some(level.heldout_rms_counts.powi(2)))),
        ("its variance / noise\u{b2}", each(&|level| level.heldout_chi2)),
        ("gap / counts rms", each(&gap)),
        ("gap / noise", each(&|level| in_noise(gap(level)))),
        ("structured / noise", each(&|level| structured(level, |part| part.rms_noise))),
        ("structured at most (95 %) / noise", each(&|level| structured(level, |part| part.upper_noise))),
    ];
    let mut table = Table::new(if levels.len() < 3 { &LEVELS[..] } else { &LEVELS_WITH_DRAFT });
    for (name, values) in rows {
        table.row([name.to_owned()].into_iter().chain(values.into_iter().map(or_dash)));
    }
    table
}

fn unexplained(f: &mut fmt::Formatter<'_>, found: &Discovery) -> fmt::Result {
    writeln!(f, "<section>\n<h2>What stays unexplained</h2>")?;
    if found.verdict == Verdict::CannotJudge {
        writeln!(f, "<p>Unknown: these data do not tell it from noise.</p>")?;
    } else if found.unexplained.depends_on.is_empty() {
        writeln!(f, "<p>Nothing beyond noise is left that depends on any covariate examined.</p>")?;
    } else {
        let on = words::depends_on(found);
        if found.verdict == Verdict::Explained {
            let below = small(found);
            writeln!(
                f,
                "<p>What is left is seen, but certainly below {below}; it does not count. It depends on {}.</p>",
                Text(on)
            )?;
        } else {
            writeln!(
                f,
                "<p class=\"warn\">What is left of the gap depends on {}, and no effect of the library explains it, so the {} \
                 does not contain it.</p>",
                Text(on),
                words::grown_model(found)
            )?;
        }
        if !found.unexplained.gap.is_empty() {
            writeln!(f, "{}", gap::table_of(&found.unexplained.gap))?;
        }
    }
    writeln!(f, "</section>")
}

/// What the structured residual of an explained gap is certainly below.
fn small(found: &Discovery) -> &'static str {
    match found.final_.level.structured {
        Some(part) if part.upper_noise < HALF_NOISE => "half the noise",
        Some(_) if found.tolerance_counts.is_some() => "the tolerance that was declared beforehand",
        _ => "twice the noise",
    }
}
