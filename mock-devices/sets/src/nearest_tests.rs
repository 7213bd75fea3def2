use tactus_hidden::CATALOGUE;

use super::*;
use crate::{Amount, Content, NoiseKind, Recipe};

/// Of a set with a thermometer.
const SEED: u64 = 5;

/// A short set with one physics.
fn fits(id: &str, effect: &str, strength: f64) -> ClassFits {
    let recipe = Recipe {
        frames: Some(2500),
        noise: NoiseKind::White,
        content: Content { physics: vec![id.into()], ..Content::default() },
        amount: Amount::Strength(strength),
        ..Recipe::new(SEED)
    };
    let label = recipe.make().unwrap().label;
    recipe.class_fit(&label.physics[0], effect).unwrap()
}

#[test]
fn the_right_form_fits_and_a_wrong_one_does_not() {
    let right = fits("stretched-spread", "anisotropic-spread", 0.5);
    assert!(right.shrink("anisotropic-spread").unwrap() > 0.9999, "{right:?}");
    let wrong = fits("stretched-spread", "time-lag", 0.5);
    assert!(wrong.shrink("time-lag").unwrap() < 0.1, "{wrong:?}");
}

/// The library's form, but not in the same numbers: crosstalk of counts, not of mm, so that gains that scatter by 10 % count; scans
/// of a path, not of frames with straight lines between them; the last speed of loading, not the greatest.
const SAME_FORM: [&str; 5] =
    ["crosstalk-neighbours", "crosstalk-column", "scan-rows", "scan-elements", "rate-logarithmic"];

#[test]
fn a_library_point_is_fitted_by_the_librarys_own_form() {
    let points = CATALOGUE.iter().filter(|physics| physics.is_library_point);
    for physics in points.filter(|physics| !SAME_FORM.contains(&physics.id)) {
        let effect = physics.effect.unwrap();
        let shrink = fits(physics.id, effect, 0.7).shrink(effect).unwrap();
        assert!(shrink > 0.999, "{}: {shrink}", physics.id);
    }
}

#[test]
fn the_nearest_wrong_effect_counts() {
    let effects = [("a", 3.0), ("b", 5.0), ("c", 40.0)].map(|(name, z)| (name.to_owned(), z));
    let fits = ClassFits { base: 50.0, effects: effects.into() };
    assert_eq!(fits.z_name("a"), Some(4.0));
    assert_eq!(fits.z_name("b"), Some(0.0));
    assert_eq!(fits.z_name("d"), None);
}

#[test]
fn no_effect_fits_worse_than_the_base_model() {
    let effects = [("a", 3.0), ("b", 460.0), ("c", 52.0)].map(|(name, z)| (name.to_owned(), z));
    let fits = ClassFits { base: 5.0, effects: effects.into() };
    assert_eq!(fits.z_name("a"), Some(4.0));
    assert_eq!(fits.z_name("b"), Some(0.0));
}

#[test]
fn a_tone_is_found_by_its_line() {
    let series: Vec<f64> = (0..900).map(|frame| (TAU * 3.21 * f64::from(frame) / 30.0).sin()).collect();
    assert!((strongest_hz(&series, 30.0) - 3.21).abs() < 30.0 / 1800.0);
}
