//! The point spread of each covering at each depth (paper, Sec. 3, Eq. 3).
//!
//! ```text
//! Q(sigma) = sum_i <E_i(sigma), D_i>        sigma+ maximises Q
//! ```
//!
//! `D_i` is the image of press `i`, each element's rise turned into indentation by its own response; `E_i` is the image
//! that the base model gives for the tool at that place under a Gaussian of that sigma. Both are scaled to unit L2 norm:
//! with unit sum or unit peak there is no finite maximum. Faulty elements take no part.
//!
//! The maximum is found by Newton's method. Its standard error has two parts: the scatter of the presses' own slopes
//! (the sandwich estimate, which needs no model of the noise), and the errors of the elements' responses and of the sensor's
//! pose, propagated by first derivatives; the latter are common to many presses and coverings.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::Serialize;
use tactus_model::{Contact, Covering, effect};

use crate::{
    Estimate,
    order::median,
    placement::{Declared, coverings_mm, same_covering},
    places::distinct_places,
    readings::{Dwell, MeasuredPress, Readings},
    registration::SensorPose,
    response::{Gains, inverted},
};

/// Dwells whose depths differ by less are fitted together.
const DEPTH_STEP_MM: f64 = 0.02;
/// Distinct places needed to fit a spread.
const PLACES_LEAST: usize = 9;
/// A press is left out if one minus its image's likeness exceeds this many times the median press's.
const OUTLYING: f64 = 40.0;
/// Range in which sigma is searched, in pitches.
const SIGMA_PITCHES: [f64; 2] = [0.05, 50.0];
const ROUNDS_MAX: usize = 30;
/// The search ends with a step of less than this share of sigma: first when looking for outlying images, then in the final
/// fit, where the remaining step is far below any error.
const STEP_LEAST: [f64; 2] = [1e-3, 1e-6];
/// Step of the numeric derivatives by sigma, as a share of it.
const STEP_SHARE: f64 = 1e-4;
/// Step of the numeric derivatives by a press's position.
const STEP_MM: f64 = 1e-4;

/// The spread fitted to the presses to one depth under one covering.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpreadFit {
    /// Thickness of the covering.
    pub covering_mm: f64,
    /// Depth of the presses below the fitted surface.
    pub depth_mm: f64,
    /// Id of the run that the presses belong to.
    pub run: String,
    /// Number of presses used.
    pub presses: usize,
    /// Number of presses left out as outliers.
    pub left_out: usize,
    /// `sigma+`, the fitted standard deviation of the Gaussian.
    pub sigma_mm: Estimate,
    /// The part of its standard error that more presses would reduce.
    pub scatter_mm: f64,
    /// Mean cosine between measured and modelled images at sigma+: 1 if the spread is a Gaussian and the model holds.
    pub likeness: f64,
}

/// All spreads, and the covariance of their errors in mm^2.
#[derive(Debug, Clone)]
pub(crate) struct Spreads {
    pub(crate) fits: Vec<SpreadFit>,
    pub(crate) covariance: DMatrix<f64>,
}

/// Fits the spread of every covering at every depth; the texts name what could not be fitted.
pub(crate) fn spreads(
    declared: &Declared,
    readings: &Readings,
    gains: &Gains,
    place: &SensorPose,
) -> (Spreads, Vec<String>) {
    let groups = groups(declared, readings);
    let one = |group: &SpreadData<'_>| SigmaSearch::new(declared, gains, place, group)?.run(readings, group);
    let results: Vec<_> = groups.par_iter().with_max_len(1).map(one).collect();
    let (mut found, mut refused) = (Vec::new(), Vec::new());
    for (result, group) in results.into_iter().zip(&groups) {
        match result {
            Ok(one) => found.push(one),
            Err(problem) => refused.push(format!(
                "no spread of the covering of {:.3} mm from presses to {:.2} mm: {problem}",
                group.covering_mm, -group.height_mm
            )),
        }
    }
    let covariance = covariance(&found, gains, place);
    let mut fits: Vec<SpreadFit> = found.into_iter().map(|found| found.fit).collect();
    for (index, fit) in fits.iter_mut().enumerate() {
        fit.sigma_mm = Estimate::new(fit.sigma_mm.value, covariance[(index, index)]);
    }
    (Spreads { fits, covariance }, refused)
}

