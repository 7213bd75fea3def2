use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tactus_model::effect::{By, Definition, Knots, Table};
use tactus_model::{Effect, Indenter};

use crate::fixtures::{ELEMENTS, found, known, measured};
use crate::{Discovery, Known, Verdict};

const NOISE_COUNTS: f64 = 2.0;

/// What discovery finds in presses of a sensor with an effect and white noise.
fn discovered(effect: Effect) -> Discovery {
    discovered_by(&known(), effect)
}

/// What it finds with a model that may have effects already.
fn discovered_by(model: &Known, effect: Effect) -> Discovery {
    found(model, &measured(&known(), &[effect], &white()))
}

fn white() -> Vec<Vec<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    (0..30 * ELEMENTS).map(|_| (0..ELEMENTS).map(|_| NOISE_COUNTS * normal()).collect()).collect()
}

fn free(name: &str, parameters: &[(&str, f64)], at: Vec<f64>, value: impl Fn(f64) -> f64) -> Effect {
    let values = at.iter().map(|at| value(*at)).collect();
    let definition = Definition::find(name).unwrap();
    Effect::of_knots(definition, parameters.iter().copied(), Knots { at, values }).unwrap()
}

#[test]
fn a_form_that_no_formula_has_is_found_as_knots() {
    // Chains that come to the end of their length (Gent 1996): no power of depth.
    let at_mm: Vec<f64> = (1..=60).map(|k| 0.01 * f64::from(k)).collect();
    let growth = |at_mm: f64| 1.0 / (1.0 - 1.4 * at_mm) - 1.0;
    let found = discovered(free("hardening", &[("own_share", 0.0)], at_mm, growth));
    let step = found
        .steps
        .iter()
        .find(|step| step.effect == "hardening")
        .unwrap_or_else(|| panic!("{:?}", found.steps));
    let [curve] = &step.curves[..] else { panic!("{step:?}") };
    let formula = curve.formula.as_ref().unwrap();
    // A factor of all depths is the elements' gain, so only the shape is determined.
    let shape = |values: &[f64]| {
        let at =
            |at_mm: f64| values[curve.knots.iter().position(|knot| (knot.at - at_mm).abs() < 1e-9).unwrap()];
        [0.3, 0.5].map(|at_mm| (1.0 + at(at_mm)) / (1.0 + at(0.2)))
    };
    let want = [0.3, 0.5].map(|at_mm| (1.0 + growth(at_mm)) / (1.0 + growth(0.2)));
    let apart =
        |got: [f64; 2]| got.iter().zip(want).map(|(got, want)| (got / want - 1.0).abs()).fold(0.0, f64::max);
    let values: Vec<f64> = curve.knots.iter().map(|knot| knot.value).collect();
    let [of_knots, of_formula] = [&values, &formula.values].map(|values| apart(shape(values)));
    assert!(of_knots < 0.02 && of_knots < of_formula, "{of_knots} {of_formula}: {curve:?}");
    let effect = found.effects.iter().find(|effect| effect.name() == "hardening").unwrap();
    assert_eq!(effect.knots().unwrap().values, values);
    let [of_formula, of_knots] = [formula.heldout_rms_counts, step.heldout_rms_after_counts];
    assert!(of_knots < NOISE_COUNTS * 1.02 && of_formula > of_knots + 0.05, "{of_formula} {of_knots}");
}

#[test]
fn what_the_formula_explains_keeps_it() {
    let effects = [
        Effect::new("hardening", [("growth_at_1_mm", 1.5), ("exponent", 2.0), ("own_share", 0.0)]).unwrap(),
        Effect::new("saturation", [("loss_at_1_mm", 0.5), ("knee", 2.0)]).unwrap(),
    ];
    for effect in effects {
        let name = effect.name();
        let found = discovered(effect);
        let [step] = &found.steps[..] else { panic!("{name}: {:?}", found.steps) };
        assert_eq!(step.effect, name);
        assert!(step.curves.is_empty(), "{step:?}");
    }
}

