//! The truth of a set beside the report on it. Labels are opened only here.

use std::fs;

use anyhow::{Context, Result};
use serde::{Deserialize, de::DeserializeOwned};
use tactus_sets::Label;

use super::campaign::{Campaign, Planned};
use super::curves::Curve;
use super::drafts::{Covariate, Draft};
use super::run::{Places, Ran};
use super::score::{SHRINK_ERROR_MAX, Z_NAMEABLE};

/// The truth of a set, and what was reported.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Id of the set.
    pub id: String,
    /// Its purpose.
    pub campaign: Campaign,
    /// The hidden physics.
    pub truths: Vec<Truth>,
    /// Noise: standard deviation in counts, and correlation of a reading with the one before.
    pub noise: [f64; 2],
    /// The named effects; empty without a report.
    pub named: Vec<Named>,
    /// The effect that each round of the search added, even if it was withdrawn later.
    pub taken: Vec<String>,
    /// The verdict; `failed` without a report.
    pub verdict: String,
    /// Share of the gap on held-out presses that the model closes.
    pub shrink: Option<f64>,
    /// The same on presses deeper than any fitted one, if the method reports it.
    pub deeper_shrink: Option<f64>,
    /// Standard error of the shrink, as the report gives it; without it, the relative one of the gap.
    pub shrink_error: f64,
    /// Shrink of the first hidden effect, fitted alone in the first round; `None` if it was not fitted.
    pub alone_shrink: Option<f64>,
    /// The draft of what is left, if there is one.
    pub draft: Option<Draft>,
    /// Time of the processor in s, on one thread.
    pub seconds: f64,
    /// Greatest resident memory in MiB.
    pub peak_mib: f64,
}

/// A hidden physics.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// Id of the physics.
    pub physics: String,
    /// The effect of the library that it is an instance of; `None` outside the library.
    pub effect: Option<String>,
    /// True if it is a point of that effect's own parameters.
    pub is_library_point: bool,
    /// Separation from the base model after gains, offsets and spread are fitted.
    pub z: f64,
    /// Separation from the nearest wrong effect ([`ClassFits::z_name`](tactus_sets::ClassFits::z_name)), if it is computed; none outside the
    /// library, where every name is wrong.
    pub z_name: Option<f64>,
    /// Share of the gap that the effect's own best fit closes without noise, if it is computed.
    pub own_shrink: Option<f64>,
}

/// A named effect.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
pub struct Named {
    /// Name of the effect in the library.
    pub effect: String,
    /// Effects that the data cannot tell from it, as the report says.
    pub equivalent: Vec<String>,
}

impl Outcome {
    /// True if the verdict is neither `nothing-missing` nor `cannot-judge`, or an effect is named.
    pub fn is_detected(&self) -> bool {
        !self.has_failed() && (self.verdict != "nothing-missing" || !self.named.is_empty())
    }

    /// True if something was seen, and no name given to it.
    pub fn is_unexplained(&self) -> bool {
        self.verdict == "unexplained" && self.named.is_empty()
    }

    /// True if there is no report, or one that judges nothing.
    pub fn has_failed(&self) -> bool {
        self.verdict == "failed" || self.verdict == "cannot-judge"
    }

    /// True if every hidden effect is named.
    pub fn names_all(&self) -> bool {
        self.truths
            .iter()
            .all(|truth| self.named.iter().any(|named| truth.effect.as_ref() == Some(&named.effect)))
    }

    /// True if every hidden effect is named and nothing else.
    pub fn is_exact(&self) -> bool {
        self.names_all() && self.named.len() == self.truths.len()
    }

    /// True if every hidden effect is named or in a set of equivalents, each in a different one.
    pub fn holds_all(&self) -> bool {
        let effects: Vec<&str> = self.truths.iter().filter_map(|truth| truth.effect.as_deref()).collect();
        effects.len() == self.truths.len() && matches(&effects, &self.named)
    }

    /// Named effects that are neither hidden nor equivalent to a hidden one.
    pub fn wrong_names(&self) -> Vec<&str> {
        let is_true = |named: &&Named| {
            self.truths.iter().filter_map(|truth| truth.effect.as_deref()).any(|effect| named.may_be(effect))
        };
        self.named.iter().filter(|named| !is_true(named)).map(|named| named.effect.as_str()).collect()
    }

