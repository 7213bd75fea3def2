use super::{Coefficient, Polynomial};

/// NIST Statistical Reference Datasets, linear regression, Norris: `(y, x)`.
const NORRIS: [(f64, f64); 36] = [
    (0.1, 0.2),
    (338.8, 337.4),
    (118.1, 118.2),
    (888.0, 884.6),
    (9.2, 10.1),
    (228.1, 226.5),
    (668.5, 666.3),
    (998.5, 996.3),
    (449.1, 448.6),
    (778.9, 777.0),
    (559.2, 558.2),
    (0.3, 0.4),
    (0.1, 0.6),
    (778.1, 775.5),
    (668.8, 666.9),
    (339.3, 338.0),
    (448.9, 447.5),
    (10.8, 11.6),
    (557.7, 556.0),
    (228.3, 228.1),
    (998.0, 995.8),
    (888.8, 887.6),
    (119.6, 120.2),
    (0.3, 0.3),
    (0.6, 0.3),
    (557.6, 556.8),
    (339.3, 339.1),
    (888.0, 887.2),
    (998.5, 999.0),
    (778.9, 779.0),
    (10.2, 11.1),
    (117.6, 118.3),
    (228.9, 229.2),
    (668.4, 669.1),
    (449.2, 448.9),
    (0.2, 0.5),
];

/// NIST Statistical Reference Datasets, linear regression, Pontius: y at x = 150,000, 300,000, ..., twice.
const PONTIUS: [f64; 40] = [
    0.11019, 0.21956, 0.32949, 0.43899, 0.54803, 0.65694, 0.76562, 0.87487, 0.98292, 1.09146, 1.20001,
    1.30822, 1.41599, 1.52399, 1.63194, 1.73947, 1.84646, 1.95392, 2.06128, 2.16844, 0.11052, 0.22018,
    0.32939, 0.43886, 0.54798, 0.65739, 0.76596, 0.87474, 0.983, 1.0915, 1.20004, 1.30818, 1.41613, 1.52408,
    1.63159, 1.73965, 1.84696, 1.95445, 2.06177, 2.16829,
];

fn assert_close(got: f64, expected: f64, relative: f64) {
    assert!((got - expected).abs() <= relative * expected.abs(), "{got:e} is not {expected:e}");
}

fn assert_estimate(got: Coefficient, value: f64, standard_error: f64) {
    assert_close(got.value, value, 1e-9);
    assert_close(got.standard_error.unwrap(), standard_error, 1e-9);
}

#[test]
fn a_line_has_the_values_that_nist_certifies() {
    let points: Vec<[f64; 2]> = NORRIS.iter().map(|&(y, x)| [x, y]).collect();
    let fit = Polynomial::fit(1, &points).unwrap();
    assert_estimate(fit.coefficients[0], -0.262_323_073_774_029, 0.232_818_234_301_152);
    assert_estimate(fit.coefficients[1], 1.002_116_818_020_45, 0.429_796_848_199_937e-3);
    assert_close(fit.residual.unwrap(), 0.884_796_396_144_373, 1e-9);
    assert_eq!(fit.degrees_of_freedom, 34);
}

#[test]
fn a_parabola_has_the_values_that_nist_certifies() {
    let points: Vec<[f64; 2]> =
        PONTIUS.iter().enumerate().map(|(k, &y)| [150_000.0 * ((k % 20) as f64 + 1.0), y]).collect();
    let fit = Polynomial::fit(2, &points).unwrap();
    assert_estimate(fit.coefficients[0], 0.673_565_789_473_684e-3, 0.107_938_612_033_077e-3);
    assert_estimate(fit.coefficients[1], 0.732_059_160_401_003e-6, 0.157_817_399_981_659e-9);
    assert_estimate(fit.coefficients[2], -0.316_081_871_345_029e-14, 0.486_652_849_992_036e-16);
    assert_close(fit.residual.unwrap(), 0.205_177_424_076_185e-3, 1e-9);
}

#[test]
fn exact_data_gives_the_polynomial_and_no_residual() {
    let truth = |x: f64| 12.0 - 340.0 * x + 560.0 * x * x;
    let points: Vec<[f64; 2]> = [0.2, 0.3, 0.4, 0.5, 0.6].map(|x| [x, truth(x)]).to_vec();
    let fit = Polynomial::fit(2, &points).unwrap();
    for (estimate, expected) in fit.coefficients.iter().zip([12.0, -340.0, 560.0]) {
        assert_close(estimate.value, expected, 1e-11);
    }
    assert!(fit.residual.unwrap() < 1e-10);
    assert_close(fit.at(1.7), truth(1.7), 1e-11);
}

#[test]
fn as_many_points_as_coefficients_give_no_standard_error() {
    let fit = Polynomial::fit(1, &[[1.0, 2.0], [3.0, 8.0]]).unwrap();
    assert_close(fit.coefficients[1].value, 3.0, 1e-12);
    assert_eq!((fit.degrees_of_freedom, fit.residual, fit.coefficients[1].standard_error), (0, None, None));
}

#[test]
fn too_few_places_give_no_fit() {
    assert_eq!(Polynomial::fit(1, &[]), None);
    assert_eq!(Polynomial::fit(1, &[[0.3, 1.0], [0.3, 2.0], [f64::NAN, 3.0], [0.4, f64::INFINITY]]), None);
    assert_eq!(Polynomial::fit(2, &[[0.1, 1.0], [0.2, 2.0], [0.1, 1.0], [0.2, 3.0]]), None);
}
