//! What a calibration found, beside the truth.

use std::collections::BTreeMap;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use tactus_runner::embedded::truth;
use tactus_schema::{Rig, rig::ElementFault};

/// How well the truth of one rig was recovered.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recovery {
    /// Errors of quantities, in units of their standard errors.
    pub errors: Vec<(String, f64)>,
    /// Faulty elements.
    pub planted: usize,
    /// Faulty elements that were not found, or called by a wrong name.
    pub missed: usize,
    /// Sound elements that were called faulty.
    pub accused: usize,
}

impl Recovery {
    /// Compares what `tactus calibrate --json` printed with the truth of its rig.
    ///
    /// # Errors
    /// If the rig is not simulated, or something is missing in `found`.
    pub fn of(rig: &Rig, found: &Value) -> Result<Self> {
        let truth = truth(rig).context("the rig is simulated")?;
        let mut errors = Vec::new();
        let mut hold = |name: &str, estimate: &Value, truth: f64| {
            let [value, error] = [number(&estimate["value"])?, number(&estimate["standard_error"])?];
            errors.push((name.to_owned(), (value - truth) / error));
            anyhow::Ok(())
        };
        let place = &found["registration"];
        hold("origin x", &place["origin_mm"][0], truth.registration.origin_mm[0])?;
        hold("origin y", &place["origin_mm"][1], truth.registration.origin_mm[1])?;
        hold("rotation", &place["rotation_deg"], truth.registration.rotation_deg)?;
        hold("surface", &place["surface_mm"], truth.surface_mm)?;
        hold("scale", &place["scale"], 1.0)?;
        let response = truth.model.response();
        for one in list(&found["response"]["elements"])? {
            let sensitivity = response.sensitivity_counts_per_mm.get(element(one)?);
            hold(
                "gains",
                &one["sensitivity_counts_per_mm"],
                *sensitivity.context("there is such an element")?,
            )?;
        }
        let quadratic_per_mm = response.quadratic_per_mm.first().context("there are elements")?;
        hold("curvature", &found["response"]["shared_quadratic_per_mm"], *quadratic_per_mm)?;
        let psf = truth.model.psf();
        for covering in list(&found["thickness"]["coverings"])? {
            let covering_mm = number(&covering["covering_mm"])?;
            let name = format!("sigma, {covering_mm:.3} mm");
            hold(&name, &covering["sigma_mm"], psf.sigma_intercept_mm + psf.sigma_per_mm * covering_mm)?;
        }
        let line = &found["thickness"]["linear"]["coefficients"];
        hold("intercept", &line[0], psf.sigma_intercept_mm)?;
        hold("slope", &line[1], psf.sigma_per_mm)?;

        let mut accusations = BTreeMap::new();
        for fault in list(&found["health"]["faults"])? {
            accusations.insert(element(fault)?, &fault["kind"]);
        }
        let is_named = |element: &usize, fault: &ElementFault| {
            accusations.get(element).is_some_and(|kind| names(kind, fault))
        };
        Ok(Self {
            errors,
            planted: truth.faults.len(),
            missed: truth.faults.iter().filter(|(element, fault)| !is_named(element, fault)).count(),
            accused: accusations.keys().filter(|element| !truth.faults.contains_key(element)).count(),
        })
    }
}

/// True if a finding is this fault.
fn names(kind: &Value, fault: &ElementFault) -> bool {
    match fault {
        ElementFault::Dead => kind["kind"] == "dead",
        ElementFault::Stuck { counts } => kind["kind"] == "stuck" && kind["counts"] == f64::from(*counts),
        ElementFault::Noisy { .. } => kind["kind"] == "noisy",
        ElementFault::Miswired { answers_for } => {
            kind["kind"] == "cross-wired" && kind["answers_for"] == *answers_for as u64
        }
    }
}

fn element(one: &Value) -> Result<usize> {
    Ok(usize::try_from(one["element"].as_u64().context("an element has a number")?)?)
}

fn number(value: &Value) -> Result<f64> {
    value.as_f64().with_context(|| format!("{value} is a number"))
}

fn list(value: &Value) -> Result<&Vec<Value>> {
    value.as_array().with_context(|| format!("{value} is a list"))
}
