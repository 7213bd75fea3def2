//! Other ways to go about it, on the same sets.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use serde::Serialize;

use super::campaign::{Campaign, Planned};
use super::outcome::{Outcome, read};
use super::rate::{Rate, quantile};
use super::run::Places;
use super::score::{SHRINK_ERROR_MAX, Shrink, Z_SEPARATE};

/// How one way fares.
#[derive(Debug, Clone, Serialize)]
pub struct Ablation {
    /// Which way; `tactus` is ours.
    pub method: String,
    /// Anything is said to be missing where nothing is.
    pub false_alarms: Rate,
    /// One effect, from [`Z_SEPARATE`] on: named, and nothing else; of all.
    pub exact: Rate,
    /// The same: named or in a set of equivalents.
    pub in_set: Rate,
    /// The same: an effect is named that is not there, nor equivalent to one that is.
    pub wrong: Rate,
    /// Both of two are named.
    pub pairs: Rate,
    /// Outside the library: unexplained.
    pub unexplained: Rate,
    /// Outside the library: a name.
    pub outside_named: Rate,
    /// Shrink on held-out presses of all depths, where the gap is known.
    pub shrink: Shrink,
    /// Shrink on presses deeper than any fitted, on the same sets.
    pub deeper_shrink: Shrink,
    /// Median of a set's seconds on one thread.
    pub seconds: Option<f64>,
}

/// Ours, which lies in `places`, and every other way that lies in a folder of `peers` there; each on the sets that all have done.
///
/// # Errors
/// If a label or a report cannot be read.
pub fn ablations(sets: &[Planned], places: &Places) -> Result<Vec<Ablation>> {
    let mut ways = vec![("tactus".to_owned(), places.clone())];
    let peers = places.work.join("peers");
    if peers.exists() {
        let at = |path: &Path| path.display().to_string();
        for entry in fs::read_dir(&peers).with_context(|| at(&peers))? {
            let path = entry.with_context(|| at(&peers))?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            ways.push((name, Places { work: path, sealed: places.sealed.clone() }));
        }
    }
    ways[1..].sort_by(|one, other| one.0.cmp(&other.0));
    let is_done = |set: &&Planned| ways.iter().all(|(_, places)| places.ran(&set.id).exists());
    let common: Vec<Planned> = sets.iter().filter(is_done).cloned().collect();
    ways.into_iter().map(|(method, places)| Ok(Ablation::new(method, &read(&common, &places)?))).collect()
}

impl Ablation {
    fn new(method: String, outcomes: &[Outcome]) -> Self {
        let of = |campaign: Campaign| outcomes.iter().filter(move |set| set.campaign == campaign);
        let separate = || of(Campaign::Names).filter(|set| set.z() >= Z_SEPARATE - 0.5);
        let known = || separate().filter(|set| set.gap_error <= SHRINK_ERROR_MAX);
        Self {
            method,
            false_alarms: Rate::of(of(Campaign::FalseAlarms), |set| set.is_detected() || set.has_failed()),
            exact: Rate::of(separate(), Outcome::is_exact),
            in_set: Rate::of(separate(), Outcome::holds_all),
            wrong: Rate::of(separate(), |set| !set.wrong_names().is_empty()),
            pairs: Rate::of(of(Campaign::Pairs), Outcome::names_all),
            unexplained: Rate::of(of(Campaign::Outside), |set| set.verdict == "unexplained"),
            outside_named: Rate::of(of(Campaign::Outside), |set| !set.named.is_empty()),
            shrink: Shrink::new(known().filter_map(|set| set.shrink)),
            deeper_shrink: Shrink::new(known().filter_map(|set| set.deeper_shrink)),
            seconds: quantile(outcomes.iter().map(|set| set.seconds).collect(), 0.5),
        }
    }
}

#[cfg(test)]
#[path = "ablation_tests.rs"]
mod tests;
