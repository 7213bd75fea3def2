//! Rivals of a further name: the effects that a model has, with a strength that is not the same everywhere.
//!
//! Real physics has not quite the form of the library, and what its form misses may look like a small effect of another class. A class that
//! stands beside others must beat what they would do if the strength of one of them varied: the change that it makes in the prediction, times a
//! function of a covariate that is straight between knots. The covariates are the time, the depth and the tip's place. Only a stronger effect is
//! such a rival: a weak one may be nearly in proportion to the signal, and times a function of the depth it would be any hardening.

use std::sync::{Arc, LazyLock};

use tactus_model::effect::REGISTRY;

use super::grow::{names, without};
use super::rivals::{Rival, hats};
use crate::data::{History, MISWIRED};
use crate::fit::{Direction, Fitted, Parameters, Problem};

/// With what an effect may vary.
const COVARIATES: [&str; 3] = ["time", "depth", "place"];

/// For each effect, the names of its rivals, by covariate.
static NAMES: LazyLock<Vec<(&str, [String; 3])>> = LazyLock::new(|| {
    let of = |name: &'static str| {
        (name, COVARIATES.map(|covariate| format!("{name} that varies with {covariate}")))
    };
    REGISTRY.iter().map(|definition| of(definition.name)).collect()
});

/// The effect that varies, if that is what a rival is.
pub(super) fn varying_effect(rival: &str) -> Option<&'static str> {
    NAMES.iter().find(|(_, names)| names.iter().any(|name| name == rival)).map(|(effect, _)| *effect)
}

/// The rivals at a model whose first terms are known.
pub(super) fn varying<'a>(
    problem: &Problem<'_>,
    at: &Fitted,
    known_terms: usize,
    history: &History,
) -> Vec<Rival<'a>> {
    if at.parameters.walk.is_some() {
        // A walk has any form in time.
        return Vec::new();
    }
    let touches: Vec<bool> = history.depth_mm.iter().map(|depth_mm| *depth_mm > 0.0).collect();
    let always = vec![true; touches.len()];
    let factors = [
        hats(&problem.predictor.bins.t_s, &always),
        hats(&history.depth_mm, &touches),
        history.place_mm.iter().flat_map(|place| hats(place, &always)).collect(),
    ];
    // A wire is right or wrong.
    let names = names(&at.parameters, known_terms).into_iter().filter(|name| *name != MISWIRED);
    let of_effect = |name: &'static str| {
        let less = without(&at.parameters, &[name], known_terms);
        let rivals = NAMES.iter().filter(move |(effect, _)| *effect == name).flat_map(|(_, rivals)| rivals);
        let with_factors: Vec<_> = rivals.zip(&factors).filter(|(_, factors)| !factors.is_empty()).collect();
        with_factors.into_iter().map(move |(rival, factors)| Rival::alone(rival, columns(&less, factors)))
    };
    names.flat_map(of_effect).collect()
}

/// The change that an effect makes, which a model lacks, and the same times each of these factors.
fn columns<'a>(less: &Parameters, factors: &[Vec<f64>]) -> Vec<Direction<'a>> {
    let change = Direction::Towards { parameters: less.clone(), step: -1.0, factor: None };
    let varied = |factor: &Vec<f64>| Direction::Times { direction: 0, factor: Arc::new(factor.clone()) };
    [change].into_iter().chain(factors.iter().map(varied)).collect()
}

#[cfg(test)]
#[path = "varying_tests.rs"]
mod tests;
