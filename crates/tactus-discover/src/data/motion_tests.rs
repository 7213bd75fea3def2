use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tactus_schema::table::{Phase, RowView};

use super::{STILL_MM, load_speed_mm_per_s, load_speeds_mm_per_s, still, still_mm, turns};
use crate::data::bins::{Averaged, Bins};
use crate::data::{Contacts, History, Noise};
use crate::{Floor, Frames};

const PRESSES: usize = 20;
const FRAMES_EACH: usize = 110;

/// Presses of a millimetre at 3 mm/s, held for two seconds, with white noise of two counts. An encoder's positions jitter by this standard
/// deviation along each axis.
fn presses(jitter_mm: f64) -> Frames {
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut frames = Frames::new(4);
    for (frame, t_ns) in (0..PRESSES * FRAMES_EACH).zip((0..).step_by(33_333_333)) {
        let (press, within) = (frame / FRAMES_EACH, frame % FRAMES_EACH);
        let depth_mm = |steps: usize| 0.1 * steps as f64;
        let (phase, z_mm) = match within {
            0..30 => (Phase::Idle, 2.0),
            30..40 => (Phase::Load, -depth_mm(within - 29)),
            40..100 => (Phase::Hold, -depth_mm(10)),
            _ => (Phase::Unload, -depth_mm(109 - within)),
        };
        #[expect(clippy::cast_possible_truncation, reason = "counts are stored so")]
        let counts: [f32; 4] = std::array::from_fn(|_| (100.0 + 2.0 * normal()) as f32);
        frames.push(RowView {
            run: "a",
            press: if phase == Phase::Idle { -1 } else { i32::try_from(press).unwrap() },
            phase,
            t_ns,
            position_mm: [press as f64, 0.0, z_mm].map(|at| at + jitter_mm * normal()),
            covering_mm: 1.0,
            indenter: "cyl1",
            temperature_c: None,
            counts: &counts,
        });
    }
    frames
}

#[test]
fn a_tip_whose_position_jitters_rests() {
    for jitter_mm in [0.0, 1e-5, 0.001, 0.003, 0.005] {
        let frames = presses(jitter_mm);
        let tolerance_mm = still_mm(&frames);
        if jitter_mm < 1e-4 {
            assert_eq!(tolerance_mm.to_bits(), STILL_MM.to_bits());
        } else {
            let want_mm = 6.0 * 2.0_f64.sqrt() * jitter_mm;
            assert!((tolerance_mm / want_mm - 1.0).abs() < 0.15, "{jitter_mm}: {tolerance_mm} of {want_mm}");
        }
        let still = still(&frames);
        for press in 0..PRESSES {
            let last_held = press * FRAMES_EACH + 99;
            assert!(still[last_held] >= 59, "{jitter_mm}: {}", still[last_held]);
            let moving = press * FRAMES_EACH + 32..press * FRAMES_EACH + 39;
            assert!(moving.into_iter().all(|frame| still[frame] == 0), "{jitter_mm}");
        }
    }
}

#[test]
fn what_depends_on_rests_does_not_depend_on_a_jitter() {
    let (exact, shaken) = (presses(0.0), presses(0.003));
    assert_eq!(turns(&exact), turns(&shaken));
    for frames in [&exact, &shaken] {
        let contacts = Contacts::of(frames);
        assert!((contacts.longest_hold_s() - 2.0).abs() < 0.1, "{}", contacts.longest_hold_s());
        let (noise, floor) = Noise::measured(frames, &still(frames), 0.0);
        assert!(matches!(floor, Floor::Time { .. }), "{floor:?}");
        assert!((noise.rms_counts - 2.0).abs() < 0.2, "{}", noise.rms_counts);
        let history = History::of(frames, &Bins::of(frames, Averaged::None).unwrap());
        let last_held = FRAMES_EACH + 99;
        assert!((history.since_turn_s[last_held] - 2.0).abs() < 0.1, "{}", history.since_turn_s[last_held]);
        assert!(history.upward[last_held] < 0.5 && history.upward[last_held + 5] > 0.5);
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "frames or nanoseconds of a minute"
)]
fn whole(number: f64) -> usize {
    number.round() as usize
}

