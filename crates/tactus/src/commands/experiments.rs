//! `experiments`, `new`, `script reference`: what can be run, and how to write more.

use std::fs::{self, File};
use std::io::Write as _;
use std::path::Path;

use anyhow::Context;
use serde_json::{Value, json};
use tactus_plan::{Parameter, RigView, Script};
use tactus_runner::embedded::SIMULATED_RIG;
use tactus_runner::experiments as known;
use tactus_schema::Rig;

use crate::cli::{Common, ExperimentsArgs, NewArgs};
use crate::exit::{Exit, Failure, in_words};
use crate::output::{print_table, say};

/// An experiment to start from.
const TEMPLATE: &str = include_str!("experiments/template.star");

/// An experiment and its parameters, as they are on the simulated rig.
struct Listed {
    script: Script,
    parameters: Vec<Parameter>,
}

impl Listed {
    fn find(name: &str, folder: Option<&Path>, rig: &RigView) -> anyhow::Result<Self> {
        let script = known::find(name, folder).map_err(|error| Failure::new(Exit::Usage, error))?;
        let parameters = script.parameters(rig).map_err(|error| Failure::new(Exit::Usage, error))?;
        Ok(Self { script, parameters })
    }

    fn to_json(&self) -> Value {
        json!({
            "name": self.script.name(),
            "summary": self.script.summary(),
            "doc": self.script.doc(),
            "parameters": self.parameters,
        })
    }
}

pub(crate) fn experiments(common: &Common, args: &ExperimentsArgs) -> anyhow::Result<Exit> {
    let rig = RigView::of(&Rig::from_toml(SIMULATED_RIG)?);
    let folder = args.experiments.as_deref();
    if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
        return Err(Failure::new(Exit::Usage, format!("{} is no folder", folder.display())).into());
    }
    if let Some(name) = &args.name {
        let listed = Listed::find(name, folder, &rig)?;
        if common.json {
            say(&listed.to_json().to_string());
        } else {
            show(&listed);
        }
        return Ok(Exit::Done);
    }
    let (mut found, mut exit) = (Vec::new(), Exit::Done);
    for name in known::names(folder) {
        match Listed::find(&name, folder, &rig) {
            Ok(listed) => found.push(listed),
            // One script with an error does not hide the others.
            Err(error) => {
                eprintln!("tactus: {name}: {}", in_words(&error));
                exit = Exit::Failed;
            }
        }
    }
    if common.json {
        say(&json!({ "experiments": found.iter().map(Listed::to_json).collect::<Vec<_>>() }).to_string());
        return Ok(exit);
    }
    let rows: Vec<_> = found.iter().map(row).collect();
    print_table(&["EXPERIMENT", "PARAMETERS", "WHAT IT DOES"], &rows);
    say(
        "\n`tactus experiments NAME` explains one, `tactus plan NAME` shows what it would do, `tactus new NAME` begins another",
    );
    Ok(exit)
}

fn row(listed: &Listed) -> Vec<String> {
    let names: Vec<_> = listed.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
    vec![listed.script.name().to_owned(), names.join(" "), listed.script.summary().to_owned()]
}

fn show(listed: &Listed) {
    let Listed { script, parameters } = listed;
    say(&format!("{}\n\n{}\n", script.name(), script.doc()));
    let rows: Vec<_> = parameters
        .iter()
        .map(|parameter| {
            vec![
                parameter.name.clone(),
                parameter.default.to_string(),
                parameter.unit.clone().unwrap_or_default(),
                parameter.kind.to_string(),
                parameter.doc.clone(),
            ]
        })
        .collect();
    if !rows.is_empty() {
        print_table(&["PARAMETER", "DEFAULT", "UNIT", "TYPE", "MEANING"], &rows);
        say("");
    }
    say(&format!("`tactus plan {}` shows what it would do", script.name()));
}

/// Writes a script to start from. An existing file is never replaced.
pub(crate) fn new(common: &Common, args: &NewArgs) -> anyhow::Result<Exit> {
    let name = args.name.strip_suffix(".star").unwrap_or(&args.name);
    Script::parse(name, TEMPLATE).map_err(|error| Failure::new(Exit::Usage, error))?;
    fs::create_dir_all(&args.out).with_context(|| args.out.display().to_string())?;
    let path = args.out.join(name).with_extension("star");
    let created = File::create_new(&path).and_then(|mut file| file.write_all(TEMPLATE.as_bytes()));
    created.with_context(|| path.display().to_string())?;
    if common.json {
        say(&json!({ "script": path }).to_string());
    } else {
        let path = path.display();
        say(&format!(
            "{path} written: edit it, then `tactus plan {path}` shows what it would do. `tactus script reference` lists what scripts can say"
        ));
    }
    Ok(Exit::Done)
}

/// Prints the functions that scripts can call.
pub(crate) fn reference(common: &Common) -> anyhow::Result<Exit> {
    let reference = tactus_plan::reference();
    if common.json {
        say(&json!({ "reference": reference }).to_string());
    } else {
        crate::output::write(&format!("{}\n", reference.trim_end()))?;
    }
    Ok(Exit::Done)
}
