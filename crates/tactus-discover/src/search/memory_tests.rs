use std::cell::Cell;

use super::*;
use crate::data::TooLittle;
use crate::fixtures;

#[test]
fn what_is_known_of_a_model_is_not_computed_again() {
    let known = fixtures::known();
    let model = Parameters::declared(&known, 1);
    let mut other = model.clone();
    other.psf.sigma_intercept_mm += 1e-12;
    let computed = Cell::new(0);
    let kept: Kept<_> = Kept::default();
    let ask = |of: &Parameters| {
        kept.at(of, || {
            computed.set(computed.get() + 1);
            Ok(computed.get())
        })
        .unwrap()
    };
    assert_eq!([ask(&model), ask(&other), ask(&model), ask(&other)], [1, 2, 1, 2]);
}

#[test]
fn the_oldest_is_forgotten_and_a_failure_is_not_kept() {
    let known = fixtures::known();
    let model = |nth: usize| {
        let mut model = Parameters::declared(&known, 1);
        model.psf.sigma_intercept_mm += nth as f64;
        model
    };
    let kept: Kept<_> = Kept::default();
    let failed = kept.at(&model(0), || Err(TooLittle::FewPresses { fitted: 0, least: 1 }.into()));
    assert!(failed.is_err());
    for nth in 0..=MODELS_MAX {
        assert_eq!(kept.at(&model(nth), || Ok(nth)).unwrap(), nth);
    }
    assert_eq!(kept.at(&model(MODELS_MAX), || Ok(99)).unwrap(), MODELS_MAX);
    assert_eq!(kept.at(&model(0), || Ok(99)).unwrap(), 99);
}
