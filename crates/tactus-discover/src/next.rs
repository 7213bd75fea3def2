//! The next experiment: which one would distinguish two explanations that the data do not.
//!
//! Each experiment of the [`catalogue`] is rehearsed: its own script tells when and where the tip would be ([`Experiments`]). Those
//! beyond the [`reach`] of the data are left out. Each explanation predicts the frames of the others. The difference of the two
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
//! that an effect's definition names as showing it, and the lab's own, come before all others.
//!
//! # Source
//! Designs that discriminate between models: A. C. Atkinson and V. V. Fedorov, *Biometrika* 62 (1975) 57 (T-optimality).
//!
//! # Constants
//!
//! *Derived*: from other numbers. *Convention*: chosen when it was written, and not changed since; no measurement says how much hangs on it.
//! *Cost*: a bound of time or memory. *Measured*: on sets, as the reason says. *Tried*: changed after runs on tuning sets, of which no recipe is
//! kept. *Default*: that of a script. A test compares the values with the code.
//!
//! | file | constant | value | kind | reason |
//! |---|---|---|---|---|
//! | next.rs | `PROPOSALS_MAX` | `3` | convention | of one question |
//! | next.rs | `CLEAR_Z` | `20.0` | convention | an experiment of twenty standard errors is long enough; not measured |
//! | next.rs | `SMALL_SHARE` | `0.02` | convention | an effect of 2 % of the signal |
//! | catalogue.rs | `SCALES` | `[0.3, 1.0]` | default | a short and a full form of `diagnose` |
//! | catalogue.rs | `DEPTH_SHARE` | `0.5` | default | of `diagnose` |
//! | catalogue.rs | `LADDER` | `1.2` | default | of `diagnose` |
//! | catalogue.rs | `SPEEDS_MM_PER_S` | `[0.1, 0.2, 0.3, 0.5, 0.7, 1.0]` | default | of `diagnose` |
//! | catalogue.rs | `ELEMENT_DEPTHS_MM` | `[0.2, 0.3, 0.4, 0.5, 0.6]` | default | of `element-centres` |
//! | catalogue.rs | `SWEEP_SHARES` | `[0.3, 0.5, 0.65]` | default | of `grid-sweep` |
//! | plan.rs | `WORTH_Z` | `2.0` | convention | two standard errors |
//! | reach.rs | `NEARLY` | `1.05` | convention | 5 % deeper is as deep |
//! | reach.rs | `NEARLY_AS_FAST` | `1.2` | convention | the mean speed of a load depends on its depth |
//! | reach.rs | `SAME_MM` | `1e-6` | derived | the rounding of a number in a file |

mod catalogue;
mod experiments;
mod plan;
mod reach;
mod rehearsals;

use tactus_calibrate::FaultyElement;
use tactus_model::effect::{Definition, EffectError, ParameterKind};

use crate::data::{Averaged, Bins, DiscoverError, Frames, HeldOut, Known, Noise};
use crate::fit::{Direction, Free, Parameters, Predictor, Problem, Term};
use crate::numbers::parallel;
use crate::search::NotShown;
use catalogue::{Candidate, FLOOR};
pub use experiments::{Experiments, Rehearsal, RehearsalOrder};
pub use plan::{LeftOut, NextExperiment, OpenQuestion, Plan, WORTH_Z};
use rehearsals::{Design, Rehearsals};

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

/// A model with a draft, and without it.
#[derive(Debug, Clone)]
pub(crate) struct DraftModel {
    pub(crate) name: &'static str,
    pub(crate) with: Parameters,
    pub(crate) without: Parameters,
}

impl Explanation {
    /// Experiments that show the effect.
    fn shown_by(&self) -> &'static [&'static str] {
        let term = self.parameters.terms.iter().find(|term| term.definition.name == self.name);
        term.map_or(&[], |term| term.definition.shown_by)
    }
}

/// What the data leave open.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Open<'a> {
    pub(crate) pairs: &'a [Pair],
    /// Effects that the data cannot show, and the model to which they would be added.
    pub(crate) not_shown: &'a [NotShown],
    pub(crate) at: &'a Parameters,
    /// A draft that a new measurement should confirm.
    pub(crate) draft: Option<&'a DraftModel>,
    /// The data do not suffice for a verdict: repeats are proposed first.
    pub(crate) lacks_repeats: bool,
}

