//! How near rivals without a name come to the effects that are named, rightly or wrongly: for the constants of that contest.

use std::fmt;

use anyhow::Result;
use serde::Deserialize;
use tactus_discover::constants::TAKEN_SHARE;
use tactus_sets::Label;

use super::campaign::Planned;
use super::outcome::parsed;
use super::rate::quantile;
use super::run::Places;

/// A class that was added to a model, or would have been, and what a rival without a name does.
#[derive(Debug, Clone, PartialEq)]
pub struct Contest {
    /// Id of the set.
    pub id: String,
    /// Name of the effect.
    pub effect: String,
    /// True if it is hidden in the set.
    pub is_right: bool,
    /// True if it was named.
    pub kept: bool,
    /// Logarithm of its odds.
    pub ln_odds: f64,
    /// The rival with the greatest odds in its place, and their share of its odds (in logarithms).
    pub instead: Option<(String, f64)>,
    /// The same beside it, among rivals that act like it.
    pub beside: Option<(String, f64)>,
}

/// The contests of a report.
#[derive(Debug, Deserialize)]
pub(super) struct Report {
    pub(super) contests: Vec<Reported>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Reported {
    pub(super) effect: String,
    pub(super) ln_odds: f64,
    pub(super) rivals: Vec<Rivalry>,
    /// Other classes in its place.
    pub(super) classes: Vec<Class>,
    pub(super) left_ln_odds: f64,
    pub(super) kept: bool,
}

#[derive(Debug, Deserialize)]
pub(super) struct Class {
    pub(super) effect: String,
    pub(super) ln_odds: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct Rivalry {
    rival: String,
    instead_ln_odds: Option<f64>,
    beside_ln_odds: Option<f64>,
}

impl Contest {
    fn of(id: &str, label: &Label, reported: &Reported) -> Self {
        let share = |ln_odds: Option<f64>| ln_odds.unwrap_or(f64::NEG_INFINITY) / reported.ln_odds;
        let greatest = |of: &dyn Fn(&Rivalry) -> f64| {
            let rivals = reported.rivals.iter().filter(|rival| of(rival).is_finite());
            rivals.max_by(|a, b| of(a).total_cmp(&of(b))).map(|rival| (rival.rival.clone(), of(rival)))
        };
        let beside = |rival: &Rivalry| {
            let beside = share(rival.beside_ln_odds);
            if share(rival.instead_ln_odds) - beside.max(0.0) > TAKEN_SHARE {
                beside
            } else {
                f64::NEG_INFINITY
            }
        };
        Self {
            id: id.into(),
            effect: reported.effect.clone(),
            is_right: label.physics.iter().any(|one| one.effect.as_ref() == Some(&reported.effect)),
            kept: reported.kept,
            ln_odds: reported.ln_odds,
            instead: greatest(&|rival| share(rival.instead_ln_odds)),
            beside: greatest(&beside),
        }
    }
}

/// The contests of the sets that have been run.
///
/// # Errors
/// If a label or a report cannot be read.
pub fn contests(sets: &[Planned], places: &Places) -> Result<Vec<Contest>> {
    let mut contests = Vec::new();
    for set in sets.iter().filter(|set| places.report(&set.id).exists()) {
        let label: Label = parsed(&places.label(&set.id))?;
        let report: Report = parsed(&places.report(&set.id))?;
        contests.extend(report.contests.iter().map(|reported| Contest::of(&set.id, &label, reported)));
    }
    Ok(contests)
}

/// A row for each contest, those of right effects first, and the quantiles of the shares.
pub fn contests_table(contests: &[Contest]) -> String {
    fmt::from_fn(|f| {
        for (what, is_right) in [("right", true), ("wrong", false)] {
            let of: Vec<&Contest> = contests.iter().filter(|one| one.is_right == is_right).collect();
            writeln!(f, "{what}: {} contests", of.len())?;
            for one in &of {
                let kept = if one.kept { "" } else { ", lost" };
                let told = |of: &Option<(String, f64)>| {
                    of.as_ref().map_or_else(|| "-".to_owned(), |(rival, share)| format!("{share:.2} {rival}"))
                };
                let (instead, beside) = (told(&one.instead), told(&one.beside));
                writeln!(
                    f,
                    "  {}: {} with {:.0}{kept}; instead {instead}; beside {beside}",
                    one.id, one.effect, one.ln_odds
                )?;
            }
            for (name, shares) in [
                ("instead", of.iter().filter_map(|one| Some(one.instead.as_ref()?.1)).collect::<Vec<f64>>()),
                ("beside", of.iter().filter_map(|one| Some(one.beside.as_ref()?.1)).collect()),
            ] {
                let at = |share: f64| quantile(shares.clone(), share).unwrap_or(f64::NAN);
                writeln!(
                    f,
                    "  {name}, {} known: least {:.3}, median {:.3}, 95 % within {:.3}, greatest {:.3}",
                    shares.len(),
                    at(0.0),
                    at(0.5),
                    at(0.95),
                    at(1.0)
                )?;
            }
        }
        Ok(())
    })
    .to_string()
}

#[cfg(test)]
#[path = "contests_tests.rs"]
mod tests;
