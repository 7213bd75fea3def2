//! Every effect of the library as a candidate, with the starts of its fits.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};
use tactus_model::effect::{Definition, ParameterKind, REGISTRY};

use super::score::{Fitting, Score};
use super::wiring;
use crate::data::DiscoverError;
use crate::fit::{Fitted, Free, Problem, Term, solve};

/// Number of grid values of a shape parameter that spans orders of magnitude, and of any other.
const VALUES_MANY: usize = 5;
const VALUES_FEW: usize = 3;

/// If an element's reading seems to contain more than this share of another's signal, or a negative share, the element may
/// answer for the other alone. Its fitted gain then means nothing.
const CROSSED_SHARE: f64 = 0.5;

/// An effect of the library, with the parameters that these data could determine.
#[derive(Debug, Clone)]
pub(crate) struct Candidate {
    pub(crate) definition: &'static Definition,
    /// Parameters that change the prediction if all others are neutral.
    amplitudes: Vec<usize>,
    /// Values of the others from which fits start.
    shapes: Shapes,
}

/// Where the values of an effect's shape parameters come from.
#[derive(Debug, Clone)]
enum Shapes {
    /// A grid, the same for every model.
    Grid(Vec<Term>),
    /// Pairs of elements: those that a model's residual suggests.
    Wiring,
}

/// The score of a candidate at the residual of a model.
#[derive(Debug, Clone)]
pub(crate) struct Screened {
    pub(crate) definition: &'static Definition,
    /// The scores of all its amplitudes at all its shapes.
    pub(crate) scores: Vec<Score>,
    /// Reduction of the cost by a first linear step, at the best shape.
    pub(crate) promise: f64,
    /// End of that step, at which a fit starts.
    pub(crate) start: Term,
    /// Width of the amplitude's range in standard errors at the best shape: how well these data can show the effect.
    pub(crate) reach: f64,
}

impl Candidate {
    /// All effects of the library, given a model without them and the frequencies of lines in its residual's spectrum.
    pub(crate) fn all(
        problem: &Problem<'_>,
        at: &Fitted,
        frequencies_hz: &[f64],
    ) -> Result<Vec<Self>, DiscoverError> {
        REGISTRY.iter().map(|definition| Self::of(definition, problem, at, frequencies_hz)).collect()
    }

    fn of(
        definition: &'static Definition,
        problem: &Problem<'_>,
        at: &Fitted,
        frequencies_hz: &[f64],
    ) -> Result<Self, DiscoverError> {
        let mut amplitudes = Vec::new();
        let mut shapes = vec![Term::neutral(definition)];
        for (parameter, known) in definition.parameters.iter().enumerate() {
            if known.kind != ParameterKind::Real {
                continue;
            }
            let acts = known.neutral == 0.0 || {
                let with = at.parameters.with(Term::neutral(definition));
                let free = Free::Of { term: with.terms.len() - 1, parameter };
                problem.slope(&with, &at.predicted, free)?.iter().any(|slope| *slope != 0.0)
            };
            let range = known.range;
            if known.name.ends_with("_hz") {
                shapes = cross(&shapes, parameter, frequencies_hz);
            } else if known.name == "duration_s" {
                shapes = cross(&shapes, parameter, &[problem.duration_s.clamp(range[0], range[1])]);
            } else if acts {
                amplitudes.push(parameter);
            } else {
                let values = grid(known.name, range, known.neutral, problem.duration_s);
                shapes = cross(&shapes, parameter, &values);
            }
        }
        let wires = definition.parameters.iter().any(|known| known.kind == ParameterKind::Element);
        let shapes = if wires { Shapes::Wiring } else { Shapes::Grid(shapes) };
        Ok(Self { definition, amplitudes, shapes })
    }

    /// Approximate number of derivatives that a screening takes.
    pub(crate) fn columns(&self) -> usize {
        let shapes = match &self.shapes {
            Shapes::Grid(terms) => terms.len(),
            Shapes::Wiring => wiring::PAIRS_MAX,
        };
        shapes * self.amplitudes.len()
    }

