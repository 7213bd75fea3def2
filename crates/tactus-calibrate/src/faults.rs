//! Faulty elements, found from what they read and when.
//!
//! | fault | evidence |
//! |---|---|
//! | stuck | one and the same reading in every frame, while others have noise |
//! | noisy | a standard deviation at rest several times the median element's |
//! | cross-wired | press by press, its readings follow the prediction for another element, not its own |
//! | dead | its rises do not grow with its predicted indentation, while the others' do |
//!
//! The prediction is the base model's equivalent indentation. An element is judged only if a press came near enough.
//! The others are listed, so that an element without a fault is not mistaken for one that was tested.
//!
//! A dead element is judged by the slope of its rises `r` against its predicted indentations `p`, over the `n` presses that
//! it should feel:
//!
//! ```text
//! g = sum p r / sum p^2        se^2 = sum (r - g p)^2 / (n - 1) / sum p^2
//! ```
//!
//! It is dead if `|g| + 3 se` is below a twentieth of the median slope of the elements that respond. The greatest rise of many
//! presses would not do: it grows with their number, also in noise. The error comes from the scatter between presses, because
//! the noise within a press may be correlated.
//!
//! # Source
//! Paper, Sec. 2.2: two elements "responded to a stimulus of one adjacent element, but not to the element itself".

use serde::Serialize;
use tactus_model::{Contact, Covering};

use crate::{
    order::median,
    placement::{Declared, across, goes_across},
    places::distinct_places,
    readings::Readings,
    registration::SensorPose,
};

/// An element is noisy if its noise is more than this many times the median.
const NOISY: f64 = 3.0;
/// Frames at rest needed to estimate noise.
const FRAMES_LEAST: u64 = 30;
/// An element counts as pressed if its predicted indentation is this share of that from a press at its centre.
const PRESSED: f64 = 0.85;
/// An element should feel a press if its predicted indentation is this share of that from the same press at its centre.
const FELT: f64 = 0.3;
/// Presses needed for a slope.
const SLOPE_PRESSES_LEAST: usize = 3;
/// A dead element's slope is less than this share of the median of those that respond.
const DEAD_SHARE: f64 = 0.05;
/// Standard errors by which a slope must be on one side of a limit.
const CERTAIN_Z: f64 = 3.0;
/// An element responds if its slope is more than this many standard errors. If less than a tenth do, none is judged.
const FELT_Z: f64 = 5.0;
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
        match trials.health(element) {
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
    /// Predicted indentation by press and element, in mm.
    predicted_mm: Vec<Vec<f64>>,
    /// Predicted indentation of an element with the same press at its centre, by press, in mm.
    centred_mm: Vec<f64>,
    /// Measured rise by press and element, in counts.
    rises: Vec<Vec<f64>>,
    places_mm: Vec<[f64; 2]>,
    /// Greatest predicted indentation of each element, as a share of that from the same press at its centre.
    reach: Vec<f64>,
    /// Median slope of the elements that respond; `None` if hardly any does.
    typical_counts_per_mm: Option<f64>,
    /// True if the presses go across the sensor: in one patch all elements rise and fall alike.
    across: bool,
}

/// Rises of an element against predicted indentations, through the origin.
#[derive(Debug, Clone, Copy)]
struct Slope {
    counts_per_mm: f64,
    /// From the scatter between presses.
    standard_error: f64,
    presses: usize,
}

enum ElementHealth {
    Unknown,
    Sound,
    Faulty(FaultKind, String),
}

impl Trials {
    fn of(declared: &Declared, readings: &Readings, place: &SensorPose) -> Self {
        let mut trials = Self {
            predicted_mm: Vec::new(),
            centred_mm: Vec::new(),
            rises: Vec::new(),
            places_mm: Vec::new(),
            reach: vec![0.0; readings.elements],
            typical_counts_per_mm: None,
            across: false,
        };
        let Ok(model) = declared.unit_model(place.sigma_mm) else { return trials };
        let centre_mm = declared.array().centre_mm(0).unwrap_or_default();
        let mut centred_mm = vec![0.0; readings.elements];
        for press in across(declared, readings) {
            let Some((dwell, indenter)) = press.deepest().zip(declared.indenter(press)) else { continue };
            if press.rest.is_none() {
                continue;
            }
            let contact = place.placement.contact(press, dwell, indenter);
            let mut predicted_mm = vec![0.0; readings.elements];
            let covering = Covering { thickness_mm: press.covering_mm };
            model.indentation(&contact, covering, &mut predicted_mm);
            let centred = Contact { position_mm: centre_mm, ..contact };
            model.indentation(&centred, covering, &mut centred_mm);
            if centred_mm[0] > 0.0 {
                for (reach, predicted_mm) in trials.reach.iter_mut().zip(&predicted_mm) {
                    *reach = reach.max(predicted_mm / centred_mm[0]);
                }
            }
            let rises =
                (0..readings.elements).filter_map(|element| press.rise(dwell, element)).map(|[rise, _]| rise);
            trials.rises.push(rises.collect());
            trials.predicted_mm.push(predicted_mm);
            trials.centred_mm.push(centred_mm[0]);
            trials.places_mm.push(press.place_mm);
        }
        trials.typical_counts_per_mm = trials.typical_counts_per_mm();
        trials.across = goes_across(declared, across(declared, readings).into_iter());
        trials
    }

