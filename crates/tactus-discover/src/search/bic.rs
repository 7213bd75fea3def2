//! Selection by the Bayesian information criterion alone, as a comparison for the protocol.
//!
//! Forward selection adds the effect with the least `cost + parameters ln(readings)`, as long as this value falls. There is
//! no corrected test, no held-out data and no removal. It assumes white noise and exact forms.
//!
//! # Source
//! G. Schwarz, *Ann. Statist.* 6 (1978) 461.

use super::grow::{FITTED_MAX, Grown, POLISH_ROUNDS, Search, TERMS_MAX};
use crate::data::DiscoverError;
use crate::fit::{Fitted, Term};

impl Search<'_> {
    /// Grows a model as long as the criterion falls.
    pub(crate) fn grow_by_bic(&self, base: Fitted) -> Result<Grown, DiscoverError> {
        let mut grown = Grown::from(base);
        for round in 0..TERMS_MAX {
            let at = &grown.at;
            let mut tried = self.round(at, round)?;
            tried.screened.sort_by(|a, b| b.promise.total_cmp(&a.promise));
            let wanted = tried.screened.iter().take(FITTED_MAX).filter(|one| one.promise > 0.0);
            let starts: Vec<Term> = wanted.map(|one| one.start.clone()).collect();
            let fits = self.fits(at, &starts, 0.0)?;
            let best = fits
                .into_iter()
                .min_by(|(_, a), (_, b)| self.criterion(a).total_cmp(&self.criterion(b)))
                .filter(|(_, best)| self.criterion(best) < self.criterion(at));
            tried.round.taken = best.as_ref().map(|(name, _)| *name);
            grown.rounds.push(tried);
            let Some((_, best)) = best else { break };
            grown.at = self.problem.fit_from(best.parameters, POLISH_ROUNDS)?;
        }
        Ok(grown)
    }

    /// The criterion less a constant that is the same for all models.
    fn criterion(&self, of: &Fitted) -> f64 {
        let parameters: usize = of.parameters.terms.iter().map(|term| term.values.len()).sum();
        let readings = self.problem.weights().filter(|weight| *weight > 0.0).count();
        of.cost + parameters as f64 * (readings.max(1) as f64).ln()
    }
}
