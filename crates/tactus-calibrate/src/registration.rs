//! Where the sensor lies: rotation, translation and the height of its surface, from presses at places apart.
//!
//! The rise of element `e` in a press at `p` with the tip at height `z` is predicted as
//!
//! ```text
//! s_e (v + k v^2)      v = u_e(p_sensor, depth, sigma)      p_sensor = Rot(-rotation) (p - origin) / scale
//!                      depth = surface - z
//! ```
//!
//! with `u_e` the equivalent indentation of the base model. All of it is fitted at once by weighted least squares:
//! origin, rotation, surface, the spread of the covering in place, one curvature `k` for all, and a sensitivity for
//! each element; so neither unequal elements nor a wrong spread move the result. The scale is fixed at 1 in this
//! fit. A second fit, which frees it, is a check: the scale should be 1.
//!
//! # Source
//! Paper, Sec. 2.1: two points near opposite corners, at which a light press excites an element's neighbours equally, give
//! orientation and position; the surface is measured at one point.

use nalgebra::DMatrix;
use serde::Serialize;
use tactus_model::{Covering, ForwardModel, Gradient, Registration};

use crate::{
    Estimate,
    least_squares::{Fit, Normal, Observation, minimise},
    order::median,
    placement::{Declared, Placement, across, goes_across},
    places::distinct_places,
    readings::{Dwell, MeasuredPress, Readings, number_of},
};

/// Distinct places needed to fit the sensor's pose.
const PLACES_LEAST: usize = 4;
/// If residuals exceed this many times the noise, presses in one patch do not determine the sensor's pose.
const PATCH_MISFIT: f64 = 3.0;
/// An element takes part if it rose by more than this many standard deviations of its noise.
const RISE_LEAST: f64 = 20.0;
/// A press is left out if its misfit exceeds this many times the median press's.
const OUTLYING: f64 = 6.0;

/// Parameters before the elements' sensitivities.
const SHARED: usize = 7;
const X: usize = 0;
const Y: usize = 1;
const ROTATION: usize = 2;
const SCALE: usize = 3;
const SURFACE: usize = 4;
const SIGMA: usize = 5;
const CURVATURE: usize = 6;

/// Where the sensor lies in the robot's frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RegistrationFit {
    /// The sensor frame's origin, in mm.
    pub origin_mm: [Estimate; 2],
    /// Angle from the robot's x axis to the sensor's; not estimated where the places lie too close together.
    pub rotation_deg: Option<Estimate>,
    /// Height of the covering's surface; not estimated where fewer than three depths were pressed.
    pub surface_mm: Option<Estimate>,
    /// Distances in the robot's frame over those declared for the sensor.
    pub scale: Option<Estimate>,
    /// Spread under the covering in place, fitted to the same presses.
    pub sigma_mm: Estimate,
    /// Thickness of the covering in place.
    pub covering_mm: f64,
    /// Ids of the runs used.
    pub runs: Vec<String>,
    /// Number of presses used.
    pub presses: usize,
    /// Outlying presses that were left out: id of the run, index of the press.
    pub left_out: Vec<(String, i32)>,
    /// Root mean square of the residuals in units of the noise: 1 if the model holds.
    pub residual_in_noise: f64,
}

impl RegistrationFit {
    /// Where the sensor lies, with the declared rotation where none was estimated.
    pub fn registration(&self, declared: Registration) -> Registration {
        Registration {
            origin_mm: self.origin_mm.map(|along| along.value),
            rotation_deg: self.rotation_deg.map_or(declared.rotation_deg, |angle| angle.value),
        }
    }
}

/// The sensor's pose in the robot's frame with its errors, as later steps use it.
#[derive(Debug, Clone)]
pub(crate) struct SensorPose {
    pub(crate) placement: Placement,
    pub(crate) sigma_mm: f64,
    /// Outlying presses: index of the run, index in it.
    pub(crate) contradicting: Vec<(usize, i32)>,
    /// Covariance of origin x, origin y, rotation in degrees, surface, sigma.
    pub(crate) covariance: DMatrix<f64>,
}

impl SensorPose {
    /// As declared, without errors.
    pub(crate) fn declared(declared: &Declared, covering_mm: f64) -> Self {
        let covariance = DMatrix::zeros(Self::UNCERTAIN, Self::UNCERTAIN);
        Self {
            placement: declared.placement(),
            sigma_mm: declared.sigma_mm(covering_mm),
            contradicting: Vec::new(),
            covariance,
        }
    }

