//! Constants of the search and of the verdict, from sets whose physics is known: by how much forms mislead the odds of classes, and how much
//! of a gap names close.

use std::fmt;

use anyhow::Result;
use serde::Deserialize;
use tactus_discover::constants::{
    DRIFTS, FORM_SHARE, LEFT_SHARE, MISFIT_SHARE, NEAR_CLOSES, SET_PROBABILITY,
};
use tactus_sets::Label;

use super::campaign::{Campaign, Planned};
use super::contests::Reported;
use super::outcome::{Named, parsed};
use super::rate::quantile;
use super::run::Places;

/// Values of the share of a class's odds that is its form's uncertainty.
const MISFIT_SHARES: [f64; 7] = [0.0, 0.005, 0.01, MISFIT_SHARE, 0.03, 0.05, 0.1];
/// Values of the share of the strongest class's odds below which another may be its form.
const FORM_SHARES: [f64; 6] = [0.01, 0.02, 0.05, FORM_SHARE, 0.1, 0.2];
/// Values of the lead with which another class takes a place.
const LEADS: [f64; 4] = [0.0, 1.0, 2.0, 3.0];
/// Values of the share of a gap that an effect closes of its own physics.
const CLOSED_SHARES: [f64; 7] = [0.5, 0.7, 0.8, NEAR_CLOSES, 0.9, 0.95, 0.98];

/// A place in a grown model: the named class and those that were fitted in its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// Logarithm of the odds of the named class.
    pub ln_odds: f64,
    /// What the model leaves, as a logarithm of odds.
    pub left: f64,
    /// True if tests see something in what the model leaves.
    pub leaves: bool,
    /// The other classes by how far their odds (in logarithms) are behind; the hidden one is marked.
    pub behind: Vec<(f64, bool)>,
    /// True if the named class is hidden.
    pub is_right: bool,
    /// The reported set, if the name stayed: how large it is, and whether the hidden class is in it.
    pub reported: Option<(usize, bool)>,
}

/// A name by itself, and the most of the gap that it may close on held-out presses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closes {
    /// The share and two standard errors.
    pub most: f64,
    /// True if it is the hidden effect.
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
    /// In sets with one name, where the verdict asks how much that closes.
    pub closes: Vec<Closes>,
}

/// The part of `report.json` that is read.
#[derive(Debug, Deserialize)]
struct Told {
    contests: Vec<Reported>,
    steps: Vec<Named>,
    #[serde(rename = "final")]
    last: Last,
    verdict: String,
    unexplained: Unexplained,
    #[serde(default)]
    given_up: Vec<GivenUp>,
}

#[derive(Debug, Deserialize)]
struct Last {
    shrink: Option<f64>,
    shrink_se: Option<f64>,
}

#[derive(Debug, Deserialize)]
struct Unexplained {
    depends_on: Vec<String>,
}

#[derive(Debug, Deserialize)]
struct GivenUp {
    effect: String,
    /// The share that it closes, if that is why it was given up.
    closed_share: Option<f64>,
}

impl Told {
    /// The only name, with what it closes, where the verdict asks for that: names explain a part, and no drift is among them.
    fn only_name(&self) -> Option<(&str, f64)> {
        let mut far = self.given_up.iter().filter_map(|one| Some((one.effect.as_str(), one.closed_share?)));
        match (&self.steps[..], far.next(), far.next()) {
            ([], Some(only), None) => Some(only),
            ([only], None, _) => {
                let is_asked = self.verdict == "partly-explained" && !DRIFTS.contains(&only.effect.as_str());
                let most = self.last.shrink? + 2.0 * self.last.shrink_se.unwrap_or(0.0);
                is_asked.then_some((only.effect.as_str(), most))
            }
            _ => None,
        }
    }
}

impl Observed {
    /// From the sets with hidden physics that have been run.
    ///
    /// # Errors
    /// If a label or a report cannot be read.
    pub fn read(sets: &[Planned], places: &Places) -> Result<Self> {
        let mut observed = Self::default();
        let hides = |set: &&Planned| set.campaign != Campaign::FalseAlarms;
        for set in sets.iter().filter(hides).filter(|set| places.report(&set.id).exists()) {
            let label: Label = parsed(&places.label(&set.id))?;
            let told: Told = parsed(&places.report(&set.id))?;
            let hidden: Vec<&str> = label.physics.iter().filter_map(|one| one.effect.as_deref()).collect();
            observed.add(&hidden, &told);
        }
        Ok(observed)
    }

