//! The candidates with their rehearsals.

use std::sync::OnceLock;

use super::Planner;
use super::catalogue::{Candidate, catalogue};
use super::experiments::{Rehearsal, RehearsalOrder};
use super::plan::{LeftOut, NextExperiment};
use super::reach::Reach;
use crate::numbers::parallel;

/// The candidates, each rehearsed once it is looked at.
pub(super) struct Rehearsals<'a> {
    planner: Planner<'a>,
    reach: Reach,
    candidates: Vec<(Candidate, OnceLock<Result<Rehearsal, String>>)>,
}

/// A rehearsed candidate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Design<'a> {
    pub(super) of: &'a Candidate,
    pub(super) seed: u64,
    pub(super) rehearsal: &'a Rehearsal,
}

impl<'a> Rehearsals<'a> {
    pub(super) fn of(planner: Planner<'a>) -> Self {
        let reach = Reach::of(planner.frames, planner.experiments.covering_mm());
        let candidates = catalogue(&reach, planner.experiments.own());
        Self {
            planner,
            reach,
            candidates: candidates.into_iter().map(|one| (one, OnceLock::new())).collect(),
        }
    }

    /// The designs of some candidates that can be made, in the catalogue's order.
    pub(super) fn designs(&self, is_wanted: impl Fn(&Candidate) -> bool) -> Vec<Design<'_>> {
        let wanted = self.candidates.iter().filter(|(candidate, _)| is_wanted(candidate));
        let wanted: Vec<&(Candidate, OnceLock<_>)> = wanted.collect();
        let designs = parallel::map(&wanted, |(of, rehearsed)| {
            let rehearsed = rehearsed.get_or_init(|| self.rehearse(of));
            let design = |rehearsal| Design { of, seed: of.seed(self.planner.seed), rehearsal };
            rehearsed.as_ref().ok().map(design)
        });
        designs.into_iter().flatten().collect()
    }

    fn rehearse(&self, candidate: &Candidate) -> Result<Rehearsal, String> {
        let Planner { experiments, faulty, seed, .. } = self.planner;
        let rehearsal = experiments.rehearse(RehearsalOrder {
            experiment: &candidate.experiment,
            parameters: &candidate.parameters,
            seed: candidate.seed(seed),
            faulty,
        })?;
        match self.reach.is_left_by(&rehearsal.frames) {
            Some(reason) => Err(reason),
            None if rehearsal.frames.is_empty() => Err("its rehearsal has no frame".to_owned()),
            None => Ok(rehearsal),
        }
    }

    /// The candidates that were looked at and cannot be made.
    pub(super) fn left_out(&self) -> Vec<LeftOut> {
        let refused = self.candidates.iter().filter_map(|(candidate, rehearsed)| {
            let reason = rehearsed.get()?.as_ref().err()?;
            let Candidate { experiment, parameters, .. } = candidate.clone();
            Some(LeftOut { experiment, parameters, reason: reason.clone() })
        });
        refused.collect()
    }
}

impl Design<'_> {
    pub(super) fn proposed(self, separates: &[String; 2], expected_z: Option<f64>) -> NextExperiment {
        NextExperiment {
            experiment: self.of.experiment.clone(),
            parameters: self.of.parameters.clone(),
            seed: self.seed,
            duration_s: self.rehearsal.duration_s,
            separates: separates.clone(),
            expected_z,
        }
    }
}