/// Presses of one run to one depth under one covering.
struct SpreadData<'a> {
    covering_mm: f64,
    height_mm: f64,
    presses: Vec<(&'a MeasuredPress, &'a Dwell)>,
}

/// For each covering, the presses of the run that has the most of them, grouped by depth.
fn groups<'a>(declared: &Declared, readings: &'a Readings) -> Vec<SpreadData<'a>> {
    let known = |press: &&MeasuredPress| press.rest.is_some() && declared.indenter(press).is_some();
    let mut groups = Vec::new();
    for covering_mm in coverings_mm(readings.presses.iter().filter(known)) {
        let under = |press: &&MeasuredPress| same_covering(press.covering_mm, covering_mm);
        let of_run = |run: usize| {
            readings.presses.iter().filter(move |press| press.run == run).filter(known).filter(under)
        };
        let most = (0..readings.runs.len()).max_by_key(|run| (of_run(*run).count(), std::cmp::Reverse(*run)));
        let mut presses: Vec<(&MeasuredPress, &Dwell)> = most
            .into_iter()
            .flat_map(of_run)
            .flat_map(|press| press.dwells.iter().map(move |dwell| (press, dwell)))
            .collect();
        presses.sort_by(|(_, one), (_, other)| other.height_mm.total_cmp(&one.height_mm));
        for alike in presses.chunk_by(|(_, one), (_, other)| one.height_mm - other.height_mm < DEPTH_STEP_MM)
        {
            let height_mm = alike.iter().map(|(_, dwell)| dwell.height_mm).sum::<f64>() / alike.len() as f64;
            let places = distinct_places(alike.iter().map(|(press, _)| press.place_mm)).len();
            if places >= PLACES_LEAST {
                groups.push(SpreadData { covering_mm, height_mm, presses: alike.to_vec() });
            }
        }
    }
    groups
}

/// One fit, and its derivatives by the responses and the pose that it uses.
struct GroupFit {
    fit: SpreadFit,
    variance: f64,
    /// By all sensitivities, then all curvatures.
    by_gains: DVector<f64>,
    by_place: DVector<f64>,
}

fn covariance(found: &[GroupFit], gains: &Gains, place: &SensorPose) -> DMatrix<f64> {
    let count = found.len();
    let mut covariance = DMatrix::from_diagonal(&DVector::from_fn(count, |row, _| found[row].variance));
    if count > 0 {
        let by_gains = DMatrix::from_fn(count, gains.own.nrows(), |row, column| found[row].by_gains[column]);
        // A wrong place acts on its own, and through the responses.
        let by_place =
            DMatrix::from_fn(count, SensorPose::UNCERTAIN, |row, column| found[row].by_place[column])
                + &by_gains * &gains.by_place;
        covariance += &by_gains * &gains.own * by_gains.transpose();
        covariance += &by_place * &place.covariance * by_place.transpose();
    }
    covariance
}

/// One image: the contact, and the elements' readings as indentations of unit norm.
struct PressImage {
    contact: Contact,
    place_mm: [f64; 2],
    measured: Vec<f64>,
    norm_mm: f64,
}

/// The search for one sigma.
struct SigmaSearch<'a> {
    declared: &'a Declared,
    gains: &'a Gains,
    place: &'a SensorPose,
    covering: Covering,
    images: Vec<PressImage>,
    /// Number of presses left out so far: an element beyond its response's turning point, or an outlier.
    left_out: usize,
}

/// One image's likeness to the model at a sigma, with derivatives.
struct ImageSlope {
    likeness: f64,
    /// Derivative of the likeness by sigma.
    by_sigma: f64,
    /// Minus its second derivative, where model and image agree.
    curvature: f64,
    /// Derivative of the modelled image of unit norm.
    shape: Vec<f64>,
}

