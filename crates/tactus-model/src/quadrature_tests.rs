use super::*;

#[test]
fn polynomials_up_to_degree_31_are_exact() {
    for degree in 0..=31 {
        let got: f64 = gauss_legendre(0.0, 2.0, 1).map(|(x, weight)| weight * x.powi(degree)).sum();
        let want = 2.0_f64.powi(degree + 1) / f64::from(degree + 1);
        assert!((got / want - 1.0).abs() < 1e-13, "degree {degree}: {got} {want}");
    }
    let beyond: f64 = gauss_legendre(-1.0, 1.0, 1).map(|(x, weight)| weight * x.powi(32)).sum();
    assert!((beyond - 2.0 / 33.0).abs() > 1e-12, "degree 32 is beyond 16 nodes");
}

#[test]
fn panels_split_the_range() {
    let kinked: f64 = gauss_legendre(-1.0, 3.0, 4).map(|(x, weight)| weight * x.abs()).sum();
    assert!((kinked - 5.0).abs() < 1e-13, "{kinked}");
}
