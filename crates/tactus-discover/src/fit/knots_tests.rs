use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tactus_model::effect::Definition;

use super::*;
use crate::fit::{Free, Prepared};
use crate::fixtures::{ELEMENTS, OPTIONS, known, measured, processes};

fn term(effect: &str, at: &[f64], values: &[f64]) -> Term {
    let knots = Knots { at: at.to_vec(), values: values.to_vec() };
    Term { knots: Some(knots), ..Term::neutral(Definition::find(effect).unwrap()) }
}

fn values(term: &Term) -> Vec<f64> {
    term.knots.clone().unwrap().values
}

fn assert_near(got: &[f64], want: &[f64]) {
    let near = got.len() == want.len() && got.iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-12);
    assert!(near, "{got:?} {want:?}");
}

#[test]
fn a_curve_that_must_not_fall_moves_from_a_knot_on() {
    let mut softening = term("softening", &[0.1, 0.2, 0.3], &[0.1, 0.3, 0.3]);
    assert_near(&[softening.move_knot(1, 0.5)], &[0.5]);
    assert_near(&values(&softening), &[0.1, 0.8, 0.8]);
    // Not below the knot before.
    assert_near(&[softening.least_step(1), softening.move_knot(1, -2.0)], &[-0.7, -0.7]);
    assert_near(&values(&softening), &[0.1, 0.1, 0.1]);
    assert_near(&[softening.move_knot(0, 100.0)], &[0.9]);
    assert!(softening.effect().is_ok());
}

#[test]
fn what_a_curve_adds_moves_from_a_knot_on() {
    // Products of value and place: 0.1, 0.2 and 0.2.
    let mut hardening = term("hardening", &[0.1, 0.2, 0.4], &[1.0, 1.0, 0.5]);
    assert_near(&[hardening.move_knot(1, 0.5)], &[0.5]);
    assert_near(&values(&hardening), &[1.0, 1.5, 0.75]);
    assert_near(
        &[hardening.moves_with(2, 1), hardening.moves_with(2, 2), hardening.moves_with(1, 0)],
        &[0.5, 1.0, 0.5],
    );
    assert_near(&[hardening.least_step(1), hardening.move_knot(1, -2.0)], &[-1.0, -1.0]);
    assert_near(&values(&hardening), &[1.0, 0.5, 0.25]);
    // The range holds for each value.
    assert_near(&[hardening.least_step(0), hardening.move_knot(2, 100.0)], &[-1.0, 19.75]);
    assert!(hardening.effect().is_ok());
}

#[test]
fn weights_move_one_by_one_and_stay_above_0() {
    let mut relaxation = term("relaxation", &[0.1, 1.0], &[0.2, 0.3]);
    assert_near(&[relaxation.move_knot(0, -0.5), relaxation.move_knot(1, 0.1)], &[-0.2, 0.1]);
    assert_near(&values(&relaxation), &[0.0, 0.4]);
    assert!(relaxation.effect().is_ok());
}

#[test]
fn a_bounded_step_is_the_best_within_the_bounds() {
    // Independent: each by itself.
    let identity = DMatrix::identity(3, 3);
    let right = DVector::from_row_slice(&[1.0, -1.0, -1.0]);
    let free = f64::NEG_INFINITY;
    let step = bounded(&identity, &right, 0.0, &[1.0; 3], &[0.0, 0.0, free]);
    assert!((step - DVector::from_row_slice(&[1.0, 0.0, -1.0])).norm() < 1e-6);
    // Two that nearly do the same: all goes to the one that may rise. By hand, 1.9 = 2 x with the other at 0.
    let twins = DMatrix::from_row_slice(2, 2, &[2.0, 1.9, 1.9, 2.0]);
    let step = bounded(&twins, &DVector::from_row_slice(&[1.9, 1.5]), 0.0, &[2.0; 2], &[0.0, 0.0]);
    assert!((step - DVector::from_row_slice(&[0.95, 0.0])).norm() < 1e-6);
}

#[test]
fn a_bounded_step_leaves_nothing_to_gain() {
    // The conditions of Kuhn and Tucker for products of columns that are far from independent.
    let columns =
        DMatrix::from_fn(40, 9, |row, k| 1.0 - (-(row as f64) / 2.0_f64.powf(k as f64 - 1.0)).exp());
    let target = DVector::from_fn(40, |row, _| ((row * row) as f64 * 0.37).sin() + 0.02 * row as f64);
    let (gram, right) = (columns.transpose() * &columns, columns.transpose() * target);
    let squares: Vec<f64> = gram.diagonal().iter().copied().collect();
    let damping = 1e-6;
    let step = bounded(&gram, &right, damping, &squares, &[-0.1; 9]);
    for index in 0..9 {
        let pull = (&right - &gram * &step)[index] - damping * squares[index] * step[index];
        let is_held = step[index] <= -0.1 + 1e-9;
        assert!(step[index] > -0.1 - 1e-9, "{index}: {}", step[index]);
        assert!(if is_held { pull < 1e-5 } else { pull.abs() < 1e-5 }, "{index}: {pull} at {}", step[index]);
    }
}

