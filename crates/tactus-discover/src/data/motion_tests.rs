use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tactus_schema::table::{Phase, RowView};

use super::{STILL_MM, still, still_mm, turns};
use crate::data::bins::Bins;
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
        let history = History::of(frames, &Bins::of(frames, false).unwrap());
        let last_held = FRAMES_EACH + 99;
        assert!((history.since_turn_s[last_held] - 2.0).abs() < 0.1, "{}", history.since_turn_s[last_held]);
        assert!(history.upward[last_held] < 0.5 && history.upward[last_held + 5] > 0.5);
    }
}
