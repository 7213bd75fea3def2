use super::*;

#[test]
fn the_exponent_is_that_of_a_power_law() {
    let points = [1.0_f64, 3.0, 10.0, 40.0].map(|size| [size, 7.0 * size.powf(1.5)]).to_vec();
    let growth = Growth { what: String::new(), size_of: "", points };
    assert!((growth.exponent() - 1.5).abs() < 1e-12);
}
