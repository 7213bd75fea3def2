use super::*;

#[test]
fn a_frame_is_found_by_the_time_of_its_sensors_clock() {
    let sent = SentTimes::new(3);
    // As the devices count: each sensor once in a period, and the clock in whole milliseconds.
    for number in (0..10_000_u32).filter(|number| number % SLOTS == 2) {
        sent.note(2, number);
        let of_number = sent.of(2, number.into()).unwrap().load(Ordering::Relaxed);
        let tick_ms = u64::try_from((slot() * number).as_millis()).unwrap();
        let under_way = sent.since(2, tick_ms).unwrap();
        assert!(under_way <= Duration::from_nanos(sent.now_ns() - of_number), "number {number}");
        assert!(sent.now_ns() > of_number);
    }
    // Another sensor's times are another's.
    assert_eq!(sent.of(1, 2).unwrap().load(Ordering::Relaxed), 0);
    assert_eq!(sent.since(3, 0), None);
}
