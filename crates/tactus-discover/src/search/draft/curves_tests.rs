use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tactus_model::Covariate;
use tactus_model::effect::{Carrier, Law, When};

use super::{Curve, Reduced, reduced};
use crate::search::draft::grammar::Atom;

const AT: [f64; 7] = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6];

/// The curve of a law, whose knots are known each with this standard error.
fn curve(law: &Law, error: f64) -> Curve {
    Curve {
        values: DVector::from_iterator(AT.len(), AT.iter().map(|at| law.value(&[*at]))),
        gram: DMatrix::identity(AT.len(), AT.len()) / (error * error),
        determined: 0.0,
    }
}

fn atom() -> Atom {
    Atom::of(Carrier::Counts, When::Always, Covariate::Depth, AT.to_vec())
}

#[test]
fn a_curve_becomes_the_law_that_passes_through_it() {
    for law in [
        Law::Linear { offset: 2.0, slope: 5.0 },
        Law::Power { scale: 20.0, exponent: 2.0 },
        Law::Exponential { scale: 6.0, length: 0.15 },
        Law::Saturating { scale: 6.0, length: 0.15 },
    ] {
        let found = reduced(&atom(), &curve(&law, 0.05), 5.0).law;
        assert_eq!(found.name(), law.name(), "{found:?}");
        for at in AT {
            let [got, want] = [&found, &law].map(|law| law.value(&[at]));
            assert!((got - want).abs() < 0.05, "{law:?} at {at}: {got}");
        }
    }
}

#[test]
fn what_no_law_passes_through_stays_a_table() {
    let bump = Curve {
        values: DVector::from_column_slice(&[0.0, 0.0, 3.0, 0.0, -3.0, 0.0, 0.0]),
        ..curve(&Law::Linear { offset: 0.0, slope: 0.0 }, 0.05)
    };
    let found = reduced(&atom(), &bump, 5.0);
    let Law::Table { at, values } = found.law else { panic!("{:?}", found.law) };
    assert_eq!((at, values[2]), (vec![AT.to_vec()], 3.0));
    assert!((found.knots[2][2] - 0.05).abs() < 1e-6, "its standard error");
}

/// Noise alone makes many fine knots miss the law that they follow, by as much as there are.
#[test]
fn fine_knots_may_miss_their_law_by_their_noise() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let places: Vec<f64> = (0..28).map(|knot| 0.02 * f64::from(knot)).collect();
    let fine = Atom::of(Carrier::Counts, When::Always, Covariate::Depth, places.clone());
    let law = Law::Exponential { scale: 6.0, length: 0.15 };
    let error = 0.05;
    // Uniform, with the variance of the error.
    let mut noise = || error * 12.0_f64.sqrt() * rng.random_range(-0.5..0.5);
    let mut one = |determined| Curve {
        values: DVector::from_iterator(28, places.iter().map(|at| law.value(&[*at]) + noise())),
        gram: DMatrix::identity(28, 28) / (error * error),
        determined,
    };
    assert_eq!(reduced(&fine, &one(28.0), 5.0).law.name(), "exponential");
    assert_eq!(
        reduced(&fine, &one(0.0), 5.0).law.name(),
        "table",
        "values that are not of the data have no noise"
    );
    let mut bent = one(28.0);
    bent.values[14] += 6.0 * error;
    assert_eq!(reduced(&fine, &bent, 5.0).law.name(), "table");
}

