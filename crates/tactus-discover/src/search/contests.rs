//! Each added class beside the rivals without a name, as it stands in the grown model.
//!
//! That no rival beats a class in its place is not enough: the class may be only the nearest form in the library of what a rival
//! describes better in part. Such a class is no name. With `E` the logarithm of the class's odds, `R` that of a rival in its place, and
//! `B` that of the rival beside it,
//!
//! ```text
//! (R - B) / E    the share of what the class explains that the rival would take over
//! B / E          what the rival still explains beside the class, although that was fitted to the end
//! ```
//!
//! If both are large for one rival, the class stands in part for what the rival describes. A physics of the class itself, in any form,
//! leaves little to a rival that acts like it; what another physics leaves is explained by a rival that takes hardly anything over from
//! the class.
//!
//! The bounds of the two shares are chosen on tuning sets, of which `tactus-bench evidence contests` prints the contests. At a
//! separation of 40, rivals that would take over more than 0.3 explained at most 0.06 beside 11 right names in foreign forms, and 0.20
//! to 0.24 beside three wrong ones that nothing beat in their place. On ten strokes of a real sensor, a tone in travel explained 0.144 beside the
//! loop that is there. Beside a fourth wrong one, `surface-offset` for a tool that is
//! felt from afar, they explained nothing: there the rival that sees the rest takes nothing over.

use super::forms::Formed;
use super::given_up::{Because, GivenUp};
use super::grow::{Equivalent, LN_ODDS_LEAST, POLISH_ROUNDS, Search, names, without};
use super::varying::varying_effect;
use crate::data::DiscoverError;
use crate::progress::Stage;

/// A rival acts like a class if it would take over more than this share.
pub const TAKEN_SHARE: f64 = 0.3;
/// A class is only the nearest form if such a rival explains more than this share beside it: the geometric mean of 0.144 and 0.20.
const BESIDE_SHARE: f64 = 0.17;

/// An added class and the rivals that compete with it.
#[derive(Debug, Clone, PartialEq)]
pub struct Contest {
    /// Name of the effect.
    pub effect: &'static str,
    /// Logarithm of its odds in its place, with the knots or the formula that it has.
    pub ln_odds: f64,
    /// The rivals.
    pub rivals: Vec<Rivalry>,
    /// Other classes that were fitted in its place, with the logarithm of their odds.
    pub classes: Vec<(&'static str, f64)>,
    /// What the model with it leaves beyond the noise of the fitted presses, as a logarithm of odds.
    pub left: f64,
    /// False if it is no name: it lost against a rival, or is too small beside another class.
    pub kept: bool,
}

/// A rival without a name, against a class.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rivalry {
    /// What it depends on.
    pub rival: &'static str,
    /// Logarithm of its odds in the place of the class.
    pub instead: f64,
    /// Logarithm of its odds beside the class and all others; minus infinity if the class lost before that was asked.
    pub beside: f64,
}

impl Contest {
    /// That of a class that lost against a rival in its place, or without rivals, that is too small.
    pub(super) fn lost(
        effect: &'static str,
        ln_odds: f64,
        left: f64,
        rivals: Vec<(&'static str, f64)>,
    ) -> Self {
        let rivalry = |(rival, instead)| Rivalry { rival, instead, beside: f64::NEG_INFINITY };
        let rivals = rivals.into_iter().map(rivalry).collect();
        Self { effect, ln_odds, rivals, classes: Vec::new(), left, kept: false }
    }

    /// The rival with the greatest odds in the place of the class, if there is one.
    pub(super) fn strongest(&self) -> Option<&'static str> {
        let strongest = self.rivals.iter().max_by(|a, b| a.instead.total_cmp(&b.instead));
        strongest.map(|strongest| strongest.rival)
    }

    /// That the class was given up, if it is no name.
    pub(crate) fn given_up(&self) -> Option<GivenUp> {
        let because = match self.nearest_form_of() {
            Some(rival) => Because::NearestForm(rival),
            None => self.strongest().map_or(Because::Little, Because::Rival),
        };
        (!self.kept).then_some(GivenUp { effect: self.effect, because })
    }

    /// A rival of which the class is only the nearest form, if there is one. What another effect in a form of its own explains beside the
    /// class is that effect's.
    fn nearest_form_of(&self) -> Option<&'static str> {
        let rivals = self.rivals.iter().filter(|rival| varying_effect(rival.rival).is_none());
        let mut takes_part = rivals.filter(|rival| {
            rival.instead - rival.beside.max(0.0) > TAKEN_SHARE * self.ln_odds
                && rival.beside > LN_ODDS_LEAST.max(BESIDE_SHARE * self.ln_odds)
        });
        takes_part.next().map(|rival| rival.rival)
    }
}

impl Search<'_> {
    /// The contest of each added class, and the model without those that lost.
    pub(crate) fn contested(
        &self,
        mut formed: Formed,
        equivalent: &mut Equivalent,
    ) -> Result<(Formed, Vec<Contest>), DiscoverError> {
        let names = names(&formed.at.parameters, self.known_terms);
        if names.is_empty() {
            return Ok((formed, Vec::new()));
        }
        self.reporter.enter(Stage::Contests, "comparing the names with what has none");
        let pass = self.pass(&formed.at)?;
        let contest = |effect: &'static str| {
            let (alike, beside) = (equivalent.get(effect)?, pass.beside(effect));
            let rivalry = |(rival, instead): &(&'static str, f64)| Rivalry {
                rival,
                instead: *instead,
                beside: beside.iter().find(|(one, _)| one == rival).map_or(f64::NEG_INFINITY, |(_, of)| *of),
            };
            let ln_odds = self.ln_odds(&alike.without, &formed.at);
            let rivals = alike.rivals.iter().map(rivalry).collect();
            let (classes, left) = (alike.classes.clone(), self.left_over(&formed.at));
            let contest = Contest { effect, ln_odds, rivals, classes, left, kept: true };
            Some(Contest { kept: contest.nearest_form_of().is_none(), ..contest })
        };
        let contests: Vec<Contest> = names.into_iter().filter_map(contest).collect();
        let lost: Vec<&'static str> =
            contests.iter().filter(|contest| !contest.kept).map(|contest| contest.effect).collect();
        if !lost.is_empty() {
            equivalent.retain(|name, _| !lost.contains(name));
            let firm = without(&formed.at.parameters, &lost, self.known_terms);
            formed.at = self.problem.fit_from(firm, POLISH_ROUNDS)?;
        }
        Ok((formed, contests))
    }
}

#[cfg(test)]
#[path = "contests_tests.rs"]
mod tests;
