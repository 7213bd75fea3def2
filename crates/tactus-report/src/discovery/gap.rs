//! Covariates and elements at which model and data disagree.

use std::fmt;

use tactus_discover::{Discovery, ElementGap, Gap};

use super::{DiscoveryReport, element_maps, residual_against, words};
use crate::{
    document::{Column, Table},
    numbers::{digits, probability},
};

/// Columns of a gap's table.
const COLUMNS: [Column; 6] = [
    Column::Name("the residual depends on"),
    Column::Number("largest from"),
    Column::Number("to"),
    Column::Name(""),
    Column::Number("size / noise"),
    Column::Number("q"),
];

pub(super) fn section(f: &mut fmt::Formatter<'_>, report: &DiscoveryReport<'_>) -> fmt::Result {
    let found = report.discovery;
    writeln!(
        f,
        "<section>\n<h2>Where the gap is</h2>\n<p class=\"lead\">The residual is the measurement minus the model's prediction. The base model is first \
         fitted to the data again (gains, zeros, spread), so that an error in these is not \
         taken for an effect.</p>"
    )?;
    table(f, found)?;
    if !found.curves.is_empty() {
        writeln!(
            f,
            "<h3>The residual against each covariate</h3>\n<p class=\"lead\">Means over nearby frames with their standard errors, for the recalibrated base model and for \
             the {}, if there is one. If a model is right, its residual is noise about zero.</p>\n<div class=\"multiples\">",
            words::grown_model(found)
        )?;
        for curve in &found.curves {
            writeln!(f, "{}", residual_against(curve))?;
        }
        writeln!(f, "</div>")?;
    }
    if !found.elements.is_empty() {
        let unit = if found.floor.rms_counts().is_some() { "units of the noise" } else { "counts" };
        writeln!(
            f,
            "<h3>The residual of each element</h3>\n<figure>\n{}\n<figcaption>Root mean square on held-out presses in {unit}, on one scale; the \
             array from above, row 0 at the bottom.{}</figcaption>\n</figure>",
            element_maps(report.array, &found.elements, found.floor.rms_counts()),
            brightest(found)
        )?;
    }
    writeln!(f, "</section>")
}

/// The elements with the largest residuals, before and after.
fn brightest(found: &Discovery) -> String {
    let noise = found.floor.rms_counts();
    let most = |of: fn(&ElementGap) -> f64| {
        let known = found.elements.iter().map(of).enumerate().filter(|(_, rms)| rms.is_finite());
        known.max_by(|a, b| a.1.total_cmp(&b.1))
    };
    let Some((element, rms)) = most(|gap| gap.before_rms_counts) else { return String::new() };
    let before = format!(" The largest is that of element {element}, {}", words::level(rms, noise));
    match most(|gap| gap.after_rms_counts) {
        Some((_, after)) if after.to_bits() == rms.to_bits() => format!("{before}."),
        Some((other, after)) => {
            let (grown, level) = (words::grown_model(found), words::level(after, noise));
            format!("{before}; with the {grown} that of element {other}, {level}.")
        }
        None => format!("{before}."),
    }
}

fn table(f: &mut fmt::Formatter<'_>, found: &Discovery) -> fmt::Result {
    let Some(global) = found.global else {
        return writeln!(
            f,
            "<p>Nothing was tested: without a noise floor, no size of a residual means anything.</p>"
        );
    };
    writeln!(
        f,
        "<p>Is there structure beyond noise? The largest standardised score is {}. The probability of a larger one in data whose residuals \
         have randomly flipped signs, block by block, is {}.</p>",
        digits(global.statistic, 3),
        words::probability(global.p_value)
    )?;
    if found.gap.is_empty() {
        return writeln!(f, "<p>The residual depends on no covariate examined.</p>");
    }
    writeln!(
        f,
        "{}\n<p class=\"lead\">Size: root mean square of the dependence in units of the noise of one reading. q: the false-discovery \
         rate if all rows down to this one are accepted.</p>",
        table_of(&found.gap)
    )
}

/// On what a residual depends, such as `element and depth (element 17)`.
pub fn gap_in_words(gap: &Gap) -> String {
    let element = gap.element.map_or_else(String::new, |element| format!(" (element {element})"));
    format!("{}{element}", gap.covariate)
}

/// On what a residual depends, and where it is largest.
pub(super) fn table_of(gap: &[Gap]) -> Table<'static> {
    let mut table = Table::new(&COLUMNS);
    for gap in gap {
        let [from, to] = words::ends(gap.range);
        let size = digits(gap.effect_size, 3);
        table.row([gap_in_words(gap).as_str(), &from, &to, gap.unit, &size, &probability(gap.q_value)]);
    }
    table
}
