//! How each element responds to presses at its own centre (paper, Sec. 2.2 and Fig. 2).
//!
//! The rise of element `e` over its rest, in a press near its centre, is fitted as
//!
//! ```text
//! linear            s_e u
//! shared quadratic  s_e (u + k u^2)          one k for all elements
//! own quadratic     s_e (u + k_e u^2)
//! ```
//!
//! over the equivalent indentation `u` of the press: its depth below the fitted surface, times the base model's factor for
//! its distance from the centre (near 1). All dwells of a press share one reading at rest; the weights account for this
//! common error.
//!
//! Held-out dwells decide between the three forms: each fifth is predicted from the others, and a form with more
//! parameters must beat the previous best by two standard errors over the elements.

mod fit;

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use serde::Serialize;
use tactus_model::Covering;

use crate::{
    Estimate, Health,
    placement::Declared,
    readings::{MeasuredPress, Readings},
    registration::SensorPose,
};

use fit::{CentrePress, FittedForm, HeldOutError, fit, heldout};

/// A press counts as one at an element's centre if its predicted indentation is this share of that at the centre.
const NEAR: f64 = 0.9;
/// From this many elements on, the scatter of the gain is taken between elements, else between dwells.
const ELEMENTS_LEAST: usize = 5;
/// Presses with at least this many dwells are preferred to others.
const DWELLS_LEAST: usize = 3;
/// A response begins flat if its slope is fewer standard errors than this, or its curvature at the deepest press
/// has more than this many times the share of the slope.
const FLAT_ERRORS: f64 = 5.0;
const FLAT_CURVATURE: f64 = 3.0;
/// Step of the numeric derivatives by the sensor's pose, in mm or degrees.
const STEP: f64 = 1e-4;

/// A form of the response.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ResponseForm {
    /// `s_e u`.
    Linear,
    /// `s_e (u + k u^2)`.
    SharedQuadratic,
    /// `s_e (u + k_e u^2)`.
    OwnQuadratic,
}

impl ResponseForm {
    /// Every form, from few parameters to many.
    pub const ALL: [Self; 3] = [Self::Linear, Self::SharedQuadratic, Self::OwnQuadratic];

    /// Its name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::SharedQuadratic => "quadratic, one curvature",
            Self::OwnQuadratic => "quadratic, own curvatures",
        }
    }
}

/// The elements' responses.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ResponseFit {
    /// The selected form.
    pub form: ResponseForm,
    /// The residuals of each form that could be fitted.
    pub trials: Vec<Trial>,
    /// The common curvature `k` of the shared quadratic, in 1/mm, if there is such a fit.
    pub shared_quadratic_per_mm: Option<Estimate>,
    /// Root mean square of the residuals of the selected form in units of the noise: 1 if the form holds.
    pub residual_in_noise: f64,
    /// Mean of the elements' sensitivities. The errors that all elements share, of the sensor's surface, pose and common curvature,
    /// do not average out: they are the greater part of its error.
    pub mean_sensitivity_counts_per_mm: Estimate,
    /// The elements' responses by index, without faulty elements and those without a press at their centre.
    pub elements: Vec<ElementResponse>,
    /// Responses of the cross-wired elements, from presses at the centres of the elements whose signals they give. No other
    /// fit uses them.
    pub cross_wired: Vec<ElementResponse>,
}

/// The residuals of one form.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Trial {
    /// The form that was fitted.
    pub form: ResponseForm,
    /// Root mean square of the residuals, in counts.
    pub rms_counts: f64,
    /// The same on dwells that took no part in the fit; `None` if there are too few dwells to hold any out.
    pub heldout_rms_counts: Option<f64>,
}

/// One element's response.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ElementResponse {
    /// Row-major index of the element.
    pub element: usize,
    /// Equivalent indentation in mm and rise in counts of each dwell.
    pub points: Vec<[f64; 2]>,
    /// `s_e` of the linear form, in counts per mm.
    pub linear_counts_per_mm: Estimate,
    /// `s_e` and `k_e` of the form with own curvatures, in counts per mm and 1/mm, if there is such a fit.
    pub quadratic: Option<[Estimate; 2]>,
    /// `s_e` of the selected form; its error includes those of the sensor's pose and surface.
    pub sensitivity_counts_per_mm: Estimate,
    /// The sensitivity minus the mean of all elements; its error is without what they share. `None` of cross-wired elements.
    pub above_mean_counts_per_mm: Option<Estimate>,
    /// `k` of the selected form; 0 if it is linear.
    pub quadratic_per_mm: Estimate,
}

