//! The gap before and after, what stays unexplained, and what to measure next.

use std::fmt;

use tactus_discover::{Discovery, Level};

use super::{
    figures::levels,
    next,
    words::{list, percent},
};
use crate::{
    document::{Column, Table},
    markup::Text,
    numbers::digits,
};

pub(super) fn sections(f: &mut fmt::Formatter<'_>, found: &Discovery) -> fmt::Result {
    before_and_after(f, found)?;
    unexplained(f, found)?;
    next::section(f, found)
}

fn before_and_after(f: &mut fmt::Formatter<'_>, found: &Discovery) -> fmt::Result {
    let mut table = Table::new(&[
        Column::Name("on held-out presses"),
        Column::Number("residual / counts rms"),
        Column::Number("residual / noise"),
        Column::Number("\u{3c7}\u{b2} a reading"),
        Column::Number("gap / counts rms"),
        Column::Number("gap / noise"),
    ]);
    let noise = found.noise_rms_counts;
    let dash = || "\u{2013}".to_owned();
    let mut row = |name: &str, Level { heldout_rms_counts: rms, heldout_chi2 }: Level| {
        let gap = noise.map(|noise| (rms * rms - noise * noise).max(0.0).sqrt());
        let in_noise = |counts: Option<f64>| match (counts, noise) {
            (Some(counts), Some(noise)) => digits(counts / noise, 3),
            _ => dash(),
        };
        table.row([
            name.to_owned(),
            digits(rms, 3),
            in_noise(Some(rms)),
            digits(heldout_chi2, 3),
            gap.map_or_else(dash, |gap| digits(gap, 3)),
            in_noise(gap),
        ]);
    };
    row("base model, recalibrated", found.base);
    row("grown model", found.final_.level);
    writeln!(
        f,
        "<section>\n<h2>The gap before and after</h2>\n<figure>\n{}\n<figcaption>Root mean square of the residual on held-out presses, in \
         counts.</figcaption>\n</figure>\n{table}\n<p class=\"lead\">The gap is the part of the residual beyond noise: the square root of the \
         difference of their mean squares. {}</p>\n</section>",
        levels(found),
        found.final_.shrink.map_or_else(String::new, |share| format!(
            "{} of the base model's gap was closed, in mean squares.",
            percent(share)
        ))
    )
}

fn unexplained(f: &mut fmt::Formatter<'_>, found: &Discovery) -> fmt::Result {
    let share = percent(found.unexplained.share);
    writeln!(f, "<section>\n<h2>What stays unexplained</h2>")?;
    if found.unexplained.depends_on.is_empty() {
        writeln!(f, "<p>Nothing beyond noise is left that depends on any covariate examined.</p>")?;
    } else {
        writeln!(
            f,
            "<p class=\"warn\">{share} of the gap is left. It depends on {}, and no effect of the library explains it, so the grown model does \
             not contain it.</p>",
            Text(list(&found.unexplained.depends_on))
        )?;
    }
    writeln!(f, "</section>")
}
