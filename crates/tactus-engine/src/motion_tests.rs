use std::time::Duration;

use super::*;

#[test]
fn a_rising_tip_takes_the_first_stop_although_one_was_pressed_just_before_the_rise_and_then_one_a_second() {
    let at = |ms: u64| MonoTime::from_ns(5_000_000_000).after(Duration::from_millis(ms));
    let mut way_up = WayUp::default();
    assert!(way_up.takes_stop(at(0)), "the stop of the run before");
    // A new run comes down, and the supervisor raises the tip.
    way_up.begin();
    assert!(way_up.takes_stop(at(300)), "the first of this rise");
    assert!(!way_up.takes_stop(at(305)), "a stop without end would hold the tip in contact");
    assert!(!way_up.takes_stop(at(1299)));
    assert!(way_up.takes_stop(at(1300)));
}

/// How many of 40 tries at these heights a trouble may end before the retract has failed.
fn tries_with(trouble: &Broken, z_mm: impl Fn(u32) -> f64) -> usize {
    let mut setbacks = Setbacks::new(z_mm(0));
    let allowed = |at: &u32| {
        setbacks.count(trouble, z_mm(*at), 0.005);
        setbacks.troubles <= TROUBLES_MAX
    };
    (0..40).take_while(allowed).count()
}

#[test]
fn a_tip_that_has_risen_has_as_many_tries_again() {
    let trouble = Broken::Stage(StageError::Unanswered { command: "Z1".into(), waited_s: 0.3 });
    // 0.1 mm in every fifth try.
    assert_eq!(tries_with(&trouble, |at| -0.4 + 0.1 * f64::from(at / 5)), 40);
    // Less than the tolerance is no rise.
    assert_eq!(tries_with(&trouble, |at| -0.4 + 0.0001 * f64::from(at)), TROUBLES_MAX as usize);
}

#[test]
fn an_acquisition_task_that_is_slow_is_a_trouble_as_others_are() {
    let gone = Broken::Gone(crate::acquisition::Gone);
    assert_eq!(tries_with(&gone, |_| -0.4), TROUBLES_MAX as usize);
}
