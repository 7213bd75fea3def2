#![expect(clippy::float_cmp, reason = "these values are exact")]

use super::{Axis, number, round_step};

fn ticks(axis: &Axis, data: &[f64]) -> Vec<String> {
    let scale = axis.scale(data.iter().copied(), 6.0);
    scale.ticks.iter().map(|tick| scale.label(*tick)).collect()
}

#[test]
fn ticks_are_rounded_and_hold_the_data() {
    let axis = Axis::new("depth", "mm");
    assert_eq!(ticks(&axis, &[0.2, 0.6]), ["0.2", "0.3", "0.4", "0.5", "0.6"]);
    assert_eq!(
        ticks(&axis.clone().from_zero(), &[0.2, 0.6]),
        ["0.0", "0.1", "0.2", "0.3", "0.4", "0.5", "0.6"]
    );
    assert_eq!(ticks(&axis, &[-3.0, 593.0]), ["\u{2212}100", "0", "100", "200", "300", "400", "500", "600"]);
    assert_eq!(
        ticks(&axis, &[0.0, 29_000.0]),
        ["0", "5000", "10\u{202f}000", "15\u{202f}000", "20\u{202f}000", "25\u{202f}000", "30\u{202f}000"]
    );
}

#[test]
fn a_tight_axis_ends_at_the_data() {
    let scale = Axis::new("signal", "counts").from_zero().tight().scale([-12.0, 7800.0].into_iter(), 4.0);
    assert_eq!(scale.range, [-12.0, 7800.0]);
    assert_eq!(scale.ticks, [0.0, 2000.0, 4000.0, 6000.0]);
}

#[test]
fn a_fixed_range_stays_and_has_its_ticks_inside() {
    let axis = Axis::new("time", "s").spanning([0.0, 17.3]);
    let scale = axis.scale([5.0, 900.0].into_iter(), 6.0);
    assert_eq!(scale.range, [0.0, 17.3]);
    assert_eq!(scale.ticks, [0.0, 5.0, 10.0, 15.0]);
    assert!((scale.share(8.65) - 0.5).abs() < 1e-12);
}

#[test]
fn no_data_one_value_and_what_is_not_a_number_still_give_an_axis() {
    for data in [&[][..], &[0.0], &[7.5], &[-1e-30], &[1e300, 1e300], &[f64::NAN, f64::INFINITY]] {
        let scale = Axis::new("any", "").scale(data.iter().copied(), 5.0);
        assert!(scale.range[0] < scale.range[1], "{data:?}: {scale:?}");
        assert!((1..=12).contains(&scale.ticks.len()), "{data:?}: {scale:?}");
        assert!(
            data.iter().filter(|v| v.is_finite()).all(|v| (0.0..=1.0).contains(&scale.share(*v))),
            "{data:?}"
        );
    }
}

#[test]
fn steps_are_one_two_or_five() {
    for (rough, step) in [(0.07, 0.1), (0.1, 0.1), (0.11, 0.2), (3.3, 5.0), (5.1, 10.0), (1234.0, 2000.0)] {
        assert!((round_step(rough) / step - 1.0).abs() < 1e-9, "{rough}");
    }
}

#[test]
fn numbers_read_well() {
    assert_eq!(number(-0.0004, 3), "0.000");
    assert_eq!(number(-12.5, 1), "\u{2212}12.5");
    assert_eq!(number(1234.0, 0), "1234");
    assert_eq!(number(1_234_567.25, 2), "1\u{202f}234\u{202f}567.25");
    assert_eq!(number(f64::NAN, 1), "\u{2013}");
}

#[test]
fn a_logarithmic_axis_has_its_ticks_at_round_numbers() {
    let axis = Axis::new("time since contact", "s").logarithmic();
    assert_eq!(ticks(&axis, &[0.04, 3.0]), ["0.05", "0.1", "0.2", "0.5", "1", "2"]);
    assert_eq!(ticks(&axis, &[0.01, 100.0]), ["0.01", "0.1", "1", "10", "100"]);
    let scale = axis.scale([0.01, 100.0].into_iter(), 6.0);
    assert!((scale.share(1.0) - 0.5).abs() < 1e-12);
    assert!((scale.share(10.0) - 0.75).abs() < 1e-12);
}

#[test]
fn what_has_no_logarithm_or_hardly_varies_is_drawn_on_a_plain_axis() {
    let axis = Axis::new("time", "s").logarithmic();
    for data in [[0.0, 100.0], [-1.0, 100.0], [20.0, 100.0]] {
        let scale = axis.scale(data.into_iter(), 6.0);
        let middle = f64::midpoint(scale.range[0], scale.range[1]);
        assert!((scale.share(middle) - 0.5).abs() < 1e-12, "{data:?}");
    }
}
