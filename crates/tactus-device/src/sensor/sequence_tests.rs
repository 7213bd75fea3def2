use std::time::Duration;

use tactus_schema::{DeviceTick, FrameFlags, MonoTime};

use super::{Cause, Place, Sequence};

/// 30 Hz, a tick a millisecond.
fn sequence() -> Sequence {
    Sequence::new(30.0, Duration::from_millis(1))
}

fn place(sequence: &mut Sequence, tick_ms: u64, received_ms: i64, cause: Cause) -> Place {
    sequence.place(DeviceTick(tick_ms), MonoTime::from_ns(received_ms * 1_000_000), cause)
}

#[test]
fn a_steady_device_loses_nothing() {
    let mut sequence = sequence();
    for frame in 0..10_000u64 {
        // 33, 33, 34 ms; and however late they come.
        let placed = place(&mut sequence, frame * 1000 / 30, 0, Cause::Link);
        assert_eq!((placed.seq, placed.lost_before, placed.gap), (frame, 0, None));
    }
}

#[test]
fn lost_frames_are_counted_by_the_devices_clock() {
    for lost in [1u32, 2, 59, 1000] {
        let mut sequence = sequence();
        place(&mut sequence, 0, 0, Cause::Link);
        let tick_ms = u64::from(lost + 1) * 1000 / 30;
        let placed = place(&mut sequence, tick_ms, 5, Cause::Link);
        assert_eq!((placed.seq, placed.lost_before), (u64::from(lost) + 1, lost));
        assert_eq!(placed.flags, FrameFlags::GAP_BEFORE);
        let gap = placed.gap.unwrap();
        assert_eq!((gap.frames_lost, gap.after_seq, gap.next_seq), (lost.into(), 0, u64::from(lost) + 1));
    }
}

#[test]
fn across_a_reconnection_the_hosts_clock_counts() {
    let mut sequence = sequence();
    assert_eq!(place(&mut sequence, 70_000, 0, Cause::Reconnected).flags, FrameFlags::NEW_EPOCH);
    place(&mut sequence, 70_033, 33, Cause::Link);
    let placed = place(&mut sequence, 12, 2066, Cause::Reconnected);
    assert_eq!((placed.seq, placed.epoch, placed.lost_before), (62, 1, 60));
    assert_eq!(placed.flags, FrameFlags::NEW_EPOCH.with(FrameFlags::GAP_BEFORE));
    assert_eq!(place(&mut sequence, 45, 2099, Cause::Link).seq, 63);
}

#[test]
fn a_jumping_clock_loses_nothing_by_itself() {
    let mut sequence = sequence();
    place(&mut sequence, 1000, 0, Cause::Link);
    let placed = place(&mut sequence, 99_000, 33, Cause::ClockJumped);
    assert_eq!((placed.seq, placed.epoch, placed.gap), (1, 1, None));
    assert_eq!(placed.flags, FrameFlags::NEW_EPOCH);
}

#[test]
fn the_reason_is_told() {
    let mut sequence = sequence();
    place(&mut sequence, 0, 0, Cause::Link);
    let placed = place(&mut sequence, 100, 100, Cause::HostTooSlow);
    assert_eq!(placed.gap.unwrap().reason, "the service was too slow to take them");
}
