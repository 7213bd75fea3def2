//! Test helpers: a sensor with known parameters.

use super::{Definition, Effect, Knots};
use crate::{
    Array, Covering, ForwardModel, Indenter, Moment, Pipeline, Psf, Registration, Response, Simulator,
};

pub(crate) const THIN: Covering = Covering { thickness_mm: 1.016 };

pub(crate) const CYLINDER: Indenter = Indenter::Cylinder { diameter_mm: 1.0 };

pub(crate) fn model() -> ForwardModel {
    let response = Response {
        sensitivity_counts_per_mm: (0..48).map(|element| 900.0 + 5.0 * f64::from(element)).collect(),
        baseline_counts: vec![100.0; 48],
        quadratic_per_mm: vec![0.15; 48],
        reference_indenter: CYLINDER,
        reference_covering: THIN,
    };
    ForwardModel::new(Array::digitacts(), Psf::PAPER, response).unwrap()
}

pub(crate) fn simulator(effects: impl IntoIterator<Item = Effect>) -> Simulator {
    Simulator {
        model: model(),
        registration: Registration { origin_mm: [20.0, 15.0], rotation_deg: 3.0 },
        surface_mm: 0.25,
        covering: THIN,
        indenter: CYLINDER,
        effects: effects.into_iter().collect(),
        noise_rms_counts: 0.0,
    }
}

pub(crate) fn effect<const N: usize>(name: &str, parameters: [(&str, f64); N]) -> Effect {
    Effect::new(name, parameters).unwrap()
}

/// An effect with a free curve: places, and the values there.
pub(crate) fn free<const N: usize>(
    name: &str,
    parameters: [(&str, f64); N],
    at: &[f64],
    values: &[f64],
) -> Effect {
    let knots = Knots { at: at.to_vec(), values: values.to_vec() };
    Effect::of_knots(Definition::find(name).unwrap(), parameters, knots).unwrap()
}

/// As [`simulator`], with elements that answer in proportion and rest at 0.
pub(crate) fn linear(effects: impl IntoIterator<Item = Effect>) -> Simulator {
    let mut one = simulator(effects);
    let response = Response::uniform(48, 1000.0, 0.0);
    one.model = ForwardModel::new(one.model.array().clone(), one.model.psf(), response).unwrap();
    one
}

/// The signal of element 21 in mm under a tip at its centre that moves linearly from depth to depth (times in s, depths in
/// mm). Without effects it is the depth.
pub(crate) fn signals_mm<const N: usize>(effect: &Effect, depths: [(f64, f64); N]) -> [f64; N] {
    let one = linear([effect.clone()]);
    let mut pipeline = Pipeline::new(&one).unwrap();
    depths.map(|(t_s, depth_mm)| pipeline.step(Moment::at(t_s), &upon(&one, 21, depth_mm))[21] / 1000.0)
}

/// An array of elements so fine that under a point they read the spread itself, at x and y of 0, 1 and 4 mm, the
/// base model's of standard deviation 1 mm; the covering is 1.016 mm thick.
pub(crate) fn fine(effect: Effect) -> Simulator {
    let point = Indenter::Cylinder { diameter_mm: 1e-3 };
    let response = Response { reference_indenter: point.clone(), ..Response::uniform(9, 1.0, 0.0) };
    let centres = vec![0.0, 1.0, 4.0];
    let array = Array::new("fine", [1e-3; 2], centres.clone(), centres, 30.0, 4095.0, 1.0).unwrap();
    let mut one = simulator([effect]);
    one.model =
        ForwardModel::new(array, Psf { sigma_intercept_mm: 1.0, sigma_per_mm: 0.0 }, response).unwrap();
    one.indenter = point;
    one
}

/// Position of the tip over an element's centre at a depth, robot frame.
pub(crate) fn upon(simulator: &Simulator, element: usize, depth_mm: f64) -> [f64; 3] {
    let [x, y] = simulator.registration.to_robot(simulator.model.array().centre_mm(element).unwrap());
    [x, y, simulator.surface_mm - depth_mm]
}

/// Counts under a tip that rests at a position from the start.
pub(crate) fn still(simulator: &Simulator, tip_mm: [f64; 3]) -> Vec<f64> {
    Pipeline::new(simulator).unwrap().step(Moment::at(0.0), &tip_mm).to_vec()
}
