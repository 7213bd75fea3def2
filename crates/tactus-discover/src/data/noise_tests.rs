use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tactus_schema::table::{Phase, RowView};

use super::Noise;
use crate::data::motion::still;
use crate::{Floor, Frames};

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "frames or nanoseconds of a minute"
)]
fn whole(number: f64) -> usize {
    number.round() as usize
}

/// A tip at rest with frames at this rate, under noise of standard deviation 3 with this correlation time, for a minute.
fn resting_at(rate_hz: f64, time_s: f64) -> Frames {
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let kept = (-1.0 / (rate_hz * time_s)).exp();
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut noise: [f64; 8] = std::array::from_fn(|_| 3.0 * normal());
    let mut frames = Frames::new(8);
    for frame in 0..whole(60.0 * rate_hz) {
        for noise in &mut noise {
            *noise = kept * *noise + 3.0 * (1.0 - kept * kept).sqrt() * normal();
        }
        #[expect(clippy::cast_possible_truncation, reason = "counts are stored so")]
        let counts = noise.map(|noise| (100.0 + noise) as f32);
        frames.push(RowView {
            run: "a",
            press: -1,
            phase: Phase::Idle,
            t_ns: i64::try_from(whole(frame as f64 / rate_hz * 1e9)).unwrap(),
            position_mm: [0.0, 0.0, 2.0],
            covering_mm: 1.0,
            indenter: "cyl1",
            temperature_c: None,
            counts: &counts,
        });
    }
    frames
}

/// A tip at rest under first-order autoregressive noise of standard deviation 3, beside a slow ramp.
fn resting(phi: f64) -> Frames {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut frames = Frames::new(4);
    let mut noise = [0.0; 4];
    for (index, t_ns) in (0..6000).zip((0..).step_by(33_333_333)) {
        for noise in &mut noise {
            let fresh: f64 = StandardNormal.sample(&mut rng);
            *noise = phi * *noise + 3.0 * (1.0 - phi * phi).sqrt() * fresh;
        }
        let ramp = 0.002 * f64::from(index);
        #[expect(clippy::cast_possible_truncation, reason = "counts are stored so")]
        let counts = noise.map(|noise| (100.0 + ramp + noise) as f32);
        frames.push(RowView {
            run: "a",
            press: -1,
            phase: Phase::Idle,
            t_ns,
            position_mm: [0.0, 0.0, 2.0],
            covering_mm: 1.0,
            indenter: "cyl1",
            temperature_c: None,
            counts: &counts,
        });
    }
    frames
}

/// The noise from rests that reach the plateau.
fn of_rests(frames: &Frames) -> Option<Noise> {
    Noise::of(frames, &frames.counts, &still(frames), 0.01).map(|(noise, _)| noise)
}

fn floor(frames: &Frames, step_counts: f64) -> Floor {
    Noise::measured(frames, &still(frames), step_counts).1
}

#[test]
fn the_noise_is_that_of_one_reading_at_any_autocorrelation() {
    for phi in [0.0, 0.5, 0.8] {
        let frames = resting(phi);
        let noise = of_rests(&frames).unwrap();
        assert!(matches!(floor(&frames, 0.01), Floor::Time { .. }));
        assert!((noise.rms_counts - 3.0).abs() < 0.1, "{phi}: {}", noise.rms_counts);
        assert!((noise.correlation[1] - phi).abs() < 0.05, "{phi}: {:?}", noise.correlation);
    }
}

#[test]
fn the_noise_is_that_of_one_reading_at_any_rate() {
    for rate_hz in [30.0, 50.0, 100.0, 1000.0] {
        for time_s in [0.001, 0.15] {
            let noise = of_rests(&resting_at(rate_hz, time_s)).unwrap();
            assert!((noise.rms_counts / 3.0 - 1.0).abs() < 0.08, "{rate_hz} {time_s}: {}", noise.rms_counts);
            for lag_s in [0.0, 0.05, 0.1, 0.2, 0.4, 0.9] {
                let lag = (lag_s * rate_hz).round();
                let want = (-lag / rate_hz / time_s).exp();
                let got = noise.correlation_at(whole(lag));
                assert!((got - want).abs() < 0.1, "{rate_hz} {time_s} {lag_s}: {got} of {want}");
            }
        }
    }
}

#[test]
fn noise_that_outlasts_the_plateau_is_not_known_at_a_high_rate() {
    for rate_hz in [100.0, 1000.0] {
        let frames = resting_at(rate_hz, 5.0);
        assert!(of_rests(&frames).is_none(), "{rate_hz}");
    }
}

