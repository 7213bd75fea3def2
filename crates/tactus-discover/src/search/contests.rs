//! Each added class beside the rivals without a name, as it stands in the grown model.

use super::forms::Formed;
use super::grow::{Equivalent, Search, names};
use crate::data::DiscoverError;

/// An added class and the rivals that compete with it.
#[derive(Debug, Clone, PartialEq)]
pub struct Contest {
    /// Name of the effect.
    pub effect: &'static str,
    /// Logarithm of its odds in its place, with the knots or the formula that it has.
    pub ln_odds: f64,
    /// The rivals.
    pub rivals: Vec<Rivalry>,
}

/// A rival without a name, against a class.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rivalry {
    /// What it depends on.
    pub rival: &'static str,
    /// Logarithm of its odds in the place of the class.
    pub instead: f64,
    /// Logarithm of its odds beside the class and all others.
    pub beside: f64,
}

impl Search<'_> {
    /// The contest of each added class.
    pub(crate) fn contests(
        &self,
        formed: &Formed,
        equivalent: &Equivalent,
    ) -> Result<Vec<Contest>, DiscoverError> {
        let names = names(&formed.at.parameters, self.known_terms);
        if names.is_empty() {
            return Ok(Vec::new());
        }
        let beside = self.pass(&formed.at)?.rivals();
        let contest = |effect: &'static str| {
            let alike = equivalent.get(effect)?;
            let rivalry = |(rival, instead): &(&'static str, f64)| Rivalry {
                rival,
                instead: *instead,
                beside: beside.iter().find(|(one, _)| one == rival).map_or(f64::NEG_INFINITY, |(_, of)| *of),
            };
            Some(Contest {
                effect,
                ln_odds: self.ln_odds(&alike.without, &formed.at),
                rivals: alike.rivals.iter().map(rivalry).collect(),
            })
        };
        Ok(names.into_iter().filter_map(contest).collect())
    }
}
