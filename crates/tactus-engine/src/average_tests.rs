use tactus_schema::{FrameFlags, TimeStamp, WallTime};

use super::*;

fn frame(at_ms: i64, count: f32, lost_before: u32) -> Frame {
    let mono = MonoTime::from_ns(at_ms * 1_000_000);
    Frame {
        seq: 0,
        epoch: 0,
        device_tick: None,
        received: TimeStamp { mono, wall: WallTime::default() },
        counts: vec![count, 2.0 * count].into(),
        flags: FrameFlags::default(),
        lost_before,
        simulated: true,
        bad_elements: [].into(),
        temperature_c: None,
    }
}

fn average(from_ms: i64, until_ms: i64, frames: &[Frame]) -> Option<Average> {
    let at = |ms: i64| MonoTime::from_ns(ms * 1_000_000);
    let (window, mut average) = Window::open(at(from_ms), at(until_ms));
    frames.iter().try_fold(window, |window, frame| window.take(frame, false));
    average.try_recv().ok()
}

#[test]
fn only_the_frames_within_are_averaged() {
    let frames = [frame(0, 100.0, 0), frame(10, 1.0, 0), frame(20, 3.0, 0), frame(30, 100.0, 0)];
    let average = average(10, 30, &frames).unwrap();
    assert_eq!((average.mean_counts, average.frames, average.lost), (vec![2.0, 4.0], 2, 0));
    let root_two = 2.0_f64.sqrt();
    assert!(
        (average.rms_counts[0] - root_two).abs() < 1e-12
            && (average.rms_counts[1] - 2.0 * root_two).abs() < 1e-12
    );
    assert_eq!(average.span.map(MonoTime::ns), [10_000_000, 20_000_000]);
}

#[test]
fn a_gap_that_reaches_into_it_is_told() {
    assert_eq!(average(10, 30, &[frame(15, 1.0, 0), frame(40, 1.0, 2)]).unwrap().lost, 2);
    assert_eq!(average(10, 30, &[frame(0, 1.0, 7), frame(15, 1.0, 0), frame(40, 1.0, 0)]).unwrap().lost, 0);
}

#[test]
fn a_time_shorter_than_a_period_gets_the_next_frame() {
    let average = average(10, 12, &[frame(0, 9.0, 0), frame(33, 5.0, 0), frame(66, 7.0, 0)]).unwrap();
    assert_eq!((average.mean_counts, average.frames), (vec![5.0, 10.0], 1));
}

#[test]
fn it_waits_until_its_end_has_passed() {
    assert_eq!(average(10, 30, &[frame(15, 1.0, 0), frame(20, 1.0, 0)]), None);
}

#[test]
fn a_late_frame_counts_as_lost() {
    let at = |ms: i64| MonoTime::from_ns(ms * 1_000_000);
    let (window, mut average) = Window::open(at(10), at(30));
    let frames = [(frame(12, 1.0, 0), false), (frame(20, 9.0, 0), true), (frame(40, 1.0, 0), false)];
    frames.iter().try_fold(window, |window, (frame, is_late)| window.take(frame, *is_late));
    let average = average.try_recv().unwrap();
    assert_eq!((average.mean_counts, average.frames, average.lost), (vec![1.0, 2.0], 1, 1));
}
