//! Every effect of the library as a candidate, with the starts of its fits.

use std::borrow::Cow;

use tactus_model::effect::{By, CurveKind, Definition, Knots, ParameterKind, REGISTRY, Table};

use super::wiring;
use crate::data::{DiscoverError, Line, interval_s};
use crate::fit::{Fitted, Free, Problem, Term, places, table_places};

/// Number of grid values of a shape parameter that spans orders of magnitude, and of any other or a ratio of times.
const VALUES_MANY: usize = 5;
const VALUES_FEW: usize = 3;
/// Time from which a grid begins, unless frames follow one another faster.
const SHORTEST_S: f64 = 0.02;

/// What a line in the spectrum gives beside the frequency.
const PHASE: &str = "phase_per_column_deg";

/// If an element's reading seems to contain more than this share of another's signal, or a negative share, the element may
/// answer for the other alone. Its fitted gain then means nothing.
const CROSSED_SHARE: f64 = 0.5;

/// An effect of the library, with the parameters that these data could determine.
#[derive(Debug, Clone)]
pub(crate) struct Candidate {
    pub(crate) definition: &'static Definition,
    /// Parameters that change the prediction if all others are neutral, and of these the ones that stand apart.
    amplitudes: Vec<usize>,
    apart: Vec<usize>,
    /// Values of the others from which fits start.
    shapes: Shapes,
    /// Free parts of the class: knots in place of its formula, and each amplitude that may be a table, as one; at their neutral values.
    free: Vec<Term>,
    /// From how many shapes a residual picks: all pairs of elements, or all frequencies that the frames can tell apart. 1 for a grid.
    alternatives: f64,
}

/// Where the values of an effect's shape parameters come from.
#[derive(Debug, Clone)]
enum Shapes {
    /// A grid, the same for every model.
    Grid(Vec<Term>),
    /// Pairs of elements: those that a model's residual suggests.
    Wiring,
}

impl Candidate {
    /// All effects of the library, given a model without them and the lines in its residual's spectrum.
    pub(crate) fn all(
        problem: &Problem<'_>,
        at: &Fitted,
        lines: &[Line],
    ) -> Result<Vec<Self>, DiscoverError> {
        let library = REGISTRY.iter().chain(&problem.predictor.known.drafts);
        library.map(|definition| Self::of(definition, problem, at, lines)).collect()
    }

    fn of(
        definition: &'static Definition,
        problem: &Problem<'_>,
        at: &Fitted,
        lines: &[Line],
    ) -> Result<Self, DiscoverError> {
        let (mut amplitudes, mut apart) = (Vec::new(), Vec::new());
        let mut alternatives = 1.0;
        let mut shapes = vec![Term::neutral(definition)];
        for (parameter, known) in definition.parameters.iter().enumerate() {
            if known.kind != ParameterKind::Real || known.name == PHASE {
                continue;
            }
            let acts = known.neutral == 0.0 || {
                let with = at.parameters.with(Term::neutral(definition));
                let free = Free::Of { term: with.terms.len() - 1, parameter };
                problem.slope(&with, &at.predicted, free)?.iter().any(|slope| *slope != 0.0)
            };
            let range = known.range;
            if known.name.ends_with("_hz") {
                shapes = of_lines(&shapes, parameter, lines);
                alternatives = problem.extent.duration_s / (2.0 * interval_s(problem.predictor.frames));
            } else if known.name == "duration_s" {
                shapes = cross(&shapes, parameter, &[problem.extent.duration_s.clamp(range[0], range[1])]);
            } else if acts && known.is_apart {
                apart.push(parameter);
            } else if acts {
                amplitudes.push(parameter);
            } else {
                let times_s =
                    [interval_s(problem.predictor.frames).min(SHORTEST_S), problem.extent.duration_s];
                let values = grid(known.name, range, known.neutral, times_s);
                shapes = cross(&shapes, parameter, &values);
            }
        }
        let wires = definition.parameters.iter().any(|known| known.kind == ParameterKind::Element);
        if wires {
            alternatives = (problem.predictor.bins.elements as f64).powi(2);
        }
        let shapes = if wires { Shapes::Wiring } else { Shapes::Grid(shapes) };
        let free = free(definition, &amplitudes, problem);
        Ok(Self { definition, amplitudes, apart, shapes, free, alternatives })
    }