    /// The shrink, 0 without a report, over that of the first hidden effect, fitted alone without noise, if that is computed.
    pub fn shrink_to_own_fit(&self) -> Option<f64> {
        self.shrink_to(self.truths.first()?.own_shrink)
    }

    /// The same over that of the fit in the report. Where nothing is seen the report has none, so that misses are not in it.
    pub fn shrink_to_fit_in_report(&self) -> Option<f64> {
        self.shrink_to(self.alone_shrink)
    }

    fn shrink_to(&self, fit: Option<f64>) -> Option<f64> {
        Some(self.known_shrink()? / fit.filter(|fit| *fit > 0.0)?)
    }

    /// The shrink if it is known within a tenth; 0 without a report.
    pub fn known_shrink(&self) -> Option<f64> {
        if self.has_failed() {
            Some(0.0)
        } else {
            self.shrink.filter(|_| self.shrink_error <= SHRINK_ERROR_MAX)
        }
    }

    /// True if a hidden physics is a point of the library's own parameters.
    pub fn is_library_point(&self) -> bool {
        self.truths.iter().any(|truth| truth.is_library_point)
    }

    /// Separation of the hidden physics from the nearest wrong effect, of the least separate one; `None` if it is not computed.
    pub fn z_name(&self) -> Option<f64> {
        self.truths.iter().map(|truth| truth.z_name).reduce(|one, other| Some(one?.min(other?)))?
    }

    /// True if that is as large as a name asks for.
    pub fn is_apart(&self) -> bool {
        self.z_name().is_some_and(|z| z >= Z_NAMEABLE)
    }

    /// Separation of the weakest hidden physics; infinite if there is none.
    pub fn z(&self) -> f64 {
        self.truths.iter().map(|truth| truth.z).fold(f64::INFINITY, f64::min)
    }
}

impl Named {
    fn may_be(&self, effect: &str) -> bool {
        self.effect == effect || self.equivalent.iter().any(|other| other == effect)
    }
}

/// True if each effect can be matched with a different name.
fn matches(effects: &[&str], named: &[Named]) -> bool {
    let Some((first, rest)) = effects.split_first() else { return true };
    (0..named.len()).filter(|index| named[*index].may_be(first)).any(|index| {
        let others: Vec<Named> = named
            .iter()
            .enumerate()
            .filter(|(other, _)| *other != index)
            .map(|(_, one)| one.clone())
            .collect();
        matches(rest, &others)
    })
}

/// The part of `report.json` that is read.
#[derive(Debug, Deserialize)]
struct DiscoveryReport {
    split: Split,
    base: Level,
    rounds: Vec<Round>,
    steps: Vec<Named>,
    #[serde(rename = "final")]
    last: Last,
    verdict: String,
    #[serde(default)]
    draft: Option<Drafted>,
}

/// A draft; without a stage the report says why there is none.
#[derive(Debug, Deserialize)]
struct Drafted {
    stage: Option<String>,
    #[serde(default)]
    covariates: Vec<Covariate>,
    closed_share: Option<f64>,
}

#[derive(Debug, Deserialize)]
struct Split {
    frames: usize,
    train_presses: usize,
    heldout_presses: usize,
}

#[derive(Debug, Deserialize)]
struct Level {
    heldout_chi2: Option<f64>,
}

#[derive(Debug, Deserialize)]
struct Round {
    candidates: Vec<Candidate>,
    taken: Option<String>,
}

#[derive(Debug, Deserialize)]
struct Candidate {
    effect: String,
    shrink: Option<f64>,
}

#[derive(Debug, Deserialize)]
struct Last {
    shrink: Option<f64>,
    shrink_se: Option<f64>,
    deeper_shrink: Option<f64>,
}

/// The outcomes of the sets that have been run.
///
/// # Errors
/// If a label or a report cannot be read.
pub fn read(sets: &[Planned], places: &Places) -> Result<Vec<Outcome>> {
    sets.iter().filter(|set| places.ran(&set.id).exists()).map(|set| one(set, places)).collect()
}

