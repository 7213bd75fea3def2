//! Rivals without a name: dependences that no effect of the library is, and that a name must beat.
//!
//! Each is a group of columns with free coefficients: a smooth function (straight lines between knots) of a covariate, or of two, times
//! the signal or its slope; or a tone in a covariate, whose frequency is the clearest of a periodogram ([`super::tones`]) and charged for
//! this.
//!
//! | rival | function of | times |
//! |---|---|---|
//! | sum of signals | the sum of all signals | the element's own signal |
//! | share of the largest signal | the element's own signal over the largest | the element's own signal |
//! | place | the tip's x and, apart, y | the element's own signal |
//! | place, in counts | the tip's x and, apart, y, wherever it stands | 1 |
//! | place in the element | the tip's x and y from the nearest centre | the element's own signal |
//! | direction of approach | the side from which the tool came, x and y | the signal, its slopes along x and y |
//! | distance from the tip | the distance of the element's centre from the tip | the largest signal |
//! | distance along the approach | the element's centre less the tip, along the last move aside | the element's own signal |
//! | speed of travel | the speed of the stage without contact | 1 |
//! | height above the surface | the tip's height without contact | the image of a press at the tip's place |
//! | contact | the element, while the tool touches | 1 |
//! | jump in counts | the element's own counts, above or below a place | 1 |
//! | tone in counts | the element's own counts | 1 |
//! | tone in travel | the length of the tip's way | 1 |
//! | tone in x, in y | the tip's place | the element's own signal |
//!
//! None of them has the formula of a physics. But some are here because tuning sets with a certain physics outside the library had a wrong name
//! without them, so what discovery says of that physics is no independent evidence:
//!
//! | rival | added | after a miss of |
//! |---|---|---|
//! | jump in counts | 2026-11-28 | `range-switch`: an amplifier whose ranges do not meet was named `hardening` |
//! | place, in counts | 2026-11-29 | `arm-shadow`: what the arm over the sensor adds to counts |
//!
//! Tones and distances were added on 2026-11-24. The height above the surface was added on the same day; the history does not tell whether a
//! miss of `proximity` led to it.
//!
//! Beside them stand the effects that the model has, each with a strength that varies ([`super::varying`]).
//!
//! The sum of signals and the place compete also with one function for loading and another for unloading.
//!
//! A class whose free part is a curve that model files cannot hold yet is as strong as that curve within the constraints of the class:
//! `heavy-tail` is a function of the distance from the tip that is nowhere negative far out. Without them the curve is a rival of all
//! classes but this one.

use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;

use super::cells::Point;
use super::covariates::{Factor, Feature, Form, Forms, LOW_MM};
use super::evidence::Signs;
use super::jumps;
use super::tones::{Tone, clearest, most_per_count};
use super::varying::varying;
use crate::data::{DiscoverError, OnWay};
use crate::fit::{Direction, Fitted, Hat, Problem};

/// Knots of a function of one covariate.
const KNOTS: usize = 5;

/// The reported position of a stage at rest still varies slightly, by so many mm; times and speeds are not finer.
pub(super) const JITTER: f64 = 1e-3;
/// Knots of a function of single readings lie where the signal is at least this share of the largest.
const SIGNAL_SHARE: f64 = 0.02;

/// A rival and its columns.
pub(crate) struct Rival<'a> {
    pub(crate) name: &'static str,
    /// The earlier rival whose columns are its own too.
    pub(crate) beside: Option<&'static str>,
    /// [`Direction::Times`] counts from the first of them.
    pub(crate) columns: Vec<Direction<'a>>,
    /// From how many alternatives the residual picked it.
    pub(crate) among: f64,
    /// The class whose free part it is, with the signs that the class allows.
    pub(crate) free: Option<(&'static str, Vec<Signs>)>,
}

impl<'a> Rival<'a> {
    /// One with columns of its own.
    pub(super) fn alone(name: &'static str, columns: Vec<Direction<'a>>) -> Self {
        Self { name, beside: None, columns, among: 1.0, free: None }
    }
}

