use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tactus_schema::table::{Phase, RowView};

use super::{Converter, Fault, Gap, Rounding};
use crate::Frames;

fn readings(counts: impl Iterator<Item = f32>) -> Frames {
    let mut frames = Frames::new(1);
    for (t_ns, counts) in (0..).step_by(33_000_000).zip(counts) {
        frames.push(row(-1, t_ns, &[counts]));
    }
    frames
}

fn row(press: i32, t_ns: i64, counts: &[f32]) -> RowView<'_> {
    RowView {
        run: "a",
        press,
        phase: Phase::Idle,
        t_ns,
        position_mm: [0.0; 3],
        covering_mm: 1.0,
        indenter: "cyl1",
        temperature_c: None,
        counts,
    }
}

fn step(frames: &Frames) -> Option<(f64, f64)> {
    step_of(frames, 1.0)
}

fn step_of(frames: &Frames, declared_counts: f64) -> Option<(f64, f64)> {
    match Converter::seen(frames, declared_counts)? {
        Converter { fault: Fault::WiderSteps(step_counts), p_value } => Some((step_counts, p_value)),
        Converter { .. } => None,
    }
}

#[test]
fn readings_on_a_wider_lattice_give_its_step() {
    let (step, chance) = step(&readings((0..40_i16).map(|k| 100.0 + 4.0 * f32::from(k)))).unwrap();
    assert!((step - 4.0).abs() < 1e-6 && chance < 1e-9, "{step} {chance}");
}

/// In volts a step is no binary fraction, and each reading is rounded to single precision.
#[test]
fn steps_are_seen_in_any_unit() {
    for unit in [1e-4, 1e-3, 1.0 / 4095.0, 0.01, 0.1, 1e4] {
        #[expect(clippy::cast_possible_truncation, reason = "counts are stored so")]
        let codes = |step: f64| (0..16_000).map(move |k| (unit * (100.0 + step * f64::from(k))) as f32);
        let seen = |step| match Converter::seen(&readings(codes(step)), unit)?.fault {
            Fault::WiderSteps(step_counts) => Some(step_counts / unit),
            Fault::Gaps(_) => None,
        };
        let step = seen(4.0).unwrap();
        assert!((step - 4.0).abs() < 1e-5, "unit {unit}: {step}");
        assert_eq!(seen(1.0), None, "unit {unit}");
    }
}

/// A dead element reads 0, far below the others, and single codes are not seen.
#[test]
fn steps_are_seen_beyond_a_gap_of_codes() {
    for (bits, volts) in [(12, 3.3), (12, 5.0), (14, 3.3), (16, 3.3)] {
        let unit = volts / f64::from(2_i32.pow(bits));
        let first = 2_i32.pow(bits) * 2 / 5;
        let codes = (0..1000).filter(|k| k % 7 != 3).map(|k| first + 4 * k).chain([0, 0]);
        #[expect(clippy::cast_possible_truncation, reason = "counts are stored so")]
        let frames = readings(codes.map(|code| (unit * f64::from(code)) as f32));
        let Some(Converter { fault: Fault::WiderSteps(step), .. }) = Converter::seen(&frames, unit) else {
            panic!("{bits} bits of {volts} V");
        };
        assert!((step / unit - 4.0).abs() < 1e-4, "{bits} bits of {volts} V: {step}");
    }
}

/// From 2 on, single precision has steps of 2.4e-7, wider than those of this converter.
#[test]
fn the_steps_of_single_precision_are_no_converters() {
    #[expect(clippy::cast_possible_truncation, reason = "counts are stored so")]
    let frames = readings((0..1000).map(|k| (2.2 + 2.5 / f64::from(1 << 24) * f64::from(3 * k)) as f32));
    assert!(step_of(&frames, 2.5 / f64::from(1 << 24)).is_none());
    // Nor are whole numbers beyond its 24 bits, which are 8 apart there.
    #[expect(clippy::cast_possible_truncation, reason = "counts are stored so")]
    let frames = readings((0..9000).map(|k| (f64::from(1 << 26) + f64::from(k)) as f32));
    assert!(step_of(&frames, 1.0).is_none());
}

#[test]
fn readings_on_the_declared_lattice_give_none() {
    assert!(Converter::seen(&readings((0..40_i16).map(|k| 100.0 + f32::from(k))), 1.0).is_none());
    // One reading between two steps disproves the lattice.
    let odd = (0..40_i16).map(|k| 100.0 + 4.0 * f32::from(k)).chain([107.0]);
    assert!(step(&readings(odd)).is_none());
}

#[test]
fn few_readings_give_none() {
    assert!(Converter::seen(&readings((0..9_i16).map(|k| 4.0 * f32::from(k))), 1.0).is_none());
}

/// Presses of eight elements: up to some hundred counts and back at this many counts a frame, with noise of a count and a half, read by a
/// converter.
fn pressed(seed: u64, presses: i32, counts_a_frame: f64, convert: impl Fn(f64) -> f64) -> Frames {
    pressed_with_noise(seed, presses, counts_a_frame, 1.5, convert)
}

