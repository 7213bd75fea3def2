//! Responses of the elements to presses at their own centres (Sec. 2.2 and Fig. 2a of the paper).

use std::collections::{BTreeMap, BTreeSet};

use tactus_schema::Rig;

use super::presses::{PressSummary, key_of_mm};
use crate::fit::Polynomial;

/// An element is unresponsive if it reads less than this share of the median element at its own press.
const DEAD_SHARE: f64 = 0.25;
/// An element responds to another's press if its reading at its own press is less than this share of its greatest.
const OWN_SHARE: f64 = 0.95;
/// Presses at most this many rows and columns away show whether an element responds to its own.
const NEAR: usize = 2;
/// Elements that it takes to know which share of its own press an element reads at a neighbouring one.
const SHARES_MIN: usize = 4;

/// The response curves of a run, and polynomials fitted to their mean.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseCurves {
    /// Curves of the elements that respond to their own press, in order of the presses.
    pub curves: Vec<ElementCurve>,
    /// The other elements, in order of their index; they take part in no fit.
    pub unresponsive: Vec<UnresponsiveElement>,
    /// Elements among the curves of which these presses cannot show whether they respond to their own press, sorted: none of their
    /// neighbours was pressed as deep.
    pub untold: Vec<usize>,
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
    /// To which press it responds instead.
    pub answers_to: RespondsTo,
}

