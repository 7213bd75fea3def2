//! The report of a discovery: which effects a model was missing, and how certain that is.
//!
//! [`discovery_html`] makes the page, [`discovery_json`] the numbers. [`in_words`] is the verdict in a sentence or two,
//! [`not_shown`] the effects that the data cannot show. Figures are separate functions, as in
//! [`calibration`](crate::calibration).

mod active;
mod added;
mod after;
mod basis;
mod draft;
mod faulty;
mod figures;
mod gap;
mod json;
mod next;
mod tried;
mod words;

use std::fmt;

use tactus_discover::{Closed, Discovery, Verdict};
use tactus_model::Array;
use tactus_schema::draft::DraftStatus;

use crate::{
    document::{document, notes, sensor_header},
    markup::Text,
    numbers::digits,
    plot::number,
};

pub use active::{ActiveRun, AmbiguousEffect, command};
pub use draft::status as draft_status;
pub use figures::{
    draft_curve, draft_picture, draft_weights, element_maps, free_curve, residual_against, staircase,
};
pub use gap::gap_in_words;
pub use json::discovery_json;
pub use next::{Proposal, not_proposed, nothing_open, open, proposals};
pub use words::{closed, definition, flags, in_words};

/// A discovery and its data.
#[derive(Debug, Clone, Copy)]
pub struct DiscoveryReport<'a> {
    /// The rig's name.
    pub rig: &'a str,
    /// True if no physical sensor was read.
    pub simulated: bool,
    /// The sensor's array.
    pub array: &'a Array,
    /// The analysed runs, in order of time.
    pub data: &'a [DataSource],
    /// Sentences about defects of the files.
    pub notes: &'a [String],
    /// Experiments that were run to decide between explanations, in order; their recordings are among the data.
    pub active: &'a [ActiveRun],
    /// Why no further experiment was run, although there was a round for it.
    pub active_ended: Option<&'a str>,
    /// What those experiments say of drafts, one sentence each.
    pub settled: &'a [String],
    /// The lab's own effects that were tried beside those of the library.
    pub lab: &'a [LabEffect],
    /// What discovery found, to be shown.
    pub discovery: &'a Discovery,
}

/// An effect of the lab's own library.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LabEffect {
    /// Its name.
    pub name: String,
    /// What became of it.
    pub status: DraftStatus,
    /// Its version: the SHA-256 of its table with an empty name, in hexadecimal. A new name or status leaves it as it is.
    pub version: String,
}

/// An analysed run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DataSource {
    /// Run id.
    pub id: String,
    /// SHA-256 of its file, in hexadecimal; the runs of one table share it.
    pub sha256: String,
    /// Number of frames in the run.
    pub frames: u64,
    /// Number of presses in the run.
    pub presses: u64,
}

/// Makes the page of a discovery: HTML with its style and figures inline.
///
/// The order is: what the data cannot show; the verdict; faulty elements; where the gap is; what was tried and added; the gap before and
/// after; what stays unexplained; what to measure next; the data. All text from outside is escaped; nothing is loaded.
pub fn discovery_html(report: &DiscoveryReport<'_>) -> String {
    let page = fmt::from_fn(|f| {
        let about = "What the model of a sensor is missing &#183; rig";
        sensor_header(f, "Discovery", about, report.rig, report.array, report.simulated)?;
        remarks(f, report)?;
        verdict(f, report.discovery)?;
        faulty::section(f, report)?;
        gap::section(f, report)?;
        tried::section(f, report.discovery)?;
        added::section(f, report)?;
        active::section(f, report)?;
        after::sections(f, report)?;
        basis::section(f, report)
    });
    document(format!("Discovery \u{b7} {}", report.rig), page)
}

/// The effects that these data cannot show, grouped by reason.
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

/// Reservations, ahead of the results.
fn remarks(f: &mut fmt::Formatter<'_>, report: &DiscoveryReport<'_>) -> fmt::Result {
    let found = report.discovery;
    let reasons =
        not_shown(found).into_iter().map(|(reason, effects)| format!("{}: {reason}", effects.join(", ")));
    let reasons: Vec<String> = reasons.collect();
    notes(f, "Effects that these data cannot show; their absence below means nothing", &reasons)?;
    notes(f, "To know before using a number", &found.warnings)?;
    notes(f, "About the files", report.notes)?;
    if reasons.is_empty() {
        writeln!(
            f,
            "<p class=\"message good\">These data can show every effect of the library, if it is large enough.</p>"
        )?;
    }
    Ok(())
}

fn verdict(f: &mut fmt::Formatter<'_>, found: &Discovery) -> fmt::Result {
    let class = match found.verdict {
        Verdict::NothingMissing | Verdict::Explained => "good",
        Verdict::CannotJudge | Verdict::PartlyExplained | Verdict::Unexplained => "warn",
    };
    writeln!(
        f,
        "<section>\n<div class=\"headline\"><h2>Verdict</h2><span class=\"badge {class}\">{}</span></div>\n<p class=\"verdict\">{}</p>\n<dl class=\"figures\">",
        found.verdict.name(),
        Text(in_words(found))
    )?;
    let noise = found.floor.rms_counts();
    let level = |counts: f64| {
        let in_noise = noise.map_or_else(String::new, |noise| {
            format!(" <small>{} &#215; noise</small>", digits(counts / noise, 3))
        });
        format!("{}{in_noise}", digits(counts, 3))
    };
    let structured = found.final_.level.structured.map_or_else(
        || "unknown".to_owned(),
        |part| {
            let upper = if part.upper_noise.is_finite() {
                format!("&#8804; {}", digits(part.upper_noise, 3))
            } else {
                "no bound".to_owned()
            };
            format!("{} <small>{upper}</small>", digits(part.rms_noise, 3))
        },
    );
    let share = |closed: Option<Closed>| {
        let Some(of_gap) = closed else { return "\u{2013}".to_owned() };
        let (share, error) = words::closed_and_error(of_gap);
        let error = error.map_or_else(String::new, |error| format!(" <small>&#177; {error}</small>"));
        format!("{share}{error}")
    };
    let split = &found.split;
    for (name, figure) in [
        ("noise / counts", noise.map_or_else(|| "unknown".into(), |rms| digits(rms, 3))),
        ("residual before / counts", level(found.base.heldout_rms_counts)),
        ("residual after / counts", level(found.final_.level.heldout_rms_counts)),
        ("structured / noise, 95 % bound", structured),
        ("gap closed", share(found.final_.closed)),
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
    if let Some(Ok(one)) = &found.draft {
        let name = Text(&one.draft.name);
        let (with, closes) = (level(one.heldout_rms_after_counts), share(one.closed));
        writeln!(
            f,
            "</dl>\n<dl class=\"figures\">\n<div><dt>with {name} / counts</dt><dd>{with}</dd></div>\n\
             <div><dt>{name} closes, of what is left</dt><dd>{closes}</dd></div>"
        )?;
    }
    writeln!(f, "</dl>\n</section>")
}
