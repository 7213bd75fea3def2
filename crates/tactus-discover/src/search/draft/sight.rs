//! What a draft would see and act on: the covariates of each bin, and what one unit of each carrier does.

use std::ops::Range;
use std::sync::Arc;

use tactus_model::effect::{Carrier, Draft, Law, When};
use tactus_model::{Covariate, Seen, Trace};

use super::grammar::{Acting, Atom};
use crate::data::{DiscoverError, interval_s};
use crate::fit::{Direction, Fitted, Free, Grams, Problem, Term, hat};

/// Readings below this share of the largest signal of their bin do not place knots.
const LOUD_SHARE: f64 = 0.02;
/// Two knots are apart by this share of the range at least.
const APART_SHARE: f64 = 0.01;
/// Two fine knots are apart by this share of the value at least, and by a frame.
const FINE_SHARE: f64 = 0.2;
/// Knots of the curve from which weights of elements are found.
pub(super) const KNOTS_OF_ELEMENTS: usize = 3;

/// The data as a draft sees them, bin by bin.
pub(super) struct Sight {
    pub(super) elements: usize,
    /// The history at each bin, as a pipeline has it.
    traces: Vec<Trace>,
    /// The signal of each reading, in mm.
    signal_mm: Vec<f64>,
    counts: Vec<f64>,
    array: tactus_model::Array,
    /// Median time between frames.
    interval_s: f64,
    /// Change of each reading by a unit of a carrier.
    units: Vec<(Carrier, Vec<f32>)>,
}

impl Sight {
    pub(super) fn of(problem: &Problem<'_>, at: &Fitted) -> Result<Self, DiscoverError> {
        let predictor = &problem.predictor;
        let (bins, known, frames) = (predictor.bins, predictor.known, predictor.frames);
        let elements = bins.elements;
        let mut traces = Vec::with_capacity(bins.len());
        let mut trace = Trace::default();
        let mut before = None;
        for bin in 0..bins.len() {
            // A pipeline is that of a run and a tool.
            let key = (bins.run[bin], frames.indenter[bins.first[bin]]);
            if before.replace(key).is_some_and(|before| before != key) {
                trace = Trace::default();
            }
            let temperature_c = f64::from(frames.temperature_c[bins.first[bin]]);
            let temperature_c = Some(temperature_c).filter(|c| c.is_finite());
            let mut take = |t_s: f64, [x_mm, y_mm, z_mm]: [f64; 3]| {
                trace.take(t_s, known.registration.to_sensor([x_mm, y_mm]), -z_mm, temperature_c);
            };
            for point in frames.way_to(bins.first[bin]) {
                take(point.t_s, point.position_mm);
            }
            take(bins.t_s[bin], tactus_model::Path::at(&bins.paths[bins.run[bin]], bins.t_s[bin]));
            traces.push(trace.clone());
        }
        // A walk of the zeros is no part of what a pipeline has.
        let mut counts = at.predicted.clone();
        if let Some(walk) = &at.parameters.walk {
            walk.add(bins, -1.0, &mut counts);
        }
        let mut signal_mm = Vec::with_capacity(counts.len());
        for (bin, counts) in counts.chunks_exact(elements).enumerate() {
            let run = bins.run[bin];
            for (element, counts) in counts.iter().enumerate() {
                let gain = at.parameters.sensitivity[element] * at.parameters.run_gain[run];
                let linear = (counts - at.parameters.baseline[run][element]) / gain;
                signal_mm.push(straightened(linear, known.response.quadratic_per_mm[element]));
            }
        }
        let mut sight = Self {
            elements,
            traces,
            signal_mm,
            counts,
            array: known.array.clone(),
            interval_s: interval_s(frames),
            units: Vec::new(),
        };
        for carrier in Carrier::ALL {
            sight.units.push((carrier, Self::unit(problem, at, carrier)?));
        }
        Ok(sight)
    }

    /// The change of each reading by a unit of a carrier.
    fn unit(problem: &Problem<'_>, at: &Fitted, carrier: Carrier) -> Result<Vec<f32>, DiscoverError> {
        #[expect(clippy::cast_possible_truncation, reason = "as precise as a direction needs to be")]
        let single = |value: f64| value as f32;
        if carrier == Carrier::Counts {
            return Ok(vec![1.0; at.predicted.len()]);
        }
        let constant = Draft {
            name: "constant".into(),
            sentence: "a constant".into(),
            carrier,
            when: When::Always,
            covariates: vec![Covariate::Time],
            ranges: vec![[0.0, 0.0]],
            law: Law::Linear { offset: 1.0, slope: 0.0 },
            weights: None,
        };
        let with = at.parameters.with(Term::neutral(constant.define()?));
        let free = Free::Of { term: with.terms.len() - 1, parameter: 0 };
        Ok(problem.slope(&with, &at.predicted, free)?.into_iter().map(single).collect())
    }

