//! Explanations that the data cannot tell apart: each effect that was added against its near twins in its place.

use crate::DiscoverError;
use crate::candidates::Candidate;
use crate::fit::Fitted;
use crate::next::Explanation;
use crate::score::sign_flip_p;
use crate::search::{Search, names, without};

/// A twin is told from an effect if noise alone would serve it so badly with this chance at most.
const TOLD_P: f64 = 0.01;
const FLIPS: usize = 1999;
const ROUNDS: usize = 8;

/// An effect that was added, and another that would do as well in its place.
pub(crate) struct Twins {
    pub(crate) effect: &'static str,
    pub(crate) twin: &'static str,
    pub(crate) explanations: [Explanation; 2],
}

impl Search<'_> {
    /// The near twins of each effect that was added which serve the held-out presses as well.
    pub(crate) fn twins(&self, grown: &Fitted) -> Result<Vec<Twins>, DiscoverError> {
        let mut found = Vec::new();
        for effect in names(&grown.parameters, self.known_terms) {
            let less = without(&grown.parameters, effect, self.known_terms);
            let less = self.problem.fit_from(less, ROUNDS, &[], self.options.threads)?;
            let fitting = self.fitting(&less)?;
            let near = |one: &&Candidate| {
                one.definition.near_twins.contains(&effect)
                    && !names(&grown.parameters, self.known_terms).contains(&one.definition.name)
            };
            let mut starts = Vec::new();
            for candidate in self.candidates.iter().filter(near) {
                let screened = candidate.screen(&fitting, self.problem, &less.parameters, &less.predicted)?;
                if screened.promise > 0.0 {
                    starts.push(screened.start);
                }
            }
            for (twin, fitted) in self.fits(&less, &starts)? {
                if self.serves_as_well(&fitted, grown) {
                    let explanations = [(effect, grown), (twin, &fitted)].map(|(name, fitted)| Explanation {
                        name: name.to_owned(),
                        parameters: fitted.parameters.clone(),
                    });
                    found.push(Twins { effect, twin, explanations });
                }
            }
        }
        Ok(found)
    }

    fn serves_as_well(&self, twin: &Fitted, grown: &Fitted) -> bool {
        let [twin, grown] = [twin, grown].map(|one| self.problem.heldout_blocks(&one.predicted));
        let losses: Vec<f64> = twin.iter().zip(&grown).map(|(twin, grown)| twin[0] - grown[0]).collect();
        sign_flip_p(&losses, FLIPS, self.options.seed) > TOLD_P
    }
}
