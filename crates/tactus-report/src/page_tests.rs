use super::summary::duration;

#[test]
fn durations_read_well() {
    assert_eq!(duration(0.42), "0.4 s");
    assert_eq!(duration(59.94), "59.9 s");
    assert_eq!(duration(192.3), "3 min 12 s");
    assert_eq!(duration(3599.8), "1 h 0 min");
    assert_eq!(duration(11_100.0), "3 h 5 min");
}
