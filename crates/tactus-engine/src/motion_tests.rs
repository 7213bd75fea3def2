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