#[test]
fn a_mean_of_many_readings_is_as_uncertain_as_its_correlation_makes_it() {
    let frames = resting(0.5);
    let noise = of_rests(&frames).unwrap();
    // Closed form: 1 + 2 phi/(1 - phi) - 2 phi (1 - phi^n) / (n (1 - phi)^2).
    let want = 1.0 + 2.0 - 2.0 * 0.5 * (1.0 - 0.5_f64.powi(10)) / (10.0 * 0.25);
    assert!((noise.inflation(10) - want).abs() < 0.2, "{} {want}", noise.inflation(10));
}

#[test]
fn without_repeated_frames_the_weights_come_from_differences() {
    let mut frames = resting(0.0);
    for (index, at) in (0_u32..).zip(&mut frames.position_mm) {
        at[0] = f64::from(index);
    }
    assert!(of_rests(&frames).is_none());
    assert_eq!(floor(&frames, 0.01), Floor::None);
    let noise = Noise::of_differences(&frames, 0.01);
    assert!((noise.rms_counts - 3.0).abs() < 0.3, "{}", noise.rms_counts);
}

#[test]
fn the_bias_by_rounding_is_that_of_the_mean_of_many_rounded_readings() {
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    for rms in [0.0, 0.1, 0.2, 0.35] {
        let mut square = 0.0;
        for offset in 0..200 {
            let signal = f64::from(offset) / 200.0;
            let mut reading = || {
                let noise: f64 = StandardNormal.sample(&mut rng);
                (signal + rms * noise).round() - signal
            };
            let mean: f64 = (0..4000).map(|_| reading()).sum::<f64>() / 4000.0;
            square += mean * mean / 200.0;
        }
        // A mean of 4000 readings is not free of noise itself.
        assert!((super::bias_variance(rms * rms, 1.0) - square).abs() < 3e-4, "{rms}: {square}");
    }
}

#[test]
fn rounding_repeats_for_as_long_as_the_tip_rests() {
    // Presses of two seconds and rests between them, each elsewhere in the step of the converter, with little noise.
    const DWELL: usize = 60;
    let mut rng = ChaCha8Rng::seed_from_u64(13);
    let mut frames = resting(0.0);
    let mut signal = 0.0;
    for frame in 0..frames.len() {
        if frame % DWELL == 0 {
            signal = rng.random_range(0.0..50.0);
        }
        let is_press = (frame / DWELL).is_multiple_of(2);
        frames.position_mm[frame] = [0.0, 0.0, if is_press { -0.5 } else { 2.0 }];
        for counts in &mut frames.counts[4 * frame..4 * (frame + 1)] {
            let noise: f64 = StandardNormal.sample(&mut rng);
            #[expect(clippy::cast_possible_truncation, reason = "counts are stored so")]
            let rounded = (signal + 0.2 * noise).round() as f32;
            *counts = rounded;
        }
    }
    let (noise, _) = Noise::of(&frames, &frames.counts, &still(&frames), 1.0).unwrap();
    assert!((noise.repeated_frames - 60.0).abs() < 1.0, "{}", noise.repeated_frames);
    // The error of a sum over many presses: each has an error of its own, which lasts for its dwell.
    let mut error = || -> f64 {
        let at = rng.random_range(0.0..1.0);
        let mut reading = || -> f64 { StandardNormal.sample(&mut rng) };
        (0..DWELL).map(|_| (at + 0.2 * reading()).round() - at).sum()
    };
    let square = (0..4000).map(|_| error().powi(2)).sum::<f64>() / (4000 * DWELL) as f64;
    let got = noise.inflation(1000) * noise.rms_counts.powi(2);
    assert!((got / square - 1.0).abs() < 0.15, "{got} for {square}");
}

#[test]
fn noise_that_differs_by_chance_is_pooled_and_a_noisy_element_is_not() {
    let got = super::pooled(&[0.9, 1.0, 1.2, 1.1, 50.0], 0.5);
    let mean = (0.9 + 1.0 + 1.2 + 1.1) / 4.0;
    for (got, want) in got.into_iter().zip([mean, mean, mean, mean, 50.0]) {
        assert!((got - want).abs() < 1e-12, "{got}, not {want}");
    }
}

