use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tactus_schema::table::{Phase, RowView};

use super::*;
use crate::fixtures::{ELEMENTS, ShippedRig, found, known, measured, processes};
use crate::verdict::held_out::SEEN_NOISE;
use crate::{Floor, Frames, Rule, discover};

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
