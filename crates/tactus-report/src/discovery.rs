//! The report of a discovery: what a model is missing, what was added, and how well that is known.
//!
//! [`discovery_json`] is for machines, [`in_words`] the verdict in a sentence or two, [`not_shown`] what the
//! data cannot show.

mod json;
mod words;

use std::fmt;

use tactus_discover::Discovery;
use tactus_model::Array;

use crate::document::document;

pub use json::discovery_json;
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

/// Makes the page of a discovery: HTML with its style and figures inline.
pub fn discovery_html(report: &DiscoveryReport<'_>) -> String {
    let page = fmt::from_fn(|f| writeln!(f, "<p>{}</p>", crate::markup::Text(in_words(report.discovery))));
    document(format!("Discovery \u{b7} {}", report.rig), page)
}