#[test]
fn terms_of_a_class_add_to_one_curve_within_its_rules() {
    let hardening = Definition::find("hardening").unwrap();
    let curve = hardening.curve.as_ref().unwrap();
    let power = |growth: f64, exponent: f64| {
        let mut term = Term::neutral(hardening);
        term.values[..2].copy_from_slice(&[growth, exponent]);
        term
    };
    let knots = of_formulas(curve, &[power(1.0, 1.0), power(2.0, 2.0)], &[0.1, 0.5]);
    assert_near(&knots.values, &[0.12, 1.0]);
    let relaxation = Definition::find("relaxation").unwrap();
    let mut rising = Term::neutral(relaxation);
    rising.values[0] = -0.3;
    let none = of_formulas(relaxation.curve.as_ref().unwrap(), &[rising], &[1.0, 10.0]);
    assert_near(&none.values, &[0.0, 0.0]);
}

#[test]
fn the_places_of_a_table_share_one_direction_by_their_weights() {
    let known = known();
    let noise = processes(ELEMENTS, 1.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(5));
    let frames = measured(&known, &[], &noise);
    let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
    let problem = prepared.problem();
    let definition = Definition::find("indenter-size").unwrap();
    let parameter = definition.parameters.iter().position(|one| one.varies.contains(&By::Depth)).unwrap();
    let at = table_places(By::Depth, &frames, &known.registration).unwrap();
    let neutral = definition.parameters[parameter].neutral;
    let values: Vec<f64> = (0..at.len()).map(|place| neutral + 0.02 * place as f64).collect();
    let table = Table { by: By::Depth, at, values };
    let places = table.at.len();
    let model =
        prepared.base.parameters.with(Term { tables: vec![(parameter, table)], ..Term::neutral(definition) });
    let free: Vec<Free> = (0..places).map(|knot| Free::Knot { term: model.terms.len() - 1, knot }).collect();
    let predicted = problem.predict(&model).unwrap();
    let products = |directions| problem.eliminated(&model, &predicted, directions).unwrap().reduced;
    let of_table = |(number, one): (usize, &Free)| problem.of_table(&model, *one, number).unwrap();
    let shared = products(free.iter().enumerate().map(of_table).collect());
    // Each place moved by itself: the same but for the curvature within a small step.
    let apart = products(free.iter().map(|one| problem.towards(&model, *one)).collect());
    for row in 0..=places {
        for column in 0..=places {
            let scale = (apart[(row, row)] * apart[(column, column)]).sqrt();
            let [found, wanted] = [shared[(row, column)], apart[(row, column)]];
            assert!(
                scale > 0.0 && (found - wanted).abs() < 5e-3 * scale,
                "{row}, {column}: {found} {wanted}"
            );
        }
    }
}

#[test]
fn the_places_of_a_table_are_those_that_the_presses_tell_apart() {
    let known = known();
    let noise = vec![vec![0.0; ELEMENTS]; 30 * ELEMENTS];
    let frames = measured(&known, &[], &noise);
    let places = |by| table_places(by, &frames, &known.registration).unwrap();
    // Presses are up to 0.5 mm deep. The first frames in contact are near 0.5 s, the last near 143 s.
    // Of eight that get closer to the surface the two below the first depth, 0.07 mm, would have no frame.
    let depths_mm: Vec<f64> = (2..8).map(|k| 0.5 * (f64::from(k) / 7.0).powi(2)).collect();
    assert_near(&places(By::Depth), &depths_mm);
    let times = places(By::Time);
    assert_eq!(times.len(), 8);
    for (k, time_s) in (0..).zip(&times) {
        assert!((time_s - (0.5 + 142.5 * f64::from(k) / 7.0)).abs() < 3.0, "{times:?}");
    }
    let [x_mm, y_mm] = [places(By::X), places(By::Y)];
    for (mm, apart) in x_mm.windows(2).chain(y_mm.windows(2)).map(|two| (two, two[1] - two[0])) {
        assert!(apart > 1.0, "{mm:?}");
    }
}