/// Expected result of an experiment.
#[derive(Debug, Clone, Copy)]
struct Expected {
    z: f64,
    /// Share of the gap that the wrong explanation would leave.
    share: f64,
}

/// Greatest number of proposals for one pair.
const PROPOSALS_MAX: usize = 3;
/// An experiment that shows a draft by so many standard errors shows it clearly.
const CLEAR_Z: f64 = 20.0;
/// Assumed size of an effect that was not shown, as a share of the experiment's largest signal.
const SMALL_SHARE: f64 = 0.02;

/// What rehearsed experiments answer to a question.
#[derive(Debug)]
struct Answer {
    /// Those that are worth their time, best first.
    next: Vec<NextExperiment>,
    /// The one with the greatest `z`.
    best: Option<NextExperiment>,
}

/// Plans the next experiments from the data and their noise.
#[derive(Clone, Copy)]
pub(crate) struct Planner<'a> {
    pub(crate) known: &'a Known,
    /// The data. No experiment is proposed that goes deeper or loads faster than they do.
    pub(crate) frames: &'a Frames,
    pub(crate) noise: &'a Noise,
    pub(crate) faulty: &'a [FaultyElement],
    pub(crate) experiments: &'a dyn Experiments,
    pub(crate) seed: u64,
}

impl Planner<'_> {
    /// What to measure next: first repeats if they are needed; then what distinguishes each pair, first the experiment with the greatest
    /// share, then shorter ones; then what shows each effect that the data cannot show, even if it is small.
    pub(crate) fn plan(self, open: Open<'_>) -> Result<Plan, DiscoverError> {
        let rehearsals = Rehearsals::of(self);
        let mut plan = Plan::default();
        if open.lacks_repeats {
            plan.next.extend(Self::repeats(&rehearsals));
        }
        for pair in open.pairs {
            let separates = pair.of.each_ref().map(|one| one.name.to_owned());
            let shown_by = pair.of.each_ref().map(Explanation::shown_by).concat();
            // The linear prediction promises too much of what the definitions do not name.
            let is_first = |one: &Candidate| one.is_own || shown_by.contains(&one.name.as_str());
            let is_other = |one: &Candidate| !is_first(one) && one.name != FLOOR;
            let mut answer =
                rehearsals.answer(&separates, is_first, |design| self.separation(design, pair))?;
            if answer.next.is_empty() {
                let other =
                    rehearsals.answer(&separates, is_other, |design| self.separation(design, pair))?;
                answer = answer.or(other);
            }
            plan.take(answer, separates, PROPOSALS_MAX);
        }
        if let Some(DraftModel { name, with, without }) = open.draft {
            let separates = [(*name).to_owned(), "noise".to_owned()];
            let is_any = |one: &Candidate| one.name != FLOOR;
            let expect = |design: &Design<'_>| self.beyond(design, with, without);
            let mut answer = rehearsals.answer(&separates, is_any, expect)?;
            // The shortest that shows it clearly: they are in order, the longest first.
            let clear = |one: &NextExperiment| one.expected_z.is_some_and(|z| z >= CLEAR_Z);
            let shortest = answer.next.iter().rposition(clear).unwrap_or(0);
            answer.next = answer.next.into_iter().skip(shortest).collect();
            plan.take(answer, separates, 1);
        }
        for NotShown { effect, .. } in open.not_shown {
            let separates = [(*effect).to_owned(), "nothing".to_owned()];
            let definition = self.definition(effect)?;
            let shows = |one: &Candidate| one.is_own || may_show(definition, one);
            let expect = |design: &Design<'_>| self.visibility(design, definition, open.at);
            plan.take(rehearsals.answer(&separates, shows, expect)?, separates, 1);
        }
        plan.left_out = rehearsals.left_out();
        Ok(plan)
    }

    /// The definition of an effect of the library, or of a draft of the lab.
    fn definition(self, effect: &str) -> Result<&'static Definition, EffectError> {
        let draft = self.known.drafts.iter().copied().find(|draft| draft.name == effect);
        draft.map_or_else(|| Definition::find(effect), Ok)
    }

    /// The experiment that gives data a floor.
    fn repeats(rehearsals: &Rehearsals<'_>) -> Option<NextExperiment> {
        let separates = ["what is missing".to_owned(), "noise".to_owned()];
        let designs = rehearsals.designs(|one| one.name == FLOOR);
        designs.first().map(|design| design.proposed(&separates, None))
    }

    /// How well a design distinguishes a pair.
    fn separation(self, design: &Design<'_>, pair: &Pair) -> Result<Expected, DiscoverError> {
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

    /// How well a design shows a draft: what a fit of the model without it would leave.
    fn beyond(
        self,
        design: &Design<'_>,
        with: &Parameters,
        without: &Parameters,
    ) -> Result<Expected, DiscoverError> {
        self.on(design, |problem| {
            let [with, without] = [with, without].map(once);
            let (more, less) = (problem.predict(&with)?, problem.predict(&without)?);
            let change = more.iter().zip(&less).map(|(more, less)| more - less).collect();
            let columns = vec![Direction::of(change, self.frames.elements)];
            let z = problem.sizes(&without, &less, columns)?.into_iter().sum();
            // There is no other explanation that would close any of it.
            Ok(Expected { z, share: 1.0 })
        })
    }

    /// How well a design shows a small effect, by the parameter that it shows best.
    fn visibility(
        self,
        design: &Design<'_>,
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
        design: &Design<'_>,
        work: impl FnOnce(&Problem<'_>) -> Result<R, DiscoverError>,
    ) -> Result<R, DiscoverError> {
        let frames = &design.rehearsal.frames;
        let mut bins = Bins::of(frames, Averaged::Rests)?;
        let all = HeldOut { frames: vec![false; frames.len()], ..HeldOut::default() };
        bins.weigh(frames, self.noise, &all);
        let predictor = Predictor::new(self.known, frames, &bins).read_as(self.frames);
        work(&Problem::new(predictor, self.noise))
    }
}

/// True if an experiment may show an effect. The definition of a draft names none: any may show it.
fn may_show(definition: &Definition, one: &Candidate) -> bool {
    definition.shown_by.contains(&one.name.as_str()) || definition.draft().is_some() && one.name != FLOOR
}

impl Rehearsals<'_> {
    /// What some of the candidates would answer.
    fn answer(
        &self,
        separates: &[String; 2],
        is_wanted: impl Fn(&Candidate) -> bool,
        expect: impl Fn(&Design<'_>) -> Result<Expected, DiscoverError> + Sync,
    ) -> Result<Answer, DiscoverError> {
        let designs = self.designs(is_wanted);
        let mut found: Vec<(&Design<'_>, Expected)> = Vec::new();
        let expected = parallel::map(&designs, |design| expect(design));
        for (design, expected) in designs.iter().zip(expected) {
            found.push((design, expected?));
        }
        let proposed =
            |(design, expected): &(&Design<'_>, Expected)| design.proposed(separates, Some(expected.z));
        let best = found.iter().max_by(|(_, one), (_, other)| one.z.total_cmp(&other.z)).map(proposed);
        found.retain(|(_, expected)| expected.z >= WORTH_Z);
        found.sort_by(|(_, one), (_, other)| {
            other.share.total_cmp(&one.share).then(other.z.total_cmp(&one.z))
        });
        // An experiment with a smaller share must take less time.
        let mut shortest_s = f64::INFINITY;
        found.retain(|(design, _)| {
            let is_shorter = design.rehearsal.duration_s < shortest_s;
            shortest_s = shortest_s.min(design.rehearsal.duration_s);
            is_shorter
        });
        Ok(Answer { next: found.iter().map(proposed).collect(), best })
    }
}

impl Answer {
    /// The other answer if this one proposes nothing, with the better of both where neither does.
    fn or(self, other: Self) -> Self {
        let better = |one: NextExperiment, two: NextExperiment| {
            if two.expected_z > one.expected_z { two } else { one }
        };
        Self { best: self.best.into_iter().chain(other.best).reduce(better), next: other.next }
    }
}

impl Plan {
    /// Takes the first proposals of an answer, or the question if there are none.
    fn take(&mut self, answer: Answer, separates: [String; 2], proposals_max: usize) {
        if answer.next.is_empty() {
            self.open.push(OpenQuestion { separates, best: answer.best });
        }
        self.next.extend(answer.next.into_iter().take(proposals_max));
    }
}

/// The same model for a single new run, with mean gains and baselines and without random walks.
fn once(of_runs: &Parameters) -> Parameters {
    Parameters {
        sensitivity: of_runs.centred().0,
        run_gain: vec![1.0],
        baseline: vec![of_runs.mean_baseline()],
        walk: None,
        ..of_runs.clone()
    }
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
