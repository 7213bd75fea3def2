//! Terminal output of a discovery.

use std::path::{Path, PathBuf};

use tactus_calibrate::Estimate;
use tactus_discover::{AddedEffect, Discovery, DraftedEffect, Estimated, FittedCurve, Level};
use tactus_model::effect::Definition;
use tactus_report::discovery::{
    AmbiguousEffect, DiscoveryReport, Proposal, closed, command, definition, draft_status, flags,
    gap_in_words, in_words, not_proposed, not_shown, proposals,
};

use crate::commands::calibrate::{estimate, faulty};
use crate::output::{duration, print_fields, print_table, say, say_next};

/// Parameters of one term that fit on a line.
const PARAMETERS_MAX: usize = 6;

pub(super) fn discovered(report: &DiscoveryReport<'_>, paths: &[PathBuf]) {
    let found = report.discovery;
    for (reason, effects) in not_shown(found) {
        say(&format!("not detectable: {}: {reason}", effects.join(", ")));
    }
    for warning in report.notes.iter().chain(&found.warnings) {
        say(&format!("warning: {warning}"));
    }
    for fault in &found.faulty {
        say(&format!("faulty: {}: {}", faulty(fault), fault.evidence));
    }
    say("");
    facts(report);
    if !found.gap.is_empty() {
        say("");
        let rows = found.gap.iter().map(|gap| {
            let [from, to] = gap.range;
            let range = format!("{from:.3} to {to:.3} {}", gap.unit);
            vec![gap_in_words(gap), range, format!("{:.2}", gap.effect_size), probability(gap.q_value)]
        });
        print_table(&["depends on", "most in", "in noise units", "q"], &rows.collect::<Vec<_>>());
    }
    if !found.steps.is_empty() {
        say("");
        let rows: Vec<Vec<String>> = found.steps.iter().flat_map(step).collect();
        print_table(&["added", "parameters", "held-out counts rms", "q", "indistinguishable from"], &rows);
        for sentence in found.steps.iter().flat_map(|step| about(found, step)) {
            say(&sentence);
        }
    }
    say("");
    say(&in_words(found));
    match &found.draft {
        Some(Ok(draft)) => say(&drafted(draft)),
        Some(Err(none)) => say(&format!("No effect was drafted of what is left: {}.", none.in_words())),
        None => {}
    }
    for run in report.active {
        let [before, after] = [&run.before, &run.after].map(|undecided| AmbiguousEffect::in_words(undecided));
        say(&format!("{}: {before} -> {after}", command(&run.experiment, &run.parameters)));
    }
    say("");
    let proposals = proposals(found);
    for Proposal { command, duration_s, decides } in proposals {
        say(&format!("next: {command}  ({})\n      {decides}", duration(duration_s)));
    }
    for sentence in not_proposed(found) {
        say(&sentence);
    }
    say("");
    for path in paths {
        say(&path.display().to_string());
    }
    let file = |name: &str| paths.iter().find(|path| path.ends_with(name));
    if let Some(Ok(drafted)) = &found.draft {
        let draft = &drafted.draft;
        let path =
            file(&format!("{}.toml", draft.name)).map_or_else(String::new, |path| path.display().to_string());
        say_next(&format!(
            "`tactus discover FILES --active` measures {} anew, then `tactus effects add {path}`",
            draft.name
        ));
    } else if let Some(draft) = paths.iter().find(|path| holds(path)) {
        say_next(&format!("`tactus effects add {}` lets every discovery try the draft", draft.display()));
    } else if let Some(model) = file("model.toml") {
        say_next(&format!("`tactus simulate --model {}` shows an image of this sensor", model.display()));
    }
}

/// True of the file of a draft that was not refuted.
fn holds(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.starts_with("draft-") && !name.ends_with("-refuted.toml")
}

