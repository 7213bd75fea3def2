use super::*;

#[test]
fn sixteen_points_are_exact_for_polynomials_up_to_degree_31() {
    for degree in 0..=31 {
        let got: f64 = smooth(0.0, 1.99, 0.9).map(|(x, weight)| weight * x.powi(degree)).sum();
        let want = 1.99_f64.powi(degree + 1) / f64::from(degree + 1);
        assert!((got / want - 1.0).abs() < 1e-13, "degree {degree}: {got} {want}");
    }
    let beyond: f64 = smooth(-0.99, 0.99, 0.9).map(|(x, weight)| weight * x.powi(32)).sum();
    assert!((beyond - 2.0 * 0.99_f64.powi(33) / 33.0).abs() > 1e-13, "degree 32 is beyond 16 nodes");
}

#[test]
fn eight_points_are_exact_for_polynomials_up_to_degree_15() {
    for degree in 0..=15 {
        let got: f64 = smooth(0.0, 1.99, 1.0).map(|(x, weight)| weight * x.powi(degree)).sum();
        let want = 1.99_f64.powi(degree + 1) / f64::from(degree + 1);
        assert!((got / want - 1.0).abs() < 1e-13, "degree {degree}: {got} {want}");
    }
}

#[test]
fn four_points_are_exact_for_polynomials_up_to_degree_7() {
    for degree in 0..=7 {
        let got: f64 = smooth(0.5, 1.0, 2.0).map(|(x, weight)| weight * x.powi(degree)).sum();
        let want = (1.0 - 0.5_f64.powi(degree + 1)) / f64::from(degree + 1);
        assert!((got / want - 1.0).abs() < 1e-14, "degree {degree}: {got} {want}");
    }
}

#[test]
fn panels_split_the_range() {
    let kinked: f64 = smooth(-1.0, 1.0, 0.25).map(|(x, weight)| weight * x.abs()).sum();
    assert!((kinked - 1.0).abs() < 1e-13, "{kinked}");
}

#[test]
fn a_gaussian_is_integrated_whatever_the_range() {
    // Twice the error function at the range's half width over the root of two.
    for (half, want) in [
        (0.125, 0.099_476_449_660_225_8),
        (0.25, 0.197_412_651_364_847_04),
        (1.0, 0.682_689_492_137_085_9),
        (3.0, 0.997_300_203_936_739_8),
    ] {
        let density = |x: f64| (-0.5 * x * x).exp() / (2.0 * std::f64::consts::PI).sqrt();
        let got: f64 = smooth(-half, half, 1.0).map(|(x, weight)| weight * density(x)).sum();
        assert!((got - want).abs() < 1e-11, "{half}: {got} {want}");
    }
}
