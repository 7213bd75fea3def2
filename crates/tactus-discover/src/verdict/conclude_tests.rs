use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use tactus_schema::table::{Phase, RowView};

use super::*;
use crate::fixtures::{ELEMENTS, ShippedRig, base, found, known, measured, processes};
use crate::verdict::residual::SEEN_NOISE;
use crate::{Floor, Frames, Rule, discover, predict};

/// The deepest frame of each press, as in a table of averaged presses. Each element is pressed this many times.
fn one_frame_a_press(repeats: usize, noise_counts: f64) -> Frames {
    let known = known();
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let whole = measured(&known, &[], &processes(ELEMENTS, 0.0, 1e-3, &mut rng));
    let noise = processes(ELEMENTS, noise_counts, 1e-3, &mut rng);
    let mut frames = Frames::new(ELEMENTS);
    for (press, noise) in (0..ELEMENTS * repeats).zip(noise) {
        let frame = 30 * (press % ELEMENTS) + 19;
        #[expect(clippy::cast_possible_truncation, reason = "counts are stored so")]
        let counts: Vec<f32> =
            whole.counts_of(frame).iter().zip(noise).map(|(counts, noise)| counts + noise as f32).collect();
        frames.push(RowView {
            run: "a",
            press: i32::try_from(press).unwrap(),
            phase: Phase::Hold,
            t_ns: i64::try_from(press).unwrap() * 5_000_000_000,
            position_mm: whole.position_mm[frame],
            covering_mm: 1.016,
            indenter: "cyl1",
            temperature_c: None,
            counts: &counts,
        });
    }
    frames
}

fn judged(frames: &Frames) -> Discovery {
    let options = Options { seed: 1, threads: 2, rule: Rule::Protocol, tolerance_counts: Some(5.0) };
    discover(&known(), frames, options, &ShippedRig::new(1.0), &|_| {}).unwrap()
}

#[test]
fn without_repeats_nothing_is_judged_and_what_to_run_is_said() {
    let found = judged(&one_frame_a_press(1, 54.0));
    assert_eq!((found.verdict, found.floor), (Verdict::CannotJudge, Floor::None));
    assert!(found.steps.is_empty() && found.rounds.is_empty() && found.gap.is_empty());
    assert_eq!((found.global, found.base.heldout_chi2, found.base.structured), (None, None, None));
    assert!(found.base.heldout_rms_counts > 30.0);
    let [next] = &found.plan.next[..] else { panic!("{:?}", found.plan) };
    assert_eq!((&*next.experiment, &*next.parameters[0].1), ("diagnose", "drift,repeats"));
    assert!(next.duration_s > 200.0, "{}", next.duration_s);
}

#[test]
fn repeats_of_places_are_a_floor_of_one_frame_a_press() {
    let found = judged(&one_frame_a_press(6, 2.0));
    assert!(matches!(found.floor, Floor::Repeats { .. }), "{:?}", found.floor);
    assert_eq!((found.verdict, found.steps.len()), (Verdict::NothingMissing, 0), "{:?}", found.gap);
    let structured = found.base.structured.unwrap();
    assert!(structured.upper_noise < SEEN_NOISE, "{structured:?}");
    assert_eq!(found.tolerance_counts, Some(5.0));
}

/// Two runs of one rig: in the second all elements are 2 % more sensitive, and their zeros lie elsewhere.
#[test]
fn runs_of_one_rig_may_differ_in_gain_and_zeros() {
    let known = known();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut run = || measured(&known, &[], &processes(ELEMENTS, 1.0, 1e-3, &mut rng));
    let (first, second) = (run(), run());
    let mut both = Frames::new(ELEMENTS);
    first.rows().for_each(|row| both.push(row));
    for row in second.rows() {
        let counts: Vec<f32> = row.counts.iter().map(|counts| 130.0 + 1.02 * (counts - 100.0)).collect();
        both.push(RowView { run: "b", counts: &counts, ..row });
    }
    let found = found(&known, &both);
    assert_eq!(found.verdict, Verdict::NothingMissing, "{:?}", found.gap);
    let [one, other] = found.grown.run_gains[..] else { panic!("two runs: {:?}", found.grown.run_gains) };
    assert!((other / one - 1.02).abs() < 1e-3, "{other} / {one}");
    assert!((one * other - 1.0).abs() < 1e-9, "the mean is 1: {one} {other}");
}

/// Without noise a converter gives the same code whenever nothing touches, so that a zero is known to half a step. Each element seems to be off by
/// its own part of a step while the tool touches.
#[test]
fn rounding_without_noise_hides_nothing() {
    let known = known();
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let presses = measured(&known, &[], &vec![vec![0.0; ELEMENTS]; 30 * ELEMENTS]);
    let mut exact = Frames::new(ELEMENTS);
    let mut times_ns = (0..).step_by(100_000_000);
    let (mut press, mut share) = (-1, 1.0);
    for row in presses.rows() {
        if row.press != press {
            (press, share) = (row.press, rng.random_range(0.5..1.0));
        }
        let [x, y, z] = row.position_mm;
        // Each press has a depth of its own, and rests are long enough to tell what the noise is.
        let position_mm = [x, y, if z < 0.0 { share * z } else { z }];
        let repeats = if matches!(row.phase, Phase::Hold | Phase::Idle) { 4 } else { 1 };
        for t_ns in times_ns.by_ref().take(repeats) {
            exact.push(RowView { t_ns, position_mm, ..row });
        }
    }
    let counts = predict(&known, &exact, &base(&known), &[]).unwrap();
    let off = |element: usize| 0.9 * (element as f32 * 0.618).fract() - 0.45;
    let mut rounded = Frames::new(ELEMENTS);
    for (row, counts) in exact.rows().zip(counts.chunks_exact(ELEMENTS)) {
        let counts: Vec<f32> =
            (0..).zip(counts).map(|(element, counts)| (counts + off(element)).round()).collect();
        rounded.push(RowView { counts: &counts, ..row });
    }
    let found = found(&known, &rounded);
    let names: Vec<_> = found.steps.iter().map(|step| step.effect).collect();
    assert_eq!((found.verdict, names), (Verdict::NothingMissing, vec![]), "{:?}", found.gap);
    assert!(found.draft.is_none());
    let structured = found.base.structured.unwrap();
    assert!((0.1..1.0).contains(&structured.upper_noise), "{structured:?}");
}
