//! Effects that were fitted and are not in the grown model, and why.

use super::varying::varying_effect;

/// An effect that was fitted, and that the grown model does not have.
#[derive(Debug, Clone, PartialEq)]
pub struct GivenUp {
    /// Its name.
    pub effect: &'static str,
    /// Why.
    pub because: Because,
}

/// Why an effect was given up.
#[derive(Debug, Clone, PartialEq)]
pub enum Because {
    /// A rival without a name explains more in its place: on what the rival depends.
    Rival(&'static str),
    /// A rival without a name would take over much of it, and explains more beside it: it is only the nearest form of that.
    NearestForm(&'static str),
    /// It explains too little, or so little beside another effect that it may be an error of that one's form.
    Little,
    /// Another effect explains more in its place.
    Other(&'static str),
    /// Presses that the fit has not seen do not confirm it.
    Unconfirmed,
    /// What is drafted without it explains as much.
    Draft,
    /// It closes this share of the gap without it on presses that its fit has not seen, and an effect closes more of its own physics.
    Far(f64),
}

impl GivenUp {
    /// True if the data do not bear the effect out: something without a name explains them better, or what its fit has not seen does not
    /// confirm it.
    pub(crate) const fn is_refuted(&self) -> bool {
        match self.because {
            Because::Rival(_)
            | Because::NearestForm(_)
            | Because::Unconfirmed
            | Because::Draft
            | Because::Far(_) => true,
            Because::Little | Because::Other(_) => false,
        }
    }

    /// The reason as a clause, such as `what explains more has no name in the library: a dependence on depth`.
    pub fn in_words(&self) -> String {
        match self.because {
            // The library has the effect that varies.
            Because::Rival(rival) if varying_effect(rival).is_some() => format!("{rival} explains more"),
            Because::Rival(rival) => {
                format!("what explains more has no name in the library: {}", rival_in_words(rival))
            }
            Because::NearestForm(rival) => {
                let rival = rival_in_words(rival);
                format!("it is only the nearest form of what has no name in the library: {rival}")
            }
            Because::Little => "it explains too little by itself or beside the others".into(),
            Because::Other(other) => format!("{other} explains more in its place"),
            Because::Unconfirmed => "presses or elements that its fit has not seen do not confirm it".into(),
            Because::Draft => "what is drafted without it explains as much".into(),
            Because::Far(share) => format!(
                "it comes nearest, and closes {:.0} % of the gap on presses that its fit has not seen: an effect closes more of its own physics",
                100.0 * share
            ),
        }
    }
}

/// A rival without a name within a sentence, such as `a dependence on place`.
pub fn rival_in_words(rival: &str) -> String {
    if varying_effect(rival).is_some() {
        return rival.to_owned();
    }
    // What it is, and not what it depends on.
    if rival.starts_with("tone in ") || rival.starts_with("jump in ") {
        return format!("a {rival}");
    }
    match rival.strip_suffix(", apart") {
        Some(rival) => format!("a dependence on {rival}, loading and unloading apart"),
        None => format!("a dependence on {rival}"),
    }
}

/// The last word on each effect that a model with these effects does not have, in the order in which they were given up.
pub(crate) fn last_words(all: Vec<GivenUp>, present: &[&str]) -> Vec<GivenUp> {
    let mut last: Vec<GivenUp> = Vec::new();
    for one in all {
        last.retain(|known| known.effect != one.effect);
        if !present.contains(&one.effect) {
            last.push(one);
        }
    }
    last
}

#[cfg(test)]
#[path = "given_up_tests.rs"]
mod tests;
