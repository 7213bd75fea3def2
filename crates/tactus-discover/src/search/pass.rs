//! The pass over the data: the products of all additions at a model.
//!
//! The additions are every shape of every effect, the free parts of their classes, and rivals without a name. From the products follow the
//! odds of any set of them ([`super::evidence`]).

use std::sync::Arc;

use nalgebra::DMatrix;

use super::candidates::Candidate;
use super::drift::TriedWalk;
use super::evidence::{Addition, Evidence, Set, Signs, excused};
use super::grow::{LN_ODDS_LEAST, Search, names};
use super::rivals::{Rival, rivals};
use super::score::Score;
use super::varying::varying_effect;
use crate::data::DiscoverError;
use crate::fit::{Direction, Fitted, Free, Grams, Problem, RANDOM_WALK, Term};
use crate::numbers::{median, parallel};

/// A class speaks for its free part, which model files cannot hold, if it has this share of the odds of that. From tuning sets: right classes
/// have 0.83 and more, wrong ones 0.21.
const FREE_SHARE: f64 = 0.4;

/// All additions at a model, with their products.
pub(crate) struct Pass {
    pub(super) additions: Vec<Addition>,
    pub(super) kinds: Vec<Kind>,
    /// Names of the classes.
    pub(super) classes: Vec<&'static str>,
    pub(super) scores: Vec<Score>,
    pub(super) grams: Grams,
    /// The products of named additions, whose directions come first, and of the residual.
    named: DMatrix<f64>,
    pub(super) walk: Option<TriedWalk>,
    /// Classes of the model.
    present: Vec<usize>,
    variance: f64,
}

/// What an addition is.
pub(super) enum Kind {
    /// A candidate in a shape.
    Term {
        candidate: usize,
        shape: Term,
        /// Its parameters to which the directions belong; none if it is a free part.
        amplitudes: Vec<usize>,
    },
    Rival,
    /// The free part of a class.
    Free(&'static str),
}

/// The additions of a pass while they are gathered.
#[derive(Default)]
struct Gathered<'a> {
    directions: Vec<Direction<'a>>,
    additions: Vec<Addition>,
    kinds: Vec<Kind>,
    classes: Vec<&'static str>,
}

impl Pass {
    /// The evidence for named additions.
    pub(super) fn evidence(&self) -> Evidence<'_> {
        self.evidence_on(&self.named)
    }

    pub(super) fn evidence_on<'a>(&'a self, products: &'a DMatrix<f64>) -> Evidence<'a> {
        Evidence { additions: &self.additions, products, variance: self.variance, present: &self.present }
    }

    pub(super) fn is_named(&self, addition: usize) -> bool {
        matches!(self.kinds[addition], Kind::Term { .. })
    }

    pub(super) fn class_of(&self, addition: usize) -> &'static str {
        self.classes[self.additions[addition].class]
    }

    /// The additions whose class `among` selects by name.
    pub(super) fn among(&self, among: impl Fn(&str) -> bool) -> Vec<usize> {
        (0..self.additions.len()).filter(|one| self.is_named(*one) && among(self.class_of(*one))).collect()
    }

    /// Logarithm of the greatest odds of any named addition by itself.
    pub(super) fn most_ln_odds(&self) -> f64 {
        let evidence = self.evidence();
        let gains = evidence.best_of_classes(&evidence.none(), &self.among(|_| true), 0.0);
        gains.first().map_or(0.0, |(_, gain)| gain.ln_odds)
    }

    /// The additions that are the free part of a class.
    fn free(&self, class: &str) -> Vec<usize> {
        (0..self.additions.len())
            .filter(|one| matches!(self.kinds[*one], Kind::Free(of) if of == class))
            .collect()
    }

    /// Logarithm of the odds of each rival of a class that has these odds: in the place of the class, and in that of its free part where
    /// that is stronger, but not so strong that the class as the model can have it is only a shadow of it.
    pub(super) fn rivalry(&self, class: &str, ln_odds: f64) -> (f64, Vec<(&'static str, f64)>) {
        let evidence = self.evidence_on(self.grams.reduced());
        let free = self.free(class).into_iter();
        let free = free.map(|one| evidence.gain_alone(one).ln_odds.min(ln_odds / FREE_SHARE));
        (free.fold(ln_odds, f64::max), self.rivals(&evidence, &evidence.none(), class))
    }

    /// Logarithm of the odds of each rival beside a model that has a class, and beside the free part of that.
    pub(crate) fn beside(&self, class: &str) -> Vec<(&'static str, f64)> {
        let evidence = self.evidence_on(self.grams.reduced());
        let free = self.free(class).into_iter().filter(|one| evidence.gain_alone(*one).ln_odds > 0.0);
        self.rivals(&evidence, &evidence.set(free), class)
    }

    /// Logarithm of the odds of each rival beside a set; that of which a class is a part is none of its rivals.
    fn rivals(&self, evidence: &Evidence<'_>, set: &Set, class: &str) -> Vec<(&'static str, f64)> {
        let own: Vec<&[usize]> =
            self.free(class).into_iter().map(|one| &self.additions[one].directions[..]).collect();
        let is_rival = |one: &usize| {
            matches!(self.kinds[*one], Kind::Rival) && !own.contains(&&self.additions[*one].directions[..])
        };
        let rivals = (0..self.additions.len()).filter(is_rival);
        rivals.map(|one| (self.class_of(one), evidence.gain(set, one).ln_odds)).collect()
    }
}

