//! The next experiment: which one would distinguish two explanations that the data do not.
//!
//! Each explanation predicts the frames of every experiment that the rig could make ([`design`]). The difference of the two
//! predictions counts only as far as a fit of the wrong explanation, with its gains, baselines, spread and effects free,
//! cannot reproduce it:
//!
//! ```text
//! z = sqrt(sum of (d / noise)^2)        d = difference of the predictions, orthogonal to the wrong one's tangent space
//! ```
//!
//! Either explanation may be the wrong one, so the smaller `z` of the two is taken. The fit uses only the new frames; with
//! the old data the distinction is no worse. Real physics has neither form exactly, so a wrong explanation must also leave a
//! good share of the gap in old and new frames together. The experiment with the greatest share comes first. Experiments
//! that an effect's definition names as showing it come before all others.
//!
//! # Source
//! Designs that discriminate between models: A. C. Atkinson and V. V. Fedorov, *Biometrika* 62 (1975) 57 (T-optimality).

mod design;

use tactus_model::effect::{Definition, ParameterKind};

use crate::data::{Bins, DiscoverError, Frames, HeldOut, Known, Noise};
use crate::fit::{Direction, Free, Parameters, Predictor, Problem, Term};
use crate::numbers::parallel;
use crate::search::NotShown;
use design::{Design, DesignSpace};

/// An experiment that would distinguish two explanations.
#[derive(Debug, Clone, PartialEq)]
pub struct NextExperiment {
    /// Name of the experiment for `tactus run`.
    pub experiment: &'static str,
    /// Its parameters and their values for `tactus run --param`.
    pub parameters: Vec<(&'static str, String)>,
    /// Approximate duration on the rig.
    pub duration_s: f64,
    /// The two explanations.
    pub separates: [String; 2],
    /// By how many standard errors their predictions would differ; `None` if that cannot be predicted.
    pub expected_z: Option<f64>,
}

/// A model that may explain the data.
#[derive(Debug, Clone)]
pub(crate) struct Explanation {
    /// The effect that distinguishes it from the other explanation.
    pub(crate) name: &'static str,
    pub(crate) parameters: Parameters,
}

/// Two explanations that the data do not distinguish.
#[derive(Debug, Clone)]
pub(crate) struct Pair {
    /// The effect in the model, and another in its place.
    pub(crate) of: [Explanation; 2],
    /// The model with neither effect.
    pub(crate) without: Parameters,
    /// Reduction of the cost by the effect in the model.
    pub(crate) gain: f64,
}

/// Expected result of an experiment.
#[derive(Debug, Clone, Copy)]
struct Expected {
    z: f64,
    /// Share of the gap that the wrong explanation would leave.
    share: f64,
}

/// Least `z` of a proposal.
const WORTH_Z: f64 = 2.0;
/// Greatest number of proposals for one pair.
const PROPOSALS_MAX: usize = 3;
/// Assumed size of an effect that was not shown, as a share of the experiment's largest signal.
const SMALL_SHARE: f64 = 0.02;

/// Parts of `diagnose` that rest, and that repeat a press.
const FLOOR_PARTS: [&str; 2] = ["drift", "repeats"];

/// Plans the next experiments from the data and their noise.
#[derive(Clone, Copy)]
pub(crate) struct Planner<'a> {
    pub(crate) known: &'a Known,
    /// The data. No design goes deeper or loads faster than they do.
    pub(crate) frames: &'a Frames,
    pub(crate) noise: &'a Noise,
}