fn one(set: &Planned, places: &Places) -> Result<Outcome> {
    let label: Label = parsed(&places.label(&set.id))?;
    let ran: Ran = parsed(&places.ran(&set.id))?;
    let report = places.report(&set.id);
    let report: Option<DiscoveryReport> = report.exists().then(|| parsed(&report)).transpose()?;
    let mut outcome = outcome(set, &label, &ran, report);
    if let Some(draft) = &mut outcome.draft {
        draft.curve = Curve::read(&set.id, places)?;
    }
    Ok(outcome)
}

fn outcome(set: &Planned, label: &Label, ran: &Ran, report: Option<DiscoveryReport>) -> Outcome {
    let truth = |dosed: &tactus_sets::PhysicsLabel| {
        let fits = dosed.class_fits();
        let effect = dosed.effect.as_deref();
        Truth {
            physics: dosed.id.clone(),
            effect: dosed.effect.clone(),
            is_library_point: dosed.is_library_point,
            z: dosed.z_beyond_spread,
            z_name: fits.as_ref().zip(effect).and_then(|(fits, effect)| fits.z_name(effect)),
            own_shrink: fits.as_ref().zip(effect).and_then(|(fits, effect)| fits.shrink(effect)),
        }
    };
    let first_effect = label.physics.first().and_then(|dosed| dosed.effect.as_deref());
    let alone_shrink = report.as_ref().and_then(|report| {
        let candidates = &report.rounds.first()?.candidates;
        candidates.iter().find(|one| Some(one.effect.as_str()) == first_effect)?.shrink
    });
    let readings = label.baseline_counts.len() as f64;
    Outcome {
        id: set.id.clone(),
        campaign: set.campaign,
        truths: label.physics.iter().map(truth).collect(),
        noise: [label.noise.rms_counts, label.noise.phi],
        shrink: report.as_ref().and_then(|report| report.last.shrink),
        deeper_shrink: report.as_ref().and_then(|report| report.last.deeper_shrink),
        shrink_error: report.as_ref().map_or(f64::INFINITY, |report| {
            report.last.shrink_se.unwrap_or_else(|| gap_error(report, readings, label.noise.phi))
        }),
        alone_shrink,
        taken: report
            .iter()
            .flat_map(|report| &report.rounds)
            .filter_map(|round| round.taken.clone())
            .collect(),
        draft: report.as_ref().and_then(|report| {
            let Drafted { stage, covariates, closed_share } = report.draft.as_ref()?;
            let (covariates, closed_share) = (covariates.clone(), *closed_share);
            Some(Draft { stage: stage.clone()?, covariates, closed_share, curve: None })
        }),
        seconds: ran.processor_s,
        peak_mib: ran.peak_mib,
        verdict: report.as_ref().map_or_else(|| "failed".into(), |report| report.verdict.clone()),
        named: report.map_or_else(Vec::new, |report| report.steps),
    }
}

/// Relative standard error of the gap, `sqrt(2 (1 + phi^2) / (n (1 - phi^2))) / (chi2 - 1)`: that of a mean of the squares of `n`
/// correlated readings.
fn gap_error(report: &DiscoveryReport, elements: f64, phi: f64) -> f64 {
    let Split { frames, train_presses, heldout_presses } = report.split;
    let share = heldout_presses as f64 / (train_presses + heldout_presses) as f64;
    let readings = frames as f64 * share * elements;
    let error = (2.0 * (1.0 + phi * phi) / (readings * (1.0 - phi * phi))).sqrt();
    let gap = report.base.heldout_chi2.unwrap_or(1.0) - 1.0;
    if gap > 0.0 { error / gap } else { f64::INFINITY }
}

pub(super) fn parsed<T: DeserializeOwned>(path: &std::path::Path) -> Result<T> {
    let text = fs::read_to_string(path).with_context(|| path.display().to_string())?;
    serde_json::from_str(&text).with_context(|| path.display().to_string())
}

#[cfg(test)]
#[path = "outcome_tests.rs"]
pub(super) mod tests;