    /// Starts of fits of this effect in addition to a model, with neutral amplitudes.
    pub(crate) fn shapes(&self, problem: &Problem<'_>, at: &Fitted) -> Cow<'_, [Term]> {
        match &self.shapes {
            Shapes::Grid(terms) => Cow::Borrowed(terms),
            Shapes::Wiring => {
                let pairs = wiring::pairs(problem, at);
                Cow::Owned(pairs.into_iter().filter_map(|pair| wired(self.definition, pair)).collect())
            }
        }
    }

    /// From how many alternatives the residual picked each of so many shapes: pairs of elements, or frequencies. 1 for a grid.
    pub(crate) fn among(&self, shapes: usize) -> f64 {
        (self.alternatives / shapes.max(1) as f64).max(1.0)
    }

    /// Free parts of the class, at their neutral values: one with knots, or with a table.
    pub(crate) fn free(&self) -> &[Term] {
        &self.free
    }

    /// The parameters that change the prediction of a shape together.
    pub(crate) fn amplitudes(&self) -> &[usize] {
        &self.amplitudes
    }

    /// The parameters that do so each by itself.
    pub(crate) fn apart(&self) -> &[usize] {
        &self.apart
    }

    /// A shape with the coefficients of some of its amplitudes, from which a fit starts.
    pub(crate) fn start(
        &self,
        problem: &Problem<'_>,
        shape: &Term,
        amplitudes: &[usize],
        coefficients: &[f64],
    ) -> Term {
        let mut start = shape.clone();
        let wires = matches!(self.shapes, Shapes::Wiring);
        if wires && coefficients.iter().any(|step| !(0.0..CROSSED_SHARE).contains(step)) {
            return crossed(start);
        }
        if start.is_free() {
            start.free_steps(coefficients, problem.extent);
            return start;
        }
        for (parameter, step) in amplitudes.iter().zip(coefficients) {
            let known = &self.definition.parameters[*parameter];
            let [least, most] = known.range;
            let value = &mut start.values[*parameter];
            let margin = [0.02 * (*value - least), 0.02 * (most - *value)];
            let scale = problem.scale_of(known);
            // Beyond the longest step of a fit, derivatives at neutral amplitudes say nothing.
            let moved = scale.forward(*value, scale.bounded(*step));
            *value = moved.clamp(least + margin[0], most - margin[1]);
        }
        start
    }
}

/// The free parts of a class.
fn free(definition: &'static Definition, amplitudes: &[usize], problem: &Problem<'_>) -> Vec<Term> {
    let frames = problem.predictor.frames;
    let mut free = Vec::new();
    // Weights of times or thresholds are what several shapes make together.
    if let Some(curve) = definition.curve.as_ref().filter(|curve| curve.kind == CurveKind::Line) {
        let at = places(curve, problem);
        let knots = Some(Knots { values: vec![0.0; at.len()], at }).filter(|knots| !knots.at.is_empty());
        let shape = knots.map(|knots| Term { knots: Some(knots), ..Term::neutral(definition) });
        let mut shapes: Vec<Term> = shape.into_iter().collect();
        // What the curve is a function of may be one thing, or others by a share.
        for (parameter, known) in definition.parameters.iter().enumerate() {
            if known.name.ends_with("_share") && !curve.replaces.contains(&known.name) {
                let mut values = vec![known.range[0], known.neutral, known.range[1]];
                values.dedup();
                shapes = cross(&shapes, parameter, &values);
            }
        }
        free.extend(shapes);
    }
    for parameter in amplitudes {
        let known = &definition.parameters[*parameter];
        let table = |by: &By| {
            let at = table_places(*by, frames, &problem.predictor.known.registration)?;
            let table = Table { by: *by, values: vec![known.neutral; at.len()], at };
            Some(Term { tables: vec![(*parameter, table)], ..Term::neutral(definition) })
        };
        free.extend(known.varies.iter().filter_map(table));
    }
    free
}

/// The shapes with the frequency of each line, and its phase where the effect has one.
fn of_lines(shapes: &[Term], frequency: usize, lines: &[Line]) -> Vec<Term> {
    let set = |shape: &Term, line: &Line| {
        let mut set = shape.clone();
        set.values[frequency] = line.frequency_hz;
        if let Some(phase) = set.definition.parameters.iter().position(|known| known.name == PHASE) {
            set.values[phase] = line.phase_per_column_deg;
        }
        set
    };
    shapes.iter().flat_map(|shape| lines.iter().map(move |line| set(shape, line))).collect()
}

fn cross(shapes: &[Term], parameter: usize, values: &[f64]) -> Vec<Term> {
    let set = |shape: &Term, value: f64| {
        let mut set = shape.clone();
        set.values[parameter] = value;
        set
    };
    shapes.iter().flat_map(|shape| values.iter().map(move |value| set(shape, *value))).collect()
}

/// Values of a shape parameter at which fits start; times lie between these.
fn grid(name: &str, range: [f64; 2], neutral: f64, [shortest_s, longest_s]: [f64; 2]) -> Vec<f64> {
    let [mut least, mut most] = range;
    if name == "spread_ratio" {
        // Several shapes with different times have any spread together.
        return vec![neutral];
    }
    if name == "by_depth" {
        // What a memory follows: the element's own signal or the tool's depth. A fit finds what is between.
        return range.to_vec();
    }
    let is_time = name.ends_with("_s") && !name.ends_with("_per_s");
    if is_time {
        // The data do not show anything faster than a frame or slower than their duration.
        most = most.min(longest_s);
        least = least.max(shortest_s).min(most);
    }
    let ratio = most / least;
    if !(least > 0.0 && ratio.is_finite()) {
        return vec![neutral];
    }
    if ratio < 1.0 + 1e-9 {
        return vec![least];
    }
    let is_wide = ratio > 300.0 && !name.ends_with("_ratio");
    let count = if is_wide { VALUES_MANY } else { VALUES_FEW };
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
