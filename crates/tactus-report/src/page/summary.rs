//! The header and the facts of the run.

use std::fmt;

use crate::{
    document::SIMULATED_BADGE,
    markup::Text,
    numbers::{count, duration, plural},
    run::{RunReport, RunSummary},
};

pub(super) fn header(f: &mut fmt::Formatter<'_>, summary: &RunSummary) -> fmt::Result {
    let (word, class) = match summary.exit_status {
        Some("done") => ("done", "good"),
        Some(word @ ("degraded" | "stopped")) => (word, "warn"),
        Some(word) => (word, "bad"),
        None => ("never closed", "bad"),
    };
    writeln!(f, "<header>\n<div class=\"headline\"><h1>{}</h1>", Text(&summary.experiment))?;
    writeln!(f, "<span class=\"badge {class}\">{word}</span>")?;
    if summary.simulated {
        writeln!(f, "{SIMULATED_BADGE}")?;
    }
    writeln!(
        f,
        "</div>\n<p class=\"under\">Run <code>{}</code> &#183; rig {} &#183; {}</p>",
        Text(&summary.run_id),
        Text(&summary.rig),
        Text(&summary.started)
    )?;
    if !summary.message.is_empty() {
        writeln!(f, "<p class=\"message {class}\">{}</p>", Text(&summary.message))?;
    }
    writeln!(f, "</header>")
}

pub(super) fn facts(f: &mut fmt::Formatter<'_>, report: &RunReport) -> fmt::Result {
    let summary = &report.summary;
    let of = |planned: usize| match summary.planned {
        Some(counts) => format!(" <small>of {} planned</small>", count(counts[planned].into())),
        None => String::new(),
    };
    let planned = summary
        .duration_planned_s
        .map_or_else(String::new, |seconds| format!(" <small>of {} planned</small>", duration(seconds)));
    let lost = if summary.gaps == 0 {
        String::new()
    } else {
        format!(" <small>in {}</small>", plural(summary.gaps, "gap"))
    };
    writeln!(f, "<dl class=\"figures\">")?;
    for (name, figure) in [
        ("presses", count(summary.presses.into()) + &of(0)),
        ("dwells", count(summary.dwells.into()) + &of(1)),
        ("frames", count(summary.frames)),
        ("frames lost", count(summary.frames_lost) + &lost),
        ("duration", duration(summary.duration_s) + &planned),
    ] {
        writeln!(f, "<div><dt>{name}</dt><dd>{figure}</dd></div>")?;
    }
    writeln!(f, "</dl>\n<div class=\"facts\">\n<table>")?;
    let unknown = "not recorded";
    let array = &report.array;
    row(f, "started by", Text(&summary.who))?;
    row(f, "started", Text(&summary.started))?;
    row(f, "rig", Text(&summary.rig))?;
    row(
        f,
        "array",
        format_args!(
            "{}, {} rows x {} columns at {} Hz",
            Text(array.name()),
            array.rows(),
            array.cols(),
            array.rate_hz()
        ),
    )?;
    row(f, "covering", format_args!("{} mm", summary.covering_mm))?;
    row(f, "indenter", Text(&summary.indenter))?;
    for (nth, (name, version)) in summary.versions.iter().enumerate() {
        row(f, if nth == 0 { "versions" } else { "" }, format_args!("{} {}", Text(name), Text(version)))?;
    }
    writeln!(f, "</table>\n<table>")?;
    row(f, "script", Text(&summary.script))?;
    match &summary.script_sha256 {
        Some(hash) => row(f, "SHA-256", format_args!("<code>{}</code>", Text(hash)))?,
        None => row(f, "SHA-256", unknown)?,
    }
    match summary.seed {
        Some(seed) => row(f, "seed", seed)?,
        None => row(f, "seed", unknown)?,
    }
    for (nth, (name, value)) in summary.parameters.iter().enumerate() {
        let head = if nth == 0 { "parameters" } else { "" };
        row(f, head, format_args!("<code>{} = {}</code>", Text(name), Text(value)))?;
    }
    writeln!(f, "</table>\n</div>")
}

/// A row of a table of facts. `value` is HTML.
fn row(f: &mut fmt::Formatter<'_>, name: &str, value: impl fmt::Display) -> fmt::Result {
    writeln!(f, "<tr><th>{name}</th><td>{value}</td></tr>")
}
