//! `record info`, `export`, `recover`, `report`: commands on recordings.

use std::path::{Path, PathBuf};

use serde_json::json;
use tactus_record::table::TableFormat;
use tactus_record::{Completeness, Info, meter};
use tactus_schema::pb;

use crate::cli::{Common, ExportArgs, RecoverArgs, ReportArgs};
use crate::commands::run::write_report;
use crate::exit::{Exit, Failure, in_words};
use crate::output::{duration, print_fields, print_table, say_next};
use crate::progress::Busy;

/// The exit status of a run whose service died, as recordings tell it.
const CRASHED: &str = pb::ExitStatus::Crashed.word();

pub(crate) fn info(common: &Common, files: &[PathBuf]) -> anyhow::Result<Exit> {
    let [file] = files else { return Ok(infos(common, files)) };
    let info = reading(common, files, || tactus_record::info(file))?;
    if common.json {
        println!("{}", serde_json::to_string(&info)?);
    } else {
        println!("{info}");
        say_next(&format!("`tactus export {}` writes its table", file.display()));
    }
    Ok(tell_lacks(file, &info))
}

/// Reads each of the files once.
fn reading<T>(common: &Common, files: &[PathBuf], job: impl FnOnce() -> T) -> T {
    Busy::with("reading", common.json).reads(|| {
        for file in files {
            meter::will_read(file, &[1.0]);
        }
        job()
    })
}

/// A row for each recording. One that cannot be read does not hide the others.
fn infos(common: &Common, files: &[PathBuf]) -> Exit {
    let (mut infos, mut unreadable, mut exit) = (Vec::new(), Vec::new(), Exit::Done);
    let read = || files.iter().map(|file| (file, tactus_record::info(file))).collect::<Vec<_>>();
    for (file, info) in reading(common, files, read) {
        match info {
            Ok(info) => {
                if tell_lacks(file, &info) != Exit::Done && exit == Exit::Done {
                    exit = Exit::Degraded;
                }
                infos.push(info);
            }
            Err(error) => {
                let error = in_words(&error.into());
                eprintln!("tactus: {error}");
                unreadable.push(json!({ "path": file, "error": error }));
                exit = Exit::Failed;
            }
        }
    }
    if common.json {
        println!("{}", json!({ "recordings": infos, "unreadable": unreadable }));
        return exit;
    }
    let rows: Vec<_> = infos.iter().map(row).collect();
    let header =
        ["RUN", "EXPERIMENT", "RIG", "STARTED", "DURATION", "STATUS", "PRESSES", "FRAMES", "LOST", "FILE"];
    print_table(&header, &rows);
    exit
}

fn row(info: &Info) -> Vec<String> {
    vec![
        info.run_id.clone(),
        info.experiment.clone(),
        format!("{}{}", info.rig, if info.simulated { " (SIMULATED)" } else { "" }),
        info.started.clone(),
        duration(info.duration_s),
        info.exit_status.unwrap_or("open").to_owned(),
        info.presses.to_string(),
        info.frames.to_string(),
        (info.frames_lost + info.frames_missing).to_string(),
        info.path.clone(),
    ]
}

/// Says what a recording lacks.
fn tell_lacks(file: &Path, info: &Info) -> Exit {
    let whole = info.completeness == Completeness::Complete && info.exit_status.is_some();
    let file = file.display();
    if !whole {
        let is_damaged = matches!(info.completeness, Completeness::Damaged(_));
        let what = if is_damaged { "is damaged" } else { "was cut off" };
        eprintln!("tactus: {file} {what}; `tactus recover {file}` repairs it");
    }
    if info.frames_missing > 0 {
        eprintln!("tactus: {} frames were received and are missing in {file}", info.frames_missing);
    }
    if whole && info.frames_missing == 0 { Exit::Done } else { Exit::Degraded }
}

pub(crate) fn export(common: &Common, args: &ExportArgs) -> anyhow::Result<Exit> {
    if args.format.as_deref() == Some("foxglove") {
        return export_for_viewers(common, args);
    }
    let (out, format) = table_of(args)?;
    let busy = Busy::with("exporting", common.json);
    let summary = busy.reads(|| tactus_record::export_as(&args.recordings, &out, format))?;
    drop(busy);
    if common.json {
        println!("{}", serde_json::to_string(&summary)?);
    } else {
        for warning in &summary.warnings {
            eprintln!("warning: {warning}");
        }
        for note in &summary.notes {
            eprintln!("note: {note}");
        }
        print_fields(&[
            ("table", out.display().to_string()),
            ("rows", summary.rows.to_string()),
            ("runs", summary.runs.to_string()),
        ]);
        if format == TableFormat::Parquet {
            let table = out.display();
            say_next(&format!("`tactus calibrate {table}` or `tactus discover {table}` analyses it"));
        }
    }
    Ok(if summary.warnings.is_empty() { Exit::Done } else { Exit::Degraded })
}

