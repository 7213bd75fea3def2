//! The effects that were added to the model.

use std::fmt;

use tactus_discover::{AddedEffect, Discovery, Estimated, FittedCurve, Inclusion};
use tactus_model::{Effect, effect::Definition};

use super::words::{self, either, list};
use super::{DiscoveryReport, draft, free_curve};
use crate::{
    document::{Column, Table},
    markup::Text,
    numbers::{digits, short, with_error},
};

/// A probability worth a line of its own.
const SAID_LEAST: f64 = 0.1;

pub(super) fn section(f: &mut fmt::Formatter<'_>, report: &DiscoveryReport<'_>) -> fmt::Result {
    let found = report.discovery;
    writeln!(f, "<section>\n<h2>What was added</h2>")?;
    if found.steps.is_empty() {
        writeln!(f, "<p>Nothing.</p>")?;
    }
    for step in &found.steps {
        self::step(f, step, report)?;
    }
    let mut known: Vec<&str> = found.effects.iter().map(Effect::name).collect();
    known.retain(|name| found.steps.iter().all(|step| step.effect != *name));
    known.dedup();
    if !known.is_empty() {
        writeln!(f, "<p>Already in the model, and fitted again with the rest: {}.</p>", Text(list(known)))?;
    }
    inclusions(f, found)?;
    writeln!(f, "</section>")
}

/// How probable each effect is.
fn inclusions(f: &mut fmt::Formatter<'_>, found: &Discovery) -> fmt::Result {
    let is_likely = |one: &&Inclusion| {
        one.probability >= SAID_LEAST || found.steps.iter().any(|step| step.effect == one.effect)
    };
    let (likely, other): (Vec<&Inclusion>, Vec<&Inclusion>) = found.inclusions.iter().partition(is_likely);
    if found.inclusions.is_empty() {
        return Ok(());
    }
    writeln!(f, "<h3>How probable each effect is</h3>")?;
    if !likely.is_empty() {
        let mut table = Table::new(&[Column::Name("effect"), Column::Number("probability")]);
        for Inclusion { effect, probability } in likely {
            table.row([(*effect).to_owned(), words::percent(*probability)]);
        }
        writeln!(f, "{table}")?;
    }
    let most = other.iter().map(|one| one.probability).fold(0.0, f64::max);
    if !other.is_empty() {
        writeln!(
            f,
            "<p>Of the other {} effects that these data can show, each has at most {}; before the data each effect had a probability of 5 %.</p>",
            other.len(),
            words::percent(most)
        )?;
    }
    Ok(())
}

fn step(f: &mut fmt::Formatter<'_>, step: &AddedEffect, report: &DiscoveryReport<'_>) -> fmt::Result {
    let definition = words::definition(report.discovery, step);
    let summary = definition.map_or("", |definition| definition.summary);
    writeln!(f, "<h3>{}</h3>\n<p>{}.</p>", Text(step.effect), Text(capital(summary)))?;
    parameters(f, step, definition)?;
    for flag in words::flags(report.discovery, step) {
        writeln!(f, "<p class=\"warn\">{}</p>", Text(flag))?;
    }
    step.curves.iter().try_for_each(|curve| self::curve(f, step.effect, curve))?;
    if let Some(draft) = definition.and_then(Definition::draft) {
        draft::figures(f, report.array, draft, &[])?;
        let mut table = Table::new(&[Column::Name("what"), Column::Name("value")]);
        for (what, value) in draft::facts(draft, &report.discovery.grown) {
            table.row([what.to_owned(), value]);
        }
        writeln!(f, "{table}")?;
    }
    writeln!(
        f,
        "<p>On held-out presses the residual is {} counts rms without it (all else fitted again) and {} with it. The probability of such a \
         gain by noise alone is {} (false-discovery rate {} over all added effects). {}</p>",
        digits(step.heldout_rms_before_counts, 3),
        digits(step.heldout_rms_after_counts, 3),
        words::probability(step.p_value),
        words::probability(step.q_value),
        by_folds(step.folds_p_value)
    )?;
    if step.equivalent.is_empty() {
        return writeln!(f, "<p>The data distinguish it from every other effect that they can show.</p>");
    }
    let which = if step.equivalent.len() == 1 { "which explains" } else { "each of which explains" };
    writeln!(
        f,
        "<p class=\"warn\">These data cannot distinguish it from {}, {which} the fitted presses nearly as well. Any of them may be the cause; \
         the model contains this one as one possible description.</p>",
        Text(either(&step.equivalent))
    )
}

