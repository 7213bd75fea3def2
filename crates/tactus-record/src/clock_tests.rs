use tactus_schema::{DeviceTick, MonoTime};

use super::{EpochClock, NoClock};

const PERIOD_NS: i64 = 33_333_333;
const OFFSET_NS: i64 = 5_000_000_000;
const LEAST_DELAY_NS: i64 = 2_000_000;

/// Frames of a device with nanosecond ticks whose clock runs slow by `drift_ppm`; delays from 2 to 10 ms; every
/// eleventh is the least one.
fn frames(count: i64, drift_ppm: f64) -> Vec<(DeviceTick, MonoTime)> {
    (0..count)
        .map(|n| {
            let sampled_ns = n * PERIOD_NS;
            #[expect(clippy::cast_possible_truncation, reason = "small")]
            let device_ns = sampled_ns - (sampled_ns as f64 * drift_ppm * 1e-6).round() as i64;
            let delay_ns = LEAST_DELAY_NS + (n * 7 % 11) * 800_000;
            (
                DeviceTick(device_ns.cast_unsigned() + 123),
                MonoTime::from_ns(OFFSET_NS + sampled_ns + delay_ns),
            )
        })
        .collect()
}

#[test]
fn without_drift_the_offset_is_the_least_of_the_differences() {
    let frames = frames(9000, 0.0);
    let clock = EpochClock::estimate(3, 1, &frames).unwrap();
    let least = frames.iter().map(|(tick, received)| received.ns() - tick.0.cast_signed()).min().unwrap();
    assert_eq!((clock.epoch, clock.frames, clock.offset_ns, clock.drift_ppm), (3, 9000, least, 0.0));
    for (n, (tick, received)) in (0..).zip(&frames) {
        assert_eq!(clock.sampled(*tick, *received).ns(), OFFSET_NS + n * PERIOD_NS + LEAST_DELAY_NS);
    }
    // 5 % of the frames come with the least delay, half within 4 ms more, 99 % within 8 ms more.
    assert_eq!((clock.uncertainty_ns, clock.delay_p50_ns, clock.delay_p99_ns), (1, 4_000_000, 8_000_000));
}

#[test]
fn a_drift_is_found_and_undone() {
    for drift_ppm in [80.0, -35.0] {
        let frames = frames(18_000, drift_ppm);
        let clock = EpochClock::estimate(0, 1, &frames).unwrap();
        assert!((clock.drift_ppm - drift_ppm).abs() < 0.1, "{} for {drift_ppm}", clock.drift_ppm);
        for (n, (tick, received)) in (0..).zip(&frames) {
            let error_ns =
                clock.sampled(*tick, *received).ns() - (OFFSET_NS + n * PERIOD_NS + LEAST_DELAY_NS);
            assert!(error_ns.abs() < 20_000, "{error_ns} ns at frame {n}");
        }
    }
}

#[test]
fn a_drift_is_not_guessed_from_a_short_time() {
    // 30 s; the delays alone would tilt the line.
    let clock = EpochClock::estimate(0, 1, &frames(900, 80.0)).unwrap();
    assert!(clock.drift_ppm.abs() < f64::EPSILON);
}

#[test]
fn ticks_are_scaled_and_their_length_is_part_of_the_uncertainty() {
    let frames =
        [(DeviceTick(1000), MonoTime::from_ns(7_000_000)), (DeviceTick(1033), MonoTime::from_ns(40_500_000))];
    let clock = EpochClock::estimate(0, 1_000_000, &frames).unwrap();
    assert_eq!(clock.offset_ns, 7_000_000 - 1_000_000_000);
    // In the middle of the tick that began with 40 ms; but the first had arrived before the middle of its own.
    assert_eq!(clock.sampled(frames[1].0, frames[1].1).ns(), 40_500_000);
    assert_eq!(clock.sampled(frames[0].0, frames[0].1).ns(), 7_000_000);
    assert!(clock.uncertainty_ns >= 1_000_000);
}

/// Lateness of the estimated sampling times: ticks of a millisecond, delays from 2 to 10 ms.
fn late_ns(sampled_ns: &[i64]) -> Vec<i64> {
    let frames: Vec<(DeviceTick, MonoTime)> = (0..)
        .zip(sampled_ns)
        .map(|(n, ns): (i64, &i64)| {
            let delay_ns = LEAST_DELAY_NS + (n * 7 % 11) * 800_000;
            (DeviceTick((ns / 1_000_000).cast_unsigned()), MonoTime::from_ns(ns + delay_ns))
        })
        .collect();
    let clock = EpochClock::estimate(0, 1_000_000, &frames).unwrap();
    let late =
        |((tick, received), ns): (&(_, _), &i64)| clock.sampled(*tick, *received).ns() - LEAST_DELAY_NS - ns;
    frames.iter().zip(sampled_ns).map(late).collect()
}

#[test]
fn of_an_even_rate_times_are_far_better_known_than_the_ticks_of_its_clock() {
    // 30 and 29.7 Hz; seven of every hundred frames are lost.
    for period_ns in [33_333_333, 33_670_034] {
        let sampled_ns: Vec<i64> =
            (0..3000).filter(|n| n % 100 > 6).map(|n| 17_400_000 + n * period_ns).collect();
        let late_ns = late_ns(&sampled_ns);
        assert!(late_ns.iter().all(|late| late.abs() < 50_000), "{:?} ns late", late_ns.iter().max());
    }
}

#[test]
fn of_no_even_rate_times_are_not_early_on_average() {
    let sampled_ns: Vec<i64> = (0..3000).map(|n| n * 33_670_034 + (n * 5 % 13) * 700_000).collect();
    let late_ns = late_ns(&sampled_ns);
    let mean_ns = late_ns.iter().sum::<i64>() / 3000;
    assert!(mean_ns.abs() < 50_000, "{mean_ns} ns late on average");
    assert!(late_ns.iter().all(|late| late.abs() <= 1_000_000));
}

#[test]
fn a_clock_that_jumps_is_not_believed() {
    let mut backwards = frames(100, 0.0);
    backwards[50].0 = DeviceTick(0);
    assert_eq!(EpochClock::estimate(0, 1, &backwards), Err(NoClock::Jumped));
    let mut forwards = frames(100, 0.0);
    for frame in &mut forwards[50..] {
        frame.0.0 += 1_500_000_000;
    }
    assert_eq!(EpochClock::estimate(0, 1, &forwards), Err(NoClock::Jumped));
}

#[test]
fn without_frames_or_tick_length_there_is_no_clock() {
    assert_eq!(EpochClock::estimate(0, 1, &[]), Err(NoClock::Absent));
    assert_eq!(EpochClock::estimate(0, 0, &frames(5, 0.0)), Err(NoClock::Absent));
}

#[test]
fn the_widest_ticks_do_not_overflow() {
    let frames =
        [(DeviceTick(0), MonoTime::from_ns(i64::MIN)), (DeviceTick(u64::MAX), MonoTime::from_ns(i64::MAX))];
    assert_eq!(EpochClock::estimate(0, u64::MAX, &frames), Err(NoClock::Jumped));
}
