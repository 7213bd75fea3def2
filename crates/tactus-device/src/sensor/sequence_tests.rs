use std::time::Duration;

use tactus_schema::{DeviceTick, FrameFlags, MonoTime};

use super::{FramePlacement, GapCause, LossEvidence, ReceivedFrame, Sequence};

/// 30 Hz.
fn sequence_with(tick: Duration) -> Sequence {
    let mut sequence = Sequence::new(30.0);
    sequence.set_tick(tick);
    sequence
}

/// 30 Hz, a tick a millisecond.
fn sequence() -> Sequence {
    sequence_with(Duration::from_millis(1))
}

/// One frame, without a device's clock or count.
fn arrival(received_ms: i64) -> ReceivedFrame {
    ReceivedFrame {
        tick: None,
        evidence: LossEvidence::TimesOnly,
        received: MonoTime::from_ns(received_ms * 1_000_000),
        together: 1,
        dropped: 0,
        cause: GapCause::Link,
    }
}

fn place(sequence: &mut Sequence, tick_ms: u64, received_ms: i64, cause: GapCause) -> FramePlacement {
    let tick = Some(DeviceTick(tick_ms));
    sequence.place(ReceivedFrame { tick, cause, ..arrival(received_ms) })
}

#[test]
fn a_steady_device_loses_nothing() {
    let mut sequence = sequence();
    for frame in 0..10_000u64 {
        // 33, 33, 34 ms; and however late they come.
        let placed = place(&mut sequence, frame * 1000 / 30, 0, GapCause::Link);
        assert_eq!((placed.seq, placed.lost_before, placed.gap), (frame, 0, None));
    }
}

#[test]
fn lost_frames_are_counted_by_the_devices_clock() {
    for lost in [1u32, 2, 59, 1000] {
        let mut sequence = sequence();
        place(&mut sequence, 0, 0, GapCause::Link);
        let tick_ms = u64::from(lost + 1) * 1000 / 30;
        let placed = place(&mut sequence, tick_ms, 5, GapCause::Link);
        assert_eq!((placed.seq, placed.lost_before), (u64::from(lost) + 1, lost));
        assert_eq!(placed.flags, FrameFlags::GAP_BEFORE);
        let gap = placed.gap.unwrap();
        assert_eq!((gap.frames_lost, gap.after_seq, gap.next_seq), (lost.into(), 0, u64::from(lost) + 1));
    }
}

#[test]
fn across_a_reconnection_the_hosts_clock_counts() {
    let mut sequence = sequence();
    assert_eq!(place(&mut sequence, 70_000, 0, GapCause::Reconnected).flags, FrameFlags::NEW_EPOCH);
    place(&mut sequence, 70_033, 33, GapCause::Link);
    let placed = place(&mut sequence, 12, 2066, GapCause::Reconnected);
    assert_eq!((placed.seq, placed.epoch, placed.lost_before), (62, 1, 60));
    assert_eq!(placed.flags, FrameFlags::NEW_EPOCH.with(FrameFlags::GAP_BEFORE));
    assert_eq!(place(&mut sequence, 45, 2099, GapCause::Link).seq, 63);
}

#[test]
fn a_jumping_clock_loses_nothing_by_itself() {
    let mut sequence = sequence();
    place(&mut sequence, 1000, 0, GapCause::Link);
    let placed = place(&mut sequence, 99_000, 33, GapCause::ClockJumped);
    assert_eq!((placed.seq, placed.epoch, placed.gap), (1, 1, None));
    assert_eq!(placed.flags, FrameFlags::NEW_EPOCH);
}

#[test]
fn the_reason_is_told() {
    let mut sequence = sequence();
    place(&mut sequence, 0, 0, GapCause::Link);
    let placed = place(&mut sequence, 100, 100, GapCause::HostTooSlow);
    assert_eq!(placed.gap.unwrap().reason, "the service was too slow to take them");
}

/// What is missing before a frame that comes `after_ms` behind the first.
fn missing(tick: Duration, second: ReceivedFrame) -> u32 {
    let mut sequence = sequence_with(tick);
    sequence.place(ReceivedFrame { tick: second.tick.map(|_| DeviceTick(0)), ..arrival(0) });
    sequence.place(second).lost_before
}

#[test]
fn the_devices_own_count_is_exact_but_for_whole_rounds_which_times_tell() {
    let numbers = |lost| LossEvidence::Counted { lost, wrap: 256 };
    for (lost, after_ms, want) in
        [(0, 0, 0), (0, 900, 0), (3, 10, 3), (3, 133, 3), (3, 8_667, 259), (0, 17_100, 512)]
    {
        let second = ReceivedFrame { evidence: numbers(lost), ..arrival(after_ms) };
        assert_eq!(missing(Duration::ZERO, second), want, "{lost} after {after_ms} ms");
    }
    let jumped = ReceivedFrame { evidence: numbers(2), cause: GapCause::ClockJumped, ..arrival(100) };
    assert_eq!(missing(Duration::ZERO, jumped), 2, "a clock that jumps does not change the count");
    let slow =
        ReceivedFrame { evidence: numbers(2), dropped: 5, cause: GapCause::HostTooSlow, ..arrival(267) };
    assert_eq!(missing(Duration::ZERO, slow), 7);
}

