//! Where a model and the data disagree: the covariates on which the residual depends.

use std::sync::Arc;

use super::covariates::{Factor, Feature, Form, Forms, features};
use super::grow::{FLIPS, Search};
use super::score::{Score, flipped, largest, p_value, q_values};
use crate::data::DiscoverError;
use crate::fit::{Direction, Fitted};
use crate::numbers::parallel;

/// A covariate on which the residual depends.
#[derive(Debug, Clone, PartialEq)]
pub struct Gap {
    /// Name of the covariate, such as `time since contact`.
    pub covariate: &'static str,
    /// Unit of the covariate, such as `s`.
    pub unit: &'static str,
    /// The element at which alone the residual is largest; `None` if the dependence is not that of one element.
    pub element: Option<usize>,
    /// Range of the covariate in which the residual is largest.
    pub range: [f64; 2],
    /// Root mean square of the dependence, in standard deviations of the noise.
    pub effect_size: f64,
    /// Adjusted for the false-discovery rate (Benjamini and Hochberg).
    pub q_value: f64,
}

/// The residual against a covariate.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Name of the covariate.
    pub covariate: &'static str,
    /// Unit of the covariate.
    pub unit: &'static str,
    /// Unit of the residual: `share of the signal` or `counts`.
    pub of: &'static str,
    /// In order of the covariate.
    pub points: Vec<Point>,
}

/// A point of a [`Curve`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Value of the covariate.
    pub at: f64,
    /// Mean residual of the recalibrated base model.
    pub before: f64,
    /// Mean residual of the grown model.
    pub after: f64,
    /// Standard error of either mean, from the scatter between blocks.
    pub standard_error: f64,
}

/// Greatest false-discovery rate among the reported covariates.
const Q_MAX: f64 = 0.05;
/// Least part of a feature that recalibration does not take up.
const OWN_LEAST: f64 = 1e-3;
/// Changes the seed, so that covariates have other sign flips than candidates.
const STREAM: u64 = 0x0010_ca7e;

/// Where a model and the data disagree.
pub(crate) struct Located {
    /// The largest of all standardised scores.
    pub(crate) statistic: f64,
    /// p-value of `statistic`.
    pub(crate) p_value: f64,
    pub(crate) gap: Vec<Gap>,
}

impl Search<'_> {
    /// Tests on which covariates the residual of a model depends.
    pub(crate) fn locate(&self, at: &Fitted) -> Result<Arc<Located>, DiscoverError> {
        self.memory.located.at(&at.parameters, || self.located(at).map(Arc::new))
    }

    fn located(&self, at: &Fitted) -> Result<Located, DiscoverError> {
        let problem = self.problem;
        let elements = problem.predictor.bins.elements;
        let forms =
            Forms::of(problem, &at.parameters, &at.predicted)?.with_places(problem, &at.parameters)?;
        let features = features(problem, &forms);
        let column = |feature: &Feature| -> Direction<'_> {
            let (forms, feature) = (&forms, feature.clone());
            Direction::computed(feature.only(), move |bins| forms.values(&feature, bins, elements))
        };
        let columns: Vec<Direction<'_>> = features.iter().map(column).collect();
        let grams = problem.grams_of_each(at, columns)?;
        let scored = |index: usize| {
            let size = grams.size(index);
            // What recalibration takes up is no feature, such as the signal of an element whose gain is fitted.
            if size < OWN_LEAST * grams.whole(index) || size == 0.0 {
                return (Score::of_grams(&grams, &[]), 0.0);
            }
            (Score::of_grams(&grams, &[index]), grams.wanted(index) / size)
        };
        let indices: Vec<usize> = (0..features.len()).collect();
        let scored = parallel::map(&indices, |index| scored(*index));
        let mut covariates: Vec<&'static str> = features.iter().map(|feature| feature.covariate).collect();
        covariates.dedup();
        let of = |covariate: &str| -> Vec<usize> {
            (0..features.len()).filter(|index| features[*index].covariate == covariate).collect()
        };
        let groups: Vec<Vec<&Score>> =
            covariates.iter().map(|one| of(one).iter().map(|index| &scored[*index].0).collect()).collect();
        let under_none = flipped(&groups, FLIPS, self.options.seed ^ STREAM);
        let statistics: Vec<f64> =
            groups.iter().map(|group| group.iter().map(|score| score.z).fold(0.0, f64::max)).collect();
        let p_values: Vec<f64> =
            statistics.iter().zip(&under_none).map(|(statistic, none)| p_value(*statistic, none)).collect();
        let statistic = statistics.iter().copied().fold(0.0, f64::max);
        let mut gap: Vec<Gap> = Vec::new();
        for ((covariate, q_value), statistic) in covariates.iter().zip(q_values(&p_values)).zip(&statistics) {
            let strongest =
                of(covariate).into_iter().max_by(|a, b| scored[*a].0.z.total_cmp(&scored[*b].0.z));
            let Some(strongest) = strongest.filter(|_| q_value <= Q_MAX && *statistic > 0.0) else {
                continue;
            };
            let (_, z) = &scored[strongest];
            let feature = &features[strongest];
            let column = forms.column(feature, elements);
            let readings = column.iter().filter(|value| **value != 0.0).count();
            gap.push(Gap {
                covariate,
                unit: feature.unit,
                element: feature.only(),
                range: feature.range,
                effect_size: z.abs() / (readings.max(1) as f64).sqrt(),
                q_value,
            });
        }
        gap.sort_by(|a, b| b.effect_size.total_cmp(&a.effect_size));
        Ok(Located { statistic, p_value: p_value(statistic, &largest(&under_none)), gap })
    }

    /// The residual of the base and of the grown model against each covariate.
    pub(crate) fn curves(&self, base: &Fitted, grown: &Fitted) -> Result<Vec<Curve>, DiscoverError> {
        let problem = self.problem;
        let forms = Forms::of(problem, &base.parameters, &base.predicted)?;
        let features = features(problem, &forms);
        let mut curves: Vec<Curve> = Vec::new();
        for feature in features.iter().filter(|one| {
            matches!(one.form, Form::Signal | Form::Offset) && !matches!(one.factor, Factor::Element(..))
        }) {
            let column = forms.column(feature, problem.predictor.bins.elements);
            let Some([before, standard_error]) = problem.share(&column, &base.predicted) else { continue };
            let Some([after, _]) = problem.share(&column, &grown.predicted) else { continue };
            let at = f64::midpoint(feature.range[0], feature.range[1]);
            let of = if feature.form == Form::Signal { "share of the signal" } else { "counts" };
            let point = Point { at, before, after, standard_error };
            let same = |curve: &&mut Curve| curve.covariate == feature.covariate && curve.of == of;
            match curves.iter_mut().find(same) {
                Some(curve) => curve.points.push(point),
                None => curves.push(Curve {
                    covariate: feature.covariate,
                    unit: feature.unit,
                    of,
                    points: vec![point],
                }),
            }
        }
        curves.retain(|curve| curve.points.len() > 1);
        Ok(curves)
    }
}