    /// Places of knots: quantiles of the covariate's values.
    pub(super) fn knots(&self, of: Acting, count: usize) -> Vec<f64> {
        let (_, when, covariate) = of;
        let mut values = self.values(of);
        values.sort_by(f64::total_cmp);
        if (when, covariate) == (When::Always, Covariate::Height) {
            // It is 0 as long as the tool touches, in most frames.
            values.dedup();
        }
        let (Some(least), Some(most)) = (values.first().copied(), values.last().copied()) else {
            return Vec::new();
        };
        // The reported position of a stage at rest still varies slightly. Counts may begin anywhere.
        let jitter = if covariate == Covariate::Counts { 0.0 } else { 1e-3 * most.abs().max(least.abs()) };
        let apart = (APART_SHARE * (most - least)).max(jitter);
        let mut knots: Vec<f64> = Vec::new();
        for knot in 0..count {
            let value = values[knot * (values.len() - 1) / (count - 1).max(1)];
            if knots.last().is_none_or(|last| value - last > apart) {
                knots.push(value);
            }
        }
        knots
    }

    /// Places of knots of a curve that changes from frame to frame at first, and later more slowly; or close to the surface, and more slowly above.
    pub(super) fn fine_knots(&self, of: Acting) -> Vec<f64> {
        let mut values = self.values(of);
        values.sort_by(f64::total_cmp);
        let (_, _, covariate) = of;
        let least_apart = match (covariate, values.last()) {
            (Covariate::Height, Some(highest)) => APART_SHARE * highest,
            // The times of two frames are not quite an interval apart.
            _ => 0.9 * self.interval_s,
        };
        let mut knots: Vec<f64> = Vec::new();
        for value in values {
            let apart = |last: &f64| least_apart.max(FINE_SHARE * last);
            if knots.last().is_none_or(|last| value - last > apart(last)) {
                knots.push(value);
            }
        }
        knots
    }

    /// The least and the greatest value of a covariate.
    pub(super) fn range(&self, of: Acting) -> [f64; 2] {
        let values = self.values(of);
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if least <= most { [least, most] } else { [0.0, 0.0] }
    }

    /// The values of a covariate at the bins at which a draft acts. Of one that differs from element to element they are those of readings
    /// with a signal, unless the carrier acts on the others as well.
    fn values(&self, (carrier, when, covariate): Acting) -> Vec<f64> {
        let bins = (0..self.traces.len()).filter(|bin| when.is_now(&self.traces[*bin]));
        if !covariate.is_of_element() {
            return bins
                .filter_map(|bin| covariate.value(self.seen(bin), 0))
                .filter(|v| v.is_finite())
                .collect();
        }
        let of_bin = |bin: usize| {
            let signal_mm = &self.signal_mm[bin * self.elements..(bin + 1) * self.elements];
            let largest = signal_mm.iter().copied().fold(0.0, f64::max);
            let is_of_all = matches!(carrier, Carrier::EveryElement | Carrier::Counts);
            let is_loud = move |element: &usize| is_of_all || signal_mm[*element] > LOUD_SHARE * largest;
            let value = move |element| covariate.value(self.seen(bin), element);
            (0..self.elements).filter(is_loud).filter_map(value)
        };
        bins.flat_map(of_bin).filter(|value| value.is_finite()).collect()
    }