/// What is missing before each frame that comes at these times, by the host's clock alone.
fn missing_by_arrivals(arrivals_ms: &[i64]) -> Vec<u32> {
    let mut sequence = sequence_with(Duration::ZERO);
    arrivals_ms.iter().map(|ms| sequence.place(arrival(*ms)).lost_before).collect()
}

#[test]
fn by_the_hosts_clock_alone_a_loss_is_told_from_a_delay_by_the_frame_after_it() {
    for (arrivals_ms, want) in [
        (&[0, 33, 67, 100][..], &[0, 0, 0, 0][..]),
        (&[0, 67, 100, 133], &[0, 0, 1, 0]),
        (&[0, 200, 233, 267], &[0, 0, 5, 0]),
        // Held up, and all there in the end.
        (&[0, 67, 68, 100, 133], &[0, 0, 0, 0, 0]),
        (&[0, 200, 200, 201, 201, 202, 202, 233], &[0; 8]),
        // Of five that were held up, two are missing.
        (&[0, 200, 200, 201, 201, 233, 267], &[0, 0, 0, 0, 0, 2, 0]),
        // Longer than any buffer.
        (&[0, 2000, 2033], &[0, 59, 0]),
    ] {
        assert_eq!(missing_by_arrivals(arrivals_ms), want, "{arrivals_ms:?}");
    }
    // A device that is a little slower, or faster, than the rig says loses nothing.
    for period_us in [32_000, 34_500] {
        let arrivals_ms: Vec<i64> = (0..3000).map(|frame| frame * period_us / 1000).collect();
        assert_eq!(missing_by_arrivals(&arrivals_ms).iter().sum::<u32>(), 0, "{period_us}");
    }
}

#[test]
fn damage_on_the_way_is_a_loss_if_there_was_time_for_one() {
    let damaged =
        |after_ms, together| ReceivedFrame { evidence: LossEvidence::Damage, together, ..arrival(after_ms) };
    for (after_ms, together, want) in [(67, 1, 1), (33, 1, 0), (133, 3, 1), (100, 3, 0)] {
        assert_eq!(missing(Duration::ZERO, damaged(after_ms, together)), want, "{after_ms} ms, {together}");
    }
    let slow = ReceivedFrame { dropped: 5, cause: GapCause::HostTooSlow, ..arrival(200) };
    assert_eq!(missing(Duration::ZERO, slow), 5, "they came, and were not taken");
}

#[test]
fn a_clock_too_coarse_to_tell_frames_apart_counts_none() {
    let second = ReceivedFrame { tick: Some(DeviceTick(1)), ..arrival(33) };
    assert_eq!(missing(Duration::from_secs(1), second), 0);
    assert_eq!(missing(Duration::from_millis(10), ReceivedFrame { tick: Some(DeviceTick(10)), ..second }), 2);
}

/// Of a 1 kHz sensor, what is missing before each frame that has this tick and comes at this time.
fn missing_at_1_khz(tick: Duration, frames: impl Iterator<Item = (u64, i64)>) -> Vec<u32> {
    let mut sequence = Sequence::new(1000.0);
    sequence.set_tick(tick);
    let place = |(tick, received_us)| {
        let received = MonoTime::from_ns(received_us * 1000);
        sequence.place(ReceivedFrame { tick: Some(DeviceTick(tick)), received, ..arrival(0) }).lost_before
    };
    frames.map(place).collect()
}

/// A host that wakes late, by up to some milliseconds, and then takes what has come meanwhile.
fn taken_late(frame: i64) -> i64 {
    let wakes_us = 1000 + (frame / 7 * 7919) % 6000;
    (frame * 1000 / wakes_us + 1) * wakes_us
}

#[test]
fn a_fast_sensor_on_a_busy_host_loses_nothing_that_came() {
    let tick = Duration::from_millis(1);
    let jitter_us = |frame: i64| 300 * ((frame / 3) % 7);
    for taken_us in [&(|frame| 1000 * frame + jitter_us(frame)) as &dyn Fn(i64) -> i64, &taken_late] {
        let missing =
            missing_at_1_khz(tick, (0..5000u32).map(|frame| (frame.into(), taken_us(frame.into()))));
        assert_eq!(missing.iter().sum::<u32>(), 0);
    }
}

#[test]
fn what_a_fast_sensor_loses_is_counted_once_it_lasts() {
    for (lost, tick) in [(1, 1), (1, 0), (3, 1), (40, 0), (40, 1)] {
        let frames = (0..2000u64).filter(|frame| !(1000..1000 + lost).contains(frame));
        let missing = missing_at_1_khz(
            Duration::from_millis(tick),
            frames.map(|frame| (frame, i64::try_from(frame).unwrap() * 1000)),
        );
        assert_eq!(u64::from(missing.iter().sum::<u32>()), lost, "{lost} with ticks of {tick} ms");
        let at = missing.iter().position(|missing| *missing > 0).unwrap();
        assert!((1000..1020).contains(&at), "{at}");
    }
}