/// To what an element responds instead of its own press.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RespondsTo {
    /// A press at another element, with this row and column.
    Element([usize; 2]),
    /// A place that was not pressed: it reads too much at its neighbours' presses.
    Elsewhere,
    /// No press.
    Nothing,
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
        let readings = CentreReadings::of(presses, cols);
        let mut seen = BTreeSet::new();
        let mut untold = BTreeSet::new();
        let mut unresponsive: Vec<UnresponsiveElement> = Vec::new();
        for curve in &curves {
            let answers_to = match readings.verdict(curve.element) {
                OwnPress::Responds => continue,
                OwnPress::Untold => {
                    untold.insert(curve.element);
                    continue;
                }
                OwnPress::Not(answers_to) => answers_to,
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
            untold: untold.into_iter().collect(),
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
        let depths: BTreeSet<i64> = points.iter().map(|[depth_mm, _]| key_of_mm(*depth_mm)).collect();
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

/// Readings of all elements in the presses at centres: by depth, then by pressed element.
struct CentreReadings<'a> {
    by_depth: BTreeMap<i64, BTreeMap<usize, &'a [f32]>>,
    cols: usize,
    /// Median of the elements' readings at the deepest dwell of their own press.
    median_own: f64,
    /// Shares of its own press that an element reads at another: the median of the elements, by depth and rows and columns between them.
    shares: BTreeMap<(i64, [usize; 2]), f64>,
}

/// Whether an element responds to its own press.
enum OwnPress {
    Responds,
    Untold,
    Not(RespondsTo),
}

impl<'a> CentreReadings<'a> {
    fn of(presses: &'a [PressSummary], cols: usize) -> Self {
        let mut by_depth: BTreeMap<i64, BTreeMap<usize, &[f32]>> = BTreeMap::new();
        let mut deepest: BTreeMap<usize, (i64, &[f32])> = BTreeMap::new();
        for press in presses {
            let Some(element) = press.element else { continue };
            for dwell in &press.dwells {
                let depth = key_of_mm(dwell.depth_mm);
                by_depth.entry(depth).or_default().entry(element).or_insert(&dwell.rise_counts);
                let known = deepest.entry(element).or_insert((depth, &dwell.rise_counts));
                if depth > known.0 {
                    *known = (depth, &dwell.rise_counts);
                }
            }
        }
        let own = deepest.iter().map(|(&element, (_, rises))| rise(rises, element)).collect();
        let mut readings = Self { by_depth, cols, median_own: median(own), shares: BTreeMap::new() };
        readings.shares = readings.median_shares();
        readings
    }

    fn median_shares(&self) -> BTreeMap<(i64, [usize; 2]), f64> {
        let mut shares: BTreeMap<(i64, [usize; 2]), Vec<f64>> = BTreeMap::new();
        for (&depth, pressed) in &self.by_depth {
            for (&element, rises) in pressed {
                let own = self.toward(rises, element);
                if own < self.least() {
                    continue;
                }
                for (apart, reading) in self.near(element, pressed) {
                    shares.entry((depth, apart)).or_default().push(reading / own);
                }
            }
        }
        shares.retain(|_, shares| shares.len() >= SHARES_MIN);
        shares.into_iter().map(|(key, shares)| (key, median(shares))).collect()
    }

    /// Readings of an element at the other presses near its own: how far away, and how much.
    fn near<'b>(
        &'b self,
        element: usize,
        pressed: &'b BTreeMap<usize, &[f32]>,
    ) -> impl Iterator<Item = ([usize; 2], f64)> + 'b {
        pressed.iter().filter(move |(other, _)| **other != element).filter_map(move |(&other, rises)| {
            let rows = (element / self.cols).abs_diff(other / self.cols);
            let cols = (element % self.cols).abs_diff(other % self.cols);
            (rows <= NEAR && cols <= NEAR).then(|| ([rows, cols], self.toward(rises, element)))
        })
    }

    /// The reading in the direction of a press: some sensors' readings fall when pressed.
    fn toward(&self, rises: &[f32], element: usize) -> f64 {
        rise(rises, element) * self.median_own.signum()
    }

    /// Least reading of a responsive element at its own press.
    fn least(&self) -> f64 {
        DEAD_SHARE * self.median_own.abs()
    }

    fn verdict(&self, element: usize) -> OwnPress {
        // The deepest shows most.
        let of_element = || self.by_depth.iter().rev().filter(|(_, pressed)| pressed.contains_key(&element));
        let Some((_, deepest)) = of_element().next() else { return OwnPress::Untold };
        let own_of = |pressed: &BTreeMap<usize, &[f32]>| {
            pressed.get(&element).map_or(0.0, |rises| self.toward(rises, element))
        };
        let mut is_told = false;
        for (&depth, pressed) in of_element() {
            let own = own_of(pressed);
            let at = |(&other, rises): (&usize, &&[f32])| (other, self.toward(rises, element));
            let most = pressed.iter().map(at).max_by(|a, b| a.1.total_cmp(&b.1));
            if let Some((other, reading)) = most
                && reading >= self.least()
                && own < OWN_SHARE * reading
            {
                return OwnPress::Not(RespondsTo::Element([other / self.cols, other % self.cols]));
            }
            if own < self.least() {
                continue;
            }
            for (apart, reading) in self.near(element, pressed) {
                let Some(share) = self.shares.get(&(depth, apart)) else { continue };
                is_told = true;
                if reading / own > f64::midpoint(1.0, *share) {
                    return OwnPress::Not(RespondsTo::Elsewhere);
                }
            }
        }
        if own_of(deepest) < self.least() {
            return OwnPress::Not(RespondsTo::Nothing);
        }
        if is_told { OwnPress::Responds } else { OwnPress::Untold }
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

fn rise(rises: &[f32], element: usize) -> f64 {
    rises.get(element).map_or(0.0, |rise| f64::from(*rise))
}

fn mean(curves: &[ElementCurve]) -> Vec<[f64; 2]> {
    let mut by_depth: BTreeMap<i64, Vec<f64>> = BTreeMap::new();
    for [depth_mm, rise] in curves.iter().flat_map(|curve| &curve.points) {
        by_depth.entry(key_of_mm(*depth_mm)).or_default().push(*rise);
    }
    by_depth
        .into_iter()
        .filter(|(_, rises)| 2 * rises.len() >= curves.len())
        .map(|(depth, rises)| [depth as f64 * 1e-3, rises.iter().sum::<f64>() / rises.len() as f64])
        .collect()
}

#[cfg(test)]
#[path = "response_tests.rs"]
mod tests;