impl ElementResponse {
    /// True if the slope at the surface cannot be distinguished from 0, or the curvature soon dominates it: then the two numbers are
    /// meaningful only together.
    pub fn begins_flat(&self) -> bool {
        let deepest_mm = self.points.iter().map(|[u_mm, _]| u_mm.abs()).fold(0.0, f64::max);
        let sensitivity = self.sensitivity_counts_per_mm;
        sensitivity.value.abs() < FLAT_ERRORS * sensitivity.standard_error
            || (self.quadratic_per_mm.value * deepest_mm).abs() > FLAT_CURVATURE
    }

    /// The indentation `u` that gives a rise in counts: the inverse response. `None` beyond its turning point.
    pub fn indentation_mm(&self, rise_counts: f64) -> Option<f64> {
        inverted(rise_counts / self.sensitivity_counts_per_mm.value, self.quadratic_per_mm.value)
    }
}

/// `u` of `linear = u + k u^2`; the root that goes to `linear` as `k` goes to 0.
pub(crate) fn inverted(linear_mm: f64, quadratic_per_mm: f64) -> Option<f64> {
    let square = 1.0 + 4.0 * quadratic_per_mm * linear_mm;
    (square > 0.0).then(|| 2.0 * linear_mm / (1.0 + square.sqrt()))
}

/// The responses with their errors, as later steps use them.
#[derive(Debug, Clone)]
pub(crate) struct Gains {
    /// The elements, and `s` and `k` of each.
    pub(crate) elements: Vec<(usize, [f64; 2])>,
    /// Covariance of all `s`, then all `k`, for a known pose of the sensor.
    pub(crate) own: DMatrix<f64>,
    /// Their derivatives by the uncertain parameters of the sensor's pose.
    pub(crate) by_place: DMatrix<f64>,
}

