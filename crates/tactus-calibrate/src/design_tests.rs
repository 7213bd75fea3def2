use tactus_model::Psf;

use super::{DesignError, Reason, Wanted};
use crate::acuity::NYQUIST_SIGMA;

const PAPER: Wanted = Wanted { pitch_mm: 2.0, force_steps: 256, min_sigma: NYQUIST_SIGMA, psf: Psf::PAPER };

#[test]
fn the_papers_sensor_takes_the_thinnest_covering_as_the_paper_says() {
    let design = PAPER.design().unwrap();
    assert_eq!(design.reason, Reason::SensorAlreadyWider);
    // Eq. 4 inverted: (3 / pi - 1.11) / 0.497 pitches of 2 mm.
    assert!((design.wanted_thickness_mm.unwrap() + 0.624).abs() < 1e-3);
    let covered = design.recommended;
    assert!((covered.thickness_mm - 1.016).abs() < 1e-9 && covered.of_the_paper);
    assert!((covered.acuity.sigma - 1.362).abs() < 5e-4);
    assert!((covered.nyquist_passed - 1.05e-4).abs() < 1e-6, "{}", covered.nyquist_passed);
    // From the program of `acuity_tests`.
    assert_eq!(covered.acuity.locations, 117);
    assert_eq!((design.best_for_locating.sigma, design.best_for_locating.locations), (0.26, 485));
    assert!((0.1..0.45).contains(&design.best_for_two_points.sigma), "{:?}", design.best_for_two_points);
    let apart_mm = |covered: &super::Covered| covered.acuity.separation_mm.unwrap();
    assert!(design.best_for_two_points.separation_mm.unwrap() < apart_mm(&covered));
}

#[test]
fn a_thicker_covering_costs_acuity_and_lets_less_alias() {
    let curve = PAPER.design().unwrap().curve;
    let papers = curve.iter().filter(|covered| covered.of_the_paper);
    let sigmas: Vec<_> = papers.map(|covered| (100.0 * covered.acuity.sigma).round()).collect();
    assert_eq!(sigmas, [136.0, 174.0, 199.0, 237.0], "Fig. 5b");
    assert!(curve.windows(2).all(|pair| pair[0].thickness_mm < pair[1].thickness_mm));
    assert!(curve.windows(2).all(|pair| pair[0].acuity.locations >= pair[1].acuity.locations));
    assert!(curve.windows(2).all(|pair| pair[0].nyquist_passed > pair[1].nyquist_passed));
}

#[test]
fn what_eq_4_gives_is_recommended_where_it_can_be_had() {
    // 1.5 pitches of 2 mm: (3 - 2.22) / 0.497 = 1.569 mm.
    let design = Wanted { min_sigma: 1.5, ..PAPER }.design().unwrap();
    assert_eq!(design.reason, Reason::GivesWanted);
    assert!((design.recommended.thickness_mm - 1.57).abs() < 1e-9);
    assert!((1.5..1.503).contains(&design.recommended.acuity.sigma));
    assert!(design.curve.contains(&design.recommended));

    let thin = Wanted { min_sigma: 1.2, ..PAPER }.design().unwrap();
    assert_eq!((thin.reason, thin.recommended.of_the_paper), (Reason::ThinnerThanAvailable, true));
    let thick = Wanted { pitch_mm: 6.0, ..PAPER }.design().unwrap();
    assert_eq!(thick.reason, Reason::BeyondMeasured);
    assert!((thick.recommended.thickness_mm - 7.07).abs() < 1e-9, "{}", thick.recommended.thickness_mm);
}

#[test]
fn a_spread_that_no_covering_changes_is_taken_or_refused() {
    let psf = Psf { sigma_intercept_mm: 2.0, sigma_per_mm: 0.0 };
    let design = Wanted { psf, ..PAPER }.design().unwrap();
    assert_eq!((design.reason, design.wanted_thickness_mm), (Reason::SensorAlreadyWider, None));
    let error = Wanted { psf, min_sigma: 1.5, ..PAPER }.design().unwrap_err();
    assert!(matches!(error, DesignError::CoveringWithoutEffect { .. }), "{error}");
}

#[test]
fn numbers_that_make_no_sense_are_named_with_what_would() {
    let psf = Psf { sigma_intercept_mm: f64::NAN, ..Psf::PAPER };
    for (wanted, word) in [
        (Wanted { pitch_mm: 0.0, ..PAPER }, "the pitch must be 0.05 to 100 mm"),
        (Wanted { pitch_mm: f64::NAN, ..PAPER }, "the pitch"),
        (Wanted { force_steps: 1, ..PAPER }, "2 to 65536"),
        (Wanted { force_steps: 1_000_000, ..PAPER }, "2 to 65536"),
        (Wanted { min_sigma: -1.0, ..PAPER }, "0.05 to 10 pitches"),
        (Wanted { psf, ..PAPER }, "sigma_intercept_mm"),
        (Wanted { psf: Psf { sigma_intercept_mm: 1e4, ..psf }, ..PAPER }, "a spread must be"),
    ] {
        let error = wanted.design().unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
}
