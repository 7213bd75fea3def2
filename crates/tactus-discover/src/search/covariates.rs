//! Covariates on which the residual may depend, each divided into ranges, and the forms that a dependence may take.

use std::ops::Range;
use std::sync::Arc;

use tactus_model::effect::Definition;
use tactus_model::{Contact, Covering, ForwardModel, Response};

use super::rivals::JITTER;
use crate::data::{DiscoverError, History, Known};
use crate::fit::{Free, Parameters, Problem, Term};

/// Depth of the imagined press at a place that is not pressed.
const LOOK_MM: f64 = 0.3;

/// Greatest height from which something may be felt without contact.
pub(super) const LOW_MM: f64 = 2.0;
/// Greatest number of elements that are covariates by themselves: those with the most signal.
const ELEMENTS_MAX: usize = 48;
/// Ranges of the depth for each of them.
const ELEMENT_DEPTHS: usize = 3;
/// Presses count as all at the same place within their elements if these places differ by no more than this.
const CENTRED_MM: f64 = 0.02;

/// Form of a dependence: a value for each reading that the dependence multiplies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form {
    /// 1 for all elements; the dependence is in counts.
    Offset,
    /// The element's own signal.
    Signal,
    /// Derivative of the signal along x.
    AlongX,
    /// Derivative of the signal along y.
    AlongY,
    /// The neighbours' signals.
    Neighbours,
    /// Image of an imagined press at the tip's place.
    Place,
    /// Image of an imagined press at the last pressed place.
    LastPlace,
}

/// A range of a covariate, with a form of dependence.
#[derive(Debug, Clone)]
pub(crate) struct Feature {
    pub(crate) covariate: &'static str,
    pub(crate) unit: &'static str,
    pub(crate) form: Form,
    /// Range of the covariate.
    pub(crate) range: [f64; 2],
    /// 1 where the covariate is in the range, else 0.
    pub(crate) factor: Factor,
}

impl Feature {
    /// The element at which alone it acts, if it does not act at all.
    pub(crate) const fn only(&self) -> Option<usize> {
        match self.factor {
            Factor::Element(element, _) => Some(element),
            Factor::Bins(_) | Factor::Within(_) => None,
        }
    }
}

/// Factor of a form.
#[derive(Debug, Clone)]
pub(crate) enum Factor {
    /// For each bin.
    Bins(Arc<Vec<f64>>),
    /// 1 where the element's own signal is in this range and not 0, else 0.
    Within([f64; 2]),
    /// For each bin, of one element; 0 for the others.
    Element(usize, Arc<Vec<f64>>),
}

/// Values of the forms at a point of the parameters, reading by reading.
#[derive(Debug)]
pub(crate) struct Forms {
    signal: Vec<f64>,
    along: [Vec<f64>; 2],
    neighbours: Vec<f64>,
    /// Images of imagined presses at the tip's place and at the last pressed one, if they are wanted.
    places: Option<[Vec<f64>; 2]>,
    history: History,
}

impl Forms {
    pub(crate) fn of(
        problem: &Problem<'_>,
        at: &Parameters,
        predicted: &[f64],
    ) -> Result<Self, DiscoverError> {
        let slope = |name: &str, parameter: usize| -> Result<Vec<f64>, DiscoverError> {
            let with = at.with(Term::neutral(Definition::find(name)?));
            problem.slope(&with, predicted, Free::Of { term: with.terms.len() - 1, parameter })
        };
        let bins = problem.predictor.bins;
        let elements = bins.elements;
        let mut signal: Vec<f64> = predicted
            .chunks_exact(elements)
            .zip(&bins.run)
            .flat_map(|(counts, run)| {
                counts.iter().zip(&at.baseline[*run]).map(|(counts, base)| counts - base)
            })
            .collect();
        if let Some(walk) = &at.walk {
            walk.add(bins, -1.0, &mut signal);
        }
        Ok(Self {
            signal,
            along: [slope("misregistration", 0)?, slope("misregistration", 1)?],
            neighbours: slope("crosstalk", 0)?,
            places: None,
            history: History::of(problem.predictor.frames, bins),
        })
    }

    /// The same with the forms [`Form::Place`] and [`Form::LastPlace`].
    pub(crate) fn with_places(self, problem: &Problem<'_>, at: &Parameters) -> Result<Self, DiscoverError> {
        let [x_mm, y_mm] = &self.history.place_mm;
        let here: Vec<Option<[f64; 2]>> = x_mm.iter().zip(y_mm).map(|(x, y)| Some([*x, *y])).collect();
        let places = [images(problem, at, &here)?, images(problem, at, &self.history.last_place_mm)?];
        Ok(Self { places: Some(places), ..self })
    }

