//! Selection by the Bayesian information criterion alone, as a comparison for the protocol.
//!
//! Forward selection adds the effect with the least `cost + parameters ln(readings)`, as long as this value falls. There is
//! no corrected test, no held-out data and no removal. It assumes white noise and exact forms.
//!
//! # Source
//! G. Schwarz, *Ann. Statist.* 6 (1978) 461.

use super::grow::{Grown, NAMES_MAX, POLISH_ROUNDS, Search};
use crate::data::DiscoverError;
use crate::fit::Fitted;

impl Search<'_> {
    /// Grows a model as long as the criterion falls.
    pub(crate) fn grow_by_bic(&self, base: Fitted) -> Result<Grown, DiscoverError> {
        let mut grown = Grown::from(base);
        for index in 0..=NAMES_MAX {
            let at = &grown.at;
            let pass = self.pass(at)?;
            let mut tried = self.tested(&pass, at, index);
            let fits = self.others(&pass, at, &[], 0.0)?;
            let best = fits
                .into_iter()
                .min_by(|a, b| self.criterion(&a.fitted).total_cmp(&self.criterion(&b.fitted)))
                .filter(|best| self.criterion(&best.fitted) < self.criterion(at));
            tried.round.taken = best.as_ref().map(|best| best.name);
            grown.rounds.push(tried);
            let Some(best) = best else { break };
            grown.at = self.problem.fit_from(best.fitted.parameters, POLISH_ROUNDS)?;
        }
        Ok(grown)
    }

    /// The criterion less a constant that is the same for all models.
    fn criterion(&self, of: &Fitted) -> f64 {
        let parameters: usize = of.parameters.terms.iter().map(|term| term.values.len()).sum();
        of.cost + parameters as f64 * self.problem.readings().ln()
    }
}
