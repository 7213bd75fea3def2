//! Rivals without a name: dependences that no effect of the library is, and that a name must beat.
//!
//! Each is a group of columns with free coefficients: a smooth function (straight lines between knots) of a covariate, or of two, times
//! the signal or its slope. None is modelled after a known physics.
//!
//! | rival | function of | times |
//! |---|---|---|
//! | sum of signals | the sum of all signals | the element's own signal |
//! | place | the tip's x and, apart, y | the element's own signal |
//! | place in the element | the tip's x and y from the nearest centre | the element's own signal |
//! | direction of approach | the side from which the tool came, x and y | the signal, its slopes along x and y |
//! | speed of travel | the speed of the stage without contact | 1 |
//! | height above the surface | the tip's height without contact | the image of a press at the tip's place |
//! | contact | the element, while the tool touches | 1 |

use std::ops::Range;
use std::sync::Arc;

use super::covariates::{Factor, Feature, Form, Forms};
use crate::data::DiscoverError;
use crate::fit::{Direction, Fitted, Problem};

/// Knots of a function of one covariate.
const KNOTS: usize = 5;

/// Greatest height from which something may be felt without contact.
const LOW_MM: f64 = 2.0;

/// A rival and its columns.
pub(crate) struct Rival {
    pub(crate) name: &'static str,
    pub(crate) columns: Vec<Direction<'static>>,
}

/// The rivals at a model. `rounds` if the converter's steps are seen: then each element in contact has an offset of its own anyway.
pub(crate) fn rivals(problem: &Problem<'_>, at: &Fitted, rounds: bool) -> Result<Vec<Rival>, DiscoverError> {
    let forms = Forms::of(problem, &at.parameters, &at.predicted)?.with_places(problem, &at.parameters)?;
    let forms = Arc::new(forms);
    let bins = problem.predictor.bins;
    let elements = bins.elements;
    let array = &problem.predictor.known.array;
    let history = forms.history();
    let column = |factor: Factor, form: Form| -> Direction<'static> {
        let forms = Arc::clone(&forms);
        let feature = Feature { covariate: "", unit: "", form, range: [0.0; 2], factor };
        Direction::Column(Box::new(move |bins: Range<usize>| forms.values(&feature, bins, elements)))
    };
    let deep: Vec<bool> = history.depth_mm.iter().map(|depth_mm| *depth_mm > 0.0).collect();
    let free: Vec<bool> = deep.iter().map(|deep| !deep).collect();
    let place: Vec<[f64; 2]> = history.place_mm[0]
        .iter()
        .zip(&history.place_mm[1])
        .map(|(x, y)| problem.predictor.known.registration.to_sensor([*x, *y]))
        .collect();
    let of_place = |axis: usize| -> Vec<f64> { place.iter().map(|place| place[axis]).collect() };
    let in_element = |axis: usize| -> Vec<f64> {
        let centres = if axis == 0 { array.col_centres_mm() } else { array.row_centres_mm() };
        let from_nearest = |place: &[f64; 2]| {
            let from = centres.iter().map(|centre| place[axis] - centre);
            from.min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0)
        };
        place.iter().map(from_nearest).collect()
    };
    let sums: Vec<f64> = forms.signal().chunks_exact(elements).map(|signal| signal.iter().sum()).collect();
    let smooth = |values: &[f64], among: &[bool], form: Form| -> Vec<Direction<'static>> {
        hats(values, among).into_iter().map(|hat| column(Factor::Bins(Arc::new(hat)), form)).collect()
    };
    let both = |of: &dyn Fn(usize) -> Vec<f64>| -> Vec<Direction<'static>> {
        [0, 1].into_iter().flat_map(|axis| smooth(&of(axis), &deep, Form::Signal)).collect()
    };
    let aside = [0, 1].into_iter().flat_map(|axis| {
        let side = &history.aside[axis];
        let only = side.iter().zip(&deep).map(|(side, deep)| if *deep { *side } else { 0.0 });
        let only: Arc<Vec<f64>> = Arc::new(only.collect());
        [Form::Signal, Form::AlongX, Form::AlongY].map(|form| column(Factor::Bins(Arc::clone(&only)), form))
    });
    let height_mm: Vec<f64> = history.depth_mm.iter().map(|depth_mm| -depth_mm).collect();
    let low: Vec<bool> = height_mm.iter().zip(&free).map(|(mm, free)| *free && *mm <= LOW_MM).collect();
    let mut found = vec![
        Rival { name: "sum of signals", columns: smooth(&sums, &deep, Form::Signal) },
        Rival { name: "place", columns: both(&of_place) },
        Rival { name: "place in the element", columns: both(&in_element) },
        Rival { name: "direction of approach", columns: aside.collect() },
        Rival { name: "speed of travel", columns: smooth(&history.travel_mm_per_s, &free, Form::Offset) },
        Rival { name: "height above the surface", columns: smooth(&height_mm, &low, Form::Place) },
    ];
    if !rounds {
        let in_contact: Arc<Vec<f64>> =
            Arc::new(deep.iter().map(|deep| f64::from(u8::from(*deep))).collect());
        let of_element = |element| column(Factor::Element(element, Arc::clone(&in_contact)), Form::Offset);
        found.push(Rival { name: "contact", columns: (0..elements).map(of_element).collect() });
    }
    found.retain(|rival| !rival.columns.is_empty());
    Ok(found)
}

/// For each knot, the weight of its value in a function that is straight between knots; 0 for bins that are not among those. No knots if
/// the values do not differ.
fn hats(values: &[f64], among: &[bool]) -> Vec<Vec<f64>> {
    let kept = values.iter().zip(among).filter(|(value, among)| **among && value.is_finite());
    let knots = knots(kept.map(|(value, _)| *value).collect());
    // Beyond the first and the last knot the function is constant.
    let slope =
        |value: f64, from: Option<f64>, knot: f64| from.map_or(1.0, |from| (value - from) / (knot - from));
    let hat = |knot: usize| {
        let (below, above) = (knot.checked_sub(1).map(|below| knots[below]), knots.get(knot + 1).copied());
        let of = |(value, among): (&f64, &bool)| {
            if !among || !value.is_finite() {
                return 0.0;
            }
            slope(*value, below, knots[knot]).min(slope(*value, above, knots[knot])).clamp(0.0, 1.0)
        };
        values.iter().zip(among).map(of).collect()
    };
    if knots.len() < 2 { Vec::new() } else { (0..knots.len()).map(hat).collect() }
}

/// Quantiles of the values from the least to the greatest, each apart from the one before.
fn knots(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    let (Some(least), Some(most)) = (values.first().copied(), values.last().copied()) else {
        return Vec::new();
    };
    // The reported position of a stage at rest still varies slightly.
    let apart = 1e-3 * (most - least).max(least.abs()).max(most.abs()).max(1.0);
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