/// The rivals at a model whose first terms are known. `rounds` if the converter's steps are seen: then each element in contact has an offset of its own anyway, and a tone
/// in counts is the rounding.
pub(crate) fn rivals<'a>(
    problem: &'a Problem<'_>,
    at: &'a Fitted,
    known_terms: usize,
    rounds: bool,
) -> Result<Vec<Rival<'a>>, DiscoverError> {
    let seen = Arc::new(Seen::of(problem, at)?);
    let history = seen.forms.history();
    let (deep, upward) = (&seen.deep, &history.upward);
    let free: Vec<bool> = deep.iter().map(|deep| !deep).collect();
    let of_place = |axis: usize| -> Vec<f64> { seen.place_mm.iter().map(|place| place[axis]).collect() };
    let in_element = |axis: usize| -> Vec<f64> {
        let array = &problem.predictor.known.array;
        let centres = if axis == 0 { array.col_centres_mm() } else { array.row_centres_mm() };
        let from_nearest = |place: &[f64; 2]| {
            let from = centres.iter().map(|centre| place[axis] - centre);
            from.min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0)
        };
        seen.place_mm.iter().map(from_nearest).collect()
    };
    let sums: Vec<f64> =
        seen.forms.signal().chunks_exact(seen.elements).map(|signal| signal.iter().sum()).collect();
    let unloading = |hats: &[Vec<f64>]| -> Vec<Vec<f64>> {
        hats.iter().map(|hat| hat.iter().zip(upward).map(|(hat, up)| hat * up).collect()).collect()
    };
    let smooth = |hats: Vec<Vec<f64>>, form: Form| -> Vec<Direction<'a>> {
        hats.into_iter().map(|hat| seen.column(Factor::Bins(Arc::new(hat)), form)).collect()
    };
    let both = |of: &dyn Fn(usize) -> Vec<f64>, among: &[bool]| -> Vec<Vec<f64>> {
        [0, 1].into_iter().flat_map(|axis| hats(&of(axis), among)).collect()
    };
    let aside = [0, 1].into_iter().flat_map(|axis| {
        let side = &history.aside[axis];
        let only = side.iter().zip(deep).map(|(side, deep)| if *deep { *side } else { 0.0 });
        let only: Arc<Vec<f64>> = Arc::new(only.collect());
        [Form::Signal, Form::AlongX, Form::AlongY]
            .map(|form| seen.column(Factor::Bins(Arc::clone(&only)), form))
    });
    let height_mm: Vec<f64> = history.depth_mm.iter().map(|depth_mm| -depth_mm).collect();
    let low: Vec<bool> = height_mm.iter().zip(&free).map(|(mm, free)| *free && *mm <= LOW_MM).collect();
    // Counts have no unit in which a difference would be little.
    let (of_sum, of_places) = (hats_of(&sums, deep, 0.0), both(&of_place, deep));
    let (of_sum_apart, of_places_apart) = (unloading(&of_sum), unloading(&of_places));
    let apart = |name, of: &'static str, hats| Rival {
        beside: Some(of),
        ..Rival::alone(name, smooth(hats, Form::Signal))
    };
    let of_distance = Seen::smooth(&seen, Seen::distance_mm, Seen::largest);
    // Near the tip, gains and the spread take up what the curve loses to its tail.
    let near = |knot| if knot < of_distance.len() / 2 { Signs::Both } else { Signs::Positive };
    let tail_signs = (0..of_distance.len()).map(near).collect();
    let mut found = vec![
        Rival::alone("sum of signals", smooth(of_sum, Form::Signal)),
        apart("sum of signals, apart", "sum of signals", of_sum_apart),
        Rival::alone("share of the largest signal", Seen::smooth(&seen, Seen::share, Seen::signal)),
        Rival::alone("place", smooth(of_places, Form::Signal)),
        apart("place, apart", "place", of_places_apart),
        Rival::alone("place, in counts", smooth(both(&of_place, &vec![true; deep.len()]), Form::Offset)),
        Rival::alone("place in the element", smooth(both(&in_element, deep), Form::Signal)),
        Rival::alone("direction of approach", aside.collect()),
        Rival::alone("distance from the tip", of_distance),
        Rival {
            beside: Some("distance from the tip"),
            free: Some(("heavy-tail", tail_signs)),
            ..Rival::alone("radial curve with more weight far out", Vec::new())
        },
        Rival::alone("distance along the approach", Seen::smooth(&seen, Seen::ahead_mm, Seen::signal)),
        Rival::alone("speed of travel", smooth(hats(&history.travel_mm_per_s, &free), Form::Offset)),
        Rival::alone("height above the surface", smooth(hats(&height_mm, &low), Form::Place)),
    ];
    found.extend(picked(problem, at, &seen, rounds));
    found.extend(varying(problem, at, known_terms, history));
    if !rounds {
        let in_contact: Arc<Vec<f64>> =
            Arc::new(deep.iter().map(|deep| f64::from(u8::from(*deep))).collect());
        let of_element =
            |element| seen.column(Factor::Element(element, Arc::clone(&in_contact)), Form::Offset);
        found.push(Rival::alone("contact", (0..seen.elements).map(of_element).collect()));
    }
    found.retain(|rival| !rival.columns.is_empty() || rival.free.is_some());
    Ok(found)
}

