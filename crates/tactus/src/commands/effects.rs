//! `effects`: lists the effects of the library and the lab's own; shows, adds, renames, measures anew, retires and takes back those of the lab.

mod show;

use std::fs;
use std::path::PathBuf;

use anyhow::Context;
use serde_json::{Value, json};
use tactus_model::effect::REGISTRY;
use tactus_schema::DraftFile;
use tactus_schema::draft::{DraftStatus, stage_name};

use crate::cli::{Common, EffectsArgs, EffectsCommand};
use crate::commands::discover;
use crate::commands::library::{Held, Library};
use crate::exit::{Exit, Failure};
use crate::output::{print_table, say, say_next};
use crate::progress::Busy;

pub(crate) fn effects(common: &Common, args: &EffectsArgs) -> anyhow::Result<Exit> {
    let library = args.library.read()?;
    match &args.command {
        None | Some(EffectsCommand::List) => return Ok(list(common, args, &library)),
        Some(EffectsCommand::Show { name, figure }) => show::show(common, &library, name, figure.as_deref())?,
        Some(EffectsCommand::Add { file }) => {
            let added = args.library.add(file)?;
            let name = &added.draft.draft.name;
            tell(common, &added, &in_use(&added));
            if !common.json && added.draft.status.is_open() {
                say_next(&format!("`tactus effects confirm {name} RECORDING` measures it anew"));
            } else if !common.json && added.draft.status.is_in_use() {
                say_next("`tactus discover RUNS` tries it on recordings");
            }
        }
        Some(EffectsCommand::Rename { name, to }) => {
            let renamed = rename(library, name, to)?;
            tell(common, &renamed, &format!("{name} is {to} now"));
        }
        Some(EffectsCommand::Retire { name }) => {
            let mut one = find(library, name)?;
            one.draft.retire();
            one.write()?;
            tell(common, &one, &in_use(&one));
        }
        Some(EffectsCommand::Use { name }) => {
            let mut one = find(library, name)?;
            one.draft.take_back();
            one.write()?;
            tell(common, &one, &in_use(&one));
        }
        Some(EffectsCommand::Confirm { name, recordings, model, seed }) => {
            let Held { path, draft } = find(library, name)?;
            if draft.status == DraftStatus::Retired {
                let what = format!("{name} is retired: take it back first, with `tactus effects use {name}`");
                return Err(Failure::new(Exit::Usage, what).into());
            }
            let busy = Busy::with("measuring anew", common.json);
            let (draft, in_words) = discover::confirm(&draft, recordings, model.as_deref(), *seed)?;
            drop(busy);
            let one = Held { path, draft };
            one.write()?;
            tell(common, &one, &in_words);
        }
    }
    Ok(Exit::Done)
}

/// What came of a command: a sentence with the file, or an object with the name, the status and the file.
fn tell(common: &Common, one: &Held, in_words: &str) {
    let Held { path, draft: DraftFile { draft, status, .. } } = one;
    if common.json {
        say(&json!({ "name": draft.name, "status": status.name(), "file": path }).to_string());
    } else {
        say(&format!("{}: {in_words}", path.display()));
    }
}

/// Whether discoveries try a draft.
fn in_use(one: &Held) -> String {
    let DraftFile { draft, status, .. } = &one.draft;
    let name = &draft.name;
    match status {
        DraftStatus::Drafted | DraftStatus::Partial | DraftStatus::Confirmed => {
            format!("every discovery tries {name} from now on")
        }
        DraftStatus::Refuted => format!("{name} is kept, but refuted: no discovery tries it"),
        DraftStatus::Retired => {
            format!("{name} is retired: no discovery tries it; `tactus effects use {name}` takes it back")
        }
    }
}

fn list(common: &Common, args: &EffectsArgs, library: &Library) -> Exit {
    let Library { held, refused } = library;
    let folder = args.library.folder();
    if common.json {
        let known = REGISTRY.iter().map(|known| show::of_library(known));
        let effects: Vec<Value> = known.chain(held.iter().map(show::of_draft)).collect();
        let refused = refused.iter().map(|one| json!({ "file": one.path, "problem": one.problem }));
        let refused: Vec<Value> = refused.collect();
        say(&json!({ "effects": effects, "folder": folder, "refused": refused }).to_string());
    } else {
        let known = REGISTRY.iter().map(|known| {
            [known.name, stage_name(known.stage()), "library", known.summary].map(str::to_owned).to_vec()
        });
        let drafts = held.iter().map(|one| {
            let DraftFile { draft, status, .. } = &one.draft;
            [&draft.name, stage_name(draft.stage()), status.name(), &draft.sentence]
                .map(str::to_owned)
                .to_vec()
        });
        let refused = refused.iter().map(|one| {
            let file = one.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            vec![file, String::new(), "refused".to_owned(), format!("refused: {}", one.problem)]
        });
        let rows: Vec<_> = known.chain(drafts).chain(refused).collect();
        print_table(&["effect", "stage", "status", "what it is"], &rows);
        say("");
        if let Some(folder) = folder {
            let is_there = if folder.exists() { "" } else { ", which is not there yet" };
            say(&format!("the lab's own: {} in {}{is_there}", held.len(), folder.display()));
        }
        say_next("`tactus effects show NAME` explains one");
    }
    if library.refused.is_empty() { Exit::Done } else { Exit::Degraded }
}

fn rename(library: Library, name: &str, to: &str) -> anyhow::Result<Held> {
    if library.held.iter().any(|one| one.draft.draft.name == to) {
        return Err(Failure::new(Exit::Usage, format!("there is a draft {to:?} already")).into());
    }
    let Held { path: old, mut draft } = find(library, name)?;
    to.clone_into(&mut draft.draft.name);
    draft.draft.check().map_err(|error| Failure::new(Exit::Usage, error))?;
    let path: PathBuf = old.with_file_name(format!("{to}.toml"));
    if path.exists() && path != old {
        return Err(Failure::new(Exit::Usage, format!("{} is there already", path.display())).into());
    }
    let renamed = Held { path, draft };
    renamed.write()?;
    if renamed.path != old {
        fs::remove_file(&old).with_context(|| format!("{} cannot be removed", old.display()))?;
    }
    Ok(renamed)
}

/// The draft of a name.
fn find(library: Library, name: &str) -> anyhow::Result<Held> {
    let names: Vec<String> = library.held.iter().map(|one| one.draft.draft.name.clone()).collect();
    let found = library.held.into_iter().find(|one| one.draft.draft.name == name);
    let there = if names.is_empty() {
        "none; `tactus effects add FILE` puts one into the library, and --library names another folder"
            .to_owned()
    } else {
        names.join(", ")
    };
    Ok(found.ok_or_else(|| Failure::new(Exit::Usage, format!("no draft {name:?}; there is: {there}")))?)
}
