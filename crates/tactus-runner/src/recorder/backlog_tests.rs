use std::time::Duration;

use tactus_schema::MonoTime;

use super::{BYTES_MAX, Backlog, Lag};

fn ms(ms: i64) -> MonoTime {
    MonoTime::from_ns(ms * 1_000_000)
}

fn waiting(times_ms: impl IntoIterator<Item = i64>) -> Backlog {
    let mut backlog = Backlog::default();
    for at in times_ms {
        backlog.queued(ms(at), 100, true);
    }
    backlog
}

#[test]
fn half_a_second_alarms_once_and_a_second_is_too_late() {
    let mut backlog = waiting([0, 33, 66]);
    assert_eq!(backlog.check(0, ms(499)), Lag::KeepsUp);
    assert_eq!(backlog.check(0, ms(500)), Lag::Alarm(Duration::from_millis(500)));
    assert_eq!(backlog.check(0, ms(1000)), Lag::KeepsUp, "told once");
    assert_eq!(backlog.check(0, ms(1001)), Lag::TooLate(Duration::from_millis(1001)));
}

#[test]
fn what_was_written_does_not_count_and_a_new_backlog_alarms_anew() {
    let mut backlog = waiting([0, 600, 700]);
    assert!(matches!(backlog.check(0, ms(700)), Lag::Alarm(_)));
    assert_eq!(backlog.check(3, ms(700)), Lag::KeepsUp);
    assert_eq!((backlog.messages(), backlog.frames(), backlog.bytes()), (0, 0, 0));
    backlog.queued(ms(800), 100, false);
    assert_eq!((backlog.messages(), backlog.frames(), backlog.bytes()), (1, 0, 100));
    assert!(matches!(backlog.check(3, ms(1400)), Lag::Alarm(_)));
}

#[test]
fn too_many_bytes_are_too_late_at_any_age() {
    let mut backlog = Backlog::default();
    backlog.queued(ms(0), BYTES_MAX, true);
    assert_eq!(backlog.check(0, ms(0)), Lag::KeepsUp);
    backlog.queued(ms(0), 1, true);
    assert_eq!(backlog.check(0, ms(0)), Lag::TooLate(Duration::ZERO));
}

#[test]
fn a_message_a_little_older_than_the_one_before_is_no_backlog() {
    let mut backlog = waiting([100, 50]);
    assert_eq!(backlog.check(1, ms(40)), Lag::KeepsUp);
}
