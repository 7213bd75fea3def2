//! Other methods on the same sets.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use serde::Serialize;

use super::campaign::{Campaign, Planned};
use super::drafts::DraftScores;
use super::outcome::{Outcome, read};
use super::rate::{Rate, quantile};
use super::run::Places;
use super::score::{SHRINK_ERROR_MAX, Shrink, Z_SEPARATE};

/// The scores of one method.
#[derive(Debug, Clone, Serialize)]
pub struct Ablation {
    /// Name of the method; `tactus` is the real search.
    pub method: String,
    /// Detections in sets without hidden physics.
    pub false_alarms: Rate,
    /// Sets with one effect, from [`Z_SEPARATE`] on: it is named and nothing else; of all those sets.
    pub exact: Rate,
    /// The same sets: it is named or in a set of equivalents.
    pub in_set: Rate,
    /// The same sets: a named effect is neither hidden nor equivalent to the hidden one.
    pub wrong: Rate,
    /// Sets with two effects: both are named.
    pub pairs: Rate,
    /// Sets outside the library: the verdict is `unexplained`.
    pub unexplained: Rate,
    /// Sets outside the library: an effect is named.
    pub outside_named: Rate,
    /// Drafts of what no effect explains.
    pub drafts: DraftScores,
    /// Shrink on held-out presses of all depths, where it is known within a tenth.
    pub shrink: Shrink,
    /// Shrink on presses deeper than any fitted one, on the same sets.
    pub deeper_shrink: Shrink,
    /// Median time of a set on one thread.
    pub seconds: Option<f64>,
}

/// The scores of `tactus`, whose reports are in `places`, and of each method with a folder in `peers` there; all on the sets that
/// every one of them has run.
///
/// # Errors
/// If a label or a report cannot be read.
pub fn ablations(sets: &[Planned], places: &Places) -> Result<Vec<Ablation>> {
    let mut methods = vec![("tactus".to_owned(), places.clone())];
    let peers = places.work.join("peers");
    if peers.exists() {
        let at = |path: &Path| path.display().to_string();
        for entry in fs::read_dir(&peers).with_context(|| at(&peers))? {
            let path = entry.with_context(|| at(&peers))?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            methods.push((name, Places { work: path, labels: places.labels.clone() }));
        }
    }
    methods[1..].sort_by(|one, other| one.0.cmp(&other.0));
    let is_done = |set: &&Planned| methods.iter().all(|(_, places)| places.ran(&set.id).exists());
    let common: Vec<Planned> = sets.iter().filter(is_done).cloned().collect();
    methods.into_iter().map(|(method, places)| Ok(Ablation::new(method, &read(&common, &places)?))).collect()
}

impl Ablation {
    fn new(method: String, outcomes: &[Outcome]) -> Self {
        let of = |campaign: Campaign| outcomes.iter().filter(move |set| set.campaign == campaign);
        let separate = || of(Campaign::Names).filter(|set| set.z() >= Z_SEPARATE - 0.5);
        let known = || separate().filter(|set| set.shrink_error <= SHRINK_ERROR_MAX);
        Self {
            method,
            false_alarms: Rate::of(of(Campaign::FalseAlarms), |set| set.is_detected() || set.has_failed()),
            exact: Rate::of(separate(), Outcome::is_exact),
            in_set: Rate::of(separate(), Outcome::holds_all),
            wrong: Rate::of(separate(), |set| !set.wrong_names().is_empty()),
            pairs: Rate::of(of(Campaign::Pairs), Outcome::names_all),
            unexplained: Rate::of(of(Campaign::Outside), |set| set.verdict == "unexplained"),
            outside_named: Rate::of(of(Campaign::Outside), |set| !set.named.is_empty()),
            drafts: DraftScores::new(
                &of(Campaign::FalseAlarms).collect::<Vec<_>>(),
                &of(Campaign::Names).collect::<Vec<_>>(),
                &of(Campaign::Outside).collect::<Vec<_>>(),
            ),
            shrink: Shrink::new(known().filter_map(|set| set.shrink)),
            deeper_shrink: Shrink::new(known().filter_map(|set| set.deeper_shrink)),
            seconds: quantile(outcomes.iter().map(|set| set.seconds).collect(), 0.5),
        }
    }
}

#[cfg(test)]
#[path = "ablation_tests.rs"]
mod tests;
