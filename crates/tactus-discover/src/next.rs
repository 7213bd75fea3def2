//! The next experiment: which one would tell two explanations apart that the data cannot.
//!
//! Each explanation predicts the frames of every experiment that the rig could make ([`design`]). What their difference
//! is to be worth is what a fit of the wrong one cannot take up, with its gains, baselines, spread and effects free:
//!
//! ```text
//! z = sqrt(sum of (d / noise)^2)        d = difference of the predictions, freed of the tangent space of the wrong one
//! ```
//!
//! the smaller of the two, since nobody knows which is wrong. Only the new frames bind that fit: `z` is what the experiment
//! tells by itself, and with the old data it tells no less. Nature has neither's very form, so that a wrong one must also
//! leave a good part of what either closes, of old and new frames together: the experiment with the greatest such share
//! comes first. Those come before all others of which an effect's definition says that they show it.
//!
//! # Source
//! Designs that discriminate between models: A. C. Atkinson and V. V. Fedorov, *Biometrika* 62 (1975) 57 (T-optimality).

mod design;

use tactus_model::effect::{Definition, ParameterKind};

use crate::bins::{Bins, HeldOut};
use crate::discovery::{NextExperiment, NotShown};
use crate::fit::{Free, Problem};
use crate::noise::Noise;
use crate::parallel;
use crate::predictor::{Parameters, Predictor, Term};
use crate::score::Fitting;
use crate::{DiscoverError, Frames, Known};
use design::{Design, DesignSpace};

/// A model that may be what the data show.
#[derive(Debug, Clone)]
pub(crate) struct Explanation {
    /// The effect that it has and the other has not.
    pub(crate) name: &'static str,
    pub(crate) parameters: Parameters,
}

/// Explanations that the data do not tell apart.
#[derive(Debug, Clone)]
pub(crate) struct Pair {
    /// The one that is in the model, and another in its place.
    pub(crate) of: [Explanation; 2],
    /// The model with neither.
    pub(crate) without: Parameters,
    /// By how much the one lessens the cost of the data.
    pub(crate) gain: f64,
}

/// What an experiment is expected to tell.
#[derive(Debug, Clone, Copy)]
struct Expected {
    z: f64,
    /// Which share of the gap the wrong one would leave.
    share: f64,
}

/// An experiment that does worse is not proposed.
const WORTH_Z: f64 = 2.0;
/// Proposals for one question.
const PROPOSALS_MAX: usize = 3;
/// An effect that was not shown is taken to move the largest signal of an experiment by this share of it.
const SMALL_SHARE: f64 = 0.02;

/// What else a proposal rests on.
#[derive(Clone, Copy)]
pub(crate) struct Setting<'a> {
    pub(crate) known: &'a Known,
    /// The data: no design goes deeper, or loads faster, than they did.
    pub(crate) frames: &'a Frames,
    pub(crate) noise: &'a Noise,
}

