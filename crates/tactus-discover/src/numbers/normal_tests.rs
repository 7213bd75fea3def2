use super::of_picked;

#[test]
fn a_picked_deviate_is_that_of_its_probability_times_the_number() {
    // Upper 0.1, 1 and 5 % points of the normal distribution.
    for (z, among, counts) in
        [(3.090_232, 10.0, 2.326_348), (3.090_232, 50.0, 1.644_854), (2.326_348, 1.0, 2.326_348)]
    {
        assert!((of_picked(z, among) - counts).abs() < 1e-5, "{z} of {among}: {}", of_picked(z, among));
    }
    assert!(of_picked(2.0, 2000.0) <= 0.0);
}

#[test]
fn far_out_the_two_formulas_meet() {
    let [near, far] = [29.999_999, 30.000_001].map(|z| of_picked(z, 2256.0));
    assert!((far - near).abs() < 1e-3, "{near} {far}");
}
