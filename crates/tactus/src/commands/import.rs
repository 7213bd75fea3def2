//! `import`: a measurement table from a lab's own files.

use std::fs;
use std::path::Path;

use anyhow::Context;
use serde_json::json;
use tactus_import::{ImportError, Summary};

use crate::cli::{Common, ImportArgs};
use crate::exit::{Exit, Failure, in_words};
use crate::output::{print_fields, say, say_next};
use crate::progress::Busy;

pub(crate) fn import(common: &Common, args: &ImportArgs) -> anyhow::Result<Exit> {
    match (&args.map, &args.new_map) {
        (Some(map), None) => {
            let out = args.out.clone().unwrap_or_else(|| args.files[0].with_extension("parquet"));
            let busy = Busy::with("reading", common.json);
            let imported = busy.reads(|| tactus_import::import(map, &args.files, out));
            drop(busy);
            let summary = imported.map_err(|error| with_open_questions(error, map))?;
            Ok(told(common, &summary))
        }
        (None, Some(map)) => propose(common, &args.files[0], map),
        _ => {
            let what =
                "name the mapping with --map FILE; without one, --new-map FILE writes one to start from";
            Err(Failure::new(Exit::Usage, what).into())
        }
    }
}

/// The error, and how many questions of the mapping nobody has answered: the first of them may be its cause, and the next one's.
fn with_open_questions(error: ImportError, map: &Path) -> anyhow::Error {
    // A mapping that cannot be read is the error itself.
    match fs::read_to_string(map).map_or(0, |text| questions(&text)) {
        0 => error.into(),
        open => {
            let open = format!("{open} of its lines begin with #? and are still to be completed");
            anyhow::anyhow!("{}; {}: {open}", in_words(&error.into()), map.display())
        }
    }
}

/// Lines that only the lab can complete.
fn questions(mapping: &str) -> usize {
    mapping.lines().filter(|line| line.starts_with("#?")).count()
}

fn propose(common: &Common, file: &Path, map: &Path) -> anyhow::Result<Exit> {
    if map.exists() {
        return Err(Failure::new(Exit::Usage, format!("{} exists: name another file", map.display())).into());
    }
    let text = tactus_import::propose(file)?;
    fs::write(map, &text).with_context(|| format!("cannot write {}", map.display()))?;
    let asked = questions(&text);
    if common.json {
        say(&json!({ "map": map, "asked": asked }).to_string());
    } else {
        say(&format!("{}: complete its {asked} lines that begin with #?", map.display()));
        let (file, map) = (file.display(), map.display());
        say_next(&format!("`tactus import {file} --map {map}` makes the table"));
    }
    Ok(Exit::Done)
}

fn told(common: &Common, summary: &Summary) -> Exit {
    for warning in &summary.warnings {
        eprintln!("warning: {warning}");
    }
    if common.json {
        say(&json!(summary).to_string());
    } else {
        print_fields(&[("table", summary.path.display().to_string()), ("rows", summary.rows.to_string())]);
        for run in &summary.runs {
            say(&format!(
                "run {}: {} frames, {} presses with {} holds down to {:.3} mm; {} frames at rest",
                run.run, run.frames, run.presses, run.holds, run.depth_max_mm, run.idle
            ));
        }
        for assumed in &summary.assumed {
            say(&format!("not in the mapping: {assumed}"));
        }
        let table = summary.path.display();
        say_next(&format!("`tactus calibrate {table}` or `tactus discover {table}` analyses it"));
    }
    if summary.warnings.is_empty() { Exit::Done } else { Exit::Degraded }
}
