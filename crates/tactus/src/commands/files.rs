//! `record info`, `export`, `recover`, `report`: commands on recordings.

use std::path::{Path, PathBuf};

use serde_json::json;
use tactus_record::Completeness;
use tactus_schema::pb;

use crate::cli::{Common, ExportArgs, RecoverArgs, ReportArgs};
use crate::commands::run::write_report;
use crate::exit::Exit;
use crate::output::print_fields;

/// The exit status of a run whose service died, as recordings tell it.
const CRASHED: &str = pb::ExitStatus::Crashed.word();

pub(crate) fn info(common: &Common, file: &Path) -> anyhow::Result<Exit> {
    let info = tactus_record::info(file)?;
    if common.json {
        println!("{}", serde_json::to_string(&info)?);
    } else {
        println!("{info}");
    }
    let whole = info.completeness == Completeness::Complete && info.exit_status.is_some();
    if !whole {
        let is_damaged = matches!(info.completeness, Completeness::Damaged(_));
        let what = if is_damaged { "is damaged" } else { "was cut off" };
        eprintln!("tactus: this recording {what}; `tactus recover {}` repairs it", file.display());
    }
    if info.frames_missing > 0 {
        eprintln!("tactus: {} frames were received and are missing in this recording", info.frames_missing);
    }
    Ok(if whole && info.frames_missing == 0 { Exit::Done } else { Exit::Degraded })
}

pub(crate) fn export(common: &Common, args: &ExportArgs) -> anyhow::Result<Exit> {
    let out = args.out.clone().unwrap_or_else(|| beside(args.recordings.first(), "table.parquet"));
    let summary = tactus_record::export(&args.recordings, &out)?;
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
    }
    Ok(if summary.warnings.is_empty() { Exit::Done } else { Exit::Degraded })
}

pub(crate) fn recover(common: &Common, args: &RecoverArgs) -> anyhow::Result<Exit> {
    let out = args.out.clone().unwrap_or_else(|| beside(Some(&args.recording), "recovered.mcap"));
    let recovery = tactus_record::recover(&args.recording, &out)?;
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
    let path = write_report(&args.recording, &out)?;
    if common.json {
        println!("{}", json!({ "report": path }));
    } else {
        print_fields(&[("report", path.display().to_string())]);
    }
    Ok(Exit::Done)
}

fn beside(recording: Option<&PathBuf>, name: &str) -> PathBuf {
    recording.map_or_else(|| PathBuf::from(name), |recording| recording.with_file_name(name))
}