/// Fits the responses; the error is a sentence that says what is missing.
pub(crate) fn respond(
    declared: &Declared,
    readings: &Readings,
    health: &Health,
    place: &SensorPose,
) -> Result<(ResponseFit, Gains), String> {
    let sound = health.sound(readings.elements);
    let own = |element: usize| sound[element].then_some(element);
    // The presses are selected once, so that the small steps of the derivatives cannot change the selection.
    let groups = |moved: &SensorPose| groups(declared, readings, own, [place, moved]);
    let here = groups(place);
    if here.is_empty() {
        return Err(
            "no sound element was pressed at its centre with the reference tool under the reference covering"
                .into(),
        );
    }
    let fits = ResponseForm::ALL.map(|form| fit(form, &here, |_, _| true));
    let linear = fits[0].as_ref().ok_or("the readings do not determine the responses")?;
    let [_, shared, own] = &fits;
    // If nothing can be held out, a curvature with its error is more informative than a straight line without one.
    let unheld = if shared.is_some() { ResponseForm::SharedQuadratic } else { ResponseForm::Linear };
    let heldout = ResponseForm::ALL.map(|form| heldout(form, &here));
    let form = chosen(&heldout).unwrap_or(unheld);
    let wanted = match form {
        ResponseForm::Linear => linear,
        ResponseForm::SharedQuadratic => shared.as_ref().unwrap_or(linear),
        ResponseForm::OwnQuadratic => own.as_ref().unwrap_or(linear),
    };
    let elements = wanted.elements.clone();
    // Errors of the sensor's pose move the responses.
    let by_place = |fitted: &FittedForm| {
        let column = |parameter: usize| {
            let moved = fit(fitted.form, &groups(&place.moved(parameter, STEP)), |_, _| true);
            let moved = moved.filter(|moved| moved.elements == elements).unwrap_or_else(|| fitted.clone());
            (moved.expanded() - fitted.expanded()) / STEP
        };
        DMatrix::from_columns(&(0..SensorPose::UNCERTAIN).map(column).collect::<Vec<_>>())
    };
    let moved_by = |by_place: &DMatrix<f64>| by_place * &place.covariance * by_place.transpose();
    let (own_covariance, by_place_wanted) = (wanted.expanded_covariance(), by_place(wanted));
    let covariance = &own_covariance + moved_by(&by_place_wanted);
    let count = elements.len();
    let mean = MeanSensitivity::of(wanted, &covariance);
    let responses = elements.iter().enumerate().map(|(index, element)| {
        let [s, k] = wanted.response(index);
        let of_element = here.iter().filter(|group| group.element == *element);
        ElementResponse {
            element: *element,
            points: of_element
                .flat_map(|group| group.points.iter().map(|point| [point.u_mm, point.rise_counts]))
                .collect(),
            linear_counts_per_mm: linear.sensitivity(index),
            quadratic: own.as_ref().map(|own| [own.sensitivity(index), own.curvature(index)]),
            sensitivity_counts_per_mm: Estimate::new(s, covariance[(index, index)]),
            above_mean_counts_per_mm: Some(mean.difference(index, s, covariance[(index, index)])),
            quadratic_per_mm: Estimate::new(k, covariance[(count + index, count + index)]),
        }
    });
    let trials = fits.iter().zip(&heldout).filter_map(|(fit, errors)| {
        let fit = fit.as_ref()?;
        Some(Trial {
            form: fit.form,
            rms_counts: fit.rms_counts(&here),
            heldout_rms_counts: errors.as_ref().map(|errors| rms(errors.iter().map(|error| error.counts))),
        })
    });
    let response = ResponseFit {
        form: wanted.form,
        trials: trials.collect(),
        shared_quadratic_per_mm: shared.as_ref().map(|shared| {
            let variance = if wanted.form == ResponseForm::SharedQuadratic {
                covariance[(count, count)]
            } else {
                (shared.expanded_covariance() + moved_by(&by_place(shared)))[(count, count)]
            };
            Estimate::new(shared.response(0)[1], variance)
        }),
        residual_in_noise: wanted.residual_in_noise(),
        mean_sensitivity_counts_per_mm: Estimate::new(mean.value, mean.variance),
        elements: responses.collect(),
        cross_wired: cross_wired(declared, readings, health, place, wanted),
    };
    let gains = Gains {
        elements: elements
            .iter()
            .enumerate()
            .map(|(index, element)| (*element, wanted.response(index)))
            .collect(),
        own: own_covariance,
        by_place: by_place_wanted,
    };
    Ok((response, gains))
}

/// The mean of all sensitivities.
struct MeanSensitivity {
    value: f64,
    variance: f64,
    /// Its covariance with each sensitivity.
    with_each: Vec<f64>,
}

impl MeanSensitivity {
    /// `covariance` is that of all `s`, then all `k`.
    fn of(fitted: &FittedForm, covariance: &DMatrix<f64>) -> Self {
        let count = fitted.elements.len();
        let value = (0..count).map(|index| fitted.response(index)[0]).sum::<f64>() / count as f64;
        let with = |index| (0..count).map(|other| covariance[(index, other)]).sum::<f64>() / count as f64;
        let with_each: Vec<f64> = (0..count).map(with).collect();
        Self { value, variance: with_each.iter().sum::<f64>() / count as f64, with_each }
    }

    /// The difference of one sensitivity to it.
    fn difference(&self, index: usize, value: f64, variance: f64) -> Estimate {
        Estimate::new(value - self.value, variance - 2.0 * self.with_each[index] + self.variance)
    }
}

/// Responses of the cross-wired elements, with the curvature of the sound ones.
fn cross_wired(
    declared: &Declared,
    readings: &Readings,
    health: &Health,
    place: &SensorPose,
    wanted: &FittedForm,
) -> Vec<ElementResponse> {
    let mut there = groups(declared, readings, |element| health.answers_for(element), [place, place]);
    let k = match wanted.form {
        ResponseForm::Linear => 0.0,
        ResponseForm::SharedQuadratic | ResponseForm::OwnQuadratic => wanted.typical_curvature(),
    };
    for point in there.iter_mut().flat_map(|group| &mut group.points) {
        point.u_mm += k * point.u_mm * point.u_mm;
    }
    let Some(fitted) = fit(ResponseForm::Linear, &there, |_, _| true) else { return Vec::new() };
    let responses = fitted.elements.iter().enumerate().map(|(index, element)| ElementResponse {
        element: *element,
        points: Vec::new(),
        linear_counts_per_mm: fitted.sensitivity(index),
        quadratic: None,
        sensitivity_counts_per_mm: fitted.sensitivity(index),
        above_mean_counts_per_mm: None,
        quadratic_per_mm: Estimate::new(k, 0.0),
    });
    responses.collect()
}