#[test]
fn differences_of_whole_counts_give_the_noise_of_a_reading() {
    for step_counts in [0.0, 1.0, 4.0] {
        let mut frames = resting(0.0);
        for counts in &mut frames.counts {
            *counts = if step_counts > 0.0 { (*counts / step_counts).round() * step_counts } else { *counts };
        }
        let noise = Noise::of_differences(&frames, f64::from(step_counts));
        let want = (9.0 + f64::from(step_counts).powi(2) / 12.0).sqrt();
        assert!((noise.rms_counts / want - 1.0).abs() < 0.02, "{} for {want}", noise.rms_counts);
    }
}

const ELEMENTS: usize = 24;

/// First-order autoregressive noise of standard deviation 1, from frame to frame.
struct Autoregressive {
    rng: ChaCha8Rng,
    phi: f64,
    now: [f64; ELEMENTS],
}

impl Autoregressive {
    fn new(seed: u64, phi: f64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let now = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
        Self { rng, phi, now }
    }

    fn next(&mut self) -> [f64; ELEMENTS] {
        for value in &mut self.now {
            let fresh: f64 = StandardNormal.sample(&mut self.rng);
            *value = self.phi * *value + (1.0 - self.phi * self.phi).sqrt() * fresh;
        }
        self.now
    }
}

/// A frame at 30 Hz, with counts in steps; 0 is no step.
fn push(frames: &mut Frames, press: i32, position_mm: [f64; 3], counts: [f64; ELEMENTS], step_counts: f64) {
    #[expect(clippy::cast_possible_truncation, reason = "counts are stored so")]
    let counts = counts.map(|counts| {
        (if step_counts > 0.0 { (counts / step_counts).round() * step_counts } else { counts }) as f32
    });
    frames.push(RowView {
        run: "a",
        press,
        phase: if position_mm[2] < 0.0 { Phase::Hold } else { Phase::Idle },
        t_ns: i64::try_from(frames.len()).unwrap() * 33_333_333,
        position_mm,
        covering_mm: 1.0,
        indenter: "cyl1",
        temperature_c: None,
        counts: &counts,
    });
}

/// The paper's element centres: dwells of 8 frames at five depths, on one element after the other. The pressed element and the next
/// relax by a tenth of their signal.
fn dwells(seed: u64, phi: f64, rms_counts: f64, step_counts: f64) -> Frames {
    let mut noise = Autoregressive::new(seed, phi);
    let mut frames = Frames::new(ELEMENTS);
    let mut take = |frames: &mut Frames, press: usize, z_mm: f64, signal: [f64; ELEMENTS]| {
        let noise = noise.next();
        let counts = std::array::from_fn(|e| 100.3 + 0.17 * e as f64 + signal[e] + rms_counts * noise[e]);
        let index = i32::try_from(press).unwrap();
        push(frames, index, [2.0 * press as f64, 0.0, z_mm], counts, step_counts);
    };
    for press in 0..ELEMENTS {
        for moving in 0..6 {
            take(&mut frames, press, 2.0 - 0.3 * f64::from(moving), [0.0; ELEMENTS]);
        }
        for depth in 1..=5 {
            for frame in 0..8 {
                let relaxed = 40.0 * f64::from(depth) * (0.9 + 0.1 * (-0.3 * f64::from(frame)).exp());
                let near = |e: usize| e == press || e == (press + 1) % ELEMENTS;
                let signal = std::array::from_fn(|e| if near(e) { relaxed } else { 0.0 });
                take(&mut frames, press, -0.1 * f64::from(depth), signal);
            }
        }
    }
    frames
}

#[test]
fn dwells_of_a_quarter_of_a_second_give_the_noise_of_a_reading() {
    for (phi, rms_counts, step_counts) in [(0.8, 3.0, 0.0), (0.8, 0.5, 1.0), (0.0, 0.4, 1.0), (0.5, 2.0, 1.0)]
    {
        for seed in 0..10 {
            let frames = dwells(seed, phi, rms_counts, step_counts);
            let (noise, floor) = Noise::measured(&frames, &still(&frames), step_counts);
            let Floor::Time { rms_counts: found, freedom } = floor else { panic!("{phi} {seed}: {floor:?}") };
            let want = (rms_counts * rms_counts + step_counts * step_counts / 12.0).sqrt();
            assert!((found / want - 1.0).abs() < 0.1, "{phi} {seed}: {found} for {want}, freedom {freedom}");
            assert!(
                (noise.correlation_at(1) - phi * (rms_counts / want).powi(2)).abs() < 0.08,
                "{phi} {seed}"
            );
        }
    }
}

