//! Faulty elements, found from what they read and when.
//!
//! | fault | evidence |
//! |---|---|
//! | stuck | one and the same reading in every frame, while others have noise |
//! | noisy | a standard deviation at rest several times the median element's |
//! | cross-wired | press by press, its readings follow the prediction for another element, not its own |
//! | dead | pressed as hard as the others, it does not rise above its noise |
//!
//! The prediction is the base model's equivalent indentation. An element is judged only if a press came near enough.
//! The others are listed, so that an element without a fault is not mistaken for one that was tested.
//!
//! # Source
//! Paper, Sec. 2.2: two elements "responded to a stimulus of one adjacent element, but not to the element itself".

use serde::Serialize;
use tactus_model::{Contact, Covering};

use crate::{
    order::{median, quantile},
    placement::{Declared, across, goes_across},
    readings::{Readings, distinct_places},
    registration::SensorPose,
};

/// An element is noisy if its noise is more than this many times the median.
const NOISY: f64 = 3.0;
/// Frames at rest needed to estimate noise.
const FRAMES_LEAST: u64 = 30;
/// An element counts as pressed if its predicted indentation is this share of that from a press at its centre.
const PRESSED: f64 = 0.85;
/// A dead element rises less than this share of the stronger elements, and less than this many standard deviations.
const DEAD: [f64; 2] = [0.02, 8.0];
/// Likeness is the cosine between readings and prediction; another element's must exceed the element's own by this.
const STRANGER: f64 = 0.02;
/// Distinct places needed to tell which element's signal an element gives.
pub(crate) const WIRING_PLACES_LEAST: usize = 4;

/// What is wrong with an element.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FaultyElement {
    /// Its row-major index.
    pub element: usize,
    /// Class of the fault.
    pub kind: FaultKind,
    /// The numbers that show it, in a sentence.
    pub evidence: String,
}

/// Kinds of faults.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum FaultKind {
    /// It responds to no press.
    Dead,
    /// It always reads the same.
    Stuck {
        /// The constant reading.
        counts: f64,
    },
    /// It gives another element's signal.
    CrossWired {
        /// Index of the other element.
        answers_for: usize,
    },
    /// Its noise is far above the others'.
    Noisy {
        /// Its standard deviation at rest.
        rms_counts: f64,
    },
}

/// The result of judging every element.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Health {
    /// Faulty elements, by index.
    pub faults: Vec<FaultyElement>,
    /// Elements that no press came near enough to: nothing is known about their response.
    pub not_judged: Vec<usize>,
}

impl Health {
    /// The element whose signal a cross-wired one gives.
    pub(crate) fn answers_for(&self, element: usize) -> Option<usize> {
        self.faults.iter().find_map(|fault| match fault.kind {
            FaultKind::CrossWired { answers_for } if fault.element == element => Some(answers_for),
            FaultKind::CrossWired { .. }
            | FaultKind::Dead
            | FaultKind::Stuck { .. }
            | FaultKind::Noisy { .. } => None,
        })
    }

    /// For each element, true if it was judged and has no fault.
    pub(crate) fn sound(&self, elements: usize) -> Vec<bool> {
        let faulty = |element: usize| self.faults.iter().any(|fault| fault.element == element);
        (0..elements).map(|element| !faulty(element) && !self.not_judged.contains(&element)).collect()
    }
}

/// Judges every element.
pub(crate) fn examine(declared: &Declared, readings: &Readings, place: &SensorPose) -> Health {
    let trials = Trials::of(declared, readings, place);
    // Elements that never change would make the others look noisy.
    let varying = readings.noise_rms_counts.iter().zip(&readings.constant_counts);
    let varying = varying.filter(|(_, constant)| constant.is_none()).filter_map(|(noise, _)| *noise);
    let typical_noise = median(varying).unwrap_or(0.0);
    let (mut faults, mut not_judged) = (Vec::new(), Vec::new());
    for element in 0..readings.elements {
        let fault = |kind, evidence| FaultyElement { element, kind, evidence };
        if let Some(counts) = stuck(readings, element, typical_noise) {
            let evidence = format!("reads {counts} in each of {} frames", readings.frames);
            faults.push(fault(FaultKind::Stuck { counts: f64::from(counts) }, evidence));
            continue;
        }
        let noise = readings.noise_rms_counts[element].unwrap_or(0.0);
        if readings.frames_at_rest >= FRAMES_LEAST && noise > NOISY * typical_noise {
            let evidence = format!(
                "{noise:.1} counts rms at rest over {} frames, where the median element has {typical_noise:.1}",
                readings.frames_at_rest
            );
            faults.push(fault(FaultKind::Noisy { rms_counts: noise }, evidence));
            continue;
        }
        match trials.health(element, noise) {
            ElementHealth::Unknown => not_judged.push(element),
            ElementHealth::Sound => {}
            ElementHealth::Faulty(kind, evidence) => faults.push(fault(kind, evidence)),
        }
    }
    Health { faults, not_judged }
}

fn stuck(readings: &Readings, element: usize, typical_noise: f64) -> Option<f32> {
    // Its noise is the rounding's. If the others have no more noise, a constant reading is no fault.
    let rounding = readings.noise_rms_counts[element].unwrap_or(0.0);
    readings.constant_counts[element]
        .filter(|_| typical_noise > 2.0 * rounding && readings.frames >= FRAMES_LEAST)
}

