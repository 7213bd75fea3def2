//! What a draft would see and act on: the covariates of each bin, and what one unit of each carrier does.

use std::f64::consts::TAU;
use std::iter::repeat_n;
use std::ops::Range;
use std::sync::Arc;

use tactus_model::effect::{Carrier, Draft, Law, When};
use tactus_model::{Covariate, Seen, Trace};

use super::grammar::{Acting, Atom};
use crate::data::{DiscoverError, interval_s};
use crate::fit::{Few, Fitted, Free, Grams, Hat, Problem, Sparse, Term};

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
    /// When a draft would act: for each bin whether it is then.
    whens: Vec<(When, Vec<bool>)>,
    /// The values of each covariate, in the order of all: bin by bin, or of one that differs from element to element reading by reading. NaN where
    /// it has none.
    covariates: Vec<Vec<f64>>,
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
        let seen = |bin: usize| Seen {
            trace: &traces[bin],
            array: &known.array,
            signal_mm: &signal_mm[bin * elements..(bin + 1) * elements],
            counts: &counts[bin * elements..(bin + 1) * elements],
        };
        let values = |covariate: &Covariate| {
            let each = if covariate.is_of_element() { elements } else { 1 };
            let mut values = Vec::with_capacity(bins.len() * each);
            for bin in 0..bins.len() {
                let of_bin = (0..each).map(|element| covariate.value(seen(bin), element));
                values.extend(of_bin.map(|value| value.filter(|one| one.is_finite()).unwrap_or(f64::NAN)));
            }
            values
        };
        let mut sight = Self {
            elements,
            whens: When::ALL
                .into_iter()
                .map(|when| (when, traces.iter().map(|trace| when.is_now(trace)).collect()))
                .collect(),
            covariates: Covariate::ALL.iter().map(values).collect(),
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
        let values = self.along(covariate);
        let bins = self.bins_of(when);
        if !covariate.is_of_element() {
            return bins.map(|bin| values[bin]).filter(|value| !value.is_nan()).collect();
        }
        let signal_mm = self.along(Covariate::Signal);
        let of_bin = |bin: usize| {
            let readings = bin * self.elements..(bin + 1) * self.elements;
            let signal_mm = &signal_mm[readings.clone()];
            let largest = signal_mm.iter().copied().fold(0.0, f64::max);
            let is_of_all = matches!(carrier, Carrier::EveryElement | Carrier::Counts);
            let is_loud = move |signal: f64| is_of_all || signal > LOUD_SHARE * largest;
            values[readings]
                .iter()
                .zip(signal_mm)
                .filter_map(move |(value, signal)| is_loud(*signal).then_some(*value))
        };
        bins.flat_map(of_bin).filter(|value| !value.is_nan()).collect()
    }

    /// The values of a covariate: bin by bin, or reading by reading.
    fn along(&self, covariate: Covariate) -> &[f64] {
        let place = Covariate::ALL.iter().position(|known| *known == covariate);
        place.map_or(&[], |place| &self.covariates[place])
    }

    /// For each bin whether it is then.
    fn is_then(&self, when: When) -> &[bool] {
        self.whens.iter().find(|(known, _)| *known == when).map_or(&[], |(_, is_then)| is_then)
    }

    /// The bins at which a draft acts.
    fn bins_of(&self, when: When) -> impl Iterator<Item = usize> + Clone + '_ {
        self.is_then(when).iter().enumerate().filter_map(|(bin, is_then)| is_then.then_some(bin))
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
        let (unit, values) = (self.unit_of(carrier), self.along(covariate));
        let is_common = !covariate.is_of_element();
        self.bins_of(when).flat_map(move |bin| {
            let of = move |reading: usize| {
                let value = values[if is_common { bin } else { reading }];
                (!value.is_nan()).then(|| (reading, value, f64::from(unit[reading])))
            };
            (bin * self.elements..(bin + 1) * self.elements).filter_map(of)
        })
    }

    /// The columns of an atom: what it does for a unit at each knot, at each pair of knots, or for each element.
    pub(super) fn columns<'a>(self: &Arc<Self>, atom: &Atom) -> Sparse<'a> {
        let columns = atom.columns(self.elements);
        let (sight, atom) = (Arc::clone(self), atom.clone());
        Sparse::of(columns, move |bins| sight.acting(&atom, bins))
    }

    /// The columns of an atom that act on each reading: bin by bin, element by element.
    fn acting(&self, atom: &Atom, bins: Range<usize>) -> Vec<Few> {
        let (unit, is_then) = (self.unit_of(atom.carrier), self.is_then(atom.when));
        let at: Vec<(&[f64], bool)> =
            atom.covariates.iter().map(|one| (self.along(*one), one.is_of_element())).collect();
        let is_common = at.iter().all(|(_, is_of_element)| !is_of_element);
        let of_curve = |bin: usize, element: usize| {
            let mut values = [0.0; 2];
            for (value, (along, is_of_element)) in values.iter_mut().zip(&at) {
                *value = along[if *is_of_element { bin * self.elements + element } else { bin }];
            }
            atom.acting(values)
        };
        // How many columns the next element is further.
        let apart = if atom.of_elements { atom.columns(1) } else { 0 };
        let mut acting = Vec::with_capacity(bins.len() * self.elements);
        for bin in bins {
            if !is_then[bin] {
                acting.extend(repeat_n(Few::default(), self.elements));
                continue;
            }
            let common = is_common.then(|| of_curve(bin, 0));
            acting.extend((0..self.elements).map(|element| {
                let weight = atom.weights.as_ref().map_or(1.0, |weights| weights[element]);
                let unit = f64::from(unit[bin * self.elements + element]);
                common.unwrap_or_else(|| of_curve(bin, element)).after(element * apart, weight * unit)
            }));
        }
        acting
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
    /// What the columns of one element have at values of the covariates: those of the knots around, or that of the whole curve, once it is known. None
    /// where a covariate has no value; the second is 0 where there is only one.
    fn acting(&self, at: [f64; 2]) -> Few {
        if at.iter().any(|one| one.is_nan()) {
            return Few::default();
        }
        let of_knots = if let Some(per_unit) = self.per_unit {
            let (sin, cos) = (TAU * per_unit * at[0]).sin_cos();
            Few::of([(0, sin), (1, cos)])
        } else {
            match self.knots.as_slice() {
                [] => Few::of([(0, 1.0)]),
                [only] => Few::of(beside(only, at[0])),
                [first, second, ..] => {
                    let columns = beside(second, at[1]);
                    let of_row = |(row, by_row): (usize, f64)| {
                        columns.map(|(column, part)| (row * second.len() + column, by_row * part))
                    };
                    Few::of(beside(first, at[0]).into_iter().flat_map(of_row))
                }
            }
        };
        match &self.curve {
            Some(curve) if self.of_elements => {
                Few::of([(0, of_knots.each().map(|(knot, part)| curve[knot] * part).sum())])
            }
            _ => of_knots,
        }
    }
}

/// The knots before and after a value, each with its hat there; all others' are 0.
fn beside(knots: &[f64], value: f64) -> [(usize, f64); 2] {
    let after = knots.partition_point(|knot| *knot <= value).min(knots.len() - 1);
    let before = after.saturating_sub(1);
    // Of the only knot once.
    let share = if before == after { 0.0 } else { Hat::of(knots, before).at(value) };
    [(before, share), (after, Hat::of(knots, after).at(value))]
}

#[cfg(test)]
#[path = "sight_tests.rs"]
mod tests;
