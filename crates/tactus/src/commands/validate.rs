//! `validate`: checks files with the parsers that the service uses.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use serde_json::json;
use tactus_plan::RigView;
use tactus_record::Completeness;
use tactus_runner::config::{self, ConfigError, Rigs, ServiceConfig};
use tactus_runner::embedded::{HIDDEN_SCHEMA, SIMULATED_RIG, TruthFile};
use tactus_runner::experiments;
use tactus_schema::{DraftFile, Model, Rig, draft, model, rig, stated_schema};
use tactus_wire::declared;

use super::link;
use crate::cli::{Common, ValidateArgs};
use crate::exit::{Exit, in_words};
use crate::output::say_next;

pub(crate) fn validate(common: &Common, args: &ValidateArgs) -> Exit {
    let results: Vec<_> = args.files.iter().flat_map(|file| check_all(file)).collect();
    for (file, result) in &results {
        match result {
            _ if common.json => {}
            Ok(what) => println!("{}: ok, {what}", file.display()),
            Err(error) => eprintln!("{}: {}", file.display(), wrong(file, error)),
        }
    }
    if common.json {
        let files: Vec<_> = results
            .iter()
            .map(|(file, result)| match result {
                Ok(what) => json!({ "file": file, "ok": true, "what": what }),
                Err(error) => json!({ "file": file, "ok": false, "error": wrong(file, error) }),
            })
            .collect();
        println!("{}", json!({ "files": files }));
    }
    if let [(file, Ok(_))] = &results[..]
        && !common.json
        && let Some(next) = next_command(file)
    {
        say_next(&next);
    }
    if results.iter().all(|(_, result)| result.is_ok()) { Exit::Done } else { Exit::Failed }
}

/// What a person is likely to do with a valid file.
fn next_command(file: &Path) -> Option<String> {
    let path = file.display();
    Some(match file.extension()?.to_str()? {
        "star" => format!("`tactus plan {path}` dry-runs it"),
        "parquet" => format!("`tactus calibrate {path}` fits the sensor to it"),
        "mcap" => format!("`tactus report {path}` shows the run"),
        _ => match stated_schema(&std::fs::read_to_string(file).ok()?) {
            Some(rig::SCHEMA) => {
                format!("`tactus plan element-centres --rig-file {path}` dry-runs an experiment on it")
            }
            Some(model::SCHEMA) => format!("`tactus simulate --model {path}` shows an image of it"),
            Some(draft::SCHEMA) => format!("`tactus effects add {path}` lets every discovery try it"),
            Some(HIDDEN_SCHEMA) => {
                format!("`tactus run diagnose --embedded --truth {path}` runs on such a rig")
            }
            Some(tactus_import::SCHEMA) => format!("`tactus import DATA --map {path}` reads data by it"),
            None => format!("`tactusd --config {path}` serves it"),
            Some(_) => return None,
        },
    })
}

/// The error in a file, without the file's name.
fn wrong(file: &Path, error: &anyhow::Error) -> String {
    let words = in_words(error);
    let prefix = format!("{}: ", file.display());
    words.strip_prefix(&prefix).map_or_else(|| words.clone(), str::to_owned)
}

/// Checks a file or, in a folder, its rig files: each by itself and against the others, as a service would serve them.
fn check_all(path: &Path) -> Vec<(PathBuf, anyhow::Result<String>)> {
    if !path.is_dir() {
        return vec![(path.to_owned(), check(path))];
    }
    let rigs = match config::files_in_folder(path).and_then(Rigs::load) {
        Ok(rigs) => rigs,
        Err(ConfigError::AllRefused { refused }) => {
            Rigs { served: Vec::new(), refused, files: Vec::new(), are_several: true }
        }
        Err(error) => return vec![(path.to_owned(), Err(error.into()))],
    };
    let served = rigs.served.into_iter().map(|files| (files.path, Ok(rig_in_words(&files.rig))));
    let refused = rigs.refused.into_iter().map(|rig| (rig.path, Err(anyhow!(rig.problem))));
    let mut results: Vec<_> = served.chain(refused).collect();
    results.sort_by(|(one, _), (other, _)| one.cmp(other));
    results
}

