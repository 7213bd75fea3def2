use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tactus_schema::table::{Phase, RowView};

use crate::Frames;
use crate::data::excerpt::Excerpt;

const ELEMENTS: usize = 16;

/// Frames at this rate: presses of 2 s, and 2 s out of contact after each. All elements read a tone, each with noise of its own.
fn pushed(rate_hz: u32, presses: u32, frames_most: usize, tone: impl Fn(f64) -> f32) -> Frames {
    recorded(rate_hz, presses, frames_most, |t_s, noise| tone(t_s) + noise)
}

/// The same of any reading, from the time and a noise of -1 to 1.
fn recorded(rate_hz: u32, presses: u32, frames_most: usize, reading: impl Fn(f64, f32) -> f32) -> Frames {
    let mut frames = Frames::new(ELEMENTS);
    frames.excerpt = Excerpt::of_frames(frames_most);
    let mut noise = ChaCha8Rng::seed_from_u64(5);
    for number in 0..4 * rate_hz * presses {
        let in_press = number % (4 * rate_hz);
        let touches = in_press < 2 * rate_hz;
        let t_s = f64::from(number) / f64::from(rate_hz);
        #[expect(clippy::cast_possible_truncation, reason = "whole nanoseconds")]
        let t_ns = (1e9 * t_s).round() as i64;
        frames.push(RowView {
            run: "a",
            press: if touches { i32::try_from(number / (4 * rate_hz)).unwrap() } else { -1 },
            phase: if touches { Phase::Hold } else { Phase::Idle },
            t_ns,
            position_mm: [t_s, 0.0, if touches { -0.5 } else { 2.0 }],
            covering_mm: 1.0,
            indenter: "cyl1",
            temperature_c: None,
            counts: &[(); ELEMENTS].map(|()| reading(t_s, noise.random_range(-1.0..1.0))),
        });
    }
    frames
}

/// No frame is the mean of more than one and a half times 32, and at most one in a hundred of less than half.
fn assert_few_outside(frames: &Frames) {
    let count = |is_outside: fn(u32) -> bool| frames.joined.iter().filter(|one| is_outside(**one)).count();
    let [more, less] = [count(|joined| joined > 48), count(|joined| joined < 16)];
    assert!(more == 0 && less <= frames.len() / 100, "{more} {less}");
}

fn silent(_: f64) -> f32 {
    0.0
}

#[test]
fn a_fast_sensor_is_read_at_the_pace_of_the_papers_before_presses_are_left_out() {
    // 20 presses at 1,000 frames a second.
    let frames = pushed(1000, 20, 4000, silent);
    assert_eq!((frames.given(), frames.left_out(), frames.joined()), (80_000, 0, 32));
    assert!((2400..=2600).contains(&frames.len()), "{}", frames.len());
    // Those at the ends of a press are means of half as many and more, unless a part ends there.
    assert_few_outside(&frames);
    // What does not change stays, and what changes evenly is that of the mean time.
    for (t_s, [x_mm, _, z_mm]) in frames.t_s.iter().zip(&frames.position_mm) {
        assert!((x_mm - t_s).abs() < 1e-9 && [-0.5, 2.0].contains(z_mm), "{t_s} {x_mm} {z_mm}");
    }
    // The frame in the middle is there at that time.
    for (number, t_s) in frames.numbers().zip(&frames.t_s) {
        #[expect(clippy::cast_precision_loss, reason = "a small number")]
        let of_middle_s = number as f64 / 1000.0;
        assert!((t_s - of_middle_s).abs() < 0.6e-3, "{t_s} {number}");
    }
    assert_eq!(frames.runs, [("a".to_owned(), frames.len())]);
}

#[test]
fn readings_are_means() {
    let slow = pushed(1000, 4, 4000, |t_s| if t_s < 8.0 { 10.0 } else { -6.0 });
    assert_eq!(slow.joined(), 8);
    for (t_s, counts) in slow.t_s.iter().zip(slow.counts.chunks_exact(ELEMENTS)) {
        let wanted = if *t_s < 8.0 { 10.0 } else { -6.0 };
        let mean = counts.iter().sum::<f32>() / 16.0;
        // An even distribution from -1 to 1 scatters by 0.58; the mean of thirty-two and more by 0.10.
        assert!((mean - wanted).abs() < 0.6, "{t_s} {mean}");
    }
}

#[test]
fn of_a_longer_recording_presses_are_left_out_too() {
    let frames = pushed(1000, 80, 4000, silent);
    assert_eq!(frames.joined(), 32);
    assert!((2000..=4000).contains(&frames.len()), "{}", frames.len());
    let read = frames.given() - frames.left_out();
    // Of as many frames as may be read, 32 each; one press of two is left out, and one of two again.
    assert!((4000 * 16..=4000 * 32).contains(&read), "{read}");
    assert_few_outside(&frames);
}

#[test]
fn a_sensor_like_the_papers_is_read_as_it_is() {
    let frames = pushed(50, 100, 4000, silent);
    assert_eq!(frames.joined(), 1);
    assert!(frames.left_out() > 0);
}

#[test]
fn twice_the_pace_of_the_papers_is_joined_too() {
    assert_eq!([60, 120, 480].map(|rate_hz| pushed(rate_hz, 100, 2000, silent).joined()), [2, 4, 16]);
}

#[test]
fn what_nothing_dithers_is_read_as_it_is() {
    // Whole counts of what rises by eight in a second.
    #[expect(clippy::cast_possible_truncation, reason = "counts")]
    let slow = |t_s: f64, noise: f32| (8.0 * t_s as f32 + noise).round();
    let frames = recorded(1000, 20, 4000, |t_s, noise| slow(t_s, 0.1 * noise));
    assert_eq!(frames.joined(), 1);
    let dithered = recorded(1000, 20, 4000, |t_s, noise| slow(t_s, 2.0 * noise));
    assert_eq!(dithered.joined(), 32);
    let constant = recorded(1000, 20, 4000, |_, _| 7.0);
    assert_eq!(constant.joined(), 1);
}

#[test]
fn times_that_stand_still_do_not_end_it() {
    let mut frames = Frames::new(1);
    frames.excerpt = Excerpt::of_frames(600);
    for (number, t_ns) in (0..5000).zip((0..).step_by(1_000_000)) {
        frames.push(RowView {
            run: "a",
            press: -1,
            phase: Phase::Idle,
            // The clock is set back in the middle, and stands then.
            t_ns: if number < 300 { t_ns } else { -1 },
            position_mm: [0.0, 0.0, 2.0],
            covering_mm: 1.0,
            indenter: "cyl1",
            temperature_c: None,
            counts: &[0.0],
        });
    }
    assert_eq!((frames.given(), frames.joined()), (5000, 1));
}

#[test]
fn a_fast_tone_is_not_averaged() {
    #[expect(clippy::cast_possible_truncation, reason = "counts")]
    let hum = |t_s: f64| 3.0 * (TAU * 50.0 * t_s).sin() as f32;
    let frames = pushed(1000, 20, 4000, hum);
    assert_eq!(frames.joined(), 1);
    assert!(frames.left_out() > 70_000);
}