#[test]
fn noise_that_outlasts_every_dwell_is_not_known_from_them() {
    let frames = dwells(1, 0.97, 3.0, 0.0);
    assert_eq!(floor(&frames, 0.0), Floor::None);
}

/// Presses of `each` frames, on `places` places in turn. A drift of the zeros, and a signal that softens from repeat to repeat.
fn presses(seed: u64, places: usize, repeats: usize, each: usize, drift_counts: f64) -> Frames {
    let mut noise = Autoregressive::new(seed, 0.6);
    let mut frames = Frames::new(ELEMENTS);
    for press in 0..places * repeats {
        let (place, repeat) = (press % places, press / places);
        let signal = 100.0 * (1.0 + 0.05 * (-0.5 * repeat as f64).exp());
        let drift = drift_counts * press as f64 / (places * repeats) as f64;
        // The stage is within 3 um in its plane and 1 um in height.
        let off = 0.003 * (press as f64).sin();
        for _ in 0..each {
            let noise = noise.next();
            let counts = std::array::from_fn(|e| {
                50.0 + signal * (place as f64 + e as f64).cos() + drift + 2.0 * noise[e]
            });
            push(
                &mut frames,
                i32::try_from(press).unwrap(),
                [place as f64 + off, 1.0, -0.3 + off / 3.0],
                counts,
                0.0,
            );
        }
        // Away, so that noise of one press has left the next.
        for _ in 0..12 {
            noise.next();
        }
    }
    frames
}

#[test]
fn one_frame_a_press_has_a_floor_if_presses_repeat() {
    for (seed, drift_counts) in (0..10).flat_map(|seed| [0.0, 30.0].map(|drift| (seed, drift))) {
        let floor = floor(&presses(seed, 8, 6, 1, drift_counts), 0.0);
        let Floor::Repeats { rms_counts, freedom } = floor else { panic!("{seed}: {floor:?}") };
        assert!((rms_counts / 2.0 - 1.0).abs() < 0.25, "{seed} {drift_counts}: {rms_counts} of 2, {freedom}");
        let [least, most] = floor.interval90_counts().unwrap();
        assert!(least < rms_counts && rms_counts < most);
    }
}

#[test]
fn one_frame_a_press_has_no_floor_if_no_press_repeats() {
    for seed in 0..10 {
        assert_eq!(floor(&presses(seed, 48, 1, 1, 0.0), 0.0), Floor::None);
    }
}

/// The tip goes up and down all the time, and comes to the same depth in every press again and again.
#[test]
fn one_press_does_not_repeat_itself() {
    let swings = |presses: usize| {
        let mut noise = Autoregressive::new(5, 0.6);
        let mut frames = Frames::new(ELEMENTS);
        for frame in 0..240 {
            let place = (frame * presses / 240) as f64;
            let z_mm = [-0.2, -0.3, -0.4, -0.3][frame % 4];
            let counts = noise.next().map(|noise| 50.0 + 300.0 * z_mm + 2.0 * noise);
            push(&mut frames, i32::try_from(frame * presses / 240).unwrap(), [place, 1.0, z_mm], counts, 0.0);
        }
        frames
    };
    for presses in [1, 4] {
        assert_eq!(floor(&swings(presses), 0.0), Floor::None, "{presses}");
    }
}

#[test]
fn short_presses_that_repeat_give_the_autocorrelation_too() {
    let frames = presses(3, 40, 12, 3, 0.0);
    let (noise, floor) = Noise::measured(&frames, &still(&frames), 0.0);
    assert!(matches!(floor, Floor::Repeats { .. }), "{floor:?}");
    for (lag, want) in [(1, 0.6), (2, 0.36)] {
        assert!((noise.correlation_at(lag) - want).abs() < 0.1, "{:?}", noise.correlation);
    }
}

/// The quantiles 5 % and 95 % of chi-square with 10 degrees of freedom: 3.940 and 18.307 (Abramowitz and Stegun, table 26.8).
#[test]
fn the_interval_of_the_noise_is_that_of_chi_square() {
    let [least, most] = Floor::Time { rms_counts: 2.0, freedom: 10.0 }.interval90_counts().unwrap();
    assert!((least - 2.0 * (10.0_f64 / 18.307).sqrt()).abs() < 0.01, "{least}");
    assert!((most - 2.0 * (10.0_f64 / 3.940).sqrt()).abs() < 0.02, "{most}");
}