    /// A feature's column.
    pub(crate) fn column(&self, feature: &Feature, elements: usize) -> Vec<f64> {
        self.values(feature, 0..self.signal.len() / elements, elements)
    }

    /// A feature's column at some bins: element by element, or only of the one at which it acts.
    pub(crate) fn values(&self, feature: &Feature, bins: Range<usize>, elements: usize) -> Vec<f64> {
        let form = match feature.form {
            Form::Offset => None,
            Form::Signal => Some(&self.signal),
            Form::AlongX => Some(&self.along[0]),
            Form::AlongY => Some(&self.along[1]),
            Form::Neighbours => Some(&self.neighbours),
            Form::Place => self.places.as_ref().map(|[here, _]| here),
            Form::LastPlace => self.places.as_ref().map(|[_, last]| last),
        };
        let of = |reading: usize| form.map_or(1.0, |form| form[reading]);
        let (first, count) = (bins.start * elements, bins.len() * elements);
        match &feature.factor {
            Factor::Bins(of_bin) => {
                let mut values = vec![0.0; count];
                // Most features act in few bins.
                for bin in bins.filter(|bin| of_bin[*bin] != 0.0) {
                    for reading in bin * elements..(bin + 1) * elements {
                        values[reading - first] = of_bin[bin] * of(reading);
                    }
                }
                values
            }
            Factor::Within(range) => {
                let value = |reading| if is_within(*range, self.signal[reading]) { of(reading) } else { 0.0 };
                (first..first + count).map(value).collect()
            }
            Factor::Element(element, of_bin) => {
                bins.map(|bin| of_bin[bin] * of(bin * elements + element)).collect()
            }
        }
    }

    pub(crate) const fn history(&self) -> &History {
        &self.history
    }

    /// The signal of every reading, in counts.
    pub(crate) fn signal(&self) -> &[f64] {
        &self.signal
    }

    /// Derivative of the signal along x or y.
    pub(crate) fn slope(&self, axis: usize) -> &[f64] {
        &self.along[axis]
    }
}

fn is_within([least, most]: [f64; 2], signal: f64) -> bool {
    signal != 0.0 && signal >= least && signal < most
}

/// Images of imagined presses at the places, in counts above the baseline; 0 where there is no place.
fn images(
    problem: &Problem<'_>,
    at: &Parameters,
    places_mm: &[Option<[f64; 2]>],
) -> Result<Vec<f64>, DiscoverError> {
    let (known, frames, bins) = (problem.predictor.known, problem.predictor.frames, problem.predictor.bins);
    let Known { array, response, registration, indenters, .. } = known;
    let elements = bins.elements;
    let response = Response {
        sensitivity_counts_per_mm: at.sensitivity.clone(),
        baseline_counts: vec![0.0; elements],
        ..response.clone()
    };
    let model = ForwardModel::new(array.clone(), at.psf, response)?;
    let mut images = vec![0.0; bins.len() * elements];
    let mut last: Option<([f64; 2], usize)> = None;
    for (bin, place_mm) in places_mm.iter().enumerate() {
        let Some(place_mm) = *place_mm else { continue };
        let target = bin * elements..(bin + 1) * elements;
        if let Some((_, from)) =
            last.filter(|(before, _)| before.map(f64::to_bits) == place_mm.map(f64::to_bits))
        {
            images.copy_within(from * elements..(from + 1) * elements, target.start);
            continue;
        }
        let frame = bins.first[bin];
        let tool = &frames.indenters[usize::from(frames.indenter[frame])];
        let Some(indenter) = indenters.get(tool).cloned() else { continue };
        let contact = Contact {
            indenter,
            position_mm: registration.to_sensor(place_mm),
            rotation_deg: -registration.rotation_deg,
            depth_mm: LOOK_MM,
        };
        model.image(&contact, Covering { thickness_mm: frames.covering_mm[frame] }, &mut images[target]);
        last = Some((place_mm, bin));
    }
    Ok(images)
}