impl Planner<'_> {
    /// For each pair, the experiments that distinguish it: first the one with the greatest share, then shorter ones.
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
            // Experiments that definitions name for either effect. The linear prediction promises too much of the others.
            let (own, others): (Vec<&Design>, Vec<&Design>) =
                designs.iter().partition(|design| shown_by.contains(&design.name));
            for designs in [own, others] {
                let best = Self::best(&designs, &separates, |design| self.separation(design, pair))?;
                if !best.is_empty() {
                    proposals.extend(best);
                    break;
                }
            }
        }
        Ok(proposals)
    }

    /// For each effect that the data cannot show, an experiment that would show it even if it is small.
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
            let best = Self::best(&own, &separates, |design| self.visibility(design, definition, at))?;
            proposals.extend(best.into_iter().take(1));
        }
        Ok(proposals)
    }

    /// The experiment that gives data a floor: it rests, and presses one place many times.
    pub(crate) fn repeats(self) -> NextExperiment {
        let designs = DesignSpace::of(self.known, self.frames).designs();
        let of = |name: &str| designs.iter().find(|one| one.name == name && one.is_whole());
        let parts = FLOOR_PARTS.map(of);
        let depth = parts.iter().flatten().flat_map(|one| &one.parameters).find(|(key, _)| *key != "parts");
        NextExperiment {
            experiment: "diagnose",
            parameters: [("parts", FLOOR_PARTS.join(","))].into_iter().chain(depth.cloned()).collect(),
            duration_s: parts.iter().flatten().map(|one| one.duration_s).sum(),
            separates: ["what is missing".to_owned(), "noise".to_owned()],
            expected_z: None,
        }
    }

    fn best(
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
        // An experiment with a smaller share must take less time.
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
            expected_z: Some(expected.z),
        });
        Ok(proposals.collect())
    }

    /// How well a design distinguishes a pair.
    fn separation(self, design: &Design, pair: &Pair) -> Result<Expected, DiscoverError> {
        self.on(design, |problem| {
            let [one, other, without] =
                [&pair.of[0].parameters, &pair.of[1].parameters, &pair.without].map(once);
            let predicted = [problem.predict(&one)?, problem.predict(&other)?, problem.predict(&without)?];
            let wrong = |at: &Parameters, predicted: &[f64], right: &[f64]| {
                let difference: Vec<f64> = right.iter().zip(predicted).map(|(a, b)| a - b).collect();
                let sizes =
                    problem.sizes(at, predicted, vec![Direction::of(difference, self.frames.elements)])?;
                Ok::<f64, DiscoverError>(sizes.iter().sum())
            };
            let z =
                wrong(&one, &predicted[0], &predicted[1])?.min(wrong(&other, &predicted[1], &predicted[0])?);
            let gap = wrong(&without, &predicted[2], &predicted[0])?;
            Ok(Expected { z, share: z * z / (pair.gain + gap * gap).max(f64::MIN_POSITIVE) })
        })
    }

    /// How well a design shows a small effect, by the parameter that it shows best.
    fn visibility(
        self,
        design: &Design,
        definition: &'static Definition,
        at: &Parameters,
    ) -> Result<Expected, DiscoverError> {
        self.on(design, |problem| {
            let at = once(at);
            let predicted = problem.predict(&at)?;
            let signal = largest(&predicted, &at.baseline[0]);
            let mut with = at.clone();
            with.terms.push(Term::neutral(definition));
            let term = with.terms.len() - 1;
            let mut columns = Vec::new();
            for (parameter, known) in definition.parameters.iter().enumerate() {
                if known.kind != ParameterKind::Real {
                    continue;
                }
                let column = problem.slope(&with, &predicted, Free::Of { term, parameter })?;
                let reach = column.iter().map(|slope| slope.abs()).fold(0.0, f64::max);
                if reach > 0.0 {
                    let small = column.iter().map(|slope| slope * SMALL_SHARE * signal / reach).collect();
                    columns.push(Direction::of(small, self.frames.elements));
                }
            }
            let best = problem.sizes(&at, &predicted, columns)?.into_iter().fold(0.0, f64::max);
            // There is no other explanation that would close any of it.
            Ok(Expected { z: best, share: 1.0 })
        })
    }

    /// Calls `work` with the least-squares problem of the design's frames.
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

/// The same model for a single new run, with mean baselines and without random walks.
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
