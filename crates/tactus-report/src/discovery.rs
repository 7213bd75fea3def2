//! The report of a discovery: what a model is missing, what was added, and how well that is known.
//!
//! [`discovery_html`] makes the page for people, [`discovery_json`] the numbers for machines. [`in_words`] is the verdict in a
//! sentence or two, [`not_shown`] what the data cannot show. Figures are functions of their own, as in
//! [`calibration`](crate::calibration).

mod active;
mod added;
mod after;
mod basis;
mod figures;
mod gap;
mod json;
mod next;
mod tried;
mod words;

use std::fmt;

use tactus_discover::{Discovery, Verdict};
use tactus_model::Array;

use crate::{
    document::{document, notes, sensor_header},
    markup::Text,
    numbers::digits,
    plot::number,
};

pub use active::{ActiveRun, AmbiguousEffect, command};
pub use figures::{element_maps, levels, residual_against};
pub use json::discovery_json;
pub use next::{Proposal, proposals};
pub use words::in_words;

/// A discovery, and what it was made from.
#[derive(Debug, Clone, Copy)]
pub struct DiscoveryReport<'a> {
    /// The rig's name.
    pub rig: &'a str,
    /// True if no physical sensor was read.
    pub simulated: bool,
    /// The elements.
    pub array: &'a Array,
    /// The runs, in order.
    pub data: &'a [DataSource],
    /// What is to be said of the files that were read; a sentence each.
    pub notes: &'a [String],
    /// What was measured on the way to decide between explanations, in order; its recordings are among the data.
    pub active: &'a [ActiveRun],
    /// What was found.
    pub discovery: &'a Discovery,
}

/// A run that was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DataSource {
    /// Run id.
    pub id: String,
    /// SHA-256 of its file, in hexadecimal; runs of one table share it.
    pub sha256: String,
    /// Frames of the run.
    pub frames: u64,
    /// Presses of the run.
    pub presses: u64,
}

/// Makes the page of a discovery: HTML with its style and figures inline.
///
/// It says first what the data cannot show, then the verdict; then where the gap is, what was tried and what was added,
/// the gap before and after, what stays unexplained, what to measure next, and what everything rests on. All text from
/// outside is escaped; nothing is loaded.
pub fn discovery_html(report: &DiscoveryReport<'_>) -> String {
    let page = fmt::from_fn(|f| {
        let about = "What the model of a sensor is missing &#183; rig";
        sensor_header(f, "Discovery", about, report.rig, report.array, report.simulated)?;
        remarks(f, report)?;
        verdict(f, report.discovery)?;
        gap::section(f, report)?;
        tried::section(f, report.discovery)?;
        added::section(f, report.discovery)?;
        active::section(f, report.active)?;
        after::sections(f, report.discovery)?;
        basis::section(f, report)
    });
    document(format!("Discovery \u{b7} {}", report.rig), page)
}

/// Why these data cannot show some effects: each reason with the effects that it hides.
pub fn not_shown(found: &Discovery) -> Vec<(&str, Vec<&'static str>)> {
    let mut reasons: Vec<(&str, Vec<&'static str>)> = Vec::new();
    for one in &found.not_shown {
        match reasons.iter_mut().find(|(reason, _)| *reason == one.reason) {
            Some((_, effects)) => effects.push(one.effect),
            None => reasons.push((&one.reason, vec![one.effect])),
        }
    }
    reasons
}

/// What to know before anything that was found.
fn remarks(f: &mut fmt::Formatter<'_>, report: &DiscoveryReport<'_>) -> fmt::Result {
    let found = report.discovery;
    let reasons =
        not_shown(found).into_iter().map(|(reason, effects)| format!("{}: {reason}", effects.join(", ")));
    let reasons: Vec<String> = reasons.collect();
    notes(f, "What these data cannot show, so that its absence below means nothing", &reasons)?;
    notes(f, "To know before using a number", &found.warnings)?;
    notes(f, "Of the files", report.notes)?;
    if reasons.is_empty() {
        writeln!(
            f,
            "<p class=\"message good\">These data could show every effect of the library, were it large enough.</p>"
        )?;
    }
    Ok(())
}

fn verdict(f: &mut fmt::Formatter<'_>, found: &Discovery) -> fmt::Result {
    let class = match found.verdict {
        Verdict::NothingMissing | Verdict::Explained => "good",
        Verdict::PartlyExplained | Verdict::Unexplained => "warn",
    };
    writeln!(
        f,
        "<section>\n<div class=\"headline\"><h2>Verdict</h2><span class=\"badge {class}\">{}</span></div>\n<p class=\"verdict\">{}</p>\n<dl class=\"figures\">",
        found.verdict.name(),
        Text(in_words(found))
    )?;
    let noise = found.noise_rms_counts;
    let level = |counts: f64| {
        let in_noise = noise.map_or_else(String::new, |noise| {
            format!(" <small>{} &#215; noise</small>", digits(counts / noise, 3))
        });
        format!("{}{in_noise}", digits(counts, 3))
    };
    let split = &found.split;
    for (name, figure) in [
        ("noise / counts", noise.map_or_else(|| "not known".into(), |rms| digits(rms, 3))),
        ("residual before / counts", level(found.base.heldout_rms_counts)),
        ("residual after / counts", level(found.final_.level.heldout_rms_counts)),
        ("gap closed", found.final_.shrink.map_or_else(|| "\u{2013}".into(), words::percent)),
        (
            "presses fitted",
            format!(
                "{} <small>{} held out</small>",
                number(split.train_presses as f64, 0),
                number(split.heldout_presses as f64, 0)
            ),
        ),
    ] {
        writeln!(f, "<div><dt>{name}</dt><dd>{figure}</dd></div>")?;
    }
    writeln!(f, "</dl>\n</section>")
}