    /// Starts of fits of this effect in addition to a model, with neutral amplitudes.
    fn shapes(&self, problem: &Problem<'_>, at: &Fitted) -> Cow<'_, [Term]> {
        match &self.shapes {
            Shapes::Grid(terms) => Cow::Borrowed(terms),
            Shapes::Wiring => {
                let pairs = wiring::pairs(problem, at);
                Cow::Owned(pairs.into_iter().filter_map(|pair| wired(self.definition, pair)).collect())
            }
        }
    }

    /// Scores this effect at the residual of a model.
    pub(crate) fn screen(
        &self,
        fitting: &Fitting<'_>,
        problem: &Problem<'_>,
        at: &Fitted,
    ) -> Result<Screened, DiscoverError> {
        let mut screened = Screened {
            definition: self.definition,
            scores: Vec::new(),
            promise: 0.0,
            start: Term::neutral(self.definition),
            reach: 0.0,
        };
        for shape in self.shapes(problem, at).iter() {
            let start = at.parameters.with(shape.clone());
            let term = start.terms.len() - 1;
            let mut columns = Vec::with_capacity(self.amplitudes.len());
            for parameter in &self.amplitudes {
                let free = Free::Of { term, parameter: *parameter };
                let mut column = problem.slope(&start, &at.predicted, free)?;
                let whole = fitting.size(&column);
                fitting.free(&mut column);
                if fitting.size(&column) < 1e-6 * whole {
                    column.fill(0.0);
                }
                let [least, most] = self.definition.parameters[*parameter].range;
                screened.reach = screened.reach.max(fitting.size(&column) * (most - least));
                columns.push(column);
            }
            screened.scores.push(fitting.score(&columns));
            let (promise, values) = self.first_step(fitting, shape, &columns);
            if promise > screened.promise {
                (screened.promise, screened.start) = (promise, values);
            }
        }
        Ok(screened)
    }

    /// The linear step from the neutral values within the ranges: its reduction of the cost, and its end.
    fn first_step(&self, fitting: &Fitting<'_>, shape: &Term, columns: &[Vec<f64>]) -> (f64, Term) {
        let mut active: Vec<usize> = (0..columns.len()).collect();
        let wires = matches!(self.shapes, Shapes::Wiring);
        loop {
            if active.is_empty() {
                return (0.0, shape.clone());
            }
            let count = active.len();
            let gram = DMatrix::from_fn(count, count, |i, j| {
                fitting.inner(&columns[active[i]], &columns[active[j]])
            });
            let right = DVector::from_fn(count, |i, _| fitting.wanted(&columns[active[i]]));
            let step = solve(&gram, &right, 0.0, gram.diagonal().as_slice());
            let outside = active.iter().zip(step.iter()).position(|(place, step)| {
                let parameter = self.amplitudes[*place];
                let range = self.definition.parameters[parameter].range;
                let value = shape.values[parameter];
                let ends = (*step < 0.0 && value <= range[0]) || (*step > 0.0 && value >= range[1]);
                ends && !wires
            });
            if let Some(outside) = outside {
                active.remove(outside);
                continue;
            }
            let mut start = shape.clone();
            if wires && step.iter().any(|step| !(0.0..CROSSED_SHARE).contains(step)) {
                return (step.dot(&right), crossed(start));
            }
            for (place, step) in active.iter().zip(step.iter()) {
                let parameter = self.amplitudes[*place];
                let [least, most] = self.definition.parameters[parameter].range;
                let value = &mut start.values[parameter];
                *value =
                    (*value + step).clamp(least + 0.02 * (*value - least), most - 0.02 * (most - *value));
            }
            return (step.dot(&right), start);
        }
    }
}

fn cross(shapes: &[Term], parameter: usize, values: &[f64]) -> Vec<Term> {
    let set = |shape: &Term, value: f64| {
        let mut set = shape.clone();
        set.values[parameter] = value;
        set
    };
    shapes.iter().flat_map(|shape| values.iter().map(move |value| set(shape, *value))).collect()
}

/// Values of a shape parameter at which fits start.
fn grid(name: &str, range: [f64; 2], neutral: f64, duration_s: f64) -> Vec<f64> {
    let [mut least, mut most] = range;
    if name.ends_with("_s") {
        // The data do not show anything faster than a frame or slower than their duration.
        most = most.min(duration_s);
        least = least.max(0.02).min(most);
    }
    let ratio = most / least;
    if !(least > 0.0 && ratio.is_finite()) {
        return vec![neutral];
    }
    if ratio < 1.0 + 1e-9 {
        return vec![least];
    }
    let count = if ratio > 300.0 { VALUES_MANY } else { VALUES_FEW };
    // The middles of equal parts of the logarithmic range.
    (0..count).map(|k| least * ratio.powf((k as f64 + 0.5) / count as f64)).collect()
}

/// A pair's term at the end of its range: the element answers for the other alone. One that is paired with itself answers for
/// nothing.
fn crossed(mut pair: Term) -> Term {
    // Elements are whole numbers.
    let is_same = |first: usize, second: usize| (pair.values[first] - pair.values[second]).abs() < 0.5;
    let is_dead = matches!(elements(&pair)[..], [first, second] if is_same(first, second));
    for (known, value) in pair.definition.parameters.iter().zip(&mut pair.values) {
        if known.kind == ParameterKind::Real {
            let [least, most] = known.range;
            *value = match known.neutral {
                0.0 if is_dead => 0.0,
                0.0 => most,
                neutral => least + 0.02 * (neutral - least),
            };
        }
    }
    pair
}

fn wired(definition: &'static Definition, pair: [usize; 2]) -> Option<Term> {
    let mut term = Term::neutral(definition);
    let [first, second] = <[usize; 2]>::try_from(elements(&term)).ok()?;
    (term.values[first], term.values[second]) = (pair[0] as f64, pair[1] as f64);
    Some(term)
}

/// Which parameters of a term are elements.
fn elements(term: &Term) -> Vec<usize> {
    let parameters = term.definition.parameters.iter().enumerate();
    parameters.filter(|(_, known)| known.kind == ParameterKind::Element).map(|(place, _)| place).collect()
}
