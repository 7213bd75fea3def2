use nalgebra::{DMatrix, DVector};
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
        unseen_gains: Vec::new(),
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
