use super::{Covariate, Seen, Trace};
use crate::Array;

/// A press at one place: down at 1 mm/s, a rest, up, then aside along x at 10 mm/s.
fn pressed() -> Trace {
    let mut trace = Trace::default();
    for step in 0..=10 {
        trace.take(0.1 * f64::from(step), [2.0, 3.0], 0.1 * f64::from(step) - 0.55, None);
    }
    trace.take(2.0, [2.0, 3.0], 0.45, Some(21.0));
    trace
}

fn value(covariate: Covariate, trace: &Trace) -> Option<f64> {
    let array = Array::digitacts();
    covariate.value(Seen { trace, array: &array, signal_mm: &[], counts: &[] }, 0)
}

fn near(got: Option<f64>, want: f64) -> bool {
    got.is_some_and(|got| (got - want).abs() < 1e-9)
}

#[test]
fn names_are_found_again() {
    for covariate in Covariate::ALL {
        assert_eq!(Covariate::find(covariate.name()), Some(covariate));
    }
    assert_eq!(Covariate::find("luck"), None);
}

#[test]
fn a_press_is_told_by_its_times_and_depths() {
    let mut trace = pressed();
    assert!(near(value(Covariate::SinceContact, &trace), 1.4), "it touched at 0.6 s");
    assert!(near(value(Covariate::SinceTurn, &trace), 0.0), "it stopped at 2 s");
    assert!(near(value(Covariate::Depth, &trace), 0.45) && near(value(Covariate::Speed, &trace), 1.0));
    assert!(near(value(Covariate::Direction, &trace), 0.0) && near(value(Covariate::Press, &trace), 1.0));
    assert!(near(value(Covariate::Temperature, &trace), 21.0));
    assert_eq!(value(Covariate::SinceRelease, &trace), None, "it was never released");
    assert!(near(value(Covariate::DeepestBefore, &trace), 0.0));

    trace.take(2.5, [2.0, 3.0], -0.05, None);
    trace.take(3.0, [7.0, 3.0], -0.05, None);
    trace.take(3.5, [7.0, 3.0], 0.15, None);
    assert!(near(value(Covariate::SinceRelease, &trace), 1.0) && near(value(Covariate::Press, &trace), 2.0));
    assert!(near(value(Covariate::DeepestBefore, &trace), 0.45), "the first press was that deep");
    assert!(near(value(Covariate::ApproachX, &trace), 1.0) && near(value(Covariate::ApproachY, &trace), 0.0));
    assert!(near(value(Covariate::Travel, &trace), 1.0 + 0.5 + 5.0 + 0.2));
}

#[test]
fn distances_are_from_the_tip_to_the_elements() {
    let (trace, array) = (pressed(), Array::digitacts());
    let [x, y] = array.centre_mm(20).unwrap();
    let seen = Seen { trace: &trace, array: &array, signal_mm: &[0.1; 48], counts: &[] };
    let got = Covariate::Distance.value(seen, 20);
    assert!(near(got, (x - 2.0).hypot(y - 3.0)));
    assert!(near(Covariate::SumOfSignals.value(seen, 20), 4.8));
    assert!(near(Covariate::ShareOfLargest.value(seen, 20), 1.0));
    assert_eq!(Covariate::Counts.value(seen, 20), None, "the counts are not known yet");
}

/// A stage that goes both ways at once goes along neither axis, nor between them.
#[test]
fn what_is_ahead_lies_along_the_way_the_tip_came() {
    let (mut trace, array) = (pressed(), Array::digitacts());
    trace.take(3.0, [5.0, 7.0], -0.1, None);
    trace.take(4.0, [5.0, 7.0], 0.3, None);
    let [x, y] = array.centre_mm(20).unwrap();
    let seen = Seen { trace: &trace, array: &array, signal_mm: &[], counts: &[] };
    assert!(near(Covariate::Ahead.value(seen, 20), 0.6 * (x - 5.0) + 0.8 * (y - 7.0)));
    assert!(near(value(Covariate::ApproachX, &trace), 1.0) && near(value(Covariate::ApproachY, &trace), 1.0));
}

#[test]
fn the_rate_of_frames_does_not_change_what_is_seen() {
    // The same press at 30 Hz and at 1 kHz.
    let at = |rate: f64| {
        let mut trace = Trace::default();
        let mut step = 0.0;
        while step / rate <= 3.0 {
            let t_s: f64 = step / rate;
            trace.take(t_s, [2.0 + t_s.min(1.0), 3.0], (t_s - 1.0).clamp(-0.5, 0.4), None);
            step += 1.0;
        }
        trace
    };
    let (slow, fast) = (at(30.0), at(1000.0));
    for covariate in [Covariate::Speed, Covariate::Travel, Covariate::SinceTurn, Covariate::SinceContact] {
        let [slow, fast] = [&slow, &fast].map(|trace| value(covariate, trace).unwrap());
        assert!((slow - fast).abs() < 0.08, "{covariate:?}: {slow} {fast}");
    }
}
