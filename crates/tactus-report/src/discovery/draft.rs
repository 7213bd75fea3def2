//! The draft of what no effect of the library explains.

use std::fmt;

use tactus_discover::{BaseModel, DraftedEffect, NoDraft};
use tactus_model::effect::{Draft, Law};
use tactus_model::{Array, Covariate};
use tactus_schema::draft::{DraftStatus, stage_name};

use super::{
    DiscoveryReport,
    figures::{draft_curve, draft_weights},
    words,
};
use crate::{
    document::{Column, Table},
    markup::Text,
    numbers::digits,
};

/// What becomes of a draft before a new measurement.
pub fn status(found: &DraftedEffect) -> DraftStatus {
    if found.is_partial() { DraftStatus::Partial } else { DraftStatus::Drafted }
}

pub(super) fn section(f: &mut fmt::Formatter<'_>, report: &DiscoveryReport<'_>) -> fmt::Result {
    match &report.discovery.draft {
        None => Ok(()),
        Some(Err(none)) => no_draft(f, none),
        Some(Ok(draft)) => drafted(f, report, draft),
    }
}

fn no_draft(f: &mut fmt::Formatter<'_>, none: &NoDraft) -> fmt::Result {
    writeln!(f, "<section>\n<h2>Draft of an effect</h2>\n<p>None: {}.</p>\n</section>", Text(none.in_words()))
}

fn drafted(f: &mut fmt::Formatter<'_>, report: &DiscoveryReport<'_>, one: &DraftedEffect) -> fmt::Result {
    let draft = &one.draft;
    writeln!(
        f,
        "<section>\n<div class=\"headline\"><h2>Draft of an effect</h2><span class=\"badge warn\">{}</span></div>\n<p class=\"verdict\">{}.</p>\n\
         <p>No effect of the library explains what is left; this was drafted from the fitted presses. It is <code>{}</code> in \
         <code>model.toml</code> and a file of its own beside it. A new measurement confirms or refutes it; a person gives it a name.</p>",
        status(one).name(),
        Text(&draft.sentence),
        Text(&draft.name),
    )?;
    figures(f, report.array, draft, &one.knots)?;
    let mut table = Table::new(&[Column::Name("what"), Column::Name("value")]);
    let nearest = one.nearest.iter().enumerate().map(|(nth, (name, behind))| {
        let of = if nth == 0 { " in the logarithm of the odds" } else { "" };
        format!("{name} (behind by {}{of})", digits(*behind, 3))
    });
    let nearest: Vec<String> = nearest.collect();
    let noise = report.discovery.floor.rms_counts();
    let level = |counts: f64| words::level(counts, noise);
    let alike = if one.alike.is_empty() { "none".to_owned() } else { one.alike.join("; ") };
    let evidence = [
        ("probability by noise alone", words::probability(one.p_value)),
        ("logarithm of its odds", digits(one.ln_odds, 3)),
        ("nearest classes", nearest.join(", ")),
        ("drafts that these data cannot tell from it", alike),
        ("folds in which it comes first or as good", format!("{} of 5", one.folds)),
        ("held-out residual without it", level(one.heldout_rms_before_counts)),
        ("held-out residual with it", level(one.heldout_rms_after_counts)),
        ("closes of what was left", one.closed.map_or_else(|| "unknown".into(), words::closed)),
    ];
    for (what, value) in facts(draft, &one.base).into_iter().chain(evidence) {
        table.row([what.to_owned(), value]);
    }
    writeln!(f, "{table}\n</section>")
}

/// The curve of a draft, with its knots if they are known, and its weights.
pub(super) fn figures(
    f: &mut fmt::Formatter<'_>,
    array: &Array,
    draft: &Draft,
    knots: &[[f64; 3]],
) -> fmt::Result {
    if let Some(curve) = draft_curve(draft, knots) {
        let caption = match (&draft.law, knots.is_empty()) {
            (Law::Table { .. }, false) => "fitted knots with standard errors",
            (_, false) => "fitted knots with standard errors, and the law that passes through them",
            (Law::Table { .. }, true) => {
                "straight lines between its knots, for each knot of the second covariate"
            }
            (_, true) => "the fitted law",
        };
        writeln!(
            f,
            "<figure>\n{curve}\n<figcaption>The draft\u{2019}s curve: {caption}.</figcaption>\n</figure>"
        )?;
    }
    if let Some(weights) = draft_weights(array, draft) {
        writeln!(f, "<figure>\n{weights}\n<figcaption>Its weight for each element.</figcaption>\n</figure>")?;
    }
    Ok(())
}

/// What a draft acts on and by what.
pub(super) fn facts(draft: &Draft, base: &BaseModel) -> Vec<(&'static str, String)> {
    let covariates = draft.covariates.iter().zip(&draft.ranges);
    let covariates: Vec<String> =
        covariates.map(|(covariate, range)| covariate_range(*covariate, *range, base)).collect();
    let numbers: Vec<String> =
        draft.law.numbers().into_iter().map(|(name, value)| format!("{name} {}", digits(value, 3))).collect();
    let law = if numbers.is_empty() {
        draft.law.name().to_owned()
    } else {
        format!("{}: {}", draft.law.name(), numbers.join(", "))
    };
    vec![
        ("stage", stage_name(draft.stage()).to_owned()),
        ("carrier", format!("{} ({})", draft.carrier.name(), draft.carrier.unit())),
        ("acts", draft.when.name().to_owned()),
        ("depends on", covariates.join("; ")),
        ("law", law),
    ]
}

/// Such as `depth, 0.10 to 0.61 mm`. A draft sees signals in mm, before the sensitivity; the gap's table has them in counts.
fn covariate_range(covariate: Covariate, range: [f64; 2], base: &BaseModel) -> String {
    let [least, most] = words::ends(range);
    let told = format!("{}, {least} to {most} {}", covariate.name(), covariate.unit());
    if !(covariate.needs_signals() && covariate.unit() == "mm") {
        return told;
    }
    let of_elements = &base.response.sensitivity_counts_per_mm;
    let sensitivity = of_elements.iter().sum::<f64>() / of_elements.len() as f64;
    let [least, most] = words::ends(range.map(|end| sensitivity * end));
    format!("{told} (times the mean sensitivity: {least} to {most} counts)")
}