    /// Number of its uncertain parameters.
    pub(crate) const UNCERTAIN: usize = 5;

    /// True if the press is no outlier.
    pub(crate) fn admits(&self, press: &MeasuredPress) -> bool {
        !self.contradicting.contains(&(press.run, press.index))
    }

    /// The same with one of its uncertain parameters moved.
    pub(crate) fn moved(&self, parameter: usize, by: f64) -> Self {
        let mut moved = self.clone();
        match parameter {
            0 | 1 => moved.placement.registration.origin_mm[parameter] += by,
            2 => moved.placement.registration.rotation_deg += by,
            3 => moved.placement.surface_mm += by,
            _ => moved.sigma_mm += by,
        }
        moved
    }
}

/// Fits the registration; the error is a sentence that says what is missing.
pub(crate) fn register(
    declared: &Declared,
    readings: &Readings,
    sound: &[bool],
) -> Result<(RegistrationFit, SensorPose), String> {
    if readings.presses.iter().all(|press| press.dwells.is_empty()) {
        return Err(
            "there is no press: the tip never stood still in the covering. In an imported table the mapping's `still_mm` decides that"
                .into(),
        );
    }
    let presses: Vec<&MeasuredPress> =
        across(declared, readings).into_iter().filter(|press| press.rest.is_some()).collect();
    if presses.is_empty() {
        return Err("no reference press has frames at rest before it, with nothing on the covering".into());
    }
    if presses.iter().all(|press| press.dwells.iter().all(|dwell| dwell.height_mm >= 0.0)) {
        return Err("every reference press lies above the declared surface, z = 0".into());
    }
    let places = distinct_places(presses.iter().map(|press| press.place_mm)).len();
    if places < PLACES_LEAST {
        return Err(format!(
            "{} pressed with the reference tool under the reference covering; it takes {PLACES_LEAST}",
            number_of(places)
        ));
    }
    let (count, covering_mm) = (presses.len(), declared.model.response().reference_covering.thickness_mm);
    let mut problem = Problem::new(declared, readings, sound, presses)?;
    let mut contradicting = Vec::new();
    let mut fit = problem.fit(None).ok_or(UNDETERMINED)?;
    // One by one: one gross outlier may make other presses look like outliers.
    while let Some(outlying) = problem.outlying(&fit) {
        if problem.presses.len() <= PLACES_LEAST || contradicting.len() * 10 >= count {
            break;
        }
        let press = problem.presses.remove(outlying);
        contradicting.push((press.run, press.index));
        problem.start.clone_from(&fit.parameters);
        fit = problem.fit(None).ok_or(UNDETERMINED)?;
    }
    let residual_in_noise = fit.misfit.sqrt();
    if !problem.free[ROTATION] && residual_in_noise > PATCH_MISFIT {
        return Err(format!(
            "the presses lie within two pitches, and residuals are {residual_in_noise:.0} times the noise: a faulty element among \
             them, perhaps, which such a patch cannot show"
        ));
    }
    let place = place(&fit, contradicting.clone());
    let estimate =
        |index: usize| Estimate::new(fit.parameters[index], fit.covariance[(index, index)] * fit.inflation());
    let free = |index: usize| problem.free[index];
    let mut runs: Vec<usize> = problem.presses.iter().map(|press| press.run).collect();
    runs.dedup();
    let registration = RegistrationFit {
        origin_mm: [estimate(X), estimate(Y)],
        rotation_deg: free(ROTATION).then(|| estimate(ROTATION)),
        surface_mm: free(SURFACE).then(|| estimate(SURFACE)),
        scale: problem.scale(&fit),
        sigma_mm: estimate(SIGMA),
        covering_mm,
        runs: runs.into_iter().map(|run| readings.runs[run].clone()).collect(),
        presses: problem.presses.len(),
        left_out: contradicting.iter().map(|(run, index)| (readings.runs[*run].clone(), *index)).collect(),
        residual_in_noise,
    };
    Ok((registration, place))
}

const UNDETERMINED: &str = "the presses do not determine the sensor's place";

/// The readings and the parameters that are fitted to them.
struct Problem<'a> {
    declared: &'a Declared,
    presses: Vec<&'a MeasuredPress>,
    /// Elements that take part, and their noise in counts.
    elements: Vec<(usize, f64)>,
    start: Vec<f64>,
    free: Vec<bool>,
}