fn rig_in_words(rig: &Rig) -> String {
    format!("rig {:?}, {} x {} elements", rig.name, rig.array.rows(), rig.array.cols())
}

/// Describes a valid file.
///
/// # Errors
/// If the file is not valid.
fn check(file: &Path) -> anyhow::Result<String> {
    match file.extension().and_then(|extension| extension.to_str()) {
        Some("toml") => check_toml(file),
        Some("star") => check_script(file),
        Some("parquet") => {
            let table = tactus_record::table::validate(file)?;
            Ok(format!("a measurement table of {} rows, {} runs", table.rows, table.runs))
        }
        Some("mcap") => check_recording(file),
        _ => bail!("only .toml, .star, .parquet and .mcap files can be validated"),
    }
}

/// The `schema` key says what the file is; without one it is a service's configuration.
fn check_toml(file: &Path) -> anyhow::Result<String> {
    let text = std::fs::read_to_string(file).context("cannot be read")?;
    match stated_schema(&text) {
        Some(rig::SCHEMA) => Ok(rig_in_words(&config::load_rig(file)?.rig)),
        Some(model::SCHEMA) => {
            let Model { base, effects } = Model::from_toml(&text)?;
            let (name, rows, cols) = (base.array.name(), base.array.rows(), base.array.cols());
            Ok(format!("model of {name:?}, {rows} x {cols} elements, {} effects", effects.len()))
        }
        Some(draft::SCHEMA) => {
            let DraftFile { draft, status, .. } = DraftFile::from_toml(&text)?;
            Ok(format!("draft {:?}, {}", draft.name, status.name()))
        }
        Some(HIDDEN_SCHEMA) => {
            TruthFile::from_toml(&text)?;
            Ok("hidden physics for a simulated rig".into())
        }
        Some(declared::SCHEMA) => Ok(link::in_words(&link::described(&text)?)),
        Some(tactus_import::SCHEMA) => {
            let [rows, cols] = tactus_import::check(file)?;
            Ok(format!("a mapping for `tactus import`, {rows} x {cols} elements"))
        }
        Some(other) => bail!(
            "schema {other:?} is unknown; known are {}, {}, {}, {}, {}, {HIDDEN_SCHEMA}",
            rig::SCHEMA,
            model::SCHEMA,
            draft::SCHEMA,
            declared::SCHEMA,
            tactus_import::SCHEMA
        ),
        None => {
            let Rigs { served, refused, .. } = ServiceConfig::load(file)?.rigs;
            if !refused.is_empty() {
                let refused: Vec<_> = refused.iter().map(ToString::to_string).collect();
                bail!("{}", refused.join("\n"));
            }
            let names: Vec<_> = served.iter().map(|files| format!("{:?}", files.rig.name)).collect();
            let rigs = if names.len() == 1 { "rig" } else { "rigs" };
            Ok(format!("a service's configuration for {rigs} {}", names.join(", ")))
        }
    }
}

fn check_script(file: &Path) -> anyhow::Result<String> {
    let script = experiments::find(&file.to_string_lossy(), None)?;
    let rig = Rig::from_toml(SIMULATED_RIG)?;
    let parameters = script.parameters(&RigView::of(&rig))?;
    Ok(format!("experiment {:?} with {} parameters", script.name(), parameters.len()))
}

fn check_recording(file: &Path) -> anyhow::Result<String> {
    let info = tactus_record::info(file)?;
    match (&info.completeness, info.exit_status) {
        (Completeness::Complete, Some(status)) => Ok(format!(
            "the recording of run {}, {status}, {} frames, {} lost",
            info.run_id, info.frames, info.frames_lost
        )),
        (Completeness::Complete, None) => bail!("the run was never closed; `tactus recover` closes it"),
        (incomplete @ (Completeness::Truncated { .. } | Completeness::Damaged(_)), _) => {
            bail!("{incomplete}; `tactus recover` saves everything that is intact")
        }
    }
}

#[cfg(test)]
#[path = "validate_tests.rs"]
mod tests;