/// Those of which the residual picks the clearest: tones in counts, in travel, in x and in y, and a jump in counts.
fn picked<'a>(problem: &'a Problem<'_>, at: &'a Fitted, seen: &Arc<Seen>, rounds: bool) -> Vec<Rival<'a>> {
    let bins = problem.predictor.bins;
    let elements = seen.elements;
    let residual: Vec<f64> = problem.residuals(&at.predicted).collect();
    let weights: Vec<f64> = problem.weights().collect();
    let rival = |name, tone: &Tone, columns: [Direction<'a>; 2]| Rival {
        name,
        beside: None,
        columns: columns.into(),
        among: tone.among,
        free: None,
    };
    // Of all elements at a bin, with what the tone multiplies.
    let in_bins = |values: &[f64], carrier: &dyn Fn(usize) -> f64| -> Option<Tone> {
        let point = |bin: usize| {
            let mut point = Point { value: values[bin], wanted: 0.0, square: 0.0 };
            for reading in bin * elements..(bin + 1) * elements {
                point.wanted += weights[reading] * residual[reading] * carrier(reading);
                point.square += weights[reading] * carrier(reading).powi(2);
            }
            point
        };
        let points: Vec<Point> = (0..bins.len()).map(point).collect();
        clearest(&points.into_iter(), f64::INFINITY)
    };
    let of_bins = |name, values: Vec<f64>, form: Form, carrier: &dyn Fn(usize) -> f64| {
        let tone = in_bins(&values, carrier)?;
        let factor = |wave: fn(f64) -> f64| {
            let waves = values.iter().map(|value| wave(TAU * tone.per_unit * value)).collect();
            seen.column(Factor::Bins(Arc::new(waves)), form)
        };
        Some(rival(name, &tone, [factor(f64::sin), factor(f64::cos)]))
    };
    let readings = residual.iter().zip(&weights).zip(&at.predicted);
    let by_counts = readings.map(|((residual, weight), counts)| Point {
        value: *counts,
        wanted: weight * residual,
        square: *weight,
    });
    let tone_in_counts = || {
        let tone = clearest(&by_counts, most_per_count(problem.predictor.known.array.step_counts()))?;
        let column =
            |wave: fn(f64) -> f64| of_counts(at, elements, move |counts| wave(TAU * tone.per_unit * counts));
        Some(rival("tone in counts", &tone, [column(f64::sin), column(f64::cos)]))
    };
    let jump_in_counts = || {
        let jump = jumps::clearest(&by_counts)?;
        let column = of_counts(at, elements, move |counts| f64::from(u8::from(counts >= jump.at)));
        Some(Rival { among: jump.among, ..Rival::alone("jump in counts", vec![column]) })
    };
    let signal = |reading: usize| seen.signal(reading / elements, reading % elements);
    let place = |axis: usize| seen.place_mm.iter().map(|place| place[axis]).collect();
    let found = [
        // The tone of a coarse converter is its rounding, which is known by then.
        if rounds { None } else { tone_in_counts() },
        of_bins("tone in travel", seen.travel_mm.clone(), Form::Offset, &|_| 1.0),
        of_bins("tone in x", place(0), Form::Signal, &signal),
        of_bins("tone in y", place(1), Form::Signal, &signal),
        if rounds { None } else { jump_in_counts() },
    ];
    found.into_iter().flatten().collect()
}