fn export_for_viewers(common: &Common, args: &ExportArgs) -> anyhow::Result<Exit> {
    let [recording] = args.recordings.as_slice() else {
        let what = "--format foxglove takes one recording: a viewer opens several files at once";
        return Err(Failure::new(Exit::Usage, what).into());
    };
    let out = args.out.clone().unwrap_or_else(|| beside(Some(recording), "foxglove.mcap"));
    if out == *recording {
        let what = format!("--out {} is the recording itself: name another file", out.display());
        return Err(Failure::new(Exit::Usage, what).into());
    }
    let busy = Busy::with("exporting", common.json);
    let written = busy.reads(|| tactus_report::viewer_file(recording, out))?;
    drop(busy);
    if common.json {
        println!("{}", serde_json::to_string(&written)?);
    } else {
        print_fields(&[
            ("file", written.path.display().to_string()),
            ("frames", written.frames.to_string()),
            ("positions", written.positions.to_string()),
            ("lines of the log", written.lines.to_string()),
        ]);
    }
    Ok(Exit::Done)
}

/// The table to write, and its format: as asked, else as its name ends.
fn table_of(args: &ExportArgs) -> anyhow::Result<(PathBuf, TableFormat)> {
    let asked =
        args.format.as_deref().and_then(|name| TableFormat::ALL.into_iter().find(|one| one.name() == name));
    let Some(out) = &args.out else {
        let format = asked.unwrap_or(TableFormat::Parquet);
        return Ok((beside(args.recordings.first(), &format!("table.{}", format.name())), format));
    };
    let format = asked.or_else(|| TableFormat::of_path(out)).ok_or_else(|| {
        let is_mcap = out.extension().is_some_and(|extension| extension == "mcap");
        let why = if is_mcap {
            "a recording is MCAP already, and a table is not; --format foxglove writes MCAP for viewers"
        } else {
            "the name does not say the format"
        };
        let what =
            format!("--out {}: {why}: end it in .parquet, .csv or .npz, or add --format", out.display());
        Failure::new(Exit::Usage, what)
    })?;
    Ok((out.clone(), format))
}

pub(crate) fn recover(common: &Common, args: &RecoverArgs) -> anyhow::Result<Exit> {
    let out = args.out.clone().unwrap_or_else(|| beside(Some(&args.recording), "recovered.mcap"));
    let busy = Busy::with("reading what is intact", common.json);
    let recovery = busy.reads(|| tactus_record::recover(&args.recording, &out))?;
    drop(busy);
    if common.json {
        println!(
            "{}",
            json!({
                "recording": out,
                "damage": recovery.damage,
                "lossy": recovery.is_lossy,
                "messages": recovery.messages,
                "frames_missing": recovery.frames_missing,
                "closed_as_crashed": recovery.closed && recovery.info.exit_status == Some(CRASHED),
                "rebuilt": recovery.rebuilt,
                "info": recovery.info,
            })
        );
    } else {
        println!("recovered {} messages into {}", recovery.messages, out.display());
        println!("the original is {}", recovery.damage);
        for what in &recovery.rebuilt {
            println!("rebuilt from the rest: {what}");
        }
        println!("{}", recovery.info);
        say_next(&format!("`tactus export {}` writes its table", out.display()));
    }
    let lacks = recovery.is_lossy || recovery.frames_missing > 0;
    if lacks {
        let missing = recovery.frames_missing;
        eprintln!("tactus: parts of the original could not be read; at least {missing} frames are missing");
    }
    Ok(if lacks { Exit::Degraded } else { Exit::Done })
}

pub(crate) fn report(common: &Common, args: &ReportArgs) -> anyhow::Result<Exit> {
    let out = args.out.clone().unwrap_or_else(|| beside(Some(&args.recording), "report.html"));
    let busy = Busy::with("writing the report", common.json);
    let path = busy.reads(|| write_report(&args.recording, &out))?;
    drop(busy);
    if common.json {
        println!("{}", json!({ "report": path }));
    } else {
        print_fields(&[("report", path.display().to_string())]);
        say_next(&format!("{} shows it in a browser", path.display()));
    }
    Ok(Exit::Done)
}

fn beside(recording: Option<&PathBuf>, name: &str) -> PathBuf {
    recording.map_or_else(|| PathBuf::from(name), |recording| recording.with_file_name(name))
}
