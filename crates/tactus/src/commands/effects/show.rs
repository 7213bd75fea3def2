//! `effects show`: an effect of the library, or a draft with what speaks for it.

use std::fs;
use std::path::Path;

use anyhow::Context;
use serde_json::{Value, json};
use tactus_model::effect::{Definition, Draft, Law, REGISTRY};
use tactus_report::discovery::draft_picture;
use tactus_schema::DraftFile;
use tactus_schema::draft::{DraftStatus, stage_name};

use crate::cli::Common;
use crate::commands::library::{Held, Library, version};
use crate::exit::{Exit, Failure};
use crate::output::{print_fields, say, say_next};

pub(super) fn show(
    common: &Common,
    library: &Library,
    name: &str,
    figure: Option<&Path>,
) -> anyhow::Result<()> {
    let held = library.held.iter().find(|one| one.draft.draft.name == name);
    let known = REGISTRY.iter().copied().find(|known| known.name == name);
    if let Some(path) = figure {
        draw(held, name, path)?;
    }
    match (held, known) {
        (Some(one), _) if common.json => {
            let mut object = of_draft(one);
            if let Some(path) = figure {
                object["figure"] = json!(path);
            }
            say(&object.to_string());
        }
        (Some(one), _) => {
            show_draft(one, figure);
        }
        (None, Some(known)) if common.json => say(&of_library(known).to_string()),
        (None, Some(known)) => show_known(known),
        (None, None) => return Err(unknown(library, name).into()),
    }
    Ok(())
}

/// There is no effect of this name.
fn unknown(library: &Library, name: &str) -> Failure {
    let known: Vec<&str> = REGISTRY.iter().map(|known| known.name).collect();
    let own: Vec<&str> = library.held.iter().map(|one| one.draft.draft.name.as_str()).collect();
    let own = if own.is_empty() { "none".to_owned() } else { own.join(", ") };
    let what =
        format!("no effect {name:?}; the library has {}; of the lab's own there is: {own}", known.join(", "));
    Failure::new(Exit::Usage, what)
}

fn show_known(known: &Definition) {
    let parameters = known.parameters.iter().map(|one| format!("{} ({})", one.name, one.range_in_words()));
    print_fields(&[
        ("effect", known.name.to_owned()),
        ("what it is", known.summary.to_owned()),
        ("stage", stage_name(known.stage()).to_owned()),
        ("parameters", parameters.collect::<Vec<_>>().join(", ")),
        ("acts by", acts_by(known).join(", ")),
        ("near twins", known.near_twins.join(", ")),
        ("shown by", known.shown_by.join(", ")),
    ]);
    say("");
    say_next(&format!(
        "`tactus run diagnose` measures what may show it, `tactus discover RUNS` looks for it; equation, units and source: \
         docs/book/reference/effects.md#{}",
        known.name
    ));
}

/// Draws the curve of a draft.
fn draw(held: Option<&Held>, name: &str, path: &Path) -> anyhow::Result<()> {
    let picture = held.and_then(|one| draft_picture(&one.draft.draft));
    let picture = picture.ok_or_else(|| {
        Failure::new(
            Exit::Usage,
            format!("{name} has no curve to draw: only drafts that depend on something have"),
        )
    })?;
    fs::write(path, picture.to_string()).with_context(|| format!("{} cannot be written", path.display()))
}