/// A column of a function of the counts that a model predicts.
fn of_counts<'a>(
    at: &'a Fitted,
    elements: usize,
    of: impl Fn(f64) -> f64 + Send + Sync + 'a,
) -> Direction<'a> {
    Direction::Column(Box::new(move |bins: Range<usize>| {
        at.predicted[bins.start * elements..bins.end * elements].iter().map(|counts| of(*counts)).collect()
    }))
}

/// What rivals are functions of, at a model.
struct Seen {
    forms: Forms,
    elements: usize,
    centres_mm: Vec<[f64; 2]>,
    /// For each bin: whether the tool touches, where the tip is on the sensor, how long its way was, and the largest signal.
    deep: Vec<bool>,
    place_mm: Vec<[f64; 2]>,
    /// Direction of the last move aside, on the sensor.
    heading: Vec<[f64; 2]>,
    travel_mm: Vec<f64>,
    largest: Vec<f64>,
}

/// A value of a reading, from its bin and its element.
type OfReading = fn(&Seen, usize, usize) -> f64;

impl Seen {
    fn of(problem: &Problem<'_>, at: &Fitted) -> Result<Self, DiscoverError> {
        let forms =
            Forms::of(problem, &at.parameters, &at.predicted)?.with_places(problem, &at.parameters)?;
        let (bins, known) = (problem.predictor.bins, problem.predictor.known);
        let elements = bins.elements;
        let history = forms.history();
        let places = history.place_mm[0].iter().zip(&history.place_mm[1]);
        let origin = known.registration.to_sensor([0.0; 2]);
        let turned = |heading: [f64; 2]| {
            let end = known.registration.to_sensor(heading);
            [end[0] - origin[0], end[1] - origin[1]]
        };
        // Counts may fall with a press.
        let largest = |signal: &[f64]| {
            signal.iter().copied().fold(0.0, |most: f64, one| if one.abs() > most.abs() { one } else { most })
        };
        let frames = problem.predictor.frames;
        let mut way_mm = 0.0;
        let mut last_mm = None;
        let mut ways_mm = Vec::with_capacity(frames.len());
        for OnWay { frame, position_mm, .. } in frames.on_way(0..frames.len()) {
            let from_mm = last_mm.replace(position_mm).unwrap_or(position_mm);
            way_mm += (0..3).map(|axis| (position_mm[axis] - from_mm[axis]).powi(2)).sum::<f64>().sqrt();
            ways_mm.extend(frame.map(|_| way_mm));
        }
        // Where the tip rests it goes no way.
        let way_of = |bin: usize| {
            let (first, end) = (bins.first[bin], bins.first[bin + 1]);
            if bins.moves[bin] { 0.5 * (ways_mm[first] + ways_mm[end - 1]) } else { ways_mm[first] }
        };
        Ok(Self {
            elements,
            centres_mm: (0..elements).filter_map(|element| known.array.centre_mm(element)).collect(),
            deep: history.depth_mm.iter().map(|depth_mm| *depth_mm > 0.0).collect(),
            place_mm: places.map(|(x, y)| known.registration.to_sensor([*x, *y])).collect(),
            heading: history.heading.iter().map(|heading| turned(*heading)).collect(),
            travel_mm: (0..bins.len()).map(way_of).collect(),
            largest: forms.signal().chunks_exact(elements).map(largest).collect(),
            forms,
        })
    }

    fn signal(&self, bin: usize, element: usize) -> f64 {
        self.forms.signal()[bin * self.elements + element]
    }

    fn largest(&self, bin: usize, _: usize) -> f64 {
        self.largest[bin]
    }

    fn share(&self, bin: usize, element: usize) -> f64 {
        if self.largest[bin] == 0.0 { 0.0 } else { self.signal(bin, element) / self.largest[bin] }
    }

