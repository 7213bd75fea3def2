//! What calibration knows of faulty elements, before anything is fitted.
//!
//! | fault | weight in fits, tests and figures | in the model |
//! |---|---|---|
//! | dead, stuck | none | `miswired` with both shares at 0: it reads its baseline |
//! | noisy, also where frames repeat each other | none | nothing: it may respond |
//! | cross-wired | as every element's | `miswired` with the other's share at 1; both shares are fitted with the rest |
//!
//! These effects are in the base of the search, so that no other effect is taken to explain a fault. An element that a known
//! effect of the model rewires keeps that effect and gets no other.

use tactus_calibrate::{Declared, FaultKind, FaultyElement, ReadingsBuilder, health};
use tactus_model::effect::{Definition, ParameterKind};
use tactus_model::{Effect, ForwardModel};

use super::error::DiscoverError;
use super::frames::Frames;
use super::known::Known;
use super::noise::Noise;
use crate::numbers::median;

/// Name of the effect of a faulty element.
pub(crate) const MISWIRED: &str = "miswired";
/// An element is noisy if its noise is also more than this many times the median where frames repeat each other, or from frame to
/// frame. At rest alone, the decay after a press looks like noise.
const NOISY: f64 = 3.0;
/// One element in this many may be cross-wired. If more seem to be, something else is wrong.
const CROSS_WIRED_ONE_IN: usize = 10;
/// This many elements that all answer for the one a common step away are a sensor that lies elsewhere. Two are not: the paper's two
/// faulty elements answer for the next one each (Sec. 2.2).
const SHIFTED_LEAST: usize = 3;

/// The faulty elements, and what follows for a discovery.
#[derive(Debug, Clone, Default)]
pub(crate) struct Faulty {
    /// As calibration found them.
    pub(crate) elements: Vec<FaultyElement>,
    /// Dead and stuck elements.
    pub(crate) silent: Vec<usize>,
    /// Noisy elements.
    pub(crate) noisy: Vec<usize>,
    /// Effects for the base of the search.
    pub(crate) effects: Vec<Effect>,
    /// Why some are not taken for faulty.
    pub(crate) warning: Option<String>,
}

impl Faulty {
    /// Judges every element by its readings.
    pub(crate) fn of(known: &Known, frames: &Frames, noise: &Noise) -> Result<Self, DiscoverError> {
        let declared = Declared {
            model: ForwardModel::new(known.array.clone(), known.psf, known.response.clone())?,
            registration: known.registration,
            indenters: known.indenters.clone(),
        };
        let mut readings = ReadingsBuilder::new(&known.array);
        for row in frames.rows() {
            readings.take(row);
        }
        let mut faults = health(&declared, &readings.finish())?.faults;
        faults.retain(|one| {
            let is_noisy = noise.by_element_counts[one.element] > NOISY * noise.rms_counts;
            is_noisy || !matches!(one.kind, FaultKind::Noisy { .. })
        });
        Self::judged(known, faults)
    }

    /// What follows from calibration's judgement.
    fn judged(known: &Known, mut elements: Vec<FaultyElement>) -> Result<Self, DiscoverError> {
        let warning = not_cross_wired(&elements, known.array.cols(), known.array.elements());
        if warning.is_some() {
            elements.retain(|one| !matches!(one.kind, FaultKind::CrossWired { .. }));
        }
        let mut faulty = Self { warning, ..Self::default() };
        for FaultyElement { element, kind, .. } in &elements {
            let (answers_for, other_share) = match kind {
                FaultKind::Noisy { .. } => {
                    faulty.noisy.push(*element);
                    continue;
                }
                FaultKind::Dead | FaultKind::Stuck { .. } => {
                    faulty.silent.push(*element);
                    (*element, 0.0)
                }
                FaultKind::CrossWired { answers_for } => (*answers_for, 1.0),
            };
            let rewires = |effect: &Effect| {
                rewired(effect.definition(), effect.parameters().map(|(_, value)| value)) == Some(*element)
            };
            if !known.effects.iter().any(rewires) {
                let parameters = [
                    ("element", *element as f64),
                    ("answers_for", answers_for as f64),
                    ("own_share", 0.0),
                    ("other_share", other_share),
                ];
                faulty.effects.push(Effect::new(MISWIRED, parameters)?);
            }
        }
        faulty.elements = elements;
        Ok(faulty)
    }

    /// True if an element has no weight.
    pub(crate) fn is_weightless(&self, element: usize) -> bool {
        self.silent.contains(&element) || self.noisy.contains(&element)
    }
}

/// Why elements that seem cross-wired are not; `None` if they are, or if there are none.
fn not_cross_wired(elements: &[FaultyElement], cols: usize, all: usize) -> Option<String> {
    let place = |element: usize| [element / cols, element % cols].map(usize::cast_signed);
    let step = |one: &FaultyElement| match one.kind {
        FaultKind::CrossWired { answers_for } => {
            let ([row, col], [to_row, to_col]) = (place(one.element), place(answers_for));
            Some([to_row - row, to_col - col])
        }
        FaultKind::Dead | FaultKind::Stuck { .. } | FaultKind::Noisy { .. } => None,
    };
    let steps: Vec<[isize; 2]> = elements.iter().filter_map(step).collect();
    let count = steps.len();
    let shifted = count >= SHIFTED_LEAST && steps.windows(2).all(|pair| pair[0] == pair[1]);
    if CROSS_WIRED_ONE_IN * count <= all && !shifted {
        return None;
    }
    let how = if shifted { "all for the one the same step away" } else { "more than one in ten" };
    Some(format!(
        "{count} elements seem to answer for others, {how}: more likely the sensor lies elsewhere than declared. They are not taken \
         for faulty; check the registration."
    ))
}

impl Noise {
    /// The same with infinite noise of some elements, so that they have no weight, and the median of the others.
    pub(crate) fn without(mut self, is_left_out: impl Fn(usize) -> bool) -> Self {
        for (element, rms_counts) in self.by_element_counts.iter_mut().enumerate() {
            if is_left_out(element) {
                *rms_counts = f64::INFINITY;
            }
        }
        let finite: Vec<f64> =
            self.by_element_counts.iter().copied().filter(|rms_counts| rms_counts.is_finite()).collect();
        self.rms_counts = median(&finite);
        self
    }
}

/// The element whose signal an effect with these values of its parameters replaces, if it is an effect of that kind.
pub(crate) fn rewired(definition: &Definition, values: impl Iterator<Item = f64>) -> Option<usize> {
    let mut parameters = definition.parameters.iter().zip(values);
    let (_, element) = parameters.find(|(known, _)| known.kind == ParameterKind::Element)?;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index of the array")]
    let element = element as usize;
    Some(element)
}

#[cfg(test)]
#[path = "faulty_tests.rs"]
mod tests;