impl<'a> Problem<'a> {
    fn new(
        declared: &'a Declared,
        readings: &Readings,
        sound: &[bool],
        presses: Vec<&'a MeasuredPress>,
    ) -> Result<Self, String> {
        let elements = taking_part(readings, sound, &presses);
        if elements.is_empty() {
            return Err("no sound element rose above its noise".into());
        }
        let mut depths: Vec<f64> =
            presses.iter().flat_map(|press| press.dwells.iter().map(|dwell| dwell.height_mm)).collect();
        depths.sort_by(f64::total_cmp);
        depths.dedup_by(|next, last| *next - *last < 0.01);
        let [x, y] = declared.registration.origin_mm;
        let sigma_mm = declared.sigma_mm(declared.model.response().reference_covering.thickness_mm);
        let mut start = vec![x, y, declared.registration.rotation_deg, 1.0, 0.0, sigma_mm, 0.0];
        let sensitivities = &declared.model.response().sensitivity_counts_per_mm;
        start.extend(elements.iter().map(|(element, _)| sensitivities[*element]));
        let mut free = vec![true; start.len()];
        free[ROTATION] = goes_across(declared, presses.iter().copied());
        free[SCALE] = false;
        // Two depths do not distinguish a shifted surface from a curved response.
        free[SURFACE] = depths.len() >= 3;
        free[CURVATURE] = depths.len() >= 2;
        Ok(Self { declared, presses, elements, start, free })
    }

    fn fit(&self, scale: Option<&Fit>) -> Option<Fit> {
        let (start, mut free) = (scale.map_or(&self.start, |fit| &fit.parameters), self.free.clone());
        free[SCALE] = scale.is_some();
        minimise(start.clone(), &free, |parameters| self.normal(parameters))
    }

    /// The check: the scale, fitted with all other parameters.
    fn scale(&self, fit: &Fit) -> Option<Estimate> {
        let fit = self.free[ROTATION].then(|| self.fit(Some(fit)))??;
        Some(Estimate::new(fit.parameters[SCALE], fit.covariance[(SCALE, SCALE)] * fit.inflation()))
    }

    fn normal(&self, parameters: &[f64]) -> Option<Normal> {
        let mut normal = Normal::new(parameters.len());
        self.each(parameters, |press, noise, readings| {
            normal.add_press(readings, rest_frames(self.presses[press]), noise);
        })?;
        Some(normal)
    }

    /// The press with the greatest misfit, if that is an outlier.
    fn outlying(&self, fit: &Fit) -> Option<usize> {
        let mut costs = vec![(0.0, 0_u32); self.presses.len()];
        self.each(&fit.parameters, |press, noise, readings| {
            let rest = 1.0 / rest_frames(self.presses[press]) as f64;
            for reading in readings {
                let variance = 1.0 / reading.frames as f64 + rest;
                costs[press].0 += (reading.residual / noise).powi(2) / variance;
                costs[press].1 += 1;
            }
        })?;
        let misfits: Vec<f64> =
            costs.iter().map(|(cost, readings)| (cost / f64::from((*readings).max(1))).sqrt()).collect();
        let limit = OUTLYING * median(misfits.iter().copied())?.max(1.0);
        let worst = misfits.iter().enumerate().max_by(|one, other| one.1.total_cmp(other.1));
        worst.filter(|(_, misfit)| **misfit > limit).map(|(press, _)| press)
    }

    /// Calls `take` for every element in every press with the press's index, the noise and the observations.
    fn each(&self, parameters: &[f64], mut take: impl FnMut(usize, f64, &[Observation])) -> Option<()> {
        let (model, placement) = (self.model(parameters)?, placement(parameters));
        for (index, press) in self.presses.iter().enumerate() {
            let (indenter, covering) =
                (self.declared.indenter(press)?, Covering { thickness_mm: press.covering_mm });
            let dwells: Vec<(&Dwell, Gradient, Slopes)> = press
                .dwells
                .iter()
                .map(|dwell| {
                    let contact = placement.contact(press, dwell, indenter);
                    (dwell, model.gradient(&contact, covering), Slopes::of(&placement, contact.position_mm))
                })
                .collect();
            for (place, (element, noise)) in self.elements.iter().enumerate() {
                let readings = dwells.iter().filter_map(|(dwell, gradient, by_placement)| {
                    let [rise, _] = press.rise(dwell, *element)?;
                    let (predicted, slopes) =
                        Self::predict(parameters, gradient, by_placement, place, *element);
                    Some(Observation {
                        residual: rise - predicted,
                        slopes: slopes.to_vec(),
                        frames: dwell.frames,
                    })
                });
                take(index, *noise, &readings.collect::<Vec<_>>());
            }
        }
        Some(())
    }

