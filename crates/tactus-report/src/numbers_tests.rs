use tactus_calibrate::Estimate;

use super::{difference, digits, duration, interval, probability, short, with_error};

#[test]
fn durations_read_well() {
    assert_eq!(duration(0.42), "0.4 s");
    assert_eq!(duration(59.94), "59.9 s");
    assert_eq!(duration(192.3), "3 min 12 s");
    assert_eq!(duration(3599.8), "1 h 0 min");
    assert_eq!(duration(11_100.0), "3 h 5 min");
}

#[test]
fn a_value_has_the_digits_that_its_error_leaves() {
    // The examples of the particle data group: .827 +- .119 -> .83 +- .12, +- .367 -> .8 +- .4.
    assert_eq!(with_error(0.827, 0.119), "0.83 \u{b1} 0.12");
    assert_eq!(with_error(0.827, 0.367), "0.8 \u{b1} 0.4");
    assert_eq!(with_error(2.725_605, 0.000_712), "2.7256 \u{b1} 0.0007");
    assert_eq!(with_error(1.234_56, 0.000_97), "1.2346 \u{b1} 0.0010");
    assert_eq!(with_error(-1_091.71, 13.19), "\u{2212}1092 \u{b1} 13");
    assert_eq!(with_error(36.498, 771.2), "36 \u{b1} 771");
}

#[test]
fn a_value_without_an_error_stands_alone() {
    assert_eq!(with_error(0.150_213, 0.0), "0.1502");
    assert_eq!(with_error(0.0, 0.0), "0.000");
    assert_eq!(with_error(12_345.6, f64::NAN), "12\u{202f}346");
    assert_eq!(with_error(f64::NAN, f64::INFINITY), "\u{2013}");
    assert_eq!(interval(&Estimate { value: 1.0, standard_error: 0.0 }), "\u{2013}");
}

#[test]
fn intervals_reach_1_96_errors_each_way() {
    assert_eq!(interval(&Estimate { value: 0.0, standard_error: 0.1 }), "\u{2212}0.20 to 0.20");
    assert_eq!(interval(&Estimate { value: 2.7256, standard_error: 0.0007 }), "2.7242 to 2.7270");
}

#[test]
fn differences_have_a_sign() {
    assert_eq!(difference(0.0604, 0.0003), "+0.06040");
    assert_eq!(difference(-0.0604, 0.02), "\u{2212}0.060");
    assert_eq!(difference(0.0, 0.02), "+0.000");
}

#[test]
fn short_numbers_lose_their_zeros() {
    assert_eq!(short(1.016, 3), "1.016");
    assert_eq!(short(2.54 + 1e-9, 6), "2.54");
    assert_eq!(short(20.0, 3), "20");
    assert_eq!(digits(0.000_123_4, 2), "0.00012");
    assert_eq!(digits(123.4, 2), "123");
    assert_eq!(probability(1e-12), "< 0.001");
    assert_eq!(probability(0.51658), "0.517");
}