/// The form with the fewest parameters that no other beats on held-out dwells; `None` if no dwell can be held out.
fn chosen(heldout: &[Option<Vec<HeldOutError>>; 3]) -> Option<ResponseForm> {
    let mut best = ResponseForm::Linear;
    let mut best_errors = heldout[0].as_ref()?;
    for (form, errors) in ResponseForm::ALL.into_iter().zip(heldout).skip(1) {
        let Some(errors) = errors else { continue };
        let mut by_element: BTreeMap<usize, f64> = BTreeMap::new();
        let mut by_dwell = Vec::new();
        for (before, after) in best_errors.iter().zip(errors) {
            let gain = before.in_noise.powi(2) - after.in_noise.powi(2);
            *by_element.entry(before.element).or_default() += gain;
            by_dwell.push(gain);
        }
        // Errors of one element are correlated; but a few elements do not show the scatter between elements.
        let gains =
            if by_element.len() >= ELEMENTS_LEAST { by_element.into_values().collect() } else { by_dwell };
        let count = gains.len() as f64;
        let mean = gains.iter().sum::<f64>() / count;
        let variance = gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        if mean > 2.0 * (variance / count).sqrt() && mean > 0.0 {
            (best, best_errors) = (form, errors);
        }
    }
    Some(best)
}

/// The presses at the centres of elements. `signal_of` names the element whose signal an element gives, or `None` if it
/// takes no part. The presses are selected with the first pose of the sensor; indentations are predicted with the second.
fn groups(
    declared: &Declared,
    readings: &Readings,
    signal_of: impl Fn(usize) -> Option<usize>,
    [chosen_at, place]: [&SensorPose; 2],
) -> Vec<CentrePress> {
    let mut near: Vec<Vec<CentrePress>> = vec![Vec::new(); readings.elements];
    let Ok(model) = declared.unit_model(chosen_at.sigma_mm) else { return Vec::new() };
    let Ok(prediction_model) = declared.unit_model(place.sigma_mm) else { return Vec::new() };
    let centre_mm = declared.array().centre_mm(0).unwrap_or_default();
    let mut predicted = vec![0.0; readings.elements];
    let mut predicted_at_centre = predicted.clone();
    let trusted = |press: &&MeasuredPress| declared.is_reference(press) && chosen_at.admits(press);
    for press in readings.presses.iter().filter(trusted) {
        let (Some(indenter), Some(deepest)) = (declared.indenter(press), press.deepest()) else { continue };
        let covering = Covering { thickness_mm: press.covering_mm };
        let mut contact = chosen_at.placement.contact(press, deepest, indenter);
        model.indentation(&contact, covering, &mut predicted);
        contact.position_mm = centre_mm;
        model.indentation(&contact, covering, &mut predicted_at_centre);
        for (element, groups) in near.iter_mut().enumerate() {
            let (Some(signal), Some(noise)) = (signal_of(element), readings.noise_rms_counts[element]) else {
                continue;
            };
            if predicted[signal] > NEAR * predicted_at_centre[0] {
                groups.extend(CentrePress::of(
                    declared,
                    &prediction_model,
                    place,
                    press,
                    [element, signal],
                    noise,
                ));
            }
        }
    }
    for groups in &mut near {
        if groups.iter().any(|group| group.points.len() >= DWELLS_LEAST) {
            groups.retain(|group| group.points.len() >= DWELLS_LEAST);
        }
    }
    near.into_iter().flatten().collect()
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (squares, count) =
        values.fold((0.0, 0.0), |(squares, count), value| (squares + value * value, count + 1.0));
    if count > 0.0 { f64::sqrt(squares / count) } else { 0.0 }
}

#[cfg(test)]
#[path = "response_tests.rs"]
mod tests;