    fn typical_counts_per_mm(&self) -> Option<f64> {
        let pressed = (0..self.reach.len()).filter(|element| self.reach[*element] >= PRESSED);
        let slopes: Vec<Slope> = pressed.filter_map(|element| self.slope(element, element)).collect();
        let sizes = slopes.iter().map(|slope| (slope.counts_per_mm.abs(), slope.standard_error));
        let felt = sizes.filter(|(size, standard_error)| *size > FELT_Z * standard_error);
        let felt: Vec<f64> = felt.map(|(size, _)| size).collect();
        median(felt.iter().copied()).filter(|_| 10 * felt.len() >= slopes.len())
    }

    fn health(&self, element: usize) -> ElementHealth {
        // If no element rises, the presses are too light to judge by, or every element is dead.
        let Some(typical) = self.typical_counts_per_mm.filter(|_| self.reach[element] >= PRESSED) else {
            return ElementHealth::Unknown;
        };
        let Some(slope) = self.slope(element, element) else { return ElementHealth::Unknown };
        // First, because an element that gives a distant one's signal does not feel presses on itself either.
        if let Some(fault) = self.cross_wired(element, typical) {
            return fault;
        }
        let Slope { counts_per_mm, standard_error, presses } = slope;
        if counts_per_mm.abs() + CERTAIN_Z * standard_error < DEAD_SHARE * typical {
            let evidence = format!(
                "rises by {counts_per_mm:.1} +- {standard_error:.1} counts per mm of predicted indentation over {presses} presses, \
                 where the median element rises by {typical:.0}"
            );
            return ElementHealth::Faulty(FaultKind::Dead, evidence);
        }
        ElementHealth::Sound
    }

    /// The fault of an element whose readings follow the prediction for another element.
    fn cross_wired(&self, element: usize, typical_counts_per_mm: f64) -> Option<ElementHealth> {
        if !self.across || distinct(&self.places_mm) < WIRING_PLACES_LEAST {
            return None;
        }
        let own = self.likeness(element, element);
        let (other, likeness) = (0..self.reach.len())
            .map(|other| (other, self.likeness(element, other)))
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        let is_liker = other != element && likeness > own + STRANGER && 1.0 - likeness < (1.0 - own) / 4.0;
        // The likeness must come from a signal, not from noise.
        let rises = |slope: Slope| {
            slope.counts_per_mm.abs() - CERTAIN_Z * slope.standard_error > DEAD_SHARE * typical_counts_per_mm
        };
        (is_liker && self.slope(element, other).is_some_and(rises)).then(|| {
            let evidence = format!(
                "over {} presses its readings follow the prediction for element {other} (cosine {likeness:.4}), not its own \
                 ({own:.4})",
                self.rises.len()
            );
            ElementHealth::Faulty(FaultKind::CrossWired { answers_for: other }, evidence)
        })
    }

    /// Slope of an element's rises against the predicted indentations of another or of itself, over the presses that the
    /// latter should feel; `None` if they are too few.
    fn slope(&self, element: usize, other: usize) -> Option<Slope> {
        let felt = || {
            let presses = self.predicted_mm.iter().zip(&self.centred_mm).zip(&self.rises);
            presses
                .map(|((predicted_mm, centred_mm), rises)| (predicted_mm[other], *centred_mm, rises[element]))
                .filter(|(predicted_mm, centred_mm, _)| {
                    *predicted_mm > 0.0 && *predicted_mm >= FELT * centred_mm
                })
        };
        let presses = felt().count();
        let squares: f64 = felt().map(|(predicted_mm, ..)| predicted_mm * predicted_mm).sum();
        let counts_per_mm = felt().map(|(predicted_mm, _, rise)| predicted_mm * rise).sum::<f64>() / squares;
        let residuals = felt().map(|(predicted_mm, _, rise)| rise - counts_per_mm * predicted_mm);
        let scatter = residuals.map(|residual| residual * residual).sum::<f64>() / (presses as f64 - 1.0);
        (presses >= SLOPE_PRESSES_LEAST).then(|| Slope {
            counts_per_mm,
            standard_error: (scatter / squares).sqrt(),
            presses,
        })
    }

    /// Cosine between the readings of one element and the prediction for another, whatever the sign of the sensitivity.
    fn likeness(&self, element: usize, other: usize) -> f64 {
        let (mut both, mut read, mut predicted) = (0.0, 0.0, 0.0);
        for (rises, predictions) in self.rises.iter().zip(&self.predicted_mm) {
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