/// A stroke of a millimetre at one speed from a fifth of a millimetre above the surface after a second, a rest of a second, and a rise at half a
/// millimetre a second; at this rate of frames.
fn stroke(rate_hz: f64, fall_mm_per_s: f64) -> Frames {
    let below_s = 1.0 + 1.0 / fall_mm_per_s;
    let mut frames = Frames::new(1);
    for frame in 0..whole((below_s + 2.0) * rate_hz) {
        let t_s = frame as f64 / rate_hz;
        let (phase, z_mm) = if t_s < 1.0 {
            (Phase::Approach, 0.2)
        } else if t_s < below_s {
            (Phase::Load, 0.2 - fall_mm_per_s * (t_s - 1.0))
        } else if t_s < below_s + 1.0 {
            (Phase::Hold, -0.8)
        } else {
            (Phase::Unload, -0.8 + 0.5 * (t_s - below_s - 1.0))
        };
        frames.push(RowView {
            run: "a",
            press: 0,
            phase,
            t_ns: i64::try_from(whole(t_s * 1e9)).unwrap(),
            position_mm: [0.0, 0.0, z_mm],
            covering_mm: 1.0,
            indenter: "cyl1",
            temperature_c: None,
            counts: &[0.0],
        });
    }
    frames
}

const RATES_HZ: [f64; 5] = [30.0, 50.0, 100.0, 300.0, 1000.0];

#[test]
fn the_stage_turns_for_as_long_at_any_rate() {
    for rate_hz in RATES_HZ {
        let frames = stroke(rate_hz, 5.0);
        for (t_s, turns) in frames.t_s.iter().zip(turns(&frames)) {
            let off_s = (t_s - 1.0).abs().min((t_s - 1.2).abs());
            let is_told = !(0.02..=0.035).contains(&off_s);
            assert!(!is_told || turns == (off_s < 0.02), "{rate_hz}: {t_s} {turns}");
        }
    }
}

#[test]
fn what_moves_slowly_moves_at_any_rate() {
    for (rate_hz, fall_mm_per_s) in
        RATES_HZ.into_iter().flat_map(|rate| [0.3, 5.0].map(|speed| (rate, speed)))
    {
        let frames = stroke(rate_hz, fall_mm_per_s);
        let below_s = 1.0 + 1.0 / fall_mm_per_s;
        for speed in load_speeds_mm_per_s(&frames).chain(load_speed_mm_per_s(&frames)) {
            assert!((speed / fall_mm_per_s - 1.0).abs() < 0.01, "{rate_hz}: {speed} of {fall_mm_per_s}");
        }
        assert!(load_speed_mm_per_s(&frames).is_some(), "{rate_hz}");
        let contacts = Contacts::of(&frames);
        assert!(contacts.falls_in_contact() && contacts.distinct_depths() == 1, "{rate_hz} {fall_mm_per_s}");
        let history = History::of(&frames, &Bins::of(&frames, Averaged::None).unwrap());
        let at = |t_s: f64| whole(t_s * rate_hz);
        for (t_s, upward, since_s) in [(below_s + 0.8, 0.0, 0.8), (below_s + 1.8, 1.0, 0.8)] {
            let frame = at(t_s);
            assert!((history.upward[frame] - upward).abs() < 0.1, "{rate_hz} {fall_mm_per_s} {t_s}");
            let got_s = history.since_turn_s[frame];
            assert!((got_s - since_s).abs() < 0.07, "{rate_hz} {fall_mm_per_s} {t_s}: {got_s}");
        }
        assert!((history.speed_mm_per_s[at(below_s + 1.8)] - 0.5).abs() < 0.01, "{rate_hz} {fall_mm_per_s}");
    }
}

/// Each is of one frame, at another depth than the one before.
#[test]
fn from_press_to_press_the_stage_does_not_turn() {
    let mut frames = stroke(30.0, 5.0);
    for (frame, press) in (0..).zip(&mut frames.press) {
        *press = frame;
        let z_mm = &mut frames.position_mm[usize::try_from(frame).unwrap()][2];
        *z_mm = -0.1 * f64::from(frame % 4);
    }
    assert!(!turns(&frames).contains(&true));
}

#[test]
fn before_and_after_a_pause_the_stage_does_not_turn() {
    let mut frames = stroke(30.0, 5.0);
    // The rest of the way down comes after five seconds.
    for t_s in frames.t_s.iter_mut().filter(|t_s| **t_s > 1.1) {
        *t_s += 5.0;
    }
    let turning: Vec<f64> =
        frames.t_s.iter().zip(turns(&frames)).filter(|(_, turns)| *turns).map(|(t_s, _)| *t_s).collect();
    assert!(turning.iter().all(|t_s| (t_s - 1.0).abs() < 0.035 || (t_s - 6.2).abs() < 0.035), "{turning:?}");
}
