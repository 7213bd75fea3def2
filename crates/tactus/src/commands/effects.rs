//! `effects`: lists the effects of the library and the lab's own; shows, adds, renames and retires those of the lab.

use std::path::Path;

use anyhow::Context;
use serde_json::{Value, json};
use tactus_model::effect::{Definition, Draft, Law, REGISTRY};
use tactus_report::discovery::draft_picture;
use tactus_schema::DraftFile;
use tactus_schema::draft::{DraftStatus, stage_name};

use crate::cli::{Common, EffectsArgs, EffectsCommand};
use crate::commands::library::Held;
use crate::exit::{Exit, Failure};
use crate::output::{print_fields, print_table, say, say_next};

pub(crate) fn effects(common: &Common, args: &EffectsArgs) -> anyhow::Result<Exit> {
    let held = args.library.read()?;
    match &args.command {
        None | Some(EffectsCommand::List) => list(common, &held),
        Some(EffectsCommand::Show { name, figure }) => {
            show(common, &held, name)?;
            if let Some(path) = figure {
                draw(&held, name, path)?;
            }
        }
        Some(EffectsCommand::Add { file }) => {
            let added = args.library.add(file)?;
            let name = &added.draft.draft.name;
            say(&format!("{}: every discovery tries {name} from now on", added.path.display()));
            say_next("`tactus discover RUNS` tries it on recordings");
        }
        Some(EffectsCommand::Rename { name, to }) => rename(held, name, to)?,
        Some(EffectsCommand::Retire { name }) => {
            let mut one = find(held, name)?;
            one.draft.status = DraftStatus::Retired;
            one.write()?;
            say(&format!("{}: {name} is retired: no discovery tries it", one.path.display()));
        }
    }
    Ok(Exit::Done)
}

fn list(common: &Common, held: &[Held]) {
    if common.json {
        let library = REGISTRY.iter().map(|known| of_library(known));
        let drafts = held.iter().map(|one| of_draft(&one.draft));
        say(&json!({ "effects": library.chain(drafts).collect::<Vec<Value>>() }).to_string());
        return;
    }
    let library = REGISTRY.iter().map(|known| {
        [known.name, stage_name(known.stage()), "library", known.summary].map(str::to_owned).to_vec()
    });
    let drafts = held.iter().map(|one| {
        let DraftFile { draft, status, .. } = &one.draft;
        [&draft.name, stage_name(draft.stage()), status.name(), &draft.sentence].map(str::to_owned).to_vec()
    });
    print_table(&["effect", "stage", "status", "what it is"], &library.chain(drafts).collect::<Vec<_>>());
    say("");
    say_next("`tactus effects show NAME` explains one");
}

fn show(common: &Common, held: &[Held], name: &str) -> anyhow::Result<()> {
    if let Some(one) = held.iter().find(|one| one.draft.draft.name == name) {
        if common.json {
            say(&of_draft(&one.draft).to_string());
        } else {
            show_draft(one);
        }
        return Ok(());
    }
    let known = Definition::find(name).map_err(|error| Failure::new(Exit::Usage, error))?;
    if common.json {
        say(&of_library(known).to_string());
        return Ok(());
    }
    let parameters = known.parameters.iter().map(|one| {
        let [least, most] = one.range;
        format!("{} ({least} to {most})", one.name)
    });
    print_fields(&[
        ("effect", known.name.to_owned()),
        ("what it is", known.summary.to_owned()),
        ("stage", stage_name(known.stage()).to_owned()),
        ("parameters", parameters.collect::<Vec<_>>().join(", ")),
        ("near twins", known.near_twins.join(", ")),
        ("shown by", known.shown_by.join(", ")),
    ]);
    say("");
    say_next(&format!(
        "`tactus run diagnose` measures what may show it, `tactus discover RUNS` looks for it; equation, units and source: \
         docs/book/reference/effects.md#{}",
        known.name
    ));
    Ok(())
}

