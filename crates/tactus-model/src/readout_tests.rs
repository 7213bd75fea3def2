use super::*;

fn twelve_bit() -> Readout {
    Readout::of(&Array::digitacts())
}

#[test]
fn readings_are_whole_steps_within_the_range() {
    let readout = twelve_bit();
    for (counts, noise, want) in [
        (100.4, 0.0, 100.0),
        (100.4, 0.2, 101.0),
        (5000.0, 0.0, 4095.0),
        (-3.0, 1.0, 0.0),
        // Noise comes before saturation: a reading past full scale can come back into range.
        (4100.0, -10.0, 4090.0),
    ] {
        assert_eq!(readout.read(counts, noise).to_bits(), f64::to_bits(want), "{counts} {noise}");
    }
}

#[test]
fn the_last_step_does_not_pass_full_scale() {
    let array = Array::new("coarse", [1.0, 1.0], vec![0.0], vec![0.0], 30.0, 100.0, 8.0).unwrap();
    let readout = Readout::of(&array);
    assert_eq!(readout.read(1e9, 0.0).to_bits(), 96.0_f64.to_bits());
    assert_eq!(readout.read(43.0, 0.0).to_bits(), 40.0_f64.to_bits());
}

/// In volts, full scale over a step is a hair less than the whole number that it stands for.
#[test]
fn the_last_step_is_that_of_full_scale_in_any_unit() {
    for unit in [1e-4, 1e-3, 0.01, 1.0 / 3.0, 1e4] {
        let full_scale = 4095.0 * unit;
        let array = Array::new("volts", [1.0, 1.0], vec![0.0], vec![0.0], 30.0, full_scale, unit).unwrap();
        let most = Readout::of(&array).read(1e9, 0.0);
        assert!((most - full_scale).abs() < 1e-6 * full_scale, "{unit}: {most}");
    }
}

#[test]
fn readings_with_a_sign_end_at_the_least_whole_step() {
    let of = |least: f64, full_scale: f64, step: f64| {
        let array = Array::new("signed", [1.0, 1.0], vec![0.0], vec![0.0], 30.0, full_scale, step).unwrap();
        let readout = Readout::of(&array.with_least_counts(least).unwrap());
        [-1e9, -12.3, 1e9].map(|counts| readout.read(counts, 0.0))
    };
    for (least, full_scale, step, want) in [
        (-4095.0, 4095.0, 1.0, [-4095.0, -12.0, 4095.0]),
        (-10.0, 100.0, 4.0, [-8.0, -8.0, 100.0]),
        (10.0, 100.0, 4.0, [12.0, 12.0, 100.0]),
    ] {
        assert_eq!(of(least, full_scale, step).map(f64::to_bits), want.map(f64::to_bits), "{least}");
    }
    let volts = of(-2.4, 2.4, 2.4 / 2048.0);
    assert!((volts[0] + 2.4).abs() < 1e-9 && (volts[2] - 2.4).abs() < 1e-9, "{volts:?}");
}

#[test]
fn a_least_reading_above_the_greatest_is_refused() {
    for least in [4095.0, 5000.0, f64::NAN, f64::NEG_INFINITY] {
        let refused = Array::digitacts().with_least_counts(least).unwrap_err();
        assert!(refused.to_string().contains("below full_scale_counts (4095)"), "{refused}");
    }
}