    fn seen(&self, bin: usize) -> Seen<'_> {
        let readings = bin * self.elements..(bin + 1) * self.elements;
        Seen {
            trace: &self.traces[bin],
            array: &self.array,
            signal_mm: &self.signal_mm[readings.clone()],
            counts: &self.counts[readings],
        }
    }

    /// What one unit of a carrier does to a reading.
    fn unit_of(&self, carrier: Carrier) -> &[f32] {
        self.units.iter().find(|(known, _)| *known == carrier).map_or(&[], |(_, unit)| unit)
    }

    /// A reading's value and the square of what a tone would multiply, for the spectrum of a covariate.
    pub(super) fn points(
        &self,
        carrier: Carrier,
        covariate: Covariate,
        when: When,
    ) -> impl Iterator<Item = (usize, f64, f64)> + Clone + '_ {
        let unit = self.unit_of(carrier);
        let bins = (0..self.traces.len()).filter(move |bin| when.is_now(&self.traces[*bin]));
        bins.flat_map(move |bin| {
            let of = move |element: usize| {
                let reading = bin * self.elements + element;
                let value = covariate.value(self.seen(bin), element)?;
                Some((reading, value, f64::from(unit[reading])))
            };
            (0..self.elements).filter_map(of)
        })
    }

    /// The columns of an atom: what it does for a unit at each knot, at each pair of knots, or for each element.
    pub(super) fn columns<'a>(self: &Arc<Self>, atom: &Atom) -> Vec<Direction<'a>> {
        let count = atom.columns(self.elements);
        let column = |number: usize| -> Direction<'a> {
            let (sight, atom) = (Arc::clone(self), atom.clone());
            let (_, only) = atom.part(number, self.elements);
            Direction::computed(only, move |bins| sight.column(&atom, number, bins))
        };
        (0..count).map(column).collect()
    }

    /// The values of a column of an atom: bin by bin, element by element, or those at its only element.
    fn column(&self, atom: &Atom, number: usize, bins: Range<usize>) -> Vec<f64> {
        let unit = self.unit_of(atom.carrier);
        let (curve, only) = atom.part(number, self.elements);
        let elements = only.map_or(0..self.elements, |element| element..element + 1);
        let mut column = vec![0.0; bins.len() * elements.len()];
        let first_bin = bins.start;
        let is_common = !atom.covariates.iter().any(|covariate| covariate.is_of_element());
        for bin in bins {
            if !atom.when.is_now(&self.traces[bin]) {
                continue;
            }
            let seen = self.seen(bin);
            let common = if is_common { atom.factor(curve, seen, 0) } else { 0.0 };
            if is_common && common == 0.0 {
                continue;
            }
            for element in elements.clone() {
                let factor = if is_common { common } else { atom.factor(curve, seen, element) };
                let weight = atom.weights.as_ref().map_or(1.0, |weights| weights[element]);
                let reading = bin * self.elements + element;
                column[(bin - first_bin) * elements.len() + element - elements.start] =
                    factor * weight * f64::from(unit[reading]);
            }
        }
        column
    }

    /// An atom of single elements with one curve for all of them: that which its knots share most, from the products of each.
    pub(super) fn with_curve(&self, atom: Atom, grams: &Grams, own: Range<usize>) -> Atom {
        let knots = atom.knots_each();
        if knots <= 1 {
            return Atom { curve: Some(Arc::new(vec![1.0])), ..atom };
        }
        // Coefficients element by element, and their precisions; then the greatest pair of singular vectors, by repeated products.
        let number = |element: usize, knot: usize| own.start + element * knots + knot;
        let cell = |element: usize, knot: usize| {
            let size = grams.size(number(element, knot));
            if size > 0.0 {
                [grams.wanted(number(element, knot)) / (size * size), size * size]
            } else {
                [0.0; 2]
            }
        };
        let mut curve = vec![1.0; knots];
        for _ in 0..20 {
            let along = |element: usize| {
                let (mut wanted, mut square) = (0.0, 0.0);
                for (knot, at) in curve.iter().enumerate() {
                    let [coefficient, precision] = cell(element, knot);
                    wanted += precision * coefficient * at;
                    square += precision * at * at;
                }
                if square > 0.0 { wanted / square } else { 0.0 }
            };
            let weights: Vec<f64> = (0..self.elements).map(along).collect();
            let of_knot = |knot: usize| {
                let (mut wanted, mut square) = (0.0, 0.0);
                for (element, weight) in weights.iter().enumerate() {
                    let [coefficient, precision] = cell(element, knot);
                    wanted += precision * coefficient * weight;
                    square += precision * weight * weight;
                }
                if square > 0.0 { wanted / square } else { 0.0 }
            };
            curve = (0..knots).map(of_knot).collect();
            let most = curve.iter().fold(0.0_f64, |most, one| most.max(one.abs()));
            if most == 0.0 {
                curve = vec![1.0; knots];
                break;
            }
            for one in &mut curve {
                *one /= most;
            }
        }
        Atom { curve: Some(Arc::new(curve)), ..atom }
    }
}

/// The signal whose response is `linear`, with the base model's quadratic term.
fn straightened(linear: f64, quadratic_per_mm: f64) -> f64 {
    let root = 1.0 + 4.0 * quadratic_per_mm * linear;
    if quadratic_per_mm == 0.0 || root <= 0.0 {
        return linear;
    }
    (root.sqrt() - 1.0) / (2.0 * quadratic_per_mm)
}

impl Atom {
    /// The product of the hats of a pair of knots, or of all with a curve.
    pub(super) fn factor(&self, curve: Option<usize>, seen: Seen<'_>, element: usize) -> f64 {
        let mut values = [0.0; 2];
        for (value, covariate) in values.iter_mut().zip(&self.covariates) {
            match covariate.value(seen, element).filter(|value| value.is_finite()) {
                Some(known) => *value = known,
                None => return 0.0,
            }
        }
        let turn = self.per_unit.map(|per_unit| (std::f64::consts::TAU * per_unit * values[0]).sin_cos());
        let at = |knot: usize| match (turn, self.knots.as_slice()) {
            (Some((sin, cos)), _) => [sin, cos][knot],
            (None, [only]) => hat(only, knot, values[0]),
            (None, [first, second]) => {
                hat(first, knot / second.len(), values[0]) * hat(second, knot % second.len(), values[1])
            }
            (None, _) => 1.0,
        };
        match (curve, &self.curve) {
            (Some(knot), _) => at(knot),
            (None, Some(curve)) => curve.iter().enumerate().map(|(knot, value)| value * at(knot)).sum(),
            (None, None) => 1.0,
        }
    }
}

#[cfg(test)]
#[path = "sight_tests.rs"]
mod tests;