/// Draws the curve of a draft.
fn draw(held: &[Held], name: &str, path: &Path) -> anyhow::Result<()> {
    let draft = held.iter().find(|one| one.draft.draft.name == name);
    let picture = draft.and_then(|one| draft_picture(&one.draft.draft));
    let picture = picture.ok_or_else(|| {
        Failure::new(
            Exit::Usage,
            format!("{name} has no curve to draw: only drafts that depend on something have"),
        )
    })?;
    std::fs::write(path, picture.to_string()).with_context(|| format!("{} cannot be written", path.display()))
}

fn show_draft(one: &Held) {
    let DraftFile { draft, status, nearest, evidence, confirmation, .. } = &one.draft;
    let mut fields = vec![
        ("effect", draft.name.clone()),
        ("what it is", draft.sentence.clone()),
        ("status", status.name().to_owned()),
        ("file", one.path.display().to_string()),
        ("stage", stage_name(draft.stage()).to_owned()),
        ("carrier", format!("{} ({})", draft.carrier.name(), draft.carrier.unit())),
        ("acts", draft.when.name().to_owned()),
        ("depends on", covariates(draft).join("; ")),
        ("law", law(draft)),
    ];
    let nearest = nearest.iter().map(|one| format!("{} ({:.0} behind)", one.class, one.ln_odds_behind));
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
    print_fields(&fields);
    if *status != DraftStatus::Retired {
        say("");
        say_next(&format!(
            "`tactus discover RUNS` tries it, `tactus effects retire {}` ends that",
            draft.name
        ));
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

fn rename(held: Vec<Held>, name: &str, to: &str) -> anyhow::Result<()> {
    if held.iter().any(|one| one.draft.draft.name == to) {
        return Err(Failure::new(Exit::Usage, format!("there is a draft {to:?} already")).into());
    }
    let Held { path: old, mut draft } = find(held, name)?;
    to.clone_into(&mut draft.draft.name);
    draft.draft.check().map_err(|error| Failure::new(Exit::Usage, error))?;
    let path = old.with_file_name(format!("{to}.toml"));
    if path.exists() && path != old {
        return Err(Failure::new(Exit::Usage, format!("{} is there already", path.display())).into());
    }
    let renamed = Held { path, draft };
    renamed.write()?;
    if renamed.path != old {
        std::fs::remove_file(&old).with_context(|| format!("{} cannot be removed", old.display()))?;
    }
    say(&format!("{}: {name} is {to} now", renamed.path.display()));
    Ok(())
}

/// The draft of a name.
fn find(held: Vec<Held>, name: &str) -> anyhow::Result<Held> {
    let names: Vec<String> = held.iter().map(|one| one.draft.draft.name.clone()).collect();
    let found = held.into_iter().find(|one| one.draft.draft.name == name);
    let there = if names.is_empty() {
        "none; `tactus effects add FILE` puts one into the library, and --library names another folder"
            .to_owned()
    } else {
        names.join(", ")
    };
    Ok(found.ok_or_else(|| Failure::new(Exit::Usage, format!("no draft {name:?}; there is: {there}")))?)
}

fn of_library(known: &Definition) -> Value {
    json!({
        "name": known.name,
        "status": "library",
        "stage": stage_name(known.stage()),
        "summary": known.summary,
        "parameters": known.parameters.iter().map(|one| json!({ "name": one.name, "range": one.range })).collect::<Vec<_>>(),
        "near_twins": known.near_twins,
        "shown_by": known.shown_by,
    })
}

fn of_draft(file: &DraftFile) -> Value {
    let DraftFile { draft, status, nearest, evidence, confirmation, .. } = file;
    json!({
        "name": draft.name,
        "status": status.name(),
        "stage": stage_name(draft.stage()),
        "summary": draft.sentence,
        "carrier": draft.carrier.name(),
        "when": draft.when.name(),
        "covariates": draft.covariates.iter().map(|one| one.name()).collect::<Vec<_>>(),
        "law": draft.law.name(),
        "nearest": nearest,
        "evidence": evidence,
        "confirmation": confirmation,
    })
}