#[test]
fn knots_of_a_known_effect_are_fitted_again() {
    let layer = |growth: f64| {
        let growth = move |at_mm: f64| if at_mm < 0.25 { 0.0 } else { growth };
        free("hardening", &[("own_share", 0.0)], vec![0.2, 0.3, 0.5], growth)
    };
    let model = Known { effects: vec![layer(0.3)], ..known() };
    let found = discovered_by(&model, layer(0.5));
    assert_eq!((found.verdict, found.steps.len()), (Verdict::NothingMissing, 0));
    let [effect] = &found.effects[..] else { panic!("{:?}", found.effects) };
    let knots = effect.knots().unwrap();
    // The elements' gains may take a factor of all depths.
    let ratio = (1.0 + knots.values[2]) / (1.0 + knots.values[0]);
    assert!((ratio - 1.5).abs() < 0.01, "{knots:?}");
    assert_eq!(knots.at, [0.2, 0.3, 0.5]);
}

/// A guide that is bent: no shift, turn, scale or skew is like it.
#[test]
fn a_parameter_that_differs_with_the_place_is_found_as_a_table() {
    let at = vec![0.9, 4.5, 8.1, 11.7, 15.3];
    let values = vec![0.2, 0.05, 0.0, 0.05, 0.2];
    let straight = Effect::neutral(Definition::find("misregistration").unwrap());
    let bent = straight.with_table("offset_y_mm", Table { by: By::X, at, values: values.clone() }).unwrap();
    let found = discovered(bent);
    let [step] = &found.steps[..] else { panic!("{:?}", found.steps) };
    assert_eq!(step.effect, "misregistration");
    let [table] = &step.curves[..] else { panic!("{step:?}") };
    assert!(table.is_table(), "{table:?}");
    assert_eq!((table.of, table.at, &table.formula), ("offset_y_mm", "x_mm", &None));
    for (knot, value) in table.knots.iter().zip(values) {
        assert!((knot.value - value).abs() < 0.02, "{table:?}");
    }
    let effect = found.effects.iter().find(|effect| effect.name() == "misregistration").unwrap();
    let (_, of_model) = effect.tables().next().unwrap();
    assert_eq!(of_model.values, table.knots.iter().map(|knot| knot.value).collect::<Vec<_>>());
}

/// A covering that settles: no constant offset, and no gain that falls, is like it at all depths.
#[test]
fn a_parameter_that_differs_with_time_is_found_as_a_table() {
    let settling = Table { by: By::Time, at: vec![0.0, 40.0, 140.0], values: vec![0.0, -0.05, -0.08] };
    let still = Effect::neutral(Definition::find("surface-offset").unwrap());
    let found = discovered(still.with_table("offset_mm", settling.clone()).unwrap());
    let [step] = &found.steps[..] else { panic!("{:?}", found.steps) };
    assert_eq!(step.effect, "surface-offset");
    let [table] = &step.curves[..] else { panic!("{step:?}") };
    assert_eq!((table.of, table.at), ("offset_mm", "time_s"));
    for knot in &table.knots {
        assert!((knot.value - settling.value(knot.at)).abs() < 0.005, "{table:?}");
    }
}

/// A wide tool that is worn down: a gain that falls leaves a sixth of it, whatever its form, and the tool's size next to nothing.
#[test]
fn a_free_part_that_leaves_hardly_anything_wins_over_a_formula() {
    let wide = Indenter::Cylinder { diameter_mm: 5.0 };
    let known = Known { indenters: [("cyl1".to_owned(), wide)].into(), ..known() };
    let worn = Table { by: By::Time, at: vec![0.0, 40.0, 140.0], values: vec![1.0, 0.85, 0.7] };
    let new = Effect::neutral(Definition::find("indenter-size").unwrap());
    let effects = [new.with_table("ratio", worn.clone()).unwrap()];
    let found = found(&known, &measured(&known, &effects, &white()));
    let step = &found.steps[0];
    assert_eq!(step.effect, "indenter-size", "{:?}", found.contests);
    let [table] = &step.curves[..] else { panic!("{step:?}") };
    assert_eq!((table.of, table.at), ("ratio", "time_s"));
    // The elements' gains may take a factor of all times.
    for knot in &table.knots {
        let [found, wanted] = [knot.value / table.knots[0].value, worn.value(knot.at)];
        assert!((found - wanted).abs() < 0.01, "{table:?}");
    }
}