    fn predict(
        parameters: &[f64],
        gradient: &Gradient,
        by_placement: &Slopes,
        place: usize,
        element: usize,
    ) -> (f64, [(usize, f64); SHARED + 1]) {
        let (sensitivity, curvature) = (parameters[SHARED + place], parameters[CURVATURE]);
        let v = gradient.counts[element];
        let per_v = sensitivity * (1.0 + 2.0 * curvature * v);
        let [by_x, by_y] = &gradient.by_position_mm;
        let along = |[x, y]: [f64; 2]| per_v * (by_x[element] * x + by_y[element] * y);
        let turned = -per_v * gradient.by_rotation_deg[element];
        let slopes = [
            (X, along(by_placement.origin[0])),
            (Y, along(by_placement.origin[1])),
            (ROTATION, along(by_placement.rotation_deg) + turned),
            (SCALE, along(by_placement.scale)),
            (SURFACE, per_v * gradient.by_depth_mm[element]),
            (SIGMA, per_v * gradient.by_sigma_intercept_mm[element]),
            (CURVATURE, sensitivity * v * v),
            (SHARED + place, v + curvature * v * v),
        ];
        (sensitivity * (v + curvature * v * v), slopes)
    }

    fn model(&self, parameters: &[f64]) -> Option<ForwardModel> {
        (parameters[SCALE] > 0.0).then(|| self.declared.unit_model(parameters[SIGMA]).ok())?
    }
}

fn place(fit: &Fit, contradicting: Vec<(usize, i32)>) -> SensorPose {
    let order = [X, Y, ROTATION, SURFACE, SIGMA];
    let covariance = DMatrix::from_fn(order.len(), order.len(), |row, column| {
        fit.inflation() * fit.covariance[(order[row], order[column])]
    });
    SensorPose {
        placement: placement(&fit.parameters),
        sigma_mm: fit.parameters[SIGMA],
        contradicting,
        covariance,
    }
}

fn rest_frames(press: &MeasuredPress) -> usize {
    press.rest.as_ref().map_or(1, |rest| rest.frames)
}

fn placement(parameters: &[f64]) -> Placement {
    Placement {
        registration: Registration {
            origin_mm: [parameters[X], parameters[Y]],
            rotation_deg: parameters[ROTATION],
        },
        scale: parameters[SCALE],
        surface_mm: parameters[SURFACE],
    }
}

/// Sound elements that rose well above their noise, each with its noise.
fn taking_part(readings: &Readings, sound: &[bool], presses: &[&MeasuredPress]) -> Vec<(usize, f64)> {
    let rises = |element: usize, noise: f64| {
        presses.iter().any(|press| {
            press.dwells.iter().any(|dwell| {
                let rise = press.rise(dwell, element);
                rise.is_some_and(|[rise, variance]| rise.abs() > RISE_LEAST * noise * variance.sqrt())
            })
        })
    };
    let noises = readings.noise_rms_counts.iter().enumerate();
    noises
        .filter_map(|(element, noise)| Some((element, noise.filter(|noise| *noise > 0.0)?)))
        .filter(|(element, noise)| sound[*element] && rises(*element, *noise))
        .collect()
}

/// Derivatives of a position on the sensor, x and y, by the parameters of the placement.
struct Slopes {
    origin: [[f64; 2]; 2],
    rotation_deg: [f64; 2],
    scale: [f64; 2],
}

impl Slopes {
    fn of(placement: &Placement, [x, y]: [f64; 2]) -> Self {
        let (sin, cos) = placement.registration.rotation_deg.to_radians().sin_cos();
        let [s, c] = [sin, cos].map(|part| part / placement.scale);
        let turn = 1.0_f64.to_radians();
        Self {
            origin: [[-c, s], [-s, -c]],
            rotation_deg: [y * turn, -x * turn],
            scale: [-x / placement.scale, -y / placement.scale],
        }
    }
}

#[cfg(test)]
#[path = "registration_tests.rs"]
mod tests;
