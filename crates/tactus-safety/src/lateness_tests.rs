use tactus_schema::{DeviceTick, FrameFlags, TimeStamp, WallTime};

use super::*;

const LATE_MAX_S: f64 = 0.1;

/// A frame of a clock of 1 ms that was sampled and arrived at these times.
fn frame(tick_ms: u64, arrived_s: f64) -> Frame {
    #[expect(clippy::cast_possible_truncation, reason = "a few hours")]
    let mono = MonoTime::from_ns((arrived_s * 1e9) as i64);
    Frame {
        seq: 0,
        epoch: 0,
        device_tick: Some(DeviceTick(tick_ms)),
        received: TimeStamp { mono, wall: WallTime::default() },
        counts: [100.0].into(),
        flags: FrameFlags::default(),
        lost_before: 0,
        simulated: true,
        bad_elements: [].into(),
        temperature_c: None,
    }
}

fn of_a_clock() -> Lateness {
    Lateness::new(1_000_000, LATE_MAX_S)
}

#[test]
fn a_link_that_queues_makes_frames_late_and_a_wait_that_lasts_is_not_forgotten() {
    let mut lateness = of_a_clock();
    // Each frame waits for 26 ms more than the last.
    let first_late = (0..100_u32).find(|at| {
        let frame = frame(1000 + 33 * u64::from(*at), 5.0 + 0.059 * f64::from(*at));
        lateness.take(&frame, LATE_MAX_S).is_some()
    });
    assert_eq!(first_late, Some(5), "by 130 ms, of which a slow clock explains 7");
    // For hours by the same time.
    for second in 0..20_000_u32 {
        let late = frame(2000 + 1000 * u64::from(second), 8.0 + f64::from(second));
        assert!(lateness.take(&late, LATE_MAX_S).is_some(), "after {second} s");
    }
    let in_time = frame(30_000_000, 30_004.0);
    assert_eq!(lateness.take(&in_time, LATE_MAX_S), None);
}

#[test]
fn a_clock_that_drifts_for_days_makes_no_frame_late() {
    for share in [0.976, 1.0, 1.0001, 1.025] {
        let mut lateness = of_a_clock();
        for second in 0..200_000_u32 {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some days in ms")]
            let tick_ms = (f64::from(second) * share * 1000.0) as u64;
            // 60 ms of jitter.
            let arrived_s = 1.0 + f64::from(second) + 0.06 * f64::from(second % 7) / 6.0;
            assert_eq!(lateness.take(&frame(tick_ms, arrived_s), LATE_MAX_S), None, "{share}, {second} s");
        }
    }
}

#[test]
fn another_epoch_has_another_clock_and_a_coarse_clock_or_none_says_nothing() {
    let mut lateness = of_a_clock();
    assert_eq!(lateness.take(&frame(50_000, 1.0), LATE_MAX_S), None);
    assert!(lateness.take(&frame(10, 1.1), LATE_MAX_S).is_some());
    let of_next_epoch = |tick_ms, at_s| Frame { epoch: 1, ..frame(tick_ms, at_s) };
    assert_eq!(lateness.take(&of_next_epoch(10, 1.2), LATE_MAX_S), None);
    assert_eq!(lateness.take(&of_next_epoch(43, 1.23), LATE_MAX_S), None);
    for tick_ns in [0, 200_000_000] {
        let mut lateness = Lateness::new(tick_ns, LATE_MAX_S);
        assert_eq!(lateness.take(&frame(50, 1.0), LATE_MAX_S), None);
        assert_eq!(lateness.take(&frame(50, 9.0), LATE_MAX_S), None);
    }
}
