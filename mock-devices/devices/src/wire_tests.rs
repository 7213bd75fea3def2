use super::*;
use crate::truth::RandomStream;

const LINE: &[u8] = b"Z-.1\n";

fn wire() -> (Wire, Instant) {
    (Wire::new(RandomStream::ToStage.rng(1)), Instant::now())
}

/// What arrives of the line with this fault, and of the one after it.
fn arrives(fault: WireFault) -> [Vec<u8>; 2] {
    let (mut wire, now) = wire();
    wire.arm(fault, now);
    [0, 1].map(|_| {
        wire.push(LINE, now);
        wire.take_due(now)
    })
}

#[test]
fn without_a_fault_bytes_pass_at_once() {
    let (mut wire, now) = wire();
    wire.push(LINE, now);
    assert_eq!((wire.next_due(), wire.take_due(now)), (Some(now), LINE.to_vec()));
}

#[test]
fn each_fault_hits_the_next_bytes_once() {
    let whole = LINE.to_vec();
    assert_eq!(arrives(WireFault::Drop(2)), [b".1\n".to_vec(), whole.clone()]);
    assert_eq!(arrives(WireFault::Drop(6)), [Vec::new(), b"-.1\n".to_vec()]);
    assert_eq!(arrives(WireFault::Truncate), [b"Z-".to_vec(), whole.clone()]);
    assert_eq!(arrives(WireFault::Repeat), [LINE.repeat(2), whole.clone()]);
    assert_eq!(arrives(WireFault::Reorder), [Vec::new(), LINE.repeat(2)]);
    let [flipped, after] = arrives(WireFault::FlipBits(1));
    let differing: u32 = flipped.iter().zip(LINE).map(|(a, b)| (a ^ b).count_ones()).sum();
    assert_eq!((flipped.len(), differing, after), (LINE.len(), 1, whole.clone()));
    let [doubled, after] = arrives(WireFault::Double(1));
    assert_eq!((doubled.len(), after), (LINE.len() + 1, whole.clone()));
    let [noise, after] = arrives(WireFault::Garbage(7));
    assert!(noise.ends_with(LINE) && noise.len() == LINE.len() + 7 && after == whole);
}

#[test]
fn bytes_are_lost_held_or_slow_for_a_time() {
    let second = Duration::from_secs(1);
    for (fault, arrivals) in [
        (WireFault::Lose(second), (0, 0)),
        (WireFault::Hold(second), (0, 5)),
        (WireFault::Drip(second), (3, 2)),
    ] {
        let (mut wire, now) = wire();
        wire.arm(fault, now);
        wire.push(LINE, now);
        let soon = wire.take_due(now + Duration::from_millis(2));
        let later = wire.take_due(now + second);
        assert_eq!((soon.len(), later.len()), arrivals, "{fault:?}");
        wire.push(LINE, now + second);
        assert_eq!(wire.take_due(now + second), LINE, "{fault:?}");
    }
}
