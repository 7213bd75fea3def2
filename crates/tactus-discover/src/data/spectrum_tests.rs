use super::transform;

#[test]
fn the_transform_is_the_sum_that_defines_it() {
    let series: Vec<[f64; 2]> = (0..16).map(|k| [f64::from(k * k % 7), f64::from(k % 3)]).collect();
    let mut fast = series.clone();
    transform(&mut fast);
    for (frequency, [re, im]) in fast.iter().enumerate() {
        let (mut want_re, mut want_im) = (0.0, 0.0);
        for (time, [x, y]) in series.iter().enumerate() {
            let (sin, cos) = (-std::f64::consts::TAU * (frequency * time) as f64 / 16.0).sin_cos();
            want_re += x * cos - y * sin;
            want_im += x * sin + y * cos;
        }
        assert!((re - want_re).abs() < 1e-9 && (im - want_im).abs() < 1e-9, "{frequency}");
    }
}