/// All features of the data.
pub(crate) fn features(problem: &Problem<'_>, forms: &Forms) -> Vec<Feature> {
    use Form::{AlongX, AlongY, LastPlace, Neighbours, Offset, Place, Signal};
    let bins = problem.predictor.bins;
    let array = &problem.predictor.known.array;
    let registration = problem.predictor.known.registration;
    let history = &forms.history;
    let deep: Vec<bool> = history.depth_mm.iter().map(|depth| *depth > 0.0).collect();
    let free: Vec<bool> = deep.iter().map(|deep| !deep).collect();
    let every = vec![true; bins.len()];
    let low = |upward: f64| -> Vec<bool> {
        let is_low = |(depth_mm, up): (&f64, &f64)| {
            *depth_mm <= 0.0 && *depth_mm >= -LOW_MM && up.total_cmp(&upward).is_eq()
        };
        history.depth_mm.iter().zip(&history.upward).map(is_low).collect()
    };
    let (signal, offset, along) = ([Signal], [Offset], [AlongX, AlongY]);
    let with_offset = |form: Form| if forms.places.is_some() { vec![form, Offset] } else { vec![Offset] };
    let mut made = Vec::new();
    let mut add = |covariate, unit, values: &[f64], among: &[bool], parts: usize, forms: &[Form]| {
        let kept: Vec<f64> =
            values.iter().zip(among).filter(|(_, among)| **among).map(|(one, _)| *one).collect();
        for range in ranges(values, among, parts, if unit == "counts" { 0.0 } else { JITTER }) {
            let within = |(value, among): (&f64, &bool)| {
                f64::from(u8::from(*among && *value >= range[0] && *value < range[1]))
            };
            let factor: Arc<Vec<f64>> = Arc::new(values.iter().zip(among).map(within).collect());
            for form in forms {
                let factor = Factor::Bins(Arc::clone(&factor));
                made.push(Feature { covariate, unit, form: *form, range: closed(range, &kept), factor });
            }
        }
    };
    add("time", "s", &bins.t_s, &every, 8, &[Offset, Signal]);
    add("time since contact", "s", &history.since_contact_s, &deep, 6, &signal);
    add("time since a start or stop", "s", &history.since_turn_s, &deep, 6, &[Signal, Offset]);
    add("time since release", "s", &history.since_release_s, &free, 6, &with_offset(LastPlace));
    add("depth", "mm", &history.depth_mm, &deep, 8, &signal);
    add("height above the surface", "mm", &negative(&history.depth_mm), &free, 4, &with_offset(Place));
    for (covariate, among) in [("height on the way down", low(0.0)), ("height on the way up", low(1.0))] {
        add(covariate, "mm", &negative(&history.depth_mm), &among, 4, &with_offset(Place));
    }
    add("largest past depth", "mm", &history.deepest_before_mm, &deep, 5, &signal);
    add("direction of motion", "", &history.upward, &deep, 2, &signal);
    add("direction of approach along x", "", &history.aside[0], &deep, 2, &[Signal, AlongX]);
    add("direction of approach along y", "", &history.aside[1], &deep, 2, &[Signal, AlongY]);
    add("speed", "mm/s", &history.speed_mm_per_s, &deep, 5, &signal);
    add("speed of travel", "mm/s", &history.travel_mm_per_s, &free, 4, &offset);
    add("press", "", &history.press, &deep, 6, &signal);
    let place: Vec<[f64; 2]> = history.place_mm[0]
        .iter()
        .zip(&history.place_mm[1])
        .map(|(x, y)| registration.to_sensor([*x, *y]))
        .collect();
    let axes = [
        ("place along x", "place in the element along x", array.col_centres_mm()),
        ("place along y", "place in the element along y", array.row_centres_mm()),
    ];
    for (axis, (on_sensor, in_element, centres)) in axes.into_iter().enumerate() {
        let values: Vec<f64> = place.iter().map(|place| place[axis]).collect();
        add(on_sensor, "mm", &values, &deep, 4, &[Signal, along[axis], along[1 - axis]]);
        add(on_sensor, "mm", &values, &every, 4, &offset);
        let within: Vec<f64> = values.iter().map(|value| value - nearest(centres, *value)).collect();
        let of_deep = || within.iter().zip(&deep).filter(|(_, deep)| **deep).map(|(within, _)| *within);
        let spread_mm = of_deep().fold(f64::NEG_INFINITY, f64::max) - of_deep().fold(f64::INFINITY, f64::min);
        if spread_mm > CENTRED_MM {
            add(in_element, "mm", &within, &deep, 4, &[Signal, along[axis]]);
        }
    }
    let sums: Vec<f64> = forms.signal.chunks_exact(bins.elements).map(|signal| signal.iter().sum()).collect();
    add("sum of signals", "counts", &sums, &deep, 6, &[Signal, Offset]);
    if history.temperature_c.iter().all(|c| c.is_finite()) {
        add("temperature", "C", &history.temperature_c, &every, 4, &[Offset, Signal]);
    }
    let range = [f64::NEG_INFINITY, f64::INFINITY];
    made.push(Feature {
        covariate: "neighbours' signals",
        unit: "counts",
        form: Neighbours,
        range: closed(range, &forms.signal),
        factor: Factor::Bins(Arc::new(vec![1.0; bins.len()])),
    });
    let strong: Vec<bool> = forms.signal.iter().map(|signal| signal.abs() > 0.0).collect();
    for range in ranges(&forms.signal, &strong, 8, 0.0) {
        let (factor, range) = (Factor::Within(range), closed(range, &forms.signal));
        made.push(Feature { covariate: "signal", unit: "counts", form: Signal, range, factor });
    }
    made.extend(of_elements(forms, &deep, bins.elements));
    made
}