impl<'a> SigmaSearch<'a> {
    fn new(
        declared: &'a Declared,
        gains: &'a Gains,
        place: &'a SensorPose,
        group: &SpreadData<'_>,
    ) -> Result<Self, String> {
        let covering = Covering { thickness_mm: group.covering_mm };
        let mut search = Self { declared, gains, place, covering, images: Vec::new(), left_out: 0 };
        for (press, dwell) in &group.presses {
            let Some(indenter) = declared.indenter(press) else { continue };
            let measured = gains.elements.iter().map(|(element, [s, k])| {
                let [rise, _] = press.rise(dwell, *element)?;
                inverted(rise / s, *k)
            });
            let Some(mut measured) = measured.collect::<Option<Vec<f64>>>() else {
                search.left_out += 1;
                continue;
            };
            let norm_mm = norm(&measured);
            if norm_mm > 0.0 {
                scale(&mut measured, 1.0 / norm_mm);
                let contact = place.placement.contact(press, dwell, indenter);
                search.images.push(PressImage { contact, place_mm: press.place_mm, measured, norm_mm });
            }
        }
        if search.images.len() < PLACES_LEAST {
            return Err(format!(
                "only {} images are left; the fit needs {PLACES_LEAST}",
                search.images.len()
            ));
        }
        Ok(search)
    }

    fn run(mut self, readings: &Readings, group: &SpreadData<'_>) -> Result<GroupFit, String> {
        // Outlying images hardly move the median image's sigma.
        let (start_mm, slopes) =
            self.maximise(median_step, self.declared.sigma_mm(self.covering.thickness_mm), STEP_LEAST[0])?;
        let unlike = median(slopes.iter().map(|slope| 1.0 - slope.likeness));
        let limit = OUTLYING * unlike.unwrap_or(f64::INFINITY).max(1e-9);
        let mut likenesses = slopes.iter().map(|slope| slope.likeness);
        let before = self.images.len();
        self.images.retain(|_| likenesses.next().is_some_and(|likeness| 1.0 - likeness <= limit));
        self.left_out += before - self.images.len();
        let (sigma_mm, slopes) = self.maximise(step, start_mm, STEP_LEAST[1])?;
        let count = slopes.len() as f64;
        let curvature: f64 = slopes.iter().map(|slope| slope.curvature).sum();
        let squares: f64 = slopes.iter().map(|slope| slope.by_sigma * slope.by_sigma).sum();
        let variance = squares * count / (count - 1.0) / (curvature * curvature);
        let fit = SpreadFit {
            covering_mm: group.covering_mm,
            depth_mm: self.place.placement.surface_mm - group.height_mm,
            run: group.presses.first().map(|(press, _)| readings.runs[press.run].clone()).unwrap_or_default(),
            presses: slopes.len(),
            left_out: self.left_out,
            sigma_mm: Estimate::new(sigma_mm, variance),
            scatter_mm: variance.sqrt(),
            likeness: slopes.iter().map(|slope| slope.likeness).sum::<f64>() / count,
        };
        let by_gains = self.by_gains(&slopes) / curvature;
        let by_place = self.by_place(sigma_mm, &slopes) / curvature;
        Ok(GroupFit { fit, variance, by_gains, by_place })
    }

    /// Where the steps from a start converge, and every image's slope there.
    fn maximise(
        &self,
        step: fn(&[ImageSlope]) -> f64,
        start_mm: f64,
        step_least: f64,
    ) -> Result<(f64, Vec<ImageSlope>), String> {
        let [least, most] = SIGMA_PITCHES.map(|pitches| pitches * self.declared.array().pitch_mm());
        let mut sigma_mm = start_mm.clamp(least, most);
        for _ in 0..ROUNDS_MAX {
            let slopes = self.slopes(sigma_mm);
            // Far from the maximum a whole step may go astray.
            let step = step(&slopes).clamp(-0.4 * sigma_mm, 0.6 * sigma_mm);
            sigma_mm += step;
            if step.abs() < step_least * sigma_mm {
                return Ok((sigma_mm, slopes));
            }
            // NaN ends the search here too.
            if !(least..=most).contains(&sigma_mm) {
                break;
            }
        }
        Err(format!("the images fit no sigma between {least:.2} and {most:.0} mm"))
    }

    fn slopes(&self, sigma_mm: f64) -> Vec<ImageSlope> {
        self.images.iter().map(|image| self.slope(sigma_mm, image, &image.contact)).collect()
    }