impl Setting<'_> {
    /// For each pair the experiments that tell it apart: the one that leaves the wrong one the greatest share, then
    /// shorter ones.
    pub(crate) fn propose(self, pairs: &[Pair]) -> Result<Vec<NextExperiment>, DiscoverError> {
        if pairs.is_empty() {
            return Ok(Vec::new());
        }
        let designs = DesignSpace::of(self.known, self.frames).designs();
        let mut proposals = Vec::new();
        for pair in pairs {
            let separates = pair.of.each_ref().map(|one| one.name.to_owned());
            let [one, other] = pair.of.each_ref().map(|one| Definition::find(one.name));
            let shown_by = [one?.shown_by, other?.shown_by].concat();
            // What is said to show either; small steps promise too much of the others.
            let (own, others): (Vec<&Design>, Vec<&Design>) =
                designs.iter().partition(|design| shown_by.contains(&design.name));
            for designs in [own, others] {
                let best = self.best(&designs, &separates, |design| self.separation(design, pair))?;
                if !best.is_empty() {
                    proposals.extend(best);
                    break;
                }
            }
        }
        Ok(proposals)
    }

    /// For each effect that the data cannot show the experiments that would show it, were it small.
    pub(crate) fn show(
        self,
        not_shown: &[NotShown],
        at: &Parameters,
    ) -> Result<Vec<NextExperiment>, DiscoverError> {
        if not_shown.is_empty() {
            return Ok(Vec::new());
        }
        let designs = DesignSpace::of(self.known, self.frames).designs();
        let mut proposals = Vec::new();
        for NotShown { effect, .. } in not_shown {
            let definition = Definition::find(effect)?;
            let own: Vec<&Design> =
                designs.iter().filter(|design| definition.shown_by.contains(&design.name)).collect();
            let separates = [(*effect).to_owned(), "nothing".to_owned()];
            let best = self.best(&own, &separates, |design| self.visibility(design, definition, at))?;
            proposals.extend(best.into_iter().take(1));
        }
        Ok(proposals)
    }

    fn best(
        self,
        designs: &[&Design],
        separates: &[String; 2],
        expect: impl Fn(&Design) -> Result<Expected, DiscoverError> + Sync,
    ) -> Result<Vec<NextExperiment>, DiscoverError> {
        let mut found: Vec<(&Design, Expected)> = Vec::new();
        let expected = parallel::map(designs, |design| expect(design));
        for (design, expected) in designs.iter().zip(expected) {
            found.push((design, expected?));
        }
        found.retain(|(_, expected)| expected.z >= WORTH_Z);
        found.sort_by(|(_, one), (_, other)| {
            other.share.total_cmp(&one.share).then(other.z.total_cmp(&one.z))
        });
        // What tells less must take less time.
        let mut shortest_s = f64::INFINITY;
        found.retain(|(design, _)| {
            let is_shorter = design.duration_s < shortest_s;
            shortest_s = shortest_s.min(design.duration_s);
            is_shorter
        });
        let proposals = found.into_iter().take(PROPOSALS_MAX).map(|(design, expected)| NextExperiment {
            experiment: design.experiment,
            parameters: design.parameters.clone(),
            duration_s: design.duration_s,
            separates: separates.clone(),
            expected_z: expected.z,
        });
        Ok(proposals.collect())
    }

    /// The wrong one is the other, whichever is right; the right one is as in the model.
    fn separation(self, design: &Design, pair: &Pair) -> Result<Expected, DiscoverError> {
        self.on(design, |problem| {
            let [one, other, without] =
                [&pair.of[0].parameters, &pair.of[1].parameters, &pair.without].map(once);
            let predicted = [problem.predict(&one)?, problem.predict(&other)?, problem.predict(&without)?];
            let wrong = |at: &Parameters, predicted: &[f64], right: &[f64]| {
                let mut difference: Vec<f64> = right.iter().zip(predicted).map(|(a, b)| a - b).collect();
                let fitting = Fitting::at(problem, at, predicted)?;
                fitting.free(&mut difference);
                Ok::<f64, DiscoverError>(fitting.size(&difference))
            };
            let z =
                wrong(&one, &predicted[0], &predicted[1])?.min(wrong(&other, &predicted[1], &predicted[0])?);
            let gap = wrong(&without, &predicted[2], &predicted[0])?;
            Ok(Expected { z, share: z * z / (pair.gain + gap * gap).max(f64::MIN_POSITIVE) })
        })
    }

    /// How far a small effect lies from the model without it, the least of its own parameters.
    fn visibility(
        self,
        design: &Design,
        definition: &'static Definition,
        at: &Parameters,
    ) -> Result<Expected, DiscoverError> {
        self.on(design, |problem| {
            let at = once(at);
            let predicted = problem.predict(&at)?;
            let fitting = Fitting::at(problem, &at, &predicted)?;
            let signal = largest(&predicted, &at.baseline[0]);
            let mut with = at.clone();
            with.terms.push(Term::neutral(definition));
            let term = with.terms.len() - 1;
            let mut best = 0.0_f64;
            for (parameter, known) in definition.parameters.iter().enumerate() {
                if known.kind != ParameterKind::Real {
                    continue;
                }
                let mut column = problem.slope(&with, &predicted, Free::Of { term, parameter })?;
                let reach = column.iter().map(|slope| slope.abs()).fold(0.0, f64::max);
                if reach > 0.0 {
                    fitting.free(&mut column);
                    best = best.max(fitting.size(&column) * SMALL_SHARE * signal / reach);
                }
            }
            // Nothing else would close any of it.
            Ok(Expected { z: best, share: 1.0 })
        })
    }

    /// Does something with a model of the design's frames.
    fn on<R>(
        self,
        design: &Design,
        work: impl FnOnce(&Problem<'_>) -> Result<R, DiscoverError>,
    ) -> Result<R, DiscoverError> {
        let frames = &design.frames;
        let mut bins = Bins::of(frames, true)?;
        let all = HeldOut { frames: vec![false; frames.len()], ..HeldOut::default() };
        bins.weigh(frames, self.noise, &all);
        work(&Problem::new(Predictor::new(self.known, frames, &bins), self.noise))
    }
}

/// The same model for a run of its own.
fn once(of_runs: &Parameters) -> Parameters {
    Parameters { baseline: vec![of_runs.mean_baseline()], walk: None, ..of_runs.clone() }
}

fn largest(predicted: &[f64], baseline: &[f64]) -> f64 {
    predicted
        .iter()
        .zip(baseline.iter().cycle())
        .map(|(counts, zero)| (counts - zero).abs())
        .fold(0.0, f64::max)
}

#[cfg(test)]
#[path = "next_tests.rs"]
mod tests;
