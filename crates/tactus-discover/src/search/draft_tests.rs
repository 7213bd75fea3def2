use nalgebra::DMatrix;

use super::super::evidence::{Addition, Evidence, Signs};
use super::width;

/// Two knots of a curve explain a residual of 30 standard deviations; a third one is seen by hardly a reading, and the products of its column
/// are those of rounding.
#[test]
fn a_knot_that_hardly_any_reading_sees_has_no_great_value() {
    let sizes = [10.0, 5.0, 1e-9];
    let along = [20.0, 22.0, 1e-3];
    let mut products = DMatrix::zeros(4, 4);
    for (knot, (size, along)) in sizes.iter().zip(along).enumerate() {
        products[(knot, knot)] = size * size;
        products[(knot, 3)] = size * along;
        products[(3, knot)] = size * along;
    }
    products[(3, 3)] = 900.0;
    let additions = [Addition {
        class: 0,
        directions: vec![0, 1, 2],
        widths: vec![width(30.0, sizes.into_iter()); 3],
        signs: vec![Signs::Both; 3],
        among: 1.0,
        is_free: false,
    }];
    let evidence = Evidence { additions: &additions, products: &products, variance: 1.0, present: &[] };
    let found = evidence.coefficients(&evidence.set([0]));
    let value = |knot: usize| found.iter().find(|(one, _)| *one == knot).map(|(_, value)| *value).unwrap();
    for (knot, want) in [(0, 2.0), (1, 4.4)] {
        assert!((value(knot) / want - 1.0).abs() < 0.02, "{knot}: {}", value(knot));
    }
    assert!(value(2).abs() < 1e-6, "{}", value(2));
}
