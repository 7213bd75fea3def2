//! The measured models.

use anyhow::Result;
use tactus_model::{Array, ForwardModel, Psf, Response};

/// A model of an array. The spread is the paper's on the array that it was measured on, and one pitch on others (the
/// paper's Fig. 10). The response is slightly nonlinear, from a baseline of 0.
///
/// # Errors
/// If the parameters do not make a model.
pub fn model(array: Array) -> Result<ForwardModel> {
    let psf = if array == Array::digitacts() {
        Psf::PAPER
    } else {
        Psf { sigma_intercept_mm: array.pitch_mm(), sigma_per_mm: 0.0 }
    };
    with_psf(array, psf)
}

/// A model with `fineness` times as many rows and columns as the `DigiTacts` array, on about the same area and with the
/// same spread.
///
/// # Errors
/// If the parameters do not make a model.
pub fn even(fineness: u32) -> Result<ForwardModel> {
    let pitch_mm = 2.0 / f64::from(fineness);
    let centres = |count: u32| (0..count).map(|place| (f64::from(place) + 0.45) * pitch_mm).collect();
    let element_mm = [0.9 * pitch_mm; 2];
    let array =
        Array::new("even", element_mm, centres(8 * fineness), centres(6 * fineness), 30.0, 4095.0, 1.0)?;
    with_psf(array, Psf::PAPER)
}

fn with_psf(array: Array, psf: Psf) -> Result<ForwardModel> {
    let elements = array.elements();
    let response =
        Response { quadratic_per_mm: vec![0.05; elements], ..Response::uniform(elements, 1000.0, 0.0) };
    Ok(ForwardModel::new(array, psf, response)?)
}