fn show_draft(one: &Held, figure: Option<&Path>) {
    let DraftFile { draft, status, nearest, evidence, confirmation, .. } = &one.draft;
    let mut fields = vec![
        ("effect", draft.name.clone()),
        ("what it is", draft.sentence.clone()),
        ("status", format!("{}: {}", status.name(), status.meaning())),
        ("file", one.path.display().to_string()),
        ("version", version(draft).unwrap_or_default()),
        ("stage", stage_name(draft.stage()).to_owned()),
        ("carrier", format!("{} ({})", draft.carrier.name(), draft.carrier.unit())),
        ("acts", draft.when.name().to_owned()),
        ("depends on", covariates(draft).join("; ")),
        ("law", law(draft)),
    ];
    let nearest = nearest
        .iter()
        .map(|one| format!("{} (by {:.0} in the logarithm of the odds)", one.class, one.ln_odds_behind));
    fields.push(("nearest", nearest.collect::<Vec<_>>().join(", ")));
    let closes = |share: &Option<f64>| {
        share.map_or_else(|| "nothing was left".to_owned(), |share| format!("closes {:.0} %", 100.0 * share))
    };
    if let Some(seen) = evidence {
        let runs: Vec<&str> = seen.data.keys().map(String::as_str).collect();
        fields.push(("drafted from", format!("{}; {}", runs.join(", "), closes(&seen.closed_share))));
    }
    if let Some(told) = confirmation {
        let runs: Vec<&str> = told.data.keys().map(String::as_str).collect();
        let strength = format!("strength {:.3}", told.strength);
        fields.push((
            "measured anew",
            format!("{}; {strength}; {}", runs.join(", "), closes(&told.closed_share)),
        ));
    }
    if let Some(path) = figure {
        fields.push(("figure", path.display().to_string()));
    }
    print_fields(&fields);
    say("");
    let name = &draft.name;
    match status {
        DraftStatus::Drafted | DraftStatus::Partial => say_next(&format!(
            "`tactus effects confirm {name} RECORDING` measures it anew; `tactus discover RUNS` tries it, and \
             `tactus effects retire {name}` ends that"
        )),
        DraftStatus::Confirmed => {
            say_next(&format!("`tactus discover RUNS` tries it, `tactus effects retire {name}` ends that"));
        }
        DraftStatus::Refuted => {
            say_next(&format!("`tactus effects confirm {name} RECORDING` measures it once more"));
        }
        DraftStatus::Retired => say_next(&format!("`tactus effects use {name}` takes it back")),
    }
}

fn covariates(draft: &Draft) -> Vec<String> {
    let ranges = draft.covariates.iter().zip(&draft.ranges);
    let range = ranges.map(|(covariate, [least, most])| {
        format!("{}, {least:.3} to {most:.3} {}", covariate.name(), covariate.unit())
    });
    range.collect()
}

fn law(draft: &Draft) -> String {
    if let Law::Table { values, .. } = &draft.law {
        return format!("a table of {} values", values.len());
    }
    let numbers = draft.law.numbers().into_iter().map(|(name, value)| format!("{name} {value:.4}"));
    format!("{}: {}", draft.law.name(), numbers.collect::<Vec<_>>().join(", "))
}

/// Covariates by which an effect of the library shows.
fn acts_by(known: &Definition) -> Vec<&'static str> {
    known.acts_by.iter().map(|covariate| covariate.name()).collect()
}

pub(super) fn of_library(known: &Definition) -> Value {
    json!({
        "name": known.name,
        "status": "library",
        "stage": stage_name(known.stage()),
        "summary": known.summary,
        "parameters": known.parameters.iter().map(|one| {
            let range = (!one.is_counts()).then_some(one.range);
            json!({ "name": one.name, "range": range })
        }).collect::<Vec<_>>(),
        "acts_by": acts_by(known),
        "near_twins": known.near_twins,
        "shown_by": known.shown_by,
    })
}

pub(super) fn of_draft(one: &Held) -> Value {
    let DraftFile { draft, status, was, covariance, nearest, evidence, confirmation } = &one.draft;
    let covariates = draft.covariates.iter().zip(&draft.ranges);
    let covariates = covariates.map(
        |(covariate, range)| json!({ "name": covariate.name(), "unit": covariate.unit(), "range": range }),
    );
    let table = if let Law::Table { at, values } = &draft.law { Some((at, values)) } else { None };
    let (at, values) = table.unzip();
    let numbers = draft.law.numbers().into_iter().map(|(name, value)| (name.to_owned(), json!(value)));
    json!({
        "name": draft.name,
        "status": status.name(),
        "was": was.map(DraftStatus::name),
        "file": one.path,
        "version": version(draft).ok(),
        "stage": stage_name(draft.stage()),
        "summary": draft.sentence,
        "carrier": draft.carrier.name(),
        "unit": draft.carrier.unit(),
        "when": draft.when.name(),
        "covariates": covariates.collect::<Vec<_>>(),
        "law": draft.law.name(),
        "numbers": at.is_none().then(|| numbers.collect::<serde_json::Map<_, _>>()),
        "at": at,
        "values": values,
        "weights": draft.weights,
        "covariance": covariance,
        "nearest": nearest,
        "evidence": evidence,
        "confirmation": confirmation,
    })
}