/// Features of single elements: their own signal, at any depth and at some.
fn of_elements(forms: &Forms, deep: &[bool], elements: usize) -> Vec<Feature> {
    let depth_mm = &forms.history.depth_mm;
    let mut squares = vec![0.0; elements];
    for signal in forms.signal.chunks_exact(elements) {
        squares.iter_mut().zip(signal).for_each(|(sum, signal)| *sum += signal * signal);
    }
    let mut loudest: Vec<usize> = (0..elements).filter(|element| squares[*element] > 0.0).collect();
    loudest.sort_by(|a, b| squares[*b].total_cmp(&squares[*a]));
    loudest.truncate(ELEMENTS_MAX);
    loudest.sort_unstable();
    let feature = |covariate, unit, range, element, of_bins: &Arc<Vec<f64>>| {
        let factor = Factor::Element(element, Arc::clone(of_bins));
        Feature { covariate, unit, form: Form::Signal, range, factor }
    };
    let always = Arc::new(vec![1.0; depth_mm.len()]);
    let whole = |element: &usize| {
        let index = *element as f64;
        feature("element", "", [index, index], *element, &always)
    };
    let mut made: Vec<Feature> = loudest.iter().map(whole).collect();
    let depths: Vec<f64> =
        depth_mm.iter().zip(deep).filter(|(_, deep)| **deep).map(|(depth, _)| *depth).collect();
    for range in ranges(depth_mm, deep, ELEMENT_DEPTHS, JITTER) {
        let within =
            |depth: &f64| f64::from(u8::from(*depth > 0.0 && *depth >= range[0] && *depth < range[1]));
        let factor = Arc::new(depth_mm.iter().map(within).collect());
        let at_depth =
            |element: &usize| feature("element and depth", "mm", closed(range, &depths), *element, &factor);
        made.extend(loudest.iter().map(at_depth));
    }
    made
}

/// Divides the values into ranges with equal numbers of bins; no ranges if the values do not differ by more than jitter.
fn ranges(values: &[f64], among: &[bool], parts: usize, jitter: f64) -> Vec<[f64; 2]> {
    let mut sorted: Vec<f64> = values
        .iter()
        .zip(among)
        .filter(|(value, among)| **among && value.is_finite())
        .map(|(v, _)| *v)
        .collect();
    sorted.sort_by(f64::total_cmp);
    let (Some(least), Some(most)) = (sorted.first().copied(), sorted.last().copied()) else {
        return Vec::new();
    };
    if most - least <= jitter.max(1e-3 * most.abs().max(least.abs())) {
        return Vec::new();
    }
    let mut edges: Vec<f64> = (1..parts).map(|k| sorted[k * sorted.len() / parts]).collect();
    edges.dedup();
    edges.retain(|edge| *edge > least);
    let starts = std::iter::once(f64::NEG_INFINITY).chain(edges.iter().copied());
    let ends = edges.iter().copied().chain(std::iter::once(f64::INFINITY));
    starts.zip(ends).map(|(start, end)| [start, end]).collect()
}

/// The range with open ends replaced by the least and greatest value.
fn closed([start, end]: [f64; 2], values: &[f64]) -> [f64; 2] {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let least = finite().fold(f64::INFINITY, f64::min);
    let most = finite().fold(f64::NEG_INFINITY, f64::max);
    [if start.is_finite() { start } else { least }, if end.is_finite() { end } else { most }]
}

fn nearest(centres: &[f64], value: f64) -> f64 {
    centres.iter().copied().min_by(|a, b| (a - value).abs().total_cmp(&(b - value).abs())).unwrap_or(value)
}

fn negative(values: &[f64]) -> Vec<f64> {
    values.iter().map(|value| -value).collect()
}

#[cfg(test)]
#[path = "covariates_tests.rs"]
mod tests;
