//! Responses of the elements to presses at their own centres (Sec. 2.2 and Fig. 2a of the paper).

use std::collections::{BTreeMap, BTreeSet};

use tactus_schema::Rig;

use super::presses::PressSummary;
use crate::fit::Polynomial;

/// An element is unresponsive if it reads less than this share of the median element at its own press.
const DEAD_SHARE: f64 = 0.25;
/// An element responds to another's press if its reading at its own press is less than this share of its greatest.
const OWN_SHARE: f64 = 0.95;
/// Depths are compared in multiples of this.
const DEPTH_STEP_MM: f64 = 1e-3;

/// The response curves of a run, and polynomials fitted to their mean.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseCurves {
    /// Curves of the elements that respond to their own press, in order of the presses.
    pub curves: Vec<ElementCurve>,
    /// The other elements, in order of their index; they take part in no fit.
    pub unresponsive: Vec<UnresponsiveElement>,
    /// Mean of the curves at each depth that at least half of them have: `[mm, counts]`.
    pub mean: Vec<[f64; 2]>,
    /// Line fitted to the mean.
    pub linear: Option<Polynomial>,
    /// Parabola fitted to the mean.
    pub quadratic: Option<Polynomial>,
}

/// Reading of one element against depth, in a press at its own centre.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementCurve {
    /// Index of the element.
    pub element: usize,
    /// Its row and column.
    pub place: [usize; 2],
    /// Index of the press.
    pub press: i32,
    /// Depth in mm and rise in counts of each dwell.
    pub points: Vec<[f64; 2]>,
    /// Line fitted to these points.
    pub linear: Option<Polynomial>,
}

/// An element that does not respond to its own press.
#[derive(Debug, Clone, PartialEq)]
pub struct UnresponsiveElement {
    /// Its readings at its own press.
    pub curve: ElementCurve,
    /// Row and column of the element at whose press it reads most; `None` if it responds to no press.
    pub answers_to: Option<[usize; 2]>,
}

impl ResponseCurves {
    /// `None` unless a press at an element's centre has dwells at two depths or more.
    pub(super) fn of(rig: &Rig, presses: &[PressSummary]) -> Option<Self> {
        let cols = rig.array.cols();
        let curves: Vec<ElementCurve> =
            presses.iter().filter_map(|press| ElementCurve::of(press, cols)).collect();
        if curves.is_empty() {
            return None;
        }
        let answers = DeepestReadings::of(presses);
        let mut seen = BTreeSet::new();
        let mut unresponsive: Vec<UnresponsiveElement> = Vec::new();
        for curve in &curves {
            let answers_to = match answers.of_element(curve.element) {
                RespondsAt::Own => continue,
                RespondsAt::To(other) => Some([other / cols, other % cols]),
                RespondsAt::Nowhere => None,
            };
            if seen.insert(curve.element) {
                unresponsive.push(UnresponsiveElement { curve: curve.clone(), answers_to });
            }
        }
        unresponsive.sort_by_key(|unresponsive| unresponsive.curve.element);
        let curves: Vec<ElementCurve> =
            curves.into_iter().filter(|curve| !seen.contains(&curve.element)).collect();
        let mean = mean(&curves);
        Some(Self {
            linear: Polynomial::fit(1, &mean),
            quadratic: Polynomial::fit(2, &mean),
            mean,
            curves,
            unresponsive,
        })
    }

    /// Mean and standard deviation of the elements' slopes, in counts per mm; `None` for fewer than two.
    pub fn slope_spread(&self) -> Option<[f64; 2]> {
        let slopes: Vec<f64> = self.curves.iter().filter_map(ElementCurve::slope_counts_per_mm).collect();
        let mean = slopes.iter().sum::<f64>() / slopes.len() as f64;
        let squares: f64 = slopes.iter().map(|slope| (slope - mean).powi(2)).sum();
        (slopes.len() > 1).then(|| [mean, (squares / (slopes.len() - 1) as f64).sqrt()])
    }
}

