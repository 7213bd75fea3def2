use super::*;
use crate::Effect;
use crate::effect::bench::free;
use crate::effect::{Definition, REGISTRY};

/// Every effect that may have a curve, with the curve.
fn curves() -> impl Iterator<Item = (&'static Definition, &'static FreeCurve)> {
    REGISTRY.iter().filter_map(|definition| Some((*definition, definition.curve.as_ref()?)))
}

fn hard(at_mm: &[f64], growth: &[f64]) -> Result<Effect, EffectError> {
    let knots = Knots { at: at_mm.to_vec(), values: growth.to_vec() };
    Effect::of_knots(Definition::find("hardening")?, [("own_share", 0.5)], knots)
}

#[test]
fn lines_run_from_0_through_the_knots_and_stay_after_the_last() {
    let knots = Knots { at: vec![1.0, 10.0, 1000.0], values: vec![0.5, 1.0, 3.0] };
    for (at, line, log_line) in [
        (0.0, 0.0, 0.0),
        (0.5, 0.25, 0.25),
        (1.0, 0.5, 0.5),
        (5.5, 0.75, 0.5 + 0.5 * 5.5_f64.log10()),
        (10.0, 1.0, 1.0),
        (100.0, 1.0 + 2.0 / 11.0, 2.0),
        (1e3, 3.0, 3.0),
        (1e9, 3.0, 3.0),
    ] {
        assert!((knots.line(at) - line).abs() < 1e-12, "{at}: {}", knots.line(at));
        assert!((knots.log_line(at) - log_line).abs() < 1e-12, "{at}: {}", knots.log_line(at));
    }
}

#[test]
fn what_breaks_the_rules_of_a_curve_is_refused() {
    let refused = |at_mm: &[f64], growth: &[f64]| hard(at_mm, growth).unwrap_err().to_string();
    let many: Vec<f64> = (1..=65).map(f64::from).collect();
    for (at_mm, growth) in [(&[][..], &[][..]), (&[0.1, 0.2], &[0.3]), (&many, &many)] {
        let [places, values] = [at_mm.len(), growth.len()];
        let error = "hardening: knots must be 1 to 64, with as many growth as at_mm, not";
        assert_eq!(refused(at_mm, growth), format!("{error} {values} and {places}"));
    }
    for (at_mm, growth, error) in [
        (0.0, 0.3, "at_mm[0] must be finite and above 0, not 0"),
        (f64::NAN, 0.3, "at_mm[0] must be finite and above 0, not NaN"),
        (0.5, 0.3, "at_mm[1] must be finite and above 0.5, not 0.4"),
        (0.2, -0.1, "growth[0] must be from 0 to 20, not -0.1"),
        (0.2, f64::INFINITY, "growth[0] must be from 0 to 20, not inf"),
        (0.2, 1.4, "growth[1] must be at least 0.7, so that it times the place does not fall, not 0.6"),
    ] {
        assert_eq!(refused(&[at_mm, 0.4], &[growth, 0.6]), format!("hardening: knots.{error}"));
    }
    // What a foam adds while its cells close stays, so its share of the depth falls again.
    assert!(hard(&[0.2, 0.4], &[1.2, 0.6]).is_ok());
    let saturation = Definition::find("saturation").unwrap();
    let falling = Knots { at: vec![0.2, 0.4], values: vec![0.7, 0.6] };
    assert_eq!(
        Effect::of_knots(saturation, [], falling).unwrap_err().to_string(),
        "saturation: knots.lost_share[1] must be at least 0.7, so that it does not fall, not 0.6"
    );
    assert_eq!(
        hard(&[0.1], &[0.2]).unwrap().with("exponent", 2.0).unwrap_err().to_string(),
        "hardening: exponent is replaced by the knots; leave it out"
    );
    let backlash = Definition::find("backlash").unwrap();
    let error = Effect::of_knots(backlash, [], Knots::default()).unwrap_err();
    assert_eq!(error.to_string(), "backlash: has no knots, only its parameters");
}

#[test]
fn an_effect_with_knots_lists_what_acts() {
    let one = hard(&[0.1], &[0.2]).unwrap();
    assert_eq!(one.parameters().collect::<Vec<_>>(), [("own_share", 0.5)]);
    assert_eq!((one.value("own_share"), one.value("exponent")), (Some(0.5), None));
    assert_eq!(one.with("own_share", 0.5).unwrap(), one);
    assert_eq!(one.with("own_share", 0.6).unwrap().knots(), one.knots());
    assert_ne!(hard(&[0.1], &[0.3]).unwrap(), one);
}

#[test]
fn a_curve_is_of_its_effect_and_begins_at_none() {
    for (definition, curve) in curves() {
        let name = definition.name;
        for replaced in curve.replaces {
            assert!(definition.parameters.iter().any(|one| one.name == *replaced), "{name}: {replaced}");
        }
        let values = (curve.formula)(Effect::neutral(definition).values(), &[0.1, 0.3, 2.0]);
        assert!(values.iter().all(|value| *value == 0.0) && values.len() == 3, "{name}: {values:?}");
        assert!(curve.range[0] <= 0.0 && curve.range[1] > 0.0 && !curve.of.is_empty(), "{name}");
    }
}

/// By rows of a table in the effect's file.
#[test]
fn each_curve_is_explained() {
    for (definition, curve) in curves() {
        let file =
            format!("{}/src/effect/{}.rs", env!("CARGO_MANIFEST_DIR"), definition.name.replace('-', "_"));
        let text = std::fs::read_to_string(file).unwrap();
        let [least, most] = curve.range;
        let rows =
            [format!("//! | `{}` | ", curve.at), format!("//! | `{}` | - | {least} to {most}", curve.of)];
        for row in rows {
            assert!(text.contains(&row), "{}: no row {row:?}", definition.name);
        }
    }
}

#[test]
fn the_formulas_values_at_fine_knots_act_as_the_formula() {
    let one = crate::effect::bench::effect(
        "hardening",
        [("growth_at_1_mm", 0.8), ("exponent", 2.0), ("own_share", 0.3)],
    );
    let at_mm: Vec<f64> = (1..=60).map(|k| 0.01 * f64::from(k)).collect();
    let curve = one.definition().curve.as_ref().unwrap();
    let growth = (curve.formula)(one.values(), &at_mm);
    let fine = free("hardening", [("own_share", 0.3)], &at_mm, &growth);
    let depths = [0.05, 0.233, 0.4, 0.555].map(|depth_mm| (0.0, depth_mm));
    let [formula, knots] = [&one, &fine].map(|one| crate::effect::bench::signals_mm(one, depths));
    assert!(
        formula.iter().zip(knots).all(|(one, other)| (one - other).abs() < 2e-5),
        "{formula:?} {knots:?}"
    );
}
