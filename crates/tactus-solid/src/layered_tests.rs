use std::f64::consts::PI;

use super::{BaseContact, Layer, LayerError};
use crate::quadrature::integrate;

fn bonded(poisson_ratio: f64) -> Layer {
    Layer::new(1.0, poisson_ratio, BaseContact::Bonded).unwrap()
}

fn sliding() -> Layer {
    Layer::new(1.0, 0.3, BaseContact::Frictionless).unwrap()
}

/// `p h^2 / P` at seven distances, found by a separate program that solves the layer's four boundary conditions
/// as linear equations for every wave number.
const AT: [f64; 7] = [0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0];
const SOLVED: [(f64, [f64; 7]); 3] = [
    (0.30, [0.69417, 0.58632, 0.36805, 0.08115, 0.00990, 0.00024, 0.00044]),
    (0.45, [0.72483, 0.60639, 0.36924, 0.06977, 0.00537, 0.00049, 0.00154]),
    (0.49, [0.74401, 0.62004, 0.37274, 0.06527, 0.00329, 0.00042, 0.00187]),
];

#[test]
fn the_pressure_is_that_of_the_boundary_conditions_solved() {
    for (poisson_ratio, solved) in SOLVED {
        let pressure = bonded(poisson_ratio).under_point();
        for (distance, solved) in AT.into_iter().zip(solved) {
            let found = pressure.pressure_per_mm2(distance);
            assert!(
                (found - solved).abs() < 0.6e-5,
                "nu {poisson_ratio}, r {distance}: {found} for {solved}"
            );
        }
    }
}

#[test]
fn even_pressure_passes_unchanged() {
    for layer in [bonded(0.0), bonded(0.3), bonded(0.5), sliding()] {
        assert!((layer.transfer(0.0) - 1.0).abs() < 1e-15);
        assert!((layer.transfer(1e-4) - 1.0).abs() < 1e-7, "and smoothly so");
    }
}

#[test]
fn the_transfer_is_the_stated_quotient() {
    for k in [0.3_f64, 1.0, 2.5, 7.0] {
        let (sinh, cosh) = (k.sinh(), k.cosh());
        let frictionless = 2.0 * (sinh + k * cosh) / ((2.0 * k).sinh() + 2.0 * k);
        assert!((sliding().transfer(k) / frictionless - 1.0).abs() < 1e-13);
        let kappa = 3.0 - 4.0 * 0.45;
        let above = 2.0 * (kappa + 1.0) * (f64::midpoint(kappa, 1.0) * cosh + k * sinh);
        let below = 2.0 * kappa * (2.0 * k).cosh() + 4.0 * k * k + 1.0 + kappa * kappa;
        assert!((bonded(0.45).transfer(k) * below / above - 1.0).abs() < 1e-13);
    }
    assert!(bonded(0.45).transfer(1e4).abs() < 1e-300, "short waves do not overflow");
}

#[test]
fn all_of_the_force_arrives() {
    for layer in [bonded(0.3), bonded(0.49), bonded(0.5), sliding()] {
        for pressure in [layer.under_point(), layer.under_disc(1.5)] {
            let all = pressure.force_within(39.0);
            assert!((all - 1.0).abs() < 1e-11, "{layer:?}: {all}");
        }
    }
    // A rectangle gets more than the circle in it, and less than the circle around it.
    let pressure = bonded(0.45).under_disc(1.5);
    let force = pressure.force_on([[-6.0, 8.0], [-7.0, 6.0]]);
    let [inner, outer] = [6.0, 8.0_f64.hypot(7.0)].map(|distance_mm| pressure.force_within(distance_mm));
    assert!(inner < force && force < outer && outer - inner < 1e-2, "{inner} < {force} < {outer}");
}

#[test]
fn the_force_on_a_rectangle_is_the_integral_of_the_pressure() {
    let layer = Layer::new(1.016, 0.45, BaseContact::Bonded).unwrap();
    for pressure in [layer.under_point(), layer.under_disc(1.0)] {
        for [x, y] in [[[-0.9, 0.9], [-0.9, 0.9]], [[1.1, 2.9], [-0.9, 0.9]], [[-0.3, 1.5], [0.2, 2.0]]] {
            let column = |x: f64| integrate(y, 0.5, |y| pressure.pressure_per_mm2(x.hypot(y)));
            let direct = integrate(x, 0.5, column);
            let found = pressure.force_on([x, y]);
            assert!((found - direct).abs() < 1e-10, "{x:?} {y:?}: {found} for {direct}");
        }
    }
}

#[test]
fn mirrored_rectangles_get_equal_forces() {
    let pressure = bonded(0.45).under_disc(1.0);
    let [x, y] = [[0.2, 2.0], [-0.4, 1.4]];
    let force = pressure.force_on([x, y]);
    for other in [[x.map(|x| -x), y], [x, y.map(|y| -y)], [y, x]] {
        let [[a, b], [c, d]] = other;
        let other = [[a.min(b), a.max(b)], [c.min(d), c.max(d)]];
        assert!((pressure.force_on(other) - force).abs() < 1e-12);
    }
}

#[test]
fn a_disc_is_a_sum_of_points() {
    let layer = bonded(0.3);
    let (disc, point) = (layer.under_disc(1.0), layer.under_point());
    let ring = |r: f64, at: f64| {
        let distance = |turn: f64| (at * at + r * r - 2.0 * at * r * turn.cos()).sqrt();
        integrate([0.0, PI], 1.0, |turn| point.pressure_per_mm2(distance(turn))) / PI
    };
    for at in [0.0, 0.4, 1.2] {
        let summed = integrate([0.0, 0.5], 0.5, |r| 2.0 * r / 0.25 * ring(r, at));
        assert!((disc.pressure_per_mm2(at) - summed).abs() < 1e-10);
    }
}

#[test]
fn lengths_scale_with_the_thickness() {
    let thick = Layer::new(2.5, 0.45, BaseContact::Bonded).unwrap();
    let (thin, thick) = (bonded(0.45).under_disc(0.8), thick.under_disc(2.0));
    assert!((thin.pressure_per_mm2(0.7) / 6.25 - thick.pressure_per_mm2(1.75)).abs() < 1e-13);
    let rectangle = [[0.1, 1.0], [-0.5, 0.6]];
    let wide = rectangle.map(|side| side.map(|end| 2.5 * end));
    assert!((thin.force_on(rectangle) - thick.force_on(wide)).abs() < 1e-12);
}

#[test]
fn the_best_gaussian_is_a_little_narrower_than_half_the_thickness() {
    for (poisson_ratio, stated) in [(0.30, 0.48), (0.45, 0.46), (0.49, 0.45)] {
        let found = bonded(poisson_ratio).gaussian_sigma_mm();
        assert!((found - stated).abs() < 0.01, "nu {poisson_ratio}: {found}");
    }
}

#[test]
fn numbers_out_of_range_are_named() {
    assert_eq!(Layer::new(0.0, 0.3, BaseContact::Bonded), Err(LayerError::Thickness(0.0)));
    assert_eq!(Layer::new(1.0, 0.51, BaseContact::Bonded), Err(LayerError::PoissonRatio(0.51)));
    assert!(
        Layer::new(f64::NAN, 0.3, BaseContact::Bonded).is_err()
            && Layer::new(1.0, f64::NAN, BaseContact::Bonded).is_err()
    );
}