impl ElementCurve {
    fn of(press: &PressSummary, cols: usize) -> Option<Self> {
        let element = press.element?;
        let own = |dwell: &super::DwellSummary| {
            dwell.rise_counts.get(element).map(|rise| [dwell.depth_mm, f64::from(*rise)])
        };
        let points: Vec<[f64; 2]> = press.dwells.iter().filter_map(own).collect();
        let depths: BTreeSet<i64> = points.iter().map(|[depth_mm, _]| depth_key(*depth_mm)).collect();
        (depths.len() > 1).then(|| Self {
            element,
            place: [element / cols, element % cols],
            press: press.index,
            linear: Polynomial::fit(1, &points),
            points,
        })
    }

    /// Slope of the fitted line.
    pub fn slope_counts_per_mm(&self) -> Option<f64> {
        self.linear.as_ref()?.coefficients.get(1).map(|slope| slope.value)
    }
}

/// Readings of all elements at the deepest dwell of each press at a centre.
struct DeepestReadings<'a> {
    /// Depth and rises, by pressed element.
    deepest: BTreeMap<usize, (i64, &'a [f32])>,
    median_own: f64,
}

impl<'a> DeepestReadings<'a> {
    fn of(presses: &'a [PressSummary]) -> Self {
        let mut deepest: BTreeMap<usize, (i64, &[f32])> = BTreeMap::new();
        for press in presses {
            let dwell = press.dwells.iter().max_by(|a, b| a.depth_mm.total_cmp(&b.depth_mm));
            if let (Some(element), Some(dwell)) = (press.element, dwell) {
                deepest.entry(element).or_insert((depth_key(dwell.depth_mm), &dwell.rise_counts));
            }
        }
        let mut own: Vec<f64> = deepest.iter().map(|(&element, (_, rises))| rise(rises, element)).collect();
        own.sort_by(f64::total_cmp);
        let median_own = own.get(own.len() / 2).copied().unwrap_or(0.0);
        Self { deepest, median_own }
    }

    /// The press to which an element responds.
    fn of_element(&self, element: usize) -> RespondsAt {
        // Some sensors' readings fall when pressed.
        let toward = |rises: &[f32]| rise(rises, element) * self.median_own.signum();
        let least = DEAD_SHARE * self.median_own.abs();
        let Some((depth, rises)) = self.deepest.get(&element) else { return RespondsAt::Nowhere };
        let own = toward(rises);
        let most = self
            .deepest
            .iter()
            .filter(|(_, (other_depth, _))| other_depth == depth)
            .map(|(&pressed, (_, rises))| (pressed, toward(rises)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        match most {
            Some((other, reading)) if reading >= least && own < OWN_SHARE * reading => RespondsAt::To(other),
            _ if own < least => RespondsAt::Nowhere,
            _ => RespondsAt::Own,
        }
    }
}

/// The press to which an element responds.
enum RespondsAt {
    Own,
    To(usize),
    Nowhere,
}

fn rise(rises: &[f32], element: usize) -> f64 {
    rises.get(element).map_or(0.0, |rise| f64::from(*rise))
}

fn mean(curves: &[ElementCurve]) -> Vec<[f64; 2]> {
    let mut by_depth: BTreeMap<i64, Vec<f64>> = BTreeMap::new();
    for [depth_mm, rise] in curves.iter().flat_map(|curve| &curve.points) {
        by_depth.entry(depth_key(*depth_mm)).or_default().push(*rise);
    }
    by_depth
        .into_iter()
        .filter(|(_, rises)| 2 * rises.len() >= curves.len())
        .map(|(depth, rises)| [depth as f64 * DEPTH_STEP_MM, rises.iter().sum::<f64>() / rises.len() as f64])
        .collect()
}

#[expect(clippy::cast_possible_truncation, reason = "saturates")]
fn depth_key(depth_mm: f64) -> i64 {
    (depth_mm / DEPTH_STEP_MM).round() as i64
}

#[cfg(test)]
#[path = "response_tests.rs"]
mod tests;