#[test]
fn a_constant_that_costs_nothing_is_dropped() {
    // Recalibration takes up any constant: it has no place in the products.
    let law = Law::Saturating { scale: -0.2, length: 0.3 };
    let mut one = curve(&law, 0.002);
    let projection = DMatrix::identity(7, 7) - DMatrix::from_element(7, 7, 1.0 / 7.0);
    one.gram = &projection * one.gram * &projection;
    one.values.add_scalar_mut(0.37);
    let Reduced { law: found, knots, .. } = reduced(&atom(), &one, 5.0);
    // The knots lie on the law, with the errors of what differs between them.
    for [at, value, error] in knots {
        assert!((value - found.value(&[at])).abs() < 0.01 && error < 0.003, "{at}: {value} +- {error}");
    }
    let rise = |law: &Law| law.value(&[0.6]) - law.value(&[0.0]);
    assert!((rise(&found) - rise(&law)).abs() < 0.01, "{found:?}");
    assert!(!matches!(found, Law::Table { .. }), "{found:?}");
}

/// No reading is before the first release: baselines take up any constant. What a release leaves is over in time.
#[test]
fn what_follows_an_event_is_over_in_time() {
    let law = Law::Exponential { scale: 6.0, length: 0.15 };
    let mut one = curve(&law, 0.05);
    let projection = DMatrix::identity(7, 7) - DMatrix::from_element(7, 7, 1.0 / 7.0);
    one.gram = &projection * one.gram * &projection;
    one.values.add_scalar_mut(-3.0);
    let since = Atom::of(Carrier::Counts, When::Always, Covariate::SinceRelease, AT.to_vec());
    let found = reduced(&since, &one, 5.0).law;
    assert!(matches!(found, Law::Exponential { scale, .. } if (scale - 6.0).abs() < 0.2), "{found:?}");
    let found = reduced(&atom(), &one, 5.0).law;
    assert!(matches!(found, Law::Saturating { scale, .. } if (scale + 6.0).abs() < 0.2), "{found:?}");
}

#[test]
fn a_table_with_a_constant_that_nothing_shows_begins_at_nothing() {
    let mut bump = Curve {
        values: DVector::from_column_slice(&[0.5, 0.5, 3.5, 0.5, -2.5, 0.5, 0.5]),
        ..curve(&Law::Linear { offset: 0.0, slope: 0.0 }, 0.05)
    };
    let projection = DMatrix::identity(7, 7) - DMatrix::from_element(7, 7, 1.0 / 7.0);
    bump.gram = &projection * bump.gram * &projection;
    let found = reduced(&atom(), &bump, 5.0);
    let Law::Table { values, .. } = found.law else { panic!("{:?}", found.law) };
    assert_eq!(values, [0.0, 0.0, 3.0, 0.0, -3.0, 0.0, 0.0]);
    assert!(found.knots.iter().all(|[_, _, error]| *error < 0.06), "{:?}", found.knots);
}

/// Counts are whatever a converter makes of them.
#[test]
fn a_law_does_not_depend_on_the_unit_of_its_covariate() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    for law in [
        Law::Linear { offset: 2.0, slope: 5.0 },
        Law::Power { scale: 20.0, exponent: 2.6 },
        Law::Exponential { scale: 6.0, length: 0.15 },
    ] {
        let scatter = DVector::from_fn(AT.len(), |_, _| 0.05 * rng.random_range(-1.0..1.0));
        let one = Curve { values: &curve(&law, 0.05).values + scatter, ..curve(&law, 0.05) };
        let in_unit = |unit: f64| {
            let places = AT.iter().map(|at| unit * at).collect();
            let atom = Atom::of(Carrier::Counts, When::Always, Covariate::Counts, places);
            let found = reduced(&atom, &one, 5.0);
            let values: Vec<f64> = AT.iter().map(|at| found.law.value(&[unit * at])).collect();
            (found.law.name(), values)
        };
        let (name, expected) = in_unit(1.0);
        for unit in [1e-5, 1.0 / 4095.0, 1e3, 1e7] {
            let (other, values) = in_unit(unit);
            assert_eq!(other, name, "{law:?} in {unit}");
            for (value, expected) in values.iter().zip(&expected) {
                assert!((value - expected).abs() < 1e-6, "{law:?} in {unit}: {value}, not {expected}");
            }
        }
    }
}
