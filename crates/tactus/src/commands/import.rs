//! `import`: a measurement table from a lab's own files.

use std::fs;
use std::path::Path;

use anyhow::Context;
use serde_json::json;
use tactus_import::Summary;

use crate::cli::{Common, ImportArgs};
use crate::exit::{Exit, Failure};
use crate::output::{print_fields, say, say_next};
use crate::progress::Busy;

pub(crate) fn import(common: &Common, args: &ImportArgs) -> anyhow::Result<Exit> {
    match (&args.map, &args.new_map) {
        (Some(map), None) => {
            let out = args.out.clone().unwrap_or_else(|| args.files[0].with_extension("parquet"));
            let busy = Busy::with("reading", common.json);
            let summary = busy.reads(|| tactus_import::import(map, &args.files, out))?;
            drop(busy);
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

fn propose(common: &Common, file: &Path, map: &Path) -> anyhow::Result<Exit> {
    if map.exists() {
        return Err(Failure::new(Exit::Usage, format!("{} exists: name another file", map.display())).into());
    }
    let text = tactus_import::propose(file)?;
    fs::write(map, &text).with_context(|| format!("cannot write {}", map.display()))?;
    let asked = text.lines().filter(|line| line.starts_with("#?")).count();
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