/// True if a rival takes the place of a class with these odds: one without a name if it is ahead by more than a form is excused; another effect
/// of the model, whose strength varies, if the class is not ahead of it by the odds with which a class holds its place.
pub(super) fn rivals_win(rivals: &[(&'static str, f64)], ln_odds: f64) -> bool {
    let least = |rival| if varying_effect(rival).is_some() { -LN_ODDS_LEAST } else { excused(ln_odds) };
    rivals.iter().any(|(rival, of_rival)| *of_rival > ln_odds + least(rival))
}

impl Search<'_> {
    /// The products of all additions at a model.
    pub(crate) fn pass(&self, at: &Fitted) -> Result<Arc<Pass>, DiscoverError> {
        self.memory.passes.at(&at.parameters, || self.pass_over(at).map(Arc::new))
    }

    fn pass_over(&self, at: &Fitted) -> Result<Pass, DiscoverError> {
        let problem = self.problem;
        let mut gathered = Gathered::default();
        for (number, candidate) in self.candidates.iter().enumerate() {
            gathered.add_candidate(problem, at, number, candidate);
        }
        let named = gathered.directions.len();
        rivals(problem, at, self.known_terms, self.rounds)?
            .into_iter()
            .for_each(|rival| gathered.add_rival(rival));
        let Gathered { directions, mut additions, kinds, classes } = gathered;
        let grams = problem.grams(at, directions)?;
        let last = grams.reduced().nrows() - 1;
        let residual = grams.reduced()[(last, last)].sqrt();
        for (addition, kind) in additions.iter_mut().zip(&kinds) {
            if !matches!(kind, Kind::Term { .. }) {
                // As a rival has no range: what would make the whole residual.
                for (width, direction) in addition.widths.iter_mut().zip(&addition.directions) {
                    *width = residual / grams.whole(*direction).max(f64::MIN_POSITIVE);
                }
            }
        }
        let shapes = |class: usize| additions.iter().filter(|one| one.class == class).count() as f64;
        let score = |one: &Addition| {
            let among = if one.among > 1.0 { one.among * shapes(one.class) } else { 1.0 };
            Score::of_grams(&grams, &one.directions).picked_from(among)
        };
        let scores = parallel::map(&additions, score);
        // The errors of a coarse converter's rounding differ from press to press, and are no noise.
        let excess = median(&scores.iter().map(|score| score.excess).collect::<Vec<_>>());
        let names = names(&at.parameters, self.known_terms);
        let present = (0..classes.len()).filter(|class| names.contains(&classes[*class])).collect();
        let walk = if classes.contains(&RANDOM_WALK.name) { problem.tried_walk(at)? } else { None };
        Ok(Pass {
            additions,
            kinds,
            classes,
            scores,
            named: grams.first(named),
            grams,
            walk,
            present,
            variance: problem.variance * if self.rounds { excess } else { 1.0 },
        })
    }
}

impl<'a> Gathered<'a> {
    /// All shapes of a candidate, and the free parts of its class.
    fn add_candidate(&mut self, problem: &Problem<'_>, at: &Fitted, number: usize, candidate: &Candidate) {
        let class = self.classes.len();
        self.classes.push(candidate.definition.name);
        let shapes = candidate.shapes(problem, at);
        let first = self.directions.len();
        let together = [candidate.amplitudes()].into_iter().filter(|amplitudes| !amplitudes.is_empty());
        for amplitudes in together.chain(candidate.apart().chunks(1)) {
            for shape in shapes.iter() {
                let part = shape_directions(problem, at, amplitudes, shape);
                let kind =
                    Kind::Term { candidate: number, shape: shape.clone(), amplitudes: amplitudes.to_vec() };
                self.add(class, part, candidate.among(shapes.len()), kind);
            }
        }
        for shape in candidate.free() {
            let part = free_directions(problem, at, candidate, shape, first);
            let kind = Kind::Term { candidate: number, shape: shape.clone(), amplitudes: Vec::new() };
            self.add(class, part, 1.0, kind);
        }
    }

    fn add(&mut self, class: usize, part: Part, among: f64, kind: Kind) {
        let first = self.directions.len();
        self.directions.extend(part.directions);
        self.additions.push(Addition {
            class,
            directions: (first..self.directions.len()).collect(),
            widths: part.widths,
            signs: part.signs,
            among,
            is_free: matches!(&kind, Kind::Term { shape, .. } if shape.is_free()),
        });
        self.kinds.push(kind);
    }

    fn add_rival(&mut self, rival: Rival<'a>) {
        let shared = self.classes.iter().position(|class| Some(*class) == rival.beside);
        let shared = shared.and_then(|class| self.additions.iter().find(|one| one.class == class));
        let mut own = shared.map_or_else(Vec::new, |of| of.directions.clone());
        let first = self.directions.len();
        own.extend(first..first + rival.columns.len());
        self.directions.extend(rival.columns.into_iter().map(|column| column.after(first)));
        let (kind, signs) = match rival.free {
            Some((class, signs)) => (Kind::Free(class), signs),
            None => (Kind::Rival, vec![Signs::Both; own.len()]),
        };
        self.additions.push(Addition {
            class: self.classes.len(),
            widths: vec![1.0; own.len()],
            signs,
            directions: own,
            among: rival.among,
            is_free: false,
        });
        self.classes.push(rival.name);
        self.kinds.push(kind);
    }
}

/// Directions, with the width and the signs of each.
struct Part {
    directions: Vec<Direction<'static>>,
    widths: Vec<f64>,
    signs: Vec<Signs>,
}

/// The directions of some amplitudes in a shape.
fn shape_directions(problem: &Problem<'_>, at: &Fitted, amplitudes: &[usize], shape: &Term) -> Part {
    let start = at.parameters.with(shape.clone());
    let term = start.terms.len() - 1;
    let wires = shape.rewires().is_some();
    let mut part = Part { directions: Vec::new(), widths: Vec::new(), signs: Vec::new() };
    for parameter in amplitudes {
        part.directions.push(problem.towards(&start, Free::Of { term, parameter: *parameter }));
        let known = &shape.definition.parameters[*parameter];
        part.widths.push(problem.scale_of(known).width());
        let value = shape.values[*parameter];
        part.signs.push(match known.range {
            _ if wires => Signs::Both,
            [least, _] if value <= least => Signs::Positive,
            [_, most] if value >= most => Signs::Negative,
            _ => Signs::Both,
        });
    }
    part
}

/// The directions of a free part of a class, whose own begin with that of its first amplitude, the `first`. A table is a parameter's own
/// direction times the weight of each place.
fn free_directions(problem: &Problem<'_>, at: &Fitted, of: &Candidate, shape: &Term, first: usize) -> Part {
    if let Some((parameter, table)) = shape.tables.first() {
        let amplitude = of.amplitudes().iter().position(|one| one == parameter).unwrap_or(0);
        let width = problem.scale_of(&of.definition.parameters[*parameter]).width();
        let direction = first + amplitude;
        let times = |factor| Direction::Times { direction, factor: Arc::new(factor) };
        let directions: Vec<_> = problem.weights_at(table).into_iter().map(times).collect();
        let count = directions.len();
        return Part { directions, widths: vec![width; count], signs: vec![Signs::Both; count] };
    }
    let start = at.parameters.with(shape.clone());
    let term = start.terms.len() - 1;
    let width = shape.curve().map_or(0.0, |curve| curve.range[1] - curve.range[0]);
    let knots = || 0..shape.listed();
    let sign = |knot| if shape.least_step(knot) < 0.0 { Signs::Both } else { Signs::Positive };
    Part {
        directions: knots().map(|knot| problem.towards(&start, Free::Knot { term, knot })).collect(),
        widths: vec![width; shape.listed()],
        signs: knots().map(sign).collect(),
    }
}

#[cfg(test)]
#[path = "pass_tests.rs"]
mod tests;
