//! The data behind a discovery.

use std::fmt;

use super::{DiscoveryReport, LabEffect};
use crate::{
    document::{Column, Table},
    numbers::{count, digits, short},
};

pub(super) fn section(f: &mut fmt::Formatter<'_>, report: &DiscoveryReport<'_>) -> fmt::Result {
    let found = report.discovery;
    let split = &found.split;
    let whole = |values: &[f64]| {
        let values: Vec<String> = values.iter().map(|value| short(*value, 3)).collect();
        if values.is_empty() { "none".into() } else { values.join(", ") + " mm" }
    };
    let noise = match (found.floor.rms_counts(), found.floor.interval90_counts()) {
        (Some(rms), Some([least, most])) => format!(
            "{} counts rms, from {} (90 % interval {} to {})",
            digits(rms, 3),
            found.floor.source(),
            digits(least, 3),
            digits(most, 3)
        ),
        _ => "unknown: nothing repeats".into(),
    };
    let tolerance = found.tolerance_counts.map_or_else(
        || "none declared".into(),
        |counts| format!("{} counts rms, declared beforehand", digits(counts, 3)),
    );
    let sensor = if report.simulated { "SIMULATED: no physical sensor was read" } else { "physical" };
    writeln!(f, "<section>\n<h2>Data</h2>\n<div class=\"facts\">\n<table>")?;
    for (name, fact) in [
        ("sensor", sensor.into()),
        ("frames", count(split.frames as u64)),
        ("noise", noise),
        ("tolerance", tolerance),
        ("seed", found.seed.to_string()),
    ] {
        writeln!(f, "<tr><th>{name}</th><td>{fact}</td></tr>")?;
    }
    writeln!(f, "</table>\n<table>")?;
    for (name, fact) in [
        ("presses fitted", count(split.train_presses as u64)),
        ("held out", format!("{} whole presses", count(split.heldout_presses as u64))),
        ("whole depths", whole(&split.heldout_depths_mm)),
        ("whole coverings", whole(&split.heldout_coverings_mm)),
    ] {
        writeln!(f, "<tr><th>{name}</th><td>{fact}</td></tr>")?;
    }
    let mut table = Table::new(&[
        Column::Name("run"),
        Column::Number("frames"),
        Column::Number("presses"),
        Column::Prose("SHA-256 of its file"),
    ]);
    for source in report.data {
        let (frames, presses) = (count(source.frames), count(source.presses));
        table.row([&source.id, &frames, &presses, &source.sha256]);
    }
    writeln!(f, "</table>\n</div>\n{table}")?;
    if !report.lab.is_empty() {
        let mut table = Table::new(&[
            Column::Name("effect of the lab"),
            Column::Name("status"),
            Column::Prose("version (SHA-256 of its table)"),
        ]);
        for LabEffect { name, status, version } in report.lab {
            table.row([name, status.name(), version]);
        }
        writeln!(f, "<p>Tried beside the effects of the library:</p>\n{table}")?;
    }
    writeln!(f, "</section>")
}
