use super::hats;

#[test]
fn hats_add_up_to_one_and_interpolate() {
    let values: Vec<f64> = (0..101).map(|k| f64::from(k) / 10.0).collect();
    let among = vec![true; 101];
    let hats = hats(&values, &among);
    let knots: Vec<f64> =
        hats.iter().map(|hat| values[hat.iter().position(|one| *one >= 1.0 - 1e-12).unwrap()]).collect();
    for (bin, value) in values.iter().enumerate() {
        let sum: f64 = hats.iter().map(|hat| hat[bin]).sum();
        assert!((sum - 1.0).abs() < 1e-12, "{value}: {sum}");
        // A straight line is exact.
        let line: f64 = hats.iter().zip(&knots).map(|(hat, knot)| hat[bin] * knot).sum();
        assert!((line - value).abs() < 1e-12, "{value}: {line}");
    }
}

#[test]
fn values_that_do_not_differ_and_bins_that_do_not_count_have_no_part() {
    assert!(hats(&[2.0; 9], &[true; 9]).is_empty());
    let hats = hats(&[1.0, 2.0, 3.0, f64::NAN, 5.0], &[true, true, true, true, false]);
    assert!(hats.iter().all(|hat| hat[3..] == [0.0, 0.0]));
}
