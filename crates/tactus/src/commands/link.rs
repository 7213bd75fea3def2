//! `link check` checks the description of a device's frames, also against recorded bytes; `link sniff` shows the bytes.

pub(crate) mod sniff;

use std::fs;
use std::path::Path;
use std::sync::Arc;

use anyhow::Context;
use serde_json::{Value, json};
use tactus_wire::declared::{CaptureReport, Format, Framing, Mismatch, RawFormat, check_capture};

use crate::cli::{Common, LinkCheckArgs};
use crate::exit::{Exit, Failure};
use crate::output::{print_fields, say};

pub(crate) fn check(common: &Common, args: &LinkCheckArgs) -> anyhow::Result<Exit> {
    let file = args.file.display();
    let text = fs::read_to_string(&args.file).with_context(|| format!("{file} cannot be read"))?;
    let format = described(&text).map_err(|error| Failure::new(Exit::Usage, format!("{file}: {error}")))?;
    let format = Arc::new(format);
    let capture = args.capture.as_deref().map(read).transpose()?;
    let report = capture.map(|bytes| check_capture(&format, &bytes));
    if common.json {
        let capture = report.as_ref().map(of_capture);
        say(&json!({ "file": args.file, "format": of_format(&format), "capture": capture }).to_string());
    } else {
        say(&format!("{file}: {}", in_words(&format)));
        if let Some(report) = &report {
            print(report);
        }
    }
    Ok(report.as_ref().map_or(Exit::Done, exit))
}

/// Parses and checks a description.
///
/// # Errors
/// If it is not a description or is inconsistent; the error names the line or the field, and the remedy.
pub(crate) fn described(text: &str) -> anyhow::Result<Format> {
    Ok(toml::from_str::<RawFormat>(text)?.check()?)
}

/// A description in words.
pub(crate) fn in_words(format: &Format) -> String {
    let arrives = match format.framing() {
        Framing::Stream => "in a stream",
        Framing::Packet => "one a packet",
    };
    let (name, bytes) = (format.name(), format.frame_bytes());
    format!("frames of {name:?}, {bytes} bytes and {} elements, {arrives}", format.samples().elements())
}

fn read(path: &Path) -> anyhow::Result<Vec<u8>> {
    fs::read(path).with_context(|| format!("{} cannot be read", path.display()))
}

/// [`Exit::Done`] if every byte belongs to a frame.
fn exit(report: &CaptureReport) -> Exit {
    match (report.stats.frames, report.first_skipped_at) {
        (0, _) => Exit::Failed,
        (_, None) => Exit::Done,
        (_, Some(_)) => Exit::Degraded,
    }
}

fn print(report: &CaptureReport) {
    let stats = &report.stats;
    let at = |at: Option<usize>| at.map_or("-".to_owned(), |at| format!("at byte {at}"));
    let mismatch = |one: Option<Mismatch>| {
        one.map_or("-".to_owned(), |Mismatch { at, expected, found }| {
            format!("at byte {at}: {found:#x} instead of {expected:#x}")
        })
    };
    let strides: Vec<String> = report
        .strides
        .iter()
        .map(|stride| format!("{} bytes ({} times)", stride.bytes, stride.count))
        .collect();
    print_fields(&[
        ("capture", format!("{} bytes", report.bytes)),
        ("frames", format!("{}, the first {}", stats.frames, at(report.first_frame_at))),
        (
            "outside frames",
            format!("{} bytes, the first {}", stats.skipped_bytes, at(report.first_skipped_at)),
        ),
        ("sync bytes", format!("{} times", report.syncs)),
        ("sync spacing", if strides.is_empty() { "-".to_owned() } else { strides.join(", ") }),
        ("bad length", mismatch(report.first_bad_length)),
        ("bad trailer", at(report.first_bad_trailer_at)),
        ("bad checksum", mismatch(report.first_bad_checksum)),
        ("missing frames", stats.lost_frames.to_string()),
        ("stale frames", stats.stale_frames.to_string()),
    ]);
    for hint in &report.hints {
        say(&format!("hint: {hint}"));
    }
}

fn of_format(format: &Format) -> Value {
    json!({
        "name": format.name(),
        "framing": match format.framing() { Framing::Stream => "stream", Framing::Packet => "packet" },
        "frame_bytes": format.frame_bytes(),
        "elements": format.samples().elements(),
    })
}

fn of_capture(report: &CaptureReport) -> Value {
    let mismatch = |one: Option<Mismatch>| {
        one.map(|Mismatch { at, expected, found }| json!({ "at": at, "expected": expected, "found": found }))
    };
    let stats = &report.stats;
    json!({
        "bytes": report.bytes,
        "frames": stats.frames,
        "first_frame_at": report.first_frame_at,
        "skipped_bytes": stats.skipped_bytes,
        "first_skipped_at": report.first_skipped_at,
        "syncs": report.syncs,
        "strides": report.strides.iter().map(|one| json!({ "bytes": one.bytes, "count": one.count })).collect::<Vec<_>>(),
        "bad_lengths": stats.bad_lengths,
        "first_bad_length": mismatch(report.first_bad_length),
        "bad_ends": stats.bad_ends,
        "first_bad_trailer_at": report.first_bad_trailer_at,
        "bad_checksums": stats.bad_checksums,
        "first_bad_checksum": mismatch(report.first_bad_checksum),
        "lost_frames": stats.lost_frames,
        "stale_frames": stats.stale_frames,
        "hints": report.hints.iter().map(ToString::to_string).collect::<Vec<_>>(),
    })
}
