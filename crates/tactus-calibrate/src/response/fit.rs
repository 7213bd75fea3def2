//! One form of the response, fitted to the presses at the elements' centres.

use nalgebra::{DMatrix, DVector};
use tactus_model::{Covering, ForwardModel};

use super::{DWELLS_LEAST, ResponseForm, rms};
use crate::{
    Estimate,
    least_squares::{self, Normal, Observation, minimise},
    order::median,
    placement::Declared,
    readings::MeasuredPress,
    registration::SensorPose,
};

/// Number of folds in which dwells are held out.
const FOLDS: usize = 5;

/// An element's readings in one press at its centre.
#[derive(Debug, Clone)]
pub(super) struct CentrePress {
    pub(super) element: usize,
    pub(super) points: Vec<CentreDwell>,
    noise_counts: f64,
    rest_frames: usize,
}

/// One dwell of such a press: predicted indentation and measured rise.
#[derive(Debug, Clone, Copy)]
pub(super) struct CentreDwell {
    pub(super) u_mm: f64,
    pub(super) rise_counts: f64,
    frames: usize,
}

/// The error of the prediction for a held-out dwell.
#[derive(Debug, Clone, Copy)]
pub(super) struct HeldOutError {
    pub(super) element: usize,
    pub(super) counts: f64,
    /// In units of its standard deviation.
    pub(super) in_noise: f64,
}

/// A form with its fitted parameters.
#[derive(Debug, Clone)]
pub(super) struct FittedForm {
    pub(super) form: ResponseForm,
    /// The elements, in the order of their parameters.
    pub(super) elements: Vec<usize>,
    fit: least_squares::Fit,
}

impl CentrePress {
    /// The readings of `element` in a press, with the indentation predicted at the element `signal`, whose signal it gives.
    pub(super) fn of(
        declared: &Declared,
        model: &ForwardModel,
        place: &SensorPose,
        press: &MeasuredPress,
        [element, signal]: [usize; 2],
        noise_counts: f64,
    ) -> Option<Self> {
        let (indenter, rest_frames) = (declared.indenter(press)?, press.rest.as_ref()?.frames);
        let mut predicted = vec![0.0; model.array().elements()];
        let points = press.dwells.iter().filter_map(|dwell| {
            let contact = place.placement.contact(press, dwell, indenter);
            model.indentation(&contact, Covering { thickness_mm: press.covering_mm }, &mut predicted);
            let [rise_counts, _] = press.rise(dwell, element)?;
            Some(CentreDwell { u_mm: predicted[signal], rise_counts, frames: dwell.frames })
        });
        let points = points.collect();
        Some(Self { element, points, noise_counts, rest_frames })
    }
}

impl FittedForm {
    /// `s` and `k` of the element at an index.
    pub(super) fn response(&self, index: usize) -> [f64; 2] {
        let parameters = &self.fit.parameters;
        [parameters[index], self.curvature_at(index).map_or(0.0, |at| parameters[at])]
    }

    /// `k` of the median element.
    pub(super) fn typical_curvature(&self) -> f64 {
        median((0..self.elements.len()).map(|index| self.response(index)[1])).unwrap_or(0.0)
    }

    pub(super) fn sensitivity(&self, index: usize) -> Estimate {
        self.estimate(index)
    }

    /// `k` of the element at an index; 0 in the linear form.
    pub(super) fn curvature(&self, index: usize) -> Estimate {
        self.curvature_at(index).map_or(Estimate { value: 0.0, standard_error: 0.0 }, |at| self.estimate(at))
    }

    /// All `s`, then all `k`.
    pub(super) fn expanded(&self) -> DVector<f64> {
        let count = self.elements.len();
        DVector::from_fn(2 * count, |row, _| self.place(row).map_or(0.0, |at| self.fit.parameters[at]))
    }

    pub(super) fn expanded_covariance(&self) -> DMatrix<f64> {
        let count = 2 * self.elements.len();
        DMatrix::from_fn(count, count, |row, column| match (self.place(row), self.place(column)) {
            (Some(row), Some(column)) => self.fit.inflation() * self.fit.covariance[(row, column)],
            _ => 0.0,
        })
    }

    pub(super) fn residual_in_noise(&self) -> f64 {
        self.fit.misfit.sqrt()
    }

    pub(super) fn rms_counts(&self, groups: &[CentrePress]) -> f64 {
        rms(groups.iter().flat_map(|group| {
            group.points.iter().map(|point| point.rise_counts - self.predicted(group.element, point.u_mm))
        }))
    }