/// The deepest dwell of every press: predicted indentations and measured rises.
struct Trials {
    /// Predicted indentation by press and element.
    predicted: Vec<Vec<f64>>,
    /// Measured rise by press and element, in counts.
    rises: Vec<Vec<f64>>,
    /// Standard deviation of a rise in units of one frame's noise.
    spread: Vec<f64>,
    places_mm: Vec<[f64; 2]>,
    /// Greatest predicted indentation of each element, as a share of that from the same press at its centre.
    reach: Vec<f64>,
    /// 90th percentile of the rises of pressed elements, which dead ones hardly influence.
    strong_rise: f64,
    /// Greatest rise of any element in units of its standard deviation.
    clearest: f64,
    /// True if the presses go across the sensor: in one patch all elements rise and fall alike.
    across: bool,
}

enum ElementHealth {
    Unknown,
    Sound,
    Faulty(FaultKind, String),
}

impl Trials {
    fn of(declared: &Declared, readings: &Readings, place: &SensorPose) -> Self {
        let mut trials = Self {
            predicted: Vec::new(),
            rises: Vec::new(),
            spread: Vec::new(),
            places_mm: Vec::new(),
            reach: vec![0.0; readings.elements],
            strong_rise: 0.0,
            clearest: 0.0,
            across: false,
        };
        let Ok(model) = declared.unit_model(place.sigma_mm) else { return trials };
        let centre_mm = declared.array().centre_mm(0).unwrap_or_default();
        let mut at_centre = vec![0.0; readings.elements];
        for press in across(declared, readings) {
            let Some((dwell, indenter)) = press.deepest().zip(declared.indenter(press)) else { continue };
            let Some(variance) = press.rise(dwell, 0).map(|[_, variance]| variance) else { continue };
            let contact = place.placement.contact(press, dwell, indenter);
            let mut predicted = vec![0.0; readings.elements];
            let covering = Covering { thickness_mm: press.covering_mm };
            model.indentation(&contact, covering, &mut predicted);
            let centred = Contact { position_mm: centre_mm, ..contact };
            model.indentation(&centred, covering, &mut at_centre);
            if at_centre[0] > 0.0 {
                for (reach, predicted) in trials.reach.iter_mut().zip(&predicted) {
                    *reach = reach.max(predicted / at_centre[0]);
                }
            }
            let rises =
                (0..readings.elements).filter_map(|element| press.rise(dwell, element)).map(|[rise, _]| rise);
            trials.rises.push(rises.collect());
            trials.predicted.push(predicted);
            trials.spread.push(variance.sqrt());
            trials.places_mm.push(press.place_mm);
        }
        let pressed: Vec<usize> =
            (0..readings.elements).filter(|element| trials.reach[*element] >= PRESSED).collect();
        trials.strong_rise =
            quantile(pressed.iter().map(|element| trials.greatest(*element)[0]), 0.9).unwrap_or(0.0);
        let clear = |element: &usize| {
            let noise = readings.noise_rms_counts[*element].unwrap_or(f64::INFINITY);
            let [rise, spread] = trials.greatest(*element);
            rise / (noise * spread)
        };
        trials.clearest = pressed.iter().map(clear).fold(0.0, f64::max);
        trials.across = goes_across(declared, across(declared, readings).into_iter());
        trials
    }

    fn health(&self, element: usize, noise: f64) -> ElementHealth {
        let [share, deviations] = DEAD;
        // If no element rises, the presses are too light to judge by, or every element is dead.
        if self.reach[element] < PRESSED || self.clearest < deviations {
            return ElementHealth::Unknown;
        }
        let [rise, spread] = self.greatest(element);
        if rise < share * self.strong_rise && rise < deviations * noise * spread {
            let evidence = format!(
                "rose by {rise:.1} counts at most under presses that raised others by {:.0}",
                self.strong_rise
            );
            return ElementHealth::Faulty(FaultKind::Dead, evidence);
        }
        if !self.across || distinct(&self.places_mm) < WIRING_PLACES_LEAST {
            return ElementHealth::Sound;
        }
        let own = self.likeness(element, element);
        let best = (0..self.reach.len())
            .map(|other| (other, self.likeness(element, other)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        match best {
            // The other element's likeness must come from a signal, not from noise.
            Some((other, likeness))
                if other != element && likeness > own + STRANGER && 1.0 - likeness < (1.0 - own) / 4.0 =>
            {
                let evidence = format!(
                    "over {} presses its readings follow the prediction for element {other} (cosine {likeness:.4}), not its own \
                     ({own:.4})",
                    self.rises.len()
                );
                ElementHealth::Faulty(FaultKind::CrossWired { answers_for: other }, evidence)
            }
            _ => ElementHealth::Sound,
        }
    }

    /// Greatest rise of an element, either way, and its standard deviation in units of a frame's noise.
    fn greatest(&self, element: usize) -> [f64; 2] {
        let rises =
            self.rises.iter().zip(&self.spread).map(|(rises, spread)| [rises[element].abs(), *spread]);
        rises.max_by(|a, b| a[0].total_cmp(&b[0])).unwrap_or([0.0, 1.0])
    }

    /// Cosine between the readings of one element and the prediction for another, whatever the sign of the sensitivity.
    fn likeness(&self, element: usize, other: usize) -> f64 {
        let (mut both, mut read, mut predicted) = (0.0, 0.0, 0.0);
        for (rises, predictions) in self.rises.iter().zip(&self.predicted) {
            both += rises[element] * predictions[other];
            read += rises[element] * rises[element];
            predicted += predictions[other] * predictions[other];
        }
        if read > 0.0 && predicted > 0.0 { (both / (read * predicted).sqrt()).abs() } else { 0.0 }
    }
}

fn distinct(places_mm: &[[f64; 2]]) -> usize {
    distinct_places(places_mm.iter().copied()).len()
}

#[cfg(test)]
#[path = "faults_tests.rs"]
mod tests;