/// What fitted presses say that the fit has not seen.
fn by_folds(p_value: Option<f64>) -> String {
    let Some(p_value) = p_value else {
        return "On fitted presses it is not tested: beside a random walk none is predicted by a fit to others. Its odds alone confirm it."
            .into();
    };
    format!(
        "On fitted presses, each predicted by a fit to others, it is {}: this decides whether the effect is confirmed.",
        words::probability(p_value)
    )
}

/// The parameters of each term with their possible ranges.
fn parameters(
    f: &mut fmt::Formatter<'_>,
    step: &AddedEffect,
    definition: Option<&Definition>,
) -> fmt::Result {
    let mut nth = 0;
    // Terms of one effect may have different parameters.
    for terms in step.terms.chunk_by(|one, other| names(one).eq(names(other))) {
        let parameters = terms.first().map_or(&[][..], Vec::as_slice);
        if parameters.is_empty() {
            continue;
        }
        let columns: Vec<Column> =
            [Column::Name("")].into_iter().chain(names(parameters).map(Column::Number)).collect();
        let mut table = Table::new(&columns);
        for term in terms {
            nth += 1;
            let name = if step.terms.len() > 1 { format!("found, {nth}") } else { "found".into() };
            table.row([name].into_iter().chain(term.iter().map(value)));
        }
        if let Some(definition) = definition {
            let range = |found: &Estimated| range(definition, found);
            table.row(["possible range".to_owned()].into_iter().chain(parameters.iter().map(range)));
        }
        writeln!(f, "{table}")?;
    }
    Ok(())
}

/// A free curve in place of a formula, or a parameter's table, in a table and a figure.
fn curve(f: &mut fmt::Formatter<'_>, effect: &str, curve: &FittedCurve) -> fmt::Result {
    let (at, of) = (curve.at, curve.of);
    if let Some(formula) = &curve.formula {
        writeln!(
            f,
            "<p>The fitted presses refute its formula, so the model has a free curve through knots in its place. With the formula the residual \
             on held-out presses would be {} counts rms.</p>",
            digits(formula.heldout_rms_counts, 3)
        )?;
    } else if curve.is_table() {
        writeln!(
            f,
            "<p>No one value of <code>{}</code> describes the presses: it differs with <code>{}</code>.</p>",
            Text(of),
            Text(at)
        )?;
    } else {
        writeln!(f, "<p>A free curve through knots describes it better than its formula.</p>")?;
    }
    let by_formula = curve.formula.iter().map(|_| Column::Number("by the formula"));
    let columns: Vec<Column> =
        [Column::Number(at), Column::Number(of)].into_iter().chain(by_formula).collect();
    let mut table = Table::new(&columns);
    for (nth, knot) in curve.knots.iter().enumerate() {
        let value = match knot.standard_error {
            Some(error) => with_error(knot.value, error),
            None => short(knot.value, 6),
        };
        let by_formula = curve.formula.iter().map(|formula| short(formula.values[nth], 4));
        table.row([short(knot.at, 4), value].into_iter().chain(by_formula));
    }
    writeln!(f, "{table}\n{}", free_curve(effect, curve))
}

fn names(term: &[Estimated]) -> impl Iterator<Item = &'static str> {
    term.iter().map(|parameter| parameter.name)
}

fn value(parameter: &Estimated) -> String {
    match parameter.standard_error {
        Some(error) => with_error(parameter.value, error),
        None => short(parameter.value, 6),
    }
}

/// The possible range of an estimated parameter.
fn range(definition: &Definition, found: &Estimated) -> String {
    let parameter = definition.parameters.iter().find(|parameter| parameter.name == found.name);
    match parameter.filter(|_| found.standard_error.is_some()) {
        Some(parameter) if parameter.is_counts() => parameter.range_in_words(),
        Some(parameter) => parameter.range.map(|end| short(end, 6)).join(" to "),
        None => String::new(),
    }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