fn pressed_with_noise(
    seed: u64,
    presses: i32,
    counts_a_frame: f64,
    noise_counts: f64,
    convert: impl Fn(f64) -> f64,
) -> Frames {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut frames = Frames::new(8);
    let mut t_ns = 0;
    for press in 0..presses {
        let tops: [f64; 8] = std::array::from_fn(|_| rng.random_range(0.0..500.0));
        let highest = tops.iter().copied().fold(0.0, f64::max);
        let phase: f64 = rng.random();
        let mut way = phase * counts_a_frame;
        while way < 2.0 * highest {
            let share = (1.0 - (way / highest - 1.0).abs()).clamp(0.0, 1.0);
            let counts = tops.map(|top| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                #[expect(clippy::cast_possible_truncation, reason = "counts are stored so")]
                let counts = convert(100.0 + top * share + noise_counts * noise).round() as f32;
                counts
            });
            frames.push(row(press, t_ns, &counts));
            t_ns += 33_000_000;
            way += counts_a_frame;
        }
    }
    frames
}

/// Each press reads the same codes as the one before: of those between them they say as much as one press.
#[test]
fn presses_that_repeat_each_other_exactly_are_one() {
    for seed in 1..=8 {
        let first = pressed_with_noise(seed, 1, 9.0, 0.0, f64::round);
        let mut frames = Frames::new(8);
        let mut t_ns = 0;
        for press in 0..60 {
            for frame in 0..first.len() {
                frames.push(row(press, t_ns, first.counts_of(frame)));
                t_ns += 33_000_000;
            }
        }
        assert_eq!(Converter::seen(&frames, 1.0), None, "{seed}");
    }
}

#[test]
fn codes_that_are_never_given_are_found_with_where_they_are_read() {
    // 12 of every 60 counts are read as the code before them, or half of them as the one after.
    for low_share in [1.0, 0.5] {
        let convert = |counts: f64| {
            let beyond = counts.rem_euclid(60.0);
            if beyond >= 12.0 {
                counts
            } else if beyond < 12.0 * low_share {
                counts - beyond
            } else {
                counts - beyond + 12.0
            }
        };
        let found = Converter::seen(&pressed(3, 60, 25.0, convert), 1.0).unwrap();
        let Fault::Gaps(gaps) = found.fault else { panic!("{found:?}") };
        assert!(gaps.len() >= 6, "{gaps:?}");
        for Gap { ends: [before, after], low_share: found } in gaps {
            assert!(
                (before % 60.0).abs() < 1e-9 && (11.0..=13.0).contains(&(after - before)),
                "{before} {after}"
            );
            assert!((found - low_share).abs() < 0.15, "{found} of {low_share}");
        }
        assert!(found.p_value < 1e-6);
    }
}

#[test]
fn a_whole_converter_has_no_gaps_however_few_or_fast_the_presses_are() {
    for seed in 0..40 {
        for (presses, counts_a_frame) in [(4, 25.0), (40, 6.0), (60, 25.0), (60, 120.0)] {
            let found = Converter::seen(&pressed(seed, presses, counts_a_frame, |counts| counts), 1.0);
            assert_eq!(found, None, "{seed} {presses} {counts_a_frame}");
        }
    }
}

#[test]
fn presses_that_repeat_to_the_count_show_no_gaps() {
    let mut frames = Frames::new(8);
    for (frame, t_ns) in (0..60 * 30).zip((0..).step_by(33_000_000)) {
        let share = f32::from(i16::try_from((frame % 30).min(10)).unwrap()) / 10.0;
        let counts: [f32; 8] =
            std::array::from_fn(|element| (100.0 + 37.0 * (element as f32) * share).round());
        frames.push(row(frame / 30, t_ns, &counts));
    }
    assert_eq!(Converter::seen(&frames, 1.0), None);
}

#[test]
fn a_jump_of_the_signal_is_no_gap_of_codes() {
    let jumps = |counts: f64| if counts > 240.0 { counts + 9.0 } else { counts };
    assert_eq!(Converter::seen(&pressed(5, 60, 25.0, jumps), 1.0), None);
}

/// Inputs of some counts with a noise of 2, as a converter reads them.
fn inputs(counts: f64, read: impl Fn(f64) -> f64) -> impl Iterator<Item = (f64, f64)> {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    (0..40_000).map(move |_| {
        let noise: f64 = StandardNormal.sample(&mut rng);
        let input = counts + 2.0 * noise;
        (input, read(input))
    })
}

#[test]
fn readings_without_rounding_are_the_input_in_the_mean() {
    // Steps of 10 counts, of 20 from 200 on, and a gap of 30 that is read as the code before it.
    let read = |counts: f64| match counts {
        counts if counts < 205.0 => (counts / 10.0).round() * 10.0,
        counts if (300.0..330.0).contains(&counts) => 300.0,
        counts if (330.0..350.0).contains(&counts) => 330.0,
        counts => (counts / 20.0).round() * 20.0,
    };
    let gap = Gap { ends: [300.0, 330.0], low_share: 1.0 };
    let converter = Converter { fault: Fault::Gaps(vec![gap]), p_value: 1e-9 };
    #[expect(clippy::cast_possible_truncation, reason = "counts are stored so")]
    let readings: Vec<f32> = (0..4_000).map(|k| read(0.1 * f64::from(k)) as f32).collect();
    let rounding = Rounding::of(&converter, &readings);
    for counts in [100.0, 103.0, 104.5, 108.0, 246.0, 250.0, 312.0, 329.0] {
        let without = inputs(counts, read).map(|(_, reading)| rounding.without(reading, counts, 2.0));
        let mean = without.sum::<f64>() / 40_000.0;
        assert!((mean - counts).abs() < 0.15, "{counts}: {mean}");
    }
    assert!(
        (rounding.without(110.0, 106.0, 0.0) - 106.0).abs() < 1e-9,
        "without noise it is one of the codes"
    );
    assert!((rounding.without(400.0, 1e4, 2.0) - 1e4).abs() < 1e-9, "beyond the last code it is that one");
}