    fn offset_from_tip_mm(&self, bin: usize, element: usize) -> [f64; 2] {
        let (centre, tip) = (self.centres_mm[element], self.place_mm[bin]);
        [centre[0] - tip[0], centre[1] - tip[1]]
    }

    fn distance_mm(&self, bin: usize, element: usize) -> f64 {
        let [x, y] = self.offset_from_tip_mm(bin, element);
        x.hypot(y)
    }

    /// How far the element is from the tip, along the direction of the last move aside.
    fn ahead_mm(&self, bin: usize, element: usize) -> f64 {
        let [x, y] = self.offset_from_tip_mm(bin, element);
        let [along_x, along_y] = self.heading[bin];
        x * along_x + y * along_y
    }

    /// A factor for each bin, times a form.
    fn column<'a>(self: &Arc<Self>, factor: Factor, form: Form) -> Direction<'a> {
        let seen = Arc::clone(self);
        let feature = Feature { covariate: "", unit: "", form, range: [0.0; 2], factor };
        Direction::computed(feature.only(), move |bins| seen.forms.values(&feature, bins, seen.elements))
    }

    /// A smooth function of a value of single readings in contact, times another value.
    fn smooth<'a>(seen: &Arc<Self>, value: OfReading, times: OfReading) -> Vec<Direction<'a>> {
        let loud =
            |(bin, element): &(usize, usize)| seen.deep[*bin] && seen.share(*bin, *element) > SIGNAL_SHARE;
        let readings = (0..seen.deep.len()).flat_map(|bin| (0..seen.elements).map(move |e| (bin, e)));
        let knots =
            knots(readings.filter(loud).map(|(bin, element)| value(seen, bin, element)).collect(), JITTER);
        let column = |knot: usize| -> Direction<'a> {
            let (seen, hat) = (Arc::clone(seen), Hat::of(&knots, knot));
            Direction::Column(Box::new(move |bins: Range<usize>| {
                let mut column = vec![0.0; bins.len() * seen.elements];
                for (place, bin) in bins.enumerate().filter(|(_, bin)| seen.deep[*bin]) {
                    for element in 0..seen.elements {
                        column[place * seen.elements + element] =
                            times(&seen, bin, element) * hat.at(value(&seen, bin, element));
                    }
                }
                column
            }))
        };
        if knots.len() < 2 { Vec::new() } else { (0..knots.len()).map(column).collect() }
    }
}

/// For each knot, the weight of its value in a function that is straight between knots; 0 for bins that are not among those. No knots if
/// the values do not differ.
pub(super) fn hats(values: &[f64], among: &[bool]) -> Vec<Vec<f64>> {
    hats_of(values, among, JITTER)
}

/// As [`hats`], of values that differ if they do so by more than that.
fn hats_of(values: &[f64], among: &[bool], jitter: f64) -> Vec<Vec<f64>> {
    let kept = values.iter().zip(among).filter(|(value, among)| **among && value.is_finite());
    let knots = knots(kept.map(|(value, _)| *value).collect(), jitter);
    let hat = |knot: usize| {
        let hat = Hat::of(&knots, knot);
        let of = |(value, among): (&f64, &bool)| {
            if *among && value.is_finite() { hat.at(*value) } else { 0.0 }
        };
        values.iter().zip(among).map(of).collect()
    };
    if knots.len() < 2 { Vec::new() } else { (0..knots.len()).map(hat).collect() }
}

/// Quantiles of the values from the least to the greatest, each apart from the one before.
fn knots(mut values: Vec<f64>, jitter: f64) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    let (Some(least), Some(most)) = (values.first().copied(), values.last().copied()) else {
        return Vec::new();
    };
    let apart = jitter.max(1e-3 * (most - least).max(least.abs()).max(most.abs()));
    let quantiles = (0..KNOTS).map(|knot| values[knot * (values.len() - 1) / (KNOTS - 1)]);
    let mut knots: Vec<f64> = Vec::new();
    for value in quantiles {
        if knots.last().is_none_or(|last| value - last > apart) {
            knots.push(value);
        }
    }
    knots
}

#[cfg(test)]
#[path = "rivals_tests.rs"]
mod tests;
