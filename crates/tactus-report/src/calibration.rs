//! The report of a calibration: what was found about a sensor, how well it is known, and from what.
//!
//! [`calibration_html`] makes the page. Its figures are functions of their own from what was fitted to a
//! [`Sheet`], which displays itself as SVG: Figures 2a, 2b, 5a and 5b of the paper, and maps of the
//! array.

mod elements;
mod figures;
mod health;
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

/// A calibration, and what it started from.
#[derive(Debug, Clone, Copy)]
pub struct CalibrationReport<'a> {
    /// The rig's name.
    pub rig: &'a str,
    /// True if no physical sensor was read.
    pub simulated: bool,
    /// The elements.
    pub array: &'a Array,
    /// Where the sensor was said to lie.
    pub declared_registration: Registration,
    /// The spread it was said to have.
    pub declared_psf: Psf,
    /// What was found.
    pub calibration: &'a Calibration,
    /// What is to be said of the files that were read; a sentence each.
    pub notes: &'a [String],
}

/// Makes the page of a calibration: HTML with its style and figures inline.
///
/// It says first what everything rests on, what to beware of and what could not be determined; then where the sensor
/// lies, which elements are faulty, how the others answer, and how the covering spreads. What is absent is said to be.
/// All text from outside is escaped; nothing is loaded.
pub fn calibration_html(report: &CalibrationReport<'_>) -> String {
    let page = fmt::from_fn(|f| {
        sensor_header(f, "Calibration", "Rig", report.rig, report.array, report.simulated)?;
        basis(f, report)?;
        remarks(f, report)?;
        sections(f, report, FigurePlacement::Inline)
    });
    document(format!("Calibration \u{b7} {}", report.rig), page)
}

/// Where the paper's figures stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FigurePlacement {
    /// In their sections.
    Inline,
    /// Elsewhere on the page.
    Elsewhere,
}

/// A figure and what is to be said of it.
pub(crate) struct Drawing {
    /// In the paper.
    pub(crate) number: &'static str,
    pub(crate) title: &'static str,
    pub(crate) caption: String,
    pub(crate) sheet: Sheet,
}

/// The paper's figures that this calibration gives.
pub(crate) fn drawings(report: &CalibrationReport<'_>) -> Vec<Drawing> {
    let response = report.calibration.response.iter().flat_map(response::drawings);
    response.chain(spread::drawings(report)).collect()
}

/// All that was found, one section for each step.
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

/// What the calibration rests on.
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
    let noise = noise.map_or_else(|| "not known".into(), |rms| digits(rms, 3) + " counts rms");
    for (name, fact) in [
        ("coverings pressed", coverings),
        ("sensitivities for", format!("a covering of {} mm", short(data.reference_covering_mm, 3))),
        ("noise at rest", format!("{noise}, median element")),
    ] {
        writeln!(f, "<tr><th>{name}</th><td>{fact}</td></tr>")?;
    }
    writeln!(f, "</table>\n</div>")
}

/// What to know before any number: of the files, of the numbers, of what is absent.
pub(crate) fn remarks(f: &mut fmt::Formatter<'_>, report: &CalibrationReport<'_>) -> fmt::Result {
    let Calibration { warnings, missing, .. } = report.calibration;
    notes(f, "Could not be determined", missing)?;
    notes(f, "To know before using a number", warnings)?;
    notes(f, "Of the files", report.notes)?;
    if warnings.is_empty() && missing.is_empty() {
        writeln!(
            f,
            "<p class=\"message good\">Every step could be done, and nothing speaks against its result.</p>"
        )?;
    }
    Ok(())
}

/// A figure among the text of its section.
fn figure(f: &mut fmt::Formatter<'_>, drawing: &Drawing) -> fmt::Result {
    let Drawing { number, title, caption, sheet } = drawing;
    writeln!(
        f,
        "<figure>\n{sheet}\n<figcaption><b>Figure {number}. {}.</b> {}</figcaption>\n</figure>",
        Text(title),
        Text(caption)
    )
}
