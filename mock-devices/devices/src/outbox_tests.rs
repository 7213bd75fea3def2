use super::*;

const MS: Duration = Duration::from_millis(1);

#[test]
fn bytes_leave_at_their_times_and_in_their_order() {
    let t0 = Instant::now();
    let mut outbox = Outbox::default();
    outbox.push(t0 + 2 * MS, *b"late");
    outbox.push(t0, *b"behind");
    assert_eq!(outbox.next_due(), Some(t0 + 2 * MS));
    assert!(outbox.take_due(t0 + MS).is_empty());
    assert_eq!(outbox.take_due(t0 + 2 * MS), b"latebehind");
    assert_eq!(outbox.next_due(), None);
}

#[test]
fn a_drip_is_one_byte_at_a_time() {
    let t0 = Instant::now();
    let mut outbox = Outbox::default();
    outbox.drip(t0, 4 * MS, b"abcd");
    for (ms, byte) in [(0, b"a"), (1, b"b"), (2, b"c"), (3, b"d")] {
        assert_eq!(outbox.take_due(t0 + ms * MS), byte);
    }
}