    /// Adds a report on a set with these effects, none where the physics is outside the library.
    fn add(&mut self, hidden: &[&str], told: &Told) {
        let is_hidden = |effect: &str| hidden.contains(&effect);
        if hidden.len() <= 1 {
            let closes = |(name, most)| Closes { most, is_right: is_hidden(name) };
            self.closes.extend(told.only_name().map(closes));
        }
        let contests = &told.contests;
        for one in contests.iter().filter(|one| one.kept) {
            let behind = one.classes.iter().map(|of| (one.ln_odds - of.ln_odds, is_hidden(&of.effect)));
            let step = told.steps.iter().find(|step| step.effect == one.effect);
            let holds = |step: &Named| {
                is_hidden(&step.effect) || step.equivalent.iter().any(|other| is_hidden(other))
            };
            let place = Place {
                ln_odds: one.ln_odds,
                left: one.left_ln_odds,
                leaves: !told.unexplained.depends_on.is_empty(),
                behind: behind.collect(),
                is_right: is_hidden(&one.effect),
                reported: step.map(|step| (1 + step.equivalent.len(), holds(step))),
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
            // Where the model leaves nothing, only the other class needs another form than its own.
            let form_odds = if place.leaves { 1.0 } else { unit.sqrt() };
            let weight = |behind: f64| (-behind / unit).exp() / form_odds;
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

    /// The same of the sets that were reported.
    pub fn reported(&self) -> [f64; 2] {
        let sets: Vec<(usize, bool)> = self.places.iter().filter_map(|place| place.reported).collect();
        let count = sets.len().max(1) as f64;
        let held = sets.iter().filter(|(_, holds)| *holds).count() as f64;
        [held / count, sets.iter().map(|(size, _)| *size as f64).sum::<f64>() / count]
    }

    /// Number of places whose right class another one would take with more than a lead, and of those whose wrong one the hidden class would.
    pub fn exchanged_at(&self, lead: f64) -> [usize; 2] {
        let is_ahead = |of: &(f64, bool)| -of.0 > lead;
        let lost = |place: &&Place| place.is_right && place.behind.iter().any(is_ahead);
        let gained = |place: &&Place| !place.is_right && place.behind.iter().any(|of| of.1 && is_ahead(of));
        [self.places.iter().filter(lost).count(), self.places.iter().filter(gained).count()]
    }

    /// Number of right names that would be taken out if an effect closed more than a share of its own physics, and of wrong ones.
    pub fn far_at(&self, share: f64) -> [usize; 2] {
        [true, false].map(|is_right| {
            self.closes.iter().filter(|one| one.is_right == is_right && one.most < share).count()
        })
    }
}

/// The constants in a table: what each value would do on these sets.
pub fn constants_table(observed: &Observed) -> String {
    fmt::from_fn(|f| {
        misfit_shares(f, observed)?;
        form_shares(f, observed)?;
        leads(f, observed)?;
        closed_shares(f, observed)?;
        writeln!(f, "FREE_SHARE and PROMISE_SHARE: reports do not hold the odds that these compare.")
    })
    .to_string()
}

fn misfit_shares(f: &mut fmt::Formatter<'_>, observed: &Observed) -> fmt::Result {
    writeln!(f, "MISFIT_SHARE, {} places     holds the hidden class  mean size", observed.places.len())?;
    let row = |f: &mut fmt::Formatter<'_>, what: &str, [held, size]: [f64; 2]| {
        writeln!(f, "  {what:<26} {:>21.1} %  {size:>9.2}", 100.0 * held)
    };
    for share in MISFIT_SHARES {
        row(f, &share.to_string(), observed.sets_at(share))?;
    }
    row(f, "as reported", observed.reported())?;
    match MISFIT_SHARES.into_iter().find(|share| observed.sets_at(*share)[0] >= SET_PROBABILITY) {
        Some(share) => writeln!(f, "  the least that holds 95 %: {share}")?,
        None => writeln!(f, "  none of these holds 95 %")?,
    }
    writeln!(
        f,
        "  Differs from the search: it tests whether the model leaves something before the names are confirmed, here that is what the report's\n  \
         residual depends on; and it leaves out classes that leave something where the model leaves nothing, which reports do not hold."
    )
}

fn form_shares(f: &mut fmt::Formatter<'_>, observed: &Observed) -> fmt::Result {
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
}

fn leads(f: &mut fmt::Formatter<'_>, observed: &Observed) -> fmt::Result {
    writeln!(f, "BETTER_LN_ODDS, {} places    a right class is lost  one is gained", observed.places.len())?;
    for lead in LEADS {
        let [lost, gained] = observed.exchanged_at(lead);
        writeln!(f, "  {lead:<26} {lost:>23}  {gained:>13}")?;
    }
    writeln!(
        f,
        "  The reports are of what is left after exchanges, so they say nothing of greater values; a formula is excused for its form, which is\n  \
         not counted here."
    )
}

fn closed_shares(f: &mut fmt::Formatter<'_>, observed: &Observed) -> fmt::Result {
    let of = |is_right: bool| observed.closes.iter().filter(|one| one.is_right == is_right).count();
    writeln!(
        f,
        "NEAR_CLOSES, {} right and {} wrong names alone  right ones go  wrong ones go",
        of(true),
        of(false)
    )?;
    for share in CLOSED_SHARES {
        let [right, wrong] = observed.far_at(share);
        writeln!(f, "  {share:<40} {right:>14}  {wrong:>13}")?;
    }
    writeln!(
        f,
        "  A name closes the share and two standard errors at most; where it was taken out, the report has the share alone. The verdict also\n  \
         counts as closed what does not last from frame to frame."
    )
}

#[cfg(test)]
#[path = "constants_tests.rs"]
mod tests;