    fn predicted(&self, element: usize, u_mm: f64) -> f64 {
        let index = self.elements.binary_search(&element).unwrap_or_default();
        let [s, k] = self.response(index);
        s * (u_mm + k * u_mm * u_mm)
    }

    fn estimate(&self, at: usize) -> Estimate {
        Estimate::new(self.fit.parameters[at], self.fit.covariance[(at, at)] * self.fit.inflation())
    }

    /// Index among the parameters of the curvature of the element at `index`.
    fn curvature_at(&self, index: usize) -> Option<usize> {
        let count = self.elements.len();
        match self.form {
            ResponseForm::Linear => None,
            ResponseForm::SharedQuadratic => Some(count),
            ResponseForm::OwnQuadratic => Some(count + index),
        }
    }

    /// Index among the parameters of a row of the expanded vector: all `s`, then all `k`.
    fn place(&self, row: usize) -> Option<usize> {
        let count = self.elements.len();
        if row < count { Some(row) } else { self.curvature_at(row - count) }
    }
}

/// Fits a form to the dwells that `keep` selects by their press and their index in it.
pub(super) fn fit(
    form: ResponseForm,
    groups: &[CentrePress],
    keep: impl Fn(&CentrePress, usize) -> bool,
) -> Option<FittedForm> {
    let mut elements: Vec<usize> = groups.iter().map(|group| group.element).collect();
    elements.dedup();
    let count = elements.len();
    let curvatures = match form {
        ResponseForm::Linear => 0,
        ResponseForm::SharedQuadratic => 1,
        ResponseForm::OwnQuadratic => count,
    };
    let free = vec![true; count + curvatures];
    let mut start: Vec<f64> = elements.iter().map(|element| slope(groups, *element)).collect();
    start.resize(count + curvatures, 0.0);
    let mut fitted = FittedForm {
        form,
        elements,
        fit: least_squares::Fit { parameters: start.clone(), covariance: DMatrix::zeros(0, 0), misfit: 1.0 },
    };
    fitted.fit = minimise(start, &free, |parameters| {
        let mut normal = Normal::new(parameters.len());
        for group in groups {
            let index = fitted.elements.binary_search(&group.element).ok()?;
            let (s, at) = (parameters[index], fitted.curvature_at(index));
            let k = at.map_or(0.0, |at| parameters[at]);
            let kept = group.points.iter().enumerate().filter(|(dwell, _)| keep(group, *dwell));
            let readings: Vec<Observation> = kept
                .map(|(_, point)| {
                    let square = point.u_mm * point.u_mm;
                    let shape = point.u_mm + k * square;
                    let mut slopes = vec![(index, shape)];
                    slopes.extend(at.map(|at| (at, s * square)));
                    Observation { residual: point.rise_counts - s * shape, slopes, frames: point.frames }
                })
                .collect();
            normal.add_press(&readings, group.rest_frames, group.noise_counts);
        }
        Some(normal)
    })?;
    Some(fitted)
}

/// Counts per mm of an element by a line through zero: the starting value of every form.
fn slope(groups: &[CentrePress], element: usize) -> f64 {
    let points = groups.iter().filter(|group| group.element == element).flat_map(|group| &group.points);
    let [above, below] = points.fold([0.0, 0.0], |[above, below], point| {
        [above + point.u_mm * point.rise_counts, below + point.u_mm * point.u_mm]
    });
    above / below
}

/// Errors of predictions of dwells that took no part in the fit; `None` if the presses have too few dwells.
pub(super) fn heldout(form: ResponseForm, groups: &[CentrePress]) -> Option<Vec<HeldOutError>> {
    // Presses with fewer dwells, such as aborted ones, take part in the fits, but none of their dwells is held out.
    let whole = |group: &&CentrePress| group.points.len() >= DWELLS_LEAST;
    let folds = FOLDS.min(groups.iter().filter(whole).map(|group| group.points.len()).min()?);
    let mut errors = Vec::new();
    for fold in 0..folds {
        let fitted = fit(form, groups, |group, dwell| !whole(&group) || dwell % folds != fold)?;
        for group in groups.iter().filter(whole) {
            for (_, point) in group.points.iter().enumerate().filter(|(dwell, _)| dwell % folds == fold) {
                let counts = point.rise_counts - fitted.predicted(group.element, point.u_mm);
                let variance = 1.0 / point.frames as f64 + 1.0 / group.rest_frames as f64;
                let in_noise = counts / (group.noise_counts * variance.sqrt());
                errors.push(HeldOutError { element: group.element, counts, in_noise });
            }
        }
    }
    Some(errors)
}