fn facts(report: &DiscoveryReport<'_>) {
    let found = report.discovery;
    let split = &found.split;
    let noise = found.floor.rms_counts();
    let level = |level: Level| {
        let counts = level.heldout_rms_counts;
        let said = format!("{counts:.3} counts rms held out (variance {:.3})", counts * counts);
        match noise.zip(level.heldout_chi2) {
            Some((noise, chi2)) => {
                format!("{said}, {:.2} times the noise (variance {chi2:.2})", counts / noise)
            }
            None => said,
        }
    };
    let structured = found.final_.level.structured.map_or_else(
        || "unknown".to_owned(),
        |part| {
            let among = if part.with_signal { "readings with a signal" } else { "all readings" };
            let upper = if part.upper_noise.is_finite() {
                format!("at most {:.2} (95 %)", part.upper_noise)
            } else {
                "without a bound: too few presses are held out".to_owned()
            };
            format!("{:.2} times the noise, {upper}, of {among}", part.rms_noise)
        },
    );
    print_fields(&[
        ("rig", format!("{}{}", report.rig, if report.simulated { " (SIMULATED)" } else { "" })),
        (
            "read",
            format!(
                "{} runs, {} frames; {} presses fitted, {} held out",
                report.data.len(),
                split.frames,
                split.train_presses,
                split.heldout_presses
            ),
        ),
        (
            "noise",
            noise.map_or_else(
                || "unknown: nothing repeats".into(),
                |rms| format!("{rms:.3} counts rms, from {}", found.floor.source()),
            ),
        ),
        (
            "tolerance",
            found.tolerance_counts.map_or_else(
                || "none declared".into(),
                |counts| format!("{counts} counts rms, declared beforehand"),
            ),
        ),
        ("before", level(found.base)),
        ("after", level(found.final_.level)),
        ("not noise", structured),
    ]);
}

/// One line per term; the first also has the values of the whole step.
fn step(step: &AddedEffect) -> Vec<Vec<String>> {
    let of_step = |nth: usize, text: String| if nth == 0 { text } else { String::new() };
    let rows = step.terms.iter().enumerate().map(|(nth, term)| {
        let (before, after) = (step.heldout_rms_before_counts, step.heldout_rms_after_counts);
        vec![
            of_step(nth, step.effect.into()),
            with_curves(parameters(term), if nth == 0 { &step.curves } else { &[] }),
            of_step(nth, format!("{before:.3} -> {after:.3}")),
            of_step(nth, probability(step.q_value)),
            of_step(nth, step.equivalent.join(", ")),
        ]
    });
    rows.collect()
}

/// What stands under the table of an added effect: a draft's sentence, and the parameters that are not to be trusted.
fn about(found: &Discovery, step: &AddedEffect) -> Vec<String> {
    let draft = definition(found, step).and_then(Definition::draft);
    let sentence = draft.map(|draft| format!("{}.", draft.sentence));
    sentence.into_iter().chain(flags(found, step)).map(|said| format!("{}: {said}", step.effect)).collect()
}

/// The parameters of a term; only the first of a long curve.
fn parameters(term: &[Estimated]) -> String {
    let mut said: Vec<String> = term.iter().take(PARAMETERS_MAX).map(parameter).collect();
    if term.len() > PARAMETERS_MAX {
        said.push(format!("and {} more in report.json", term.len() - PARAMETERS_MAX));
    }
    said.join(", ")
}

/// Parameters, and the names of free curves and tables.
fn with_curves(parameters: String, curves: &[FittedCurve]) -> String {
    let curve = |curve: &FittedCurve| {
        if curve.is_table() {
            format!("{} as a table of {}", curve.of, curve.at)
        } else {
            format!("{} through knots", curve.of)
        }
    };
    let parameters = [parameters].into_iter().filter(|parameters| !parameters.is_empty());
    parameters.chain(curves.iter().map(curve)).collect::<Vec<_>>().join(", ")
}

fn parameter(parameter: &Estimated) -> String {
    let Estimated { name, value, standard_error } = *parameter;
    match standard_error {
        Some(standard_error) => format!("{name} {}", estimate(Estimate { value, standard_error })),
        None => format!("{name} {}", four_digits(value)),
    }
}

/// A whole number as it is, another one with four significant digits.
fn four_digits(value: f64) -> String {
    if value.fract() == 0.0 {
        return value.to_string();
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
    let decimals = (3.0 - value.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.decimals$}")
}

fn probability(value: f64) -> String {
    if value < 1e-4 { "< 0.0001".into() } else { format!("{value:.4}") }
}

/// A draft in two sentences.
fn drafted(found: &DraftedEffect) -> String {
    let closes = found.closed.map_or_else(
        || "Nothing is left on held-out presses".to_owned(),
        |of_left| format!("On held-out presses it closes {} of what was left", closed(of_left)),
    );
    let DraftedEffect { draft, .. } = found;
    format!("Drafted {} ({}): {}. {closes}.", draft.name, draft_status(found).name(), draft.sentence)
}

#[cfg(test)]
#[path = "print_tests.rs"]
mod tests;
