//! The report of a calibration: results, errors and data.
//!
//! [`calibration_html`] makes the page. Its figures are separate functions from fits to a [`Sheet`], which displays itself
//! as SVG: Figures 2a, 2b, 5a and 5b of the paper, and maps of the array.

mod elements;
mod figures;
pub(crate) mod health;
mod registration;
mod response;
mod spread;

use std::fmt;

use tactus_calibrate::Calibration;
use tactus_model::{Array, Psf, Registration};

use crate::{
    document::{document, notes, sensor_header},
    markup::Text,
    numbers::{count, digits, short},
    plot::Sheet,
};

pub use elements::{health_map, sensitivity_map};
pub use figures::{point_spreads, recalibrated, responses, spread_against_thickness};

/// A calibration and the values declared before it.
#[derive(Debug, Clone, Copy)]
pub struct CalibrationReport<'a> {
    /// The rig's name.
    pub rig: &'a str,
    /// True if no physical sensor was read.
    pub simulated: bool,
    /// The sensor's array.
    pub array: &'a Array,
    /// Registration in the rig file.
    pub declared_registration: Registration,
    /// Point spread in the rig file.
    pub declared_psf: Psf,
    /// What calibration found, to be shown.
    pub calibration: &'a Calibration,
    /// Sentences about defects of the files.
    pub notes: &'a [String],
}

/// Makes the page of a calibration: HTML with its style and figures inline.
///
/// The order is: data; warnings and what could not be determined; registration; faulty elements; responses; spread.
/// Missing parts are named. All text from outside is escaped; nothing is loaded.
pub fn calibration_html(report: &CalibrationReport<'_>) -> String {
    let page = fmt::from_fn(|f| {
        sensor_header(f, "Calibration", "Rig", report.rig, report.array, report.simulated)?;
        basis(f, report)?;
        remarks(f, report)?;
        sections(f, report, FigurePlacement::Inline)
    });
    document(format!("Calibration \u{b7} {}", report.rig), page)
}

/// Where the page shows the paper's figures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FigurePlacement {
    /// In the sections of their results.
    Inline,
    /// Elsewhere on the page.
    Elsewhere,
}

/// A figure of the paper with its caption.
pub(crate) struct Drawing {
    /// Number in the paper, such as `2a`.
    pub(crate) number: &'static str,
    pub(crate) title: &'static str,
    pub(crate) caption: String,
    pub(crate) sheet: Sheet,
}

/// The paper's figures that this calibration has results for.
pub(crate) fn drawings(report: &CalibrationReport<'_>) -> Vec<Drawing> {
    let response = report.calibration.response.iter().flat_map(response::drawings);
    response.chain(spread::drawings(report)).collect()
}

/// All results, one section per step.
pub(crate) fn sections(
    f: &mut fmt::Formatter<'_>,
    report: &CalibrationReport<'_>,
    figures: FigurePlacement,
) -> fmt::Result {
    registration::section(f, report)?;
    health::section(f, report)?;
    response::section(f, report, figures)?;
    spread::section(f, report, figures)
}

/// The data of the calibration.
pub(crate) fn basis(f: &mut fmt::Formatter<'_>, report: &CalibrationReport<'_>) -> fmt::Result {
    let data = &report.calibration.data;
    let left_out = match data.frames_left_out {
        0 => String::new(),
        frames => format!(" <small>{} left out</small>", count(frames)),
    };
    writeln!(f, "<dl class=\"figures\">")?;
    for (name, figure) in [
        ("runs", count(data.runs.len() as u64)),
        ("presses", count(data.presses as u64)),
        ("dwells", count(data.dwells as u64)),
        ("frames", count(data.frames) + &left_out),
        ("coverings", count(data.coverings_mm.len() as u64)),
    ] {
        writeln!(f, "<div><dt>{name}</dt><dd>{figure}</dd></div>")?;
    }
    writeln!(f, "</dl>\n<div class=\"facts\">\n<table>")?;
    for (nth, run) in data.runs.iter().enumerate() {
        let head = if nth == 0 { "runs" } else { "" };
        writeln!(f, "<tr><th>{head}</th><td><code>{}</code></td></tr>", Text(run))?;
    }
    writeln!(f, "</table>\n<table>")?;
    let coverings: Vec<String> = data.coverings_mm.iter().map(|covering| short(*covering, 3)).collect();
    let coverings = if coverings.is_empty() { "none".into() } else { coverings.join(", ") + " mm" };
    let noise = report.calibration.noise_rms_counts;
    let noise = noise.map_or_else(|| "unknown".into(), |rms| digits(rms, 3) + " counts rms");
    for (name, fact) in [
        ("coverings pressed", coverings),
        ("sensitivities for", format!("a covering of {} mm", short(data.reference_covering_mm, 3))),
        ("noise at rest", format!("{noise}, median element")),
    ] {
        writeln!(f, "<tr><th>{name}</th><td>{fact}</td></tr>")?;
    }
    writeln!(f, "</table>\n</div>")
}

/// Reservations: undetermined results, warnings, defects of the files.
pub(crate) fn remarks(f: &mut fmt::Formatter<'_>, report: &CalibrationReport<'_>) -> fmt::Result {
    let Calibration { warnings, missing, .. } = report.calibration;
    notes(f, "Could not be determined", missing)?;
    notes(f, "To know before using a number", warnings)?;
    notes(f, "About the files", report.notes)?;
    if warnings.is_empty() && missing.is_empty() {
        writeln!(f, "<p class=\"message good\">Every step was completed without warnings.</p>")?;
    }
    Ok(())
}

/// Writes a figure with its caption.
fn figure(f: &mut fmt::Formatter<'_>, drawing: &Drawing) -> fmt::Result {
    let Drawing { number, title, caption, sheet } = drawing;
    writeln!(
        f,
        "<figure>\n{sheet}\n<figcaption><b>Figure {number}. {}.</b> {}</figcaption>\n</figure>",
        Text(title),
        Text(caption)
    )
}