    fn slope(&self, sigma_mm: f64, image: &PressImage, contact: &Contact) -> ImageSlope {
        // Two images at slightly different sigmas give the image between them and its slope, both to some 1e-8.
        let step_mm = STEP_SHARE * sigma_mm;
        let [less, more] = [sigma_mm - step_mm, sigma_mm + step_mm].map(|sigma_mm| {
            let mut predicted = vec![0.0; self.declared.array().elements()];
            let press = effect::Load {
                weight: 1.0,
                contact: contact.clone(),
                lean: [0.0; 2],
                sigma_mm: [sigma_mm; 2],
            };
            self.declared.model.indentation_of(&press, self.covering, &mut predicted);
            predicted
        });
        let elements = || self.gains.elements.iter().map(|(element, _)| *element);
        let mut modelled: Vec<f64> =
            elements().map(|element| f64::midpoint(less[element], more[element])).collect();
        let mut shape: Vec<f64> =
            elements().map(|element| (more[element] - less[element]) / (2.0 * step_mm)).collect();
        let length = norm(&modelled).max(f64::MIN_POSITIVE);
        scale(&mut modelled, 1.0 / length);
        let along = dot(&modelled, &shape);
        for (shape, modelled) in shape.iter_mut().zip(&modelled) {
            *shape = (*shape - along * modelled) / length;
        }
        ImageSlope {
            likeness: dot(&image.measured, &modelled),
            by_sigma: dot(&image.measured, &shape),
            curvature: dot(&shape, &shape),
            shape,
        }
    }

    /// Derivatives of the sum of the slopes by the elements' responses.
    fn by_gains(&self, slopes: &[ImageSlope]) -> DVector<f64> {
        let count = self.gains.elements.len();
        let mut by_gains = DVector::zeros(2 * count);
        for (image, slope) in self.images.iter().zip(slopes) {
            for (index, (_, [s, k])) in self.gains.elements.iter().enumerate() {
                let v = image.measured[index] * image.norm_mm;
                let by_v = (slope.shape[index] - image.measured[index] * slope.by_sigma) / image.norm_mm;
                let per_mm = 1.0 + 2.0 * k * v;
                by_gains[index] -= by_v * (v + k * v * v) / (s * per_mm);
                by_gains[count + index] -= by_v * v * v / per_mm;
            }
        }
        by_gains
    }

    /// Derivatives of the sum of the slopes by the sensor's pose.
    fn by_place(&self, sigma_mm: f64, slopes: &[ImageSlope]) -> DVector<f64> {
        let mut by_place = DVector::zeros(SensorPose::UNCERTAIN);
        for (image, slope) in self.images.iter().zip(slopes) {
            let mut along = [0.0; 2];
            for (axis, along) in along.iter_mut().enumerate() {
                let mut contact = image.contact.clone();
                contact.position_mm[axis] += STEP_MM;
                *along = (self.slope(sigma_mm, image, &contact).by_sigma - slope.by_sigma) / STEP_MM;
            }
            for parameter in 0..3 {
                let moved = self.place.moved(parameter, STEP_MM).placement.on_sensor(image.place_mm);
                for axis in 0..2 {
                    by_place[parameter] +=
                        along[axis] * (moved[axis] - image.contact.position_mm[axis]) / STEP_MM;
                }
            }
        }
        by_place
    }
}

/// Newton's step to the maximum of the sum.
fn step(slopes: &[ImageSlope]) -> f64 {
    let sum = |of: fn(&ImageSlope) -> f64| slopes.iter().map(of).sum::<f64>();
    sum(|slope| slope.by_sigma) / sum(|slope| slope.curvature)
}

/// The median of the images' own steps.
fn median_step(slopes: &[ImageSlope]) -> f64 {
    median(slopes.iter().map(|slope| slope.by_sigma / slope.curvature)).unwrap_or(f64::NAN)
}

fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| a * b).sum()
}

fn scale(vector: &mut [f64], by: f64) {
    for value in vector {
        *value *= by;
    }
}

fn norm(vector: &[f64]) -> f64 {
    dot(vector, vector).sqrt()
}

#[cfg(test)]
#[path = "spread_tests.rs"]
mod tests;
