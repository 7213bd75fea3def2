//! Constants of the search, from sets whose physics is known: by how much forms mislead the odds of classes.

use std::fmt;

use anyhow::Result;
use tactus_sets::Label;

use super::campaign::{Campaign, Planned};
use super::contests::{Report, Reported};
use super::outcome::parsed;
use super::rate::quantile;
use super::run::Places;

/// Values of the share of a class's odds that is its form's uncertainty.
const MISFIT_SHARES: [f64; 7] = [0.0, 0.005, 0.01, 0.02, 0.03, 0.05, 0.1];
/// Share of what a model leaves that is so, too: `1 / ln 20`, so that a class that leaves twice the square is at 5 %.
const LEFT_SHARE: f64 = 1.0 / 3.0;
/// Values of the share of the strongest class's odds below which another may be its form.
const FORM_SHARES: [f64; 6] = [0.01, 0.02, 0.05, 0.07, 0.1, 0.2];
/// Probability of a reported set.
const SET_PROBABILITY: f64 = 0.95;

/// A place in a grown model: the named class and those that were fitted in its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// Logarithm of the odds of the named class.
    pub ln_odds: f64,
    /// What the model leaves, as a logarithm of odds.
    pub left: f64,
    /// The other classes by how far their odds (in logarithms) are behind; the hidden one is marked.
    pub behind: Vec<(f64, bool)>,
    /// True if the named class is hidden.
    pub is_right: bool,
}

/// What the reports on sets say for the constants.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Observed {
    /// Places in which a hidden class is named, or was fitted.
    pub places: Vec<Place>,
    /// In sets with one effect: odds of the strongest wrong class, named or not, over those of the right one (in logarithms).
    pub wrong_shares: Vec<f64>,
    /// In sets with several: odds of the weakest right class over those of the strongest.
    pub right_shares: Vec<f64>,
}

impl Observed {
    /// From the sets of named physics that have been run.
    ///
    /// # Errors
    /// If a label or a report cannot be read.
    pub fn read(sets: &[Planned], places: &Places) -> Result<Self> {
        let mut observed = Self::default();
        let named = [Campaign::Names, Campaign::Pairs, Campaign::Triples];
        for set in sets.iter().filter(|set| named.contains(&set.campaign) && places.report(&set.id).exists())
        {
            let label: Label = parsed(&places.label(&set.id))?;
            let report: Report = parsed(&places.report(&set.id))?;
            let hidden: Vec<&str> = label.physics.iter().filter_map(|one| one.effect.as_deref()).collect();
            observed.add(&hidden, &report.contests);
        }
        Ok(observed)
    }

    fn add(&mut self, hidden: &[&str], contests: &[Reported]) {
        let is_hidden = |effect: &str| hidden.contains(&effect);
        for one in contests.iter().filter(|one| one.kept) {
            let behind = one.classes.iter().map(|of| (one.ln_odds - of.ln_odds, is_hidden(&of.effect)));
            let place = Place {
                ln_odds: one.ln_odds,
                left: one.left_ln_odds,
                behind: behind.collect(),
                is_right: is_hidden(&one.effect),
            };
            if place.is_right || place.behind.iter().any(|(_, is_hidden)| *is_hidden) {
                self.places.push(place);
            }
        }
        let odds = |is_right: bool| -> Vec<f64> {
            contests.iter().filter(|one| is_hidden(&one.effect) == is_right).map(|one| one.ln_odds).collect()
        };
        let strongest = odds(true).into_iter().fold(0.0, f64::max);
        if strongest <= 0.0 {
            return;
        }
        if hidden.len() > 1 {
            let right = contests.iter().filter(|one| one.kept && is_hidden(&one.effect));
            self.right_shares.push(right.map(|one| one.ln_odds).fold(strongest, f64::min) / strongest);
        } else {
            self.wrong_shares.push(odds(false).into_iter().fold(0.0, f64::max) / strongest);
        }
    }

    /// Share of the places whose set has the hidden class, and the mean size of the sets, at a share of misfit.
    pub fn sets_at(&self, misfit_share: f64) -> [f64; 2] {
        let (mut held, mut size) = (0.0, 0.0);
        for place in &self.places {
            let unit = 1.0 + misfit_share * place.ln_odds.max(0.0) + LEFT_SHARE * place.left;
            // Only the other class needs another form than its own.
            let weight = |behind: f64| (-behind / unit).exp() / unit.sqrt();
            let mut members: Vec<(f64, bool)> =
                place.behind.iter().map(|(behind, is_hidden)| (weight(*behind), *is_hidden)).collect();
            members.sort_by(|a, b| b.0.total_cmp(&a.0));
            members.insert(0, (1.0, place.is_right));
            let total: f64 = members.iter().map(|(weight, _)| weight).sum();
            let mut reached = 0.0;
            for (weight, is_hidden) in members {
                if reached >= SET_PROBABILITY {
                    break;
                }
                reached += weight / total;
                size += 1.0;
                held += f64::from(u8::from(is_hidden));
            }
        }
        let count = self.places.len().max(1) as f64;
        [held / count, size / count]
    }
}

/// The constants in a table: what each value would do on these sets.
pub fn constants_table(observed: &Observed) -> String {
    fmt::from_fn(|f| {
        writeln!(f, "MISFIT_SHARE, {} places     holds the hidden class  mean size", observed.places.len())?;
        for share in MISFIT_SHARES {
            let [held, size] = observed.sets_at(share);
            writeln!(f, "  {share:<26} {:>21.1} %  {size:>9.2}", 100.0 * held)?;
        }
        let enough = MISFIT_SHARES.into_iter().find(|share| observed.sets_at(*share)[0] >= SET_PROBABILITY);
        match enough {
            Some(share) => writeln!(f, "  the least that holds 95 %: {share}")?,
            None => writeln!(f, "  none of these holds 95 %")?,
        }
        let (one, several) = (&observed.wrong_shares, &observed.right_shares);
        writeln!(
            f,
            "FORM_SHARE, {} sets of one effect, {} of several  a wrong class stays  a right one is lost",
            one.len(),
            several.len()
        )?;
        let share_of = |of: &[f64], is_so: &dyn Fn(f64) -> bool| {
            100.0 * of.iter().filter(|one| is_so(**one)).count() as f64 / of.len().max(1) as f64
        };
        for share in FORM_SHARES {
            let (stays, lost) = (share_of(one, &|of| of > share), share_of(several, &|of| of <= share));
            writeln!(f, "  {share:<46} {stays:>17.1} %  {lost:>17.1} %")?;
        }
        let least = quantile(one.clone(), 0.95).unwrap_or(f64::NAN);
        writeln!(f, "  95 % of the wrong classes are within {least:.3}")
    })
    .to_string()
}

#[cfg(test)]
#[path = "constants_tests.rs"]
mod tests;
